# What killed processes leave, and several processes that write the same folder.
. tests/cli/lib_infer.sh

# Kills the command in the middle of writing a file, by a signal that nobody can clean up after: the limit on the size
# of files.
killed() {
    blocks=$1
    shift
    ( ulimit -f "$blocks"
      "$@" ) >"$T/out" 2>"$T/err"
    [ $? -gt 128 ] || fail "'$*' was not killed"
}
hidden() { find "$1" -mindepth 1 -name '.*'; }

infer_sweeps() {
    model
    photo "$T/p.ppm" 64 64
    mkdir "$T/o"
    killed 4 "$BIN/lgd-infer" --size 64 --iterations 0 "$T/p.ppm" -o "$T/o"
    [ -n "$(hidden "$T/o")" ] || fail "nothing is left: the test is none"
    expect 0 infer "$T/p.ppm" -o "$T/o"
    [ "$(ls -A "$T/o")" = p ] || fail "left over: $(ls -A "$T/o" | tr '\n' ' ')"
    # inside the folder of a photograph that has one
    killed 4 "$BIN/lgd-infer" --size 64 --iterations 0 "$T/p.ppm" -o "$T/o"
    [ -n "$(hidden "$T/o/p")" ] || fail "nothing is left in the photograph's folder: the test is none"
    expect 0 infer "$T/p.ppm" -o "$T/o"
    complete "$T/o/p"
}

# What a process still holds stays, and so does what may be another machine's until it is a day old.
sweep_spares_the_living() {
    model
    command -v flock >/dev/null || skip "no flock(1)"
    photo "$T/p.ppm" 64 64
    mkdir "$T/o"
    killed 4 "$BIN/lgd-infer" --size 64 --iterations 0 "$T/p.ppm" -o "$T/o"
    name=$(ls -A "$T/o")
    expect 0 flock "$T/o/$name" "$BIN/lgd-infer" --size 32 --iterations 0 "$T/p.ppm" -o "$T/o"
    [ -d "$T/o/$name" ] || fail "a living process's folder was removed"
    other=.lgd-00000001-${name#.lgd-????????-}
    mv "$T/o/$name" "$T/o/$other"
    expect 0 infer "$T/p.ppm" -o "$T/o"
    [ -d "$T/o/$other" ] || fail "another machine's new folder was removed"
    touch -d '2 days ago' "$T/o/$other"
    expect 0 infer "$T/p.ppm" -o "$T/o"
    [ ! -e "$T/o/$other" ] || fail "another machine's old folder stays"
    # names that are only like ours
    mkdir "$T/o/.lgd-mine.tmp" "$T/o/.lgd-0000000g-1-1.tmp" "$T/o/.lgd-00000001-01-1.tmp"
    touch -d '2 days ago' "$T/o"/.lgd-*
    expect 0 infer "$T/p.ppm" -o "$T/o"
    [ "$(hidden "$T/o" | wc -l)" -eq 3 ] || fail "somebody else's folders were removed"
}

weights_sweep() {
    model
    mkdir "$T/o"
    killed 100 "$BIN/lgd-convert" "$MODEL" "$T/o/w.safetensors"
    [ "$(ls -A "$T/o")" ] || fail "nothing is left: the test is none"
    expect 0 "$BIN/lgd-convert" "$MODEL" "$T/o/w.safetensors"
    [ "$(ls -A "$T/o")" = w.safetensors ] || fail "left over: $(ls -A "$T/o" | tr '\n' ' ')"
}

eval_and_data_sweep() {
    model
    set -- "$BIN/lgd-eval" --size 32 --iterations 1 --threads 1 --fast --set procedural:1,2 -o "$T/e"
    killed 8 "$@"
    [ -n "$(hidden "$T/e")" ] || fail "lgd-eval leaves nothing: the test is none"
    expect 0 "$@"
    [ -z "$(hidden "$T/e")" ] || fail "lgd-eval: left over: $(hidden "$T/e")"
    for format in folders strips; do
        set -- "$BIN/lgd-data" --format $format --count 1 --size 64 --threads 1 -o "$T/$format"
        killed 4 "$@"
        [ -n "$(hidden "$T/$format")" ] || fail "lgd-data leaves nothing: the test is none"
        expect 0 "$@"
        [ -z "$(hidden "$T/$format")" ] || fail "lgd-data: left over: $(hidden "$T/$format")"
    done
    # a set that is there already stays as it is
    cp -r "$T/folders" "$T/before"
    killed 4 "$BIN/lgd-data" --count 1 --size 96 --threads 1 -o "$T/folders"
    [ -n "$(hidden "$T/folders")" ] || fail "lgd-data leaves nothing in the set: the test is none"
    expect 0 diff -r -x '.*' "$T/before" "$T/folders"
    expect 0 "$BIN/lgd-data" --count 1 --size 64 --threads 1 -o "$T/folders"
    expect 0 diff -r "$T/before" "$T/folders"
}

# Each of them is done, and what stays is one's.
writers_at_once() {
    model
    photo "$T/p.ppm" 16 16
    expect 0 infer "$T/p.ppm" -o "$T/r"
    for round in 1 2 3 4 5 6 7 8; do
        jobs=
        for i in 1 2 3 4 5 6; do
            infer "$T/p.ppm" -o "$T/$round" >/dev/null 2>"$T/err.$i" &
            jobs="$jobs $!"
        done
        i=0
        for job in $jobs; do
            i=$((i + 1))
            wait "$job" || fail "one of six at once fails: $(tail -n 1 "$T/err.$i")"
        done
        complete "$T/$round/p"
        [ "$(ls -A "$T/$round")" = p ] || fail "left over: $(ls -A "$T/$round")"
        diff -r "$T/r/p" "$T/$round/p" >"$T/differs" || fail "$(head -n 1 "$T/differs")"
    done
}

# A photograph of the same name: none of the older one's maps stay beside the new ones.
older_maps_go() {
    model
    mkdir "$T/a" "$T/b"
    photo "$T/a/p.ppm" 32 32
    photo "$T/b/p.ppm" 32 32 90
    expect 0 infer "$T/a/p.ppm" -o "$T/o"
    echo mine >"$T/o/p/notes.txt"
    expect 0 infer --maps normal,height "$T/a/p.ppm" -o "$T/o" # the same photograph's stay
    for f in $FILES height.png; do [ -s "$T/o/p/$f" ] || fail "$f of the same estimate is gone"; done
    expect 0 infer --maps normal "$T/b/p.ppm" -o "$T/o"
    [ "$(ls -A "$T/o/p" | tr '\n' ' ')" = "meta.txt normal.png notes.txt " ] ||
        fail "there are: $(ls -A "$T/o/p" | tr '\n' ' ')"
    says "$T/err" "removed from the folder"
    says "$T/err" "height.png"
    expect 0 infer --maps render "$T/a/p.ppm" -o "$T/o"
    [ "$(ls -A "$T/o/p" | tr '\n' ' ')" = "meta.txt notes.txt render.png " ] ||
        fail "there are: $(ls -A "$T/o/p" | tr '\n' ' ')"
    expect 0 infer "$T/b/p.ppm" -o "$T/o"
    rm "$T/o/p/notes.txt"
    complete "$T/o/p"
    expect 0 infer --normal dx --maps normal "$T/b/p.ppm" -o "$T/o" # maps.exr has the other y
    [ "$(ls -A "$T/o/p" | tr '\n' ' ')" = "meta.txt normal.png " ] || fail "there are: $(ls -A "$T/o/p" | tr '\n' ' ')"
}

check leftovers_of_infer infer_sweeps
check leftovers_of_the_living sweep_spares_the_living
check leftovers_of_weights weights_sweep
check leftovers_of_eval_and_data eval_and_data_sweep
check leftovers_writers_at_once writers_at_once
check leftovers_older_maps older_maps_go
