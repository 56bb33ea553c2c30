# lgd-train in several processes, with each MPI library whose mpirun is installed.
. tests/cli/lib.sh
. tests/support/small_model.sh

TRAIN=$BIN/lgd-train
# In containers one process may not read another's memory; messages go through shared memory instead.
export OMPI_MCA_btl_vader_single_copy_mechanism=none OMPI_MCA_btl_smsc=none

# LAUNCH: the launcher of $1 and its options for a machine of any size, as root too; skips where there is none.
launcher() {
    for program in mpirun.$1 mpiexec.$1 mpirun mpiexec; do
        command -v "$program" >/dev/null || continue
        case $1:$("$program" --version 2>&1) in
        openmpi:*"Open MPI"*) LAUNCH="$program --allow-run-as-root --oversubscribe" ;;
        mpich:*HYDRA*) LAUNCH=$program ;;
        *) continue ;;
        esac
        [ -e "$BUILD/lib/lgd/liblgd_$1.so" ] || skip "$program is installed, and this build has no liblgd_$1.so"
        LINK=$BUILD/mpi/link_$1.so
        return
    done
    skip "no mpirun of $1"
}

# Twelve steps of g alone and twelve of g and h; buckets of some parameters each.
config() {
    small_model >"$T/small.ini"
    cat >>"$T/small.ini" <<'INI'
[train]
batch = 6
pretrain_steps = 12
pretrain_rate = 0.0005
steps = 12
rate = 0.0002
warmup = 6
checkpoint_every = 8
log_every = 1
bucket = 0.005
[validate]
every = 8
count = 5
size = 16
INI
}

# train N FOLDER ARGUMENTS...: a run of N ranks.
train() {
    n=$1
    folder=$T/$2
    shift 2
    $LAUNCH -np "$n" "$TRAIN" "$T/small.ini" --set output.folder="$folder" --threads 1 "$@"
}
alone() {
    folder=$T/$1
    shift
    "$TRAIN" "$T/small.ini" --set output.folder="$folder" --threads 1 "$@"
}

# near A B COLUMNS BOUND: the CSV files agree in the columns from the second to the last of COLUMNS, relatively.
near() {
    paste -d, "$1" "$2" | awk -F, -v last="$3" -v bound="$4" 'NR > 1 { n = NF / 2
        if ($1 != $(n + 1)) { print "row " NR " is of another step"; exit }
        for (i = 3; i <= last; i++) if ($i != "") { d = ($i - $(n + i)) / $i; if (d < 0) d = -d
            if (!(d <= bound)) { print "step " $1 ", column " i ": " $i " and " $(n + i); exit } } }' >"$T/near"
    [ ! -s "$T/near" ] || fail "$1 and $2: $(cat "$T/near")"
}
same_weights() { cmp -s "$T/$1/last.safetensors" "$T/$2/last.safetensors" || fail "the weights of $1 and $2 differ"; }

# One process, two, three and four make the same run; the same number makes the same bytes.
ranks_agree() {
    launcher "$1"
    config
    expect 0 alone one
    for n in 2 3 4; do
        expect 0 train $n $n
        says "$T/err" "ranks 0-$((n - 1)) on "
        says "$T/err" "%) for the gradients of $n ranks"
        [ "$(grep -c "validation at step 24" "$T/out")" = 1 ] || fail "validation is not printed once"
        near "$T/one/log.csv" "$T/$n/log.csv" 3 1e-4
        near "$T/one/val.csv" "$T/$n/val.csv" 8 1e-3
        [ -z "$(find "$T/$n" -name '.*')" ] || fail "temporary files are left"
    done
    expect 0 train 4 again
    for f in best last checkpoint; do cmp -s "$T/4/$f.safetensors" "$T/again/$f.safetensors" || fail "$f differs"; done
    expect 0 train 1 launched
    same_weights one launched
}

# begin N FOLDER ARGUMENTS...: a run of many steps in the background, job; waits for its first checkpoint after step 1.
begin() {
    n=$1
    folder=$2
    shift 2
    # shellcheck disable=SC2086
    env --default-signal=HUP $LAUNCH -np "$n" "$TRAIN" "$T/small.ini" --set output.folder="$T/$folder" --threads 1 \
        --set train.checkpoint_every=1 "$@" >"$T/out" 2>"$T/err" &
    job=$!
    for _ in $(seq 1 1200); do
        [ -s "$T/$folder/last.safetensors" ] && return
        sleep 0.05
    done
    fail "no checkpoint appeared: $(tail -n 1 "$T/err")"
}
# Waits until the run in FOLDER has made two hundred steps. In the first 120 what other ranks round differently grows by
# a thousand and more within ten steps, afterwards it stays below 1e-6 (20 interruptions at 12 to 722).
settle() {
    for _ in $(seq 1 1200); do
        [ "$(wc -l <"$T/$1/log.csv")" -gt 200 ] && return
        sleep 0.05
    done
    fail "no two hundred steps were made: $(tail -n 1 "$T/err")"
}
# The PID of a rank, from the first line of a run.
pid_of() { sed -n "s/.*(PIDs \\([0-9 ]*\\)).*/\\1/p" "$T/err" | head -n 1 | cut -d' ' -f$(($1 + 1)); }

# The ten steps after an interruption, made by another number of ranks; rounding grows in more of them.
goes_on_as_whole() {
    rows=$(($(cat "$T/$1.step") + 11))
    for f in whole "$1"; do head -n $rows "$T/$f/log.csv" >"$T/$f.csv"; done
    near "$T/whole.csv" "$T/$1.csv" 3 1e-4
}

# A signal to any rank or to mpirun ends all of them with a checkpoint; going on makes the same bytes, and with another
# number of ranks the same run.
signals_save() {
    launcher "$1"
    config
    sed -i 's/^pretrain_steps.*/pretrain_steps = 1500/' "$T/small.ini"
    expect 0 train 2 whole
    plain=$LAUNCH
    for signal in TERM INT HUP; do
        # Open MPI's mpirun makes SIGTERM of SIGINT and may end before it has passed on what the ranks then say.
        [ "$1:$signal" = openmpi:INT ] && continue
        rm -rf "$T/part"
        # Open MPI leaves what it ends a second; with this it also waits as long for ranks that are gone.
        if [ "$1" = openmpi ]; then LAUNCH="$plain --mca odls_base_sigkill_timeout 10"; fi
        begin 2 part
        settle part
        LAUNCH=$plain
        case $1:$signal in
        *:TERM) kill -TERM "$(pid_of 1)" ;;
        *:HUP) kill -HUP "$(pid_of 0)" ;;
        *) kill -INT $job ;; # mpirun passes it on: Open MPI as SIGTERM
        esac
        # MPICH's mpirun that has passed on SIGINT may lose the ranks' status, 130, and end with 0.
        wait $job && [ "$1:$signal" != mpich:INT ] && fail "SIG$signal: mpirun ended with 0"
        grep -q "interrupted at step" "$T/err" || fail "SIG$signal: $(tail -n 3 "$T/err" | tr '\n' ' ')"
        [ "$(grep -c "interrupted at step" "$T/err")" = 1 ] || fail "SIG$signal is said by more than one rank"
        sed -n 's/.*interrupted at step \([0-9]*\).*/\1/p' "$T/err" >"$T/other-$signal.step"
        cp -r "$T/part" "$T/other-$signal"
        expect 0 train 2 part --resume
        same_weights whole part
        lines "$T/part/log.csv" 1513
    done
    expect 0 train 3 other-TERM --resume
    says "$T/err" "was made by 2 and goes on with 3 ranks"
    goes_on_as_whole other-TERM
    expect 0 alone other-HUP --resume
    says "$T/err" "goes on with 1 rank:"
    goes_on_as_whole other-HUP
}

# kill -9 of a rank ends the job, with a line that says which; the checkpoint is whole and going on makes the same
# bytes.
killed_rank() {
    launcher "$1"
    config
    sed -i 's/^pretrain_steps.*/pretrain_steps = 150/' "$T/small.ini"
    expect 0 train 2 whole
    for rank in 1 0; do
        rm -rf "$T/part"
        begin 2 part
        victim=$(pid_of $rank)
        kill -KILL "$victim"
        wait $job && fail "mpirun ended with 0"
        case $1 in
        openmpi) says "$T/err" "process rank $rank with PID" ;;
        mpich) cat "$T/out" "$T/err" >"$T/both"; says "$T/both" "PID $victim RUNNING AT" ;;
        esac
        expect 0 train 2 part --resume
        same_weights whole part
        lines "$T/part/log.csv" 163
    done
}

# A loss that is not a number on one rank makes all of them skip the step.
skip_together() {
    launcher "$1"
    config
    [ -e "$LINK" ] || skip "no $LINK"
    LGD_LINK_POISON=5 LD_PRELOAD=$LINK expect 0 train 2 run
    says "$T/err" "step 5 is skipped: its loss is not finite"
    [ "$(grep -c "is skipped" "$T/err")" = 1 ] || fail "more than one step is skipped, or more than one rank says it"
    sed -n 6p "$T/run/log.csv" | grep -q ",nan,.*,1$" ||
        fail "no skipped step in log.csv: $(sed -n 6p "$T/run/log.csv")"
    lines "$T/run/log.csv" 25
}

# Gradients in bf16: another run, near the one in f32, and always the same one.
rounded_gradients() {
    launcher "$1"
    config
    expect 0 train 4 exact
    expect 0 train 4 rounded --set train.reduce=bf16
    says "$T/err" "summed as bf16"
    cmp -s "$T/exact/best.safetensors" "$T/rounded/best.safetensors" && fail "nothing is rounded"
    near "$T/exact/log.csv" "$T/rounded/log.csv" 3 0.05
    expect 0 train 4 again --set train.reduce=bf16
    same_weights rounded again
    expect 0 train 2 two --set train.reduce=bf16
    near "$T/exact/log.csv" "$T/two/log.csv" 3 0.05
}

# fails TEXT COMMAND...: the run ends with an error, in one line.
fails() {
    text=$1
    shift
    "$@" >"$T/out" 2>"$T/err" && fail "'$*' ended with 0"
    [ "$(grep -cF -- "$text" "$T/err")" = 1 ] || fail "'$text' is not said once: $(head -n 3 "$T/err" | tr '\n' ' ')"
}

errors_are_said_once() {
    launcher "$1"
    config
    fails "train.batch is 3: 4 ranks cannot share it" train 4 run --set train.batch=3
    [ ! -e "$T/run/config.ini" ] || fail "a run was begun"
    fails "model.rmse = batch takes an error over the whole batch" train 2 run --set model.rmse=batch \
        --set model.descent=none --set model.images=1
    fails "there is no key train.bach" train 2 run --set train.bach=3
    fails "there is no run to resume" train 2 none --resume
    fails "none.safetensors" train 2 run --init "$T/none.safetensors"
    expect 0 train 2 run --set train.steps=0 --set train.pretrain_steps=1
    fails "there is a run already" train 2 run
    fails "train.rate is 0.25" train 2 run --resume --set train.steps=0 --set train.pretrain_steps=1 \
        --set train.rate=0.25
    expect 0 train 2 help --help
    [ "$(grep -c "^Usage: lgd-train" "$T/out")" = 1 ] || fail "help is printed by more than one rank"
    if "$BIN/lgd-train" --version >/dev/null && LGD_ISA=avx2 "$BIN/lgd-train" --version >/dev/null 2>&1; then
        fails "its CPU's instruction set (LGD_ISA chooses one) is not rank 0's" \
            $LAUNCH -np 1 "$TRAIN" "$T/small.ini" --set output.folder="$T/isa" --threads 1 : \
            -np 1 env LGD_ISA=base "$TRAIN" "$T/small.ini" --set output.folder="$T/isa" --threads 1
    fi
    fails "its configuration is not rank 0's" \
        $LAUNCH -np 1 "$TRAIN" "$T/small.ini" --set output.folder="$T/keys" --threads 1 : \
        -np 1 "$TRAIN" "$T/small.ini" --set output.folder="$T/keys" --threads 1 --set train.rate=0.002
    fails "its train.checkpoint_every or max_skipped is not rank 0's" \
        $LAUNCH -np 1 "$TRAIN" "$T/small.ini" --set output.folder="$T/keys" --threads 1 : \
        -np 1 "$TRAIN" "$T/small.ini" --set output.folder="$T/keys" --threads 1 --set train.checkpoint_every=3
}

# A launcher that does not speak the library's language: each process would train by itself.
strangers() {
    launcher "$1"
    [ "$1" = openmpi ] || skip "MPICH does not start without its launcher"
    config
    OMPI_COMM_WORLD_SIZE=2 OMPI_COMM_WORLD_RANK=0 expect 1 alone run
    says "$T/err" "started as one of 2 processes, of which liblgd_openmpi.so sees 1: use the mpirun of Open MPI"
    [ ! -e "$T/run" ] || fail "a run was begun"
}

# What rank 0 cannot write ends the job: before the first step, and later.
lost_folder() {
    launcher "$1"
    config
    mkdir -p "$T/run/log.csv"
    fails "log.csv: " train 2 run
    sed -i 's/^pretrain_steps.*/pretrain_steps = 100000/' "$T/small.ini"
    begin 2 lost
    # In one step: what removes file by file leaves a folder in which a file was made meanwhile.
    mv "$T/lost" "$T/moved"
    wait $job && fail "mpirun ended with 0"
    says "$T/err" "$T/lost/"
}

# Ranks on one host sum gradients in shared memory, or send them where it has no room for them: the same run.
no_room() {
    launcher "$1"
    config
    sed -i 's/^g_width = .*/g_width = 64/; s/^g_width_max = .*/g_width_max = 128/; s/_steps = 12/_steps = 3/' \
        "$T/small.ini"
    echo 'mount -t tmpfs -o size=16m none /dev/shm && exec "$@"' >"$T/small_shm"
    unshare -m sh "$T/small_shm" true 2>/dev/null || skip "file systems cannot be mounted here"
    expect 0 train 2 shared
    grep -q "/dev/shm" "$T/err" && fail "/dev/shm is too small: $(grep /dev/shm "$T/err")"
    LAUNCH="unshare -m sh $T/small_shm $LAUNCH"
    expect 0 train 2 sent
    says "$T/err" "/dev/shm has too little room: ranks on one host send each other their gradients"
    near "$T/shared/log.csv" "$T/sent/log.csv" 3 1e-4
}

# Ranks of one host share memory, and hosts sum what theirs have; where hosts have different numbers of ranks none do.
hosts_with_ranks() {
    launcher "$1"
    config
    [ -e "$LINK" ] || skip "no $LINK"
    expect 0 alone one
    for n in 4 3; do
        LGD_LINK_HOSTS=2 LD_PRELOAD=$LINK expect 0 train $n $n
        near "$T/one/log.csv" "$T/$n/log.csv" 3 1e-4
        near "$T/one/val.csv" "$T/$n/val.csv" 8 1e-3
    done
    says "$T/err" "hosts have different numbers of ranks: ranks on one host send each other their gradients"
    LGD_LINK_HOSTS=2 LD_PRELOAD=$LINK expect 0 train 4 again
    grep -q "send each other" "$T/err" && fail "two hosts do not have two ranks each"
    same_weights 4 again
}

# Two nodes on one machine, without ssh: the second name of this machine is another node to mpirun, which starts what it
# needs there with a program of ours in place of ssh. The hostfile is the one of configs/cluster.
two_nodes() {
    launcher "$1"
    config
    cat >"$T/agent" <<'SH'
#!/bin/sh
while [ $# -gt 0 ]; do
    case $1 in -*) shift ;; *) break ;; esac
done
echo "$1" >>"$AGENT_LOG"
shift
exec /bin/sh -c "$*"
SH
    chmod +x "$T/agent"
    sed 's/^node1/localhost/; s/^node2/127.0.0.2/; s/slots=[0-9]*/slots=1/' configs/cluster/hosts >"$T/hosts"
    case $1 in
    openmpi)
        LAUNCH="$LAUNCH --hostfile $T/hosts --mca plm_rsh_agent $T/agent --mca btl self,tcp"
        LAUNCH="$LAUNCH --mca btl_tcp_if_include lo --mca oob_tcp_if_include lo"
        ;;
    mpich)
        sed -i 's/ slots=/:/' "$T/hosts"
        LAUNCH="$LAUNCH -f $T/hosts -launcher ssh -launcher-exec $T/agent"
        ;;
    esac
    AGENT_LOG=$T/agents expect 0 train 2 run
    says "$T/agents" 127.0.0.2
    says "$T/err" "for the gradients of 2 ranks"
    expect 0 alone one
    near "$T/one/log.csv" "$T/run/log.csv" 3 1e-4
    sh -n configs/cluster/slurm.sh || fail "slurm.sh is no shell script"
}

programs_know_no_mpi() {
    command -v ldd >/dev/null || skip "no ldd"
    for f in "$BIN"/lgd-* "$BUILD"/liblgd.so; do
        ldd "$f" | grep -qE 'libmpi|libmpich|libopen-rte' && fail "$f is linked with MPI"
    done
    # As on a machine without: one process neither looks for a library nor needs one; one of several says what it needs.
    mkdir -p "$T/bin"
    cp "$TRAIN" "$T/bin"
    config
    expect 0 "$T/bin/lgd-train" "$T/small.ini" --set output.folder="$T/run" --threads 1 --set train.steps=1 \
        --set train.pretrain_steps=1
    OMPI_COMM_WORLD_SIZE=2 OMPI_COMM_WORLD_RANK=0 expect 1 "$T/bin/lgd-train" "$T/small.ini" \
        --set output.folder="$T/two"
    says "$T/err" "one of 2 processes, for which lgd has to be built where Open MPI"
    PMI_SIZE=2 PMI_RANK=1 expect 1 "$T/bin/lgd-train" "$T/small.ini" --set output.folder="$T/two"
    says "$T/err" "rank 1: started as one of 2 processes, for which lgd has to be built where MPICH"
    [ ! -e "$T/two" ] || fail "a run was begun"
}

check mpi_programs_know_no_mpi programs_know_no_mpi
for library in openmpi mpich; do
    for name in ranks_agree signals_save killed_rank skip_together rounded_gradients errors_are_said_once strangers \
        lost_folder no_room hosts_with_ranks two_nodes; do
        with() { $name $library; }
        check mpi_${library}_$name with
    done
done
