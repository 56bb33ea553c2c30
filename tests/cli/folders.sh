# Folders of any size: parts, what is left out, results.jsonl, and processes that are killed (tests/kill_folder.sh).
. tests/cli/lib_infer.sh

few() { "$BIN/lgd-infer" --size 16 --iterations 0 --threads 1 --maps diffuse "$@"; }

# $1 photographs in $T/in: links to three.
photos() {
    mkdir "$T/in"
    for i in 0 1 2; do photo "$T/$i.ppm" $((9 + i)) 9; done
    i=0
    while [ $i -lt "$1" ]; do
        ln -s "$T/$((i % 3)).ppm" "$T/in/p$i.ppm"
        i=$((i + 1))
    done
}

# Fails unless results.jsonl is a line of JSON for each of $2 folders of $1.
listed() {
    lines "$1/results.jsonl" "$2"
    sed 's/^{"folder": "\([^"]*\)", "file": .*}$/\1/' "$1/results.jsonl" | sort >"$T/listed"
    ( cd "$1" && ls -d */ ) | tr -d / | sort | cmp -s - "$T/listed" ||
        fail "results.jsonl has other names: $(head -n 3 "$T/listed" | tr '\n' ' ')"
    if command -v python3 >/dev/null; then
        python3 -c 'import json, sys
for line in open(sys.argv[1]): json.loads(line)' "$1/results.jsonl" || fail "results.jsonl has lines that are no JSON"
    fi
}

parts() {
    model
    photos 12
    for i in 1 2 3; do
        few --shard $i/3 "$T/in" -o "$T/o" >"$T/names.$i" 2>"$T/err.$i" &
    done
    wait
    [ "$(cat "$T"/names.? | sort -u | wc -l)" -eq 12 ] || fail "not every photograph is in a part"
    lines "$T/names.1" "$(sort -u "$T/names.1" | wc -l)"
    [ "$(cat "$T"/names.? | wc -l)" -eq 12 ] || fail "a photograph is in two parts"
    listed "$T/o" 12
    # a photograph more moves none
    photo "$T/in/more.ppm" 8 8
    expect 0 few --shard 2/3 "$T/in" -o "$T/p"
    grep -v more "$T/out" | sed "s|$T/p|$T/o|" | cmp -s - "$T/names.2" || fail "another photograph changes the parts"
    expect 0 few "$T/in" -o "$T/one"
    for f in "$T"/o/*/diffuse.png "$T"/o/*/meta.txt; do
        cmp -s "$f" "$T/one/${f#"$T/o/"}" || fail "$f differs from one call's"
    done
    # a part may be empty
    expect 0 few --shard 1/1000000 "$T/in/p1.ppm" "$T/in/p2.ppm" -o "$T/empty"
    lines "$T/out" 0
    for bad in 0/3 4/3 1/0 1 1/ /3 1/x 1/3/3 -1/3; do
        expect 2 few --shard $bad "$T/in" -o "$T/o"
        says "$T/err" "is not I/N"
    done
    mkdir "$T/two"
    photo "$T/two/p0.ppm" 8 8 # the same stem, whatever part is asked for
    expect 2 few --shard 1/3 "$T/in" "$T/two/p0.ppm" -o "$T/o"
    expect 2 few --capture "$T/in" --shard 1/3 -o "$T/o"
}

done_again() {
    expect 0 few --skip-existing "$@" "$T/in" -o "$T/o"
    sed "s|$T/o/||" "$T/out" | tr '\n' ' ' >"$T/done"
}

existing() {
    model
    photos 4
    expect 0 few "$T/in" -o "$T/o"
    cp -r "$T/o" "$T/first"
    done_again
    lines "$T/out" 0
    says "$T/err" "4 of 4 photographs were complete already"
    diff -r "$T/o" "$T/first" >/dev/null || fail "something is written although all is complete"
    rm "$T/o/p0/meta.txt" "$T/o/p1/diffuse.png" # a move that was interrupted, a map that is lost
    rm "$T/in/p2.ppm"
    photo "$T/in/p2.ppm" 12 12 # another photograph of the name
    done_again
    [ "$(cat "$T/done")" = "p0 p1 p2 " ] || fail "done again: $(cat "$T/done")"
    listed "$T/o" 4
    for f in p0 p1; do diff -r "$T/o/$f" "$T/first/$f" >/dev/null || fail "$f differs"; done
    if cmp -s "$T/o/p2/diffuse.png" "$T/first/p2/diffuse.png"; then fail "the older photograph's maps stay"; fi
    # every option that changes a file, and other weights
    for option in "--size 17" "--iterations 1" "--orientations 1" "--fov 40" "--light-power 2" \
        "--normal dx --maps normal" \
        "--maps diffuse,normal" \
        "--exact" "--precision bf16" "--workflow metallic" "--seamless --size 32" \
        "--mask $T/0.ppm --iterations 1" "--exr half --maps exr"; do
        case $option in --mask*) rm "$T/in"/*; ln -s "$T/0.ppm" "$T/in/p0.ppm"; few "$T/in" -o "$T/o" >"$T/out" 2>&1 ||
            fail "$(cat "$T/out")" ;; esac
        # shellcheck disable=SC2086
        done_again $option
        lines "$T/out" "$(ls "$T/in" | wc -l)"
        # shellcheck disable=SC2086
        done_again $option
        lines "$T/out" 0
    done
    cp "$MODEL" "$T/w.safetensors"
    done_again --model "$T/w.safetensors"
    lines "$T/out" 1
    listed "$T/o" 4
    expect 2 few --capture "$T/in" --skip-existing -o "$T/o"
}

# What stands in results.jsonl, and who wins.
lists() {
    model
    photos 3
    echo bad >"$T/in/bad.png"
    expect 1 few "$T/in" -o "$T/o"
    lines "$T/o/results.jsonl" 4
    grep -q '^{"folder": "bad", "file": "[^"]*/in/bad.png", "seconds": [0-9.e-]*, "error": ".*bad.png.*"}$' \
        "$T/o/results.jsonl" || fail "the failed one: $(grep bad "$T/o/results.jsonl")"
    for word in '"seconds": 0.' '"rmse_first": 0.' '"rmse": 0.' '"fov": 54.2' '"fov_is": "assumed"' '"power": ' \
        '"warnings": ["field of view assumed"'; do
        grep '"folder": "p1"' "$T/o/results.jsonl" >"$T/line"
        says "$T/line" "$word"
    done
    # a killed process: half a line, a line that is owed, and one of an older estimate
    grep -v '"p1"\|"p2"' "$T/o/results.jsonl" >"$T/rest"
    grep '"p2"' "$T/o/results.jsonl" >"$T/p2"
    { sed 's/"rmse": /"rmse": 1/' "$T/p2"; cat "$T/rest"; printf '{"folder": "p1", "fi'; } >"$T/o/results.jsonl"
    rm "$T/in/bad.png"
    photo "$T/in/bad.ppm" 8 8 # it can be read now
    expect 0 few --skip-existing "$T/in" -o "$T/o"
    lines "$T/out" 1
    listed "$T/o" 4
    grep -q '"folder": "p1".*"seconds": null, "hash"' "$T/o/results.jsonl" ||
        fail "what a killed process owes: $(grep p1 "$T/o/results.jsonl")"
    sed 's/"seconds": [0-9.e-]*/"seconds": null/' "$T/p2" >"$T/want"
    grep '"p2"' "$T/o/results.jsonl" | cmp -s - "$T/want" ||
        fail "the older line stays: $(grep p2 "$T/o/results.jsonl")"
    # done again: one line still; lines of other photographs stay
    expect 0 few "$T/in/p0.ppm" "$T/in/p1.ppm" -o "$T/o"
    listed "$T/o" 4
    if grep -q '"folder": "p1".*"seconds": null' "$T/o/results.jsonl"; then fail "the new line is not taken"; fi
    # what others wrote stays, where it stands
    { echo '{"folder":"p9","note":"not ours"}'; cat "$T/o/results.jsonl"; printf 'a note'; } >"$T/noted"
    cp "$T/noted" "$T/o/results.jsonl"
    expect 0 few "$T/in/p0.ppm" "$T/in/p1.ppm" -o "$T/o"
    lines "$T/o/results.jsonl" 6
    [ "$(head -n 1 "$T/o/results.jsonl")" = '{"folder":"p9","note":"not ours"}' ] || fail "a line of others is gone"
    says "$T/o/results.jsonl" "a note"
    # of a lone photograph there is none
    expect 0 few "$T/in/p0.ppm" -o "$T/lone"
    [ "$(ls -A "$T/lone")" = p0 ] || fail "a lone photograph: $(ls -A "$T/lone")"
    cp "$T/0.ppm" "$T/in/results.jsonl.ppm"
    expect 2 few "$T/in" -o "$T/o"
    says "$T/err" "results.jsonl"
}

# Nobody's line is lost where every process writes the list anew.
lists_at_once() {
    model
    photos 24
    for i in 1 2 3 4; do few --shard $i/4 --skip-existing "$T/in" -o "$T/o" >"$T/n$i" 2>&1 & done
    wait
    listed "$T/o" 24
    for i in 1 2 3 4; do few --shard $i/4 "$T/in" -o "$T/o" >"$T/n$i" 2>&1 & done
    wait
    listed "$T/o" 24
    [ -z "$(find "$T/o" -name '.*')" ] || fail "left over: $(find "$T/o" -name '.*' | head -n 3)"
}

# Of photographs that the default model's maps look like, the summary says nothing; of noise it does.
looks_like_it() {
    for f in m_pink 057; do [ -f "$TESTDATA/photos/$f.png" ] || skip "no $TESTDATA/photos"; done
    {
        printf 'P3 64 64 255\n'
        awk 'BEGIN { for (v = 1; i++ < 3 * 64 * 64;) print int((v = v * 16807 % 2147483647) / 8388608) }'
    } >"$T/noise.ppm"
    LGD_MODEL='' expect 0 "$BIN/lgd-infer" -m phone --maps diffuse "$TESTDATA/photos/m_pink.png" \
        "$TESTDATA/photos/057.png" "$T/noise.ppm" -o "$T/o"
    says "$T/err" "lgd-infer:   $T/noise.ppm: its maps do not look like it"
    [ "$(grep -c 'do not look like it' "$T/err")" = 1 ] || fail "$(grep 'do not look like it' "$T/err")"
}

killed_and_begun_again() {
    model
    TMPDIR=$T expect 0 sh tests/kill_folder.sh 120 4 2
}

check folders_parts parts
check folders_existing existing
check folders_lists lists
check folders_lists_at_once lists_at_once
check folders_killed killed_and_begun_again
check folders_look_at looks_like_it
