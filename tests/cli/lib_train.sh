# What the tests of lgd-train share.
. tests/cli/lib.sh
. tests/support/small_model.sh
TRAIN=$BIN/lgd-train

# A run of ten small steps; more arguments go to the program. Such small work is fastest on one thread.
config() {
    small_model >"$T/small.ini"
    cat >>"$T/small.ini" <<'INI'
[train]
batch = 2
pretrain_steps = 4
steps = 6
warmup = 2
checkpoint_every = 5
log_every = 5
[validate]
every = 5
count = 2
size = 16
INI
}
train() { "$TRAIN" "$T/small.ini" --set output.folder="$T/run" --threads 1 "$@"; }

# Waits until the file of a run in the background is there.
await() {
    for _ in $(seq 1 600); do
        [ -s "$1" ] && return
        sleep 0.05
    done
    fail "$1 did not appear"
}

# Holds $job, whose whole log has so many lines, while it has steps to do.
halted_before() {
    kill -STOP $job && [ "$(wc -l <"$T/run/log.csv")" -lt "$1" ] || fail "it was halted too late: the test is none"
}
