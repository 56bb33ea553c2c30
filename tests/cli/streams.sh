# Closed standard streams: no file that a program opens becomes the stream that its messages go to.
. tests/cli/lib_infer.sh

# Runs the command with the streams of $1 closed. Fails unless it ends with 1 where the results on standard output were
# lost, else with 0.
closed() {
    way=$1
    shift
    rm -rf "$T/o"
    case $way in
    0) "$@" <&- ;; 1) "$@" >&- ;; 2) "$@" 2>&- ;;
    01) "$@" <&- >&- ;; 02) "$@" <&- 2>&- ;; 12) "$@" >&- 2>&- ;; 012) "$@" <&- >&- 2>&- ;;
    esac
    code=$?
    case $way in *1*) want=1 ;; *) want=0 ;; esac
    [ $code -eq $want ] || fail "$1 without the streams $way: exit status $code, not $want"
}
WAYS="0 1 2 01 02 12 012"

# Fails unless the second folder holds the same files with the same bytes as the first.
# results.jsonl has seconds: each of its lines is to be one of it.
same() {
    diff -rq -x results.jsonl "$1" "$2" >"$T/differs" || fail "without the streams $way: $(head -n 1 "$T/differs")"
    if [ -f "$1/results.jsonl" ]; then
        ! grep -qv '^{"folder": ".*]}$' "$2/results.jsonl" ||
            fail "without the streams $way: results.jsonl holds $(grep -v '^{"folder": ".*]}$' "$2/results.jsonl" |
            head -n 1)"
        lines "$2/results.jsonl" "$(wc -l <"$1/results.jsonl")"
    fi
}

infer_keeps_its_maps() {
    model
    mkdir "$T/in"
    photo "$T/in/0.ppm" 16 16
    for i in 1 2 3 4 5 6 7 8 9; do cp "$T/in/0.ppm" "$T/in/$i.ppm"; done
    set -- "$BIN/lgd-infer" --size 16 --iterations 1 "$T"/in/*.ppm
    expect 0 "$@" -o "$T/r"
    for w in $WAYS; do
        closed $w "$@" -o "$T/o"
        same "$T/r" "$T/o"
    done
}

# What depends on time or names the folder is left out.
timeless() {
    [ ! -s "$1/lock" ] || fail "without the streams $way: the lock holds: $(head -n 1 "$1/lock")"
    cut -d , -f 1-12,14- "$1/log.csv" >"$1/log" && rm "$1/log.csv" "$1/config.ini"
}
train_keeps_its_log() {
    { small_model
      printf '%s\n' '[train]' 'batch = 2' 'pretrain_steps = 2' 'steps = 2' 'log_every = 1' 'checkpoint_every = 2' \
          '[validate]' 'every = 2' 'count = 2' 'size = 16'; } >"$T/small.ini"
    expect 0 "$BIN/lgd-train" "$T/small.ini" --set output.folder="$T/r" --threads 1
    way=
    timeless "$T/r"
    for w in $WAYS; do
        closed $w "$BIN/lgd-train" "$T/small.ini" --set output.folder="$T/o"
        timeless "$T/o"
        same "$T/r" "$T/o"
    done
}

eval_keeps_its_results() {
    model
    set -- "$BIN/lgd-eval" --size 16 --iterations 1 --threads 1 --fast --set procedural:1,3 --images
    expect 0 "$@" -o "$T/r"
    for w in $WAYS; do
        closed $w "$@" -o "$T/o"
        cmp -s "$T/r/results.csv" "$T/o/results.csv" || fail "without the streams $w: results.csv differs"
        same "$T/r/images" "$T/o/images"
    done
}

data_keeps_its_maps() {
    for w in 0 2 02; do
        closed $w "$BIN/lgd-data" --count 2 --size 16 --threads 1 -o "$T/o"
        [ -d "$T/r" ] || mv "$T/o" "$T/r"
        [ ! -d "$T/o" ] || same "$T/r" "$T/o"
    done
}

convert_keeps_its_weights() {
    model
    expect 0 "$BIN/lgd-convert" "$MODEL" "$T/r.safetensors"
    for w in 0 2 02; do
        closed $w "$BIN/lgd-convert" "$MODEL" "$T/o.safetensors"
        cmp -s "$T/r.safetensors" "$T/o.safetensors" || fail "without the streams $w: the weights differ"
        rm "$T/o.safetensors"
    done
    closed 12 "$BIN/lgd-convert" --list "$MODEL"
}

check streams_closed_infer infer_keeps_its_maps
check streams_closed_train train_keeps_its_log
check streams_closed_eval eval_keeps_its_results
check streams_closed_data data_keeps_its_maps
check streams_closed_convert convert_keeps_its_weights
