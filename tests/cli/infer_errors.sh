# Errors of lgd-infer: names, folders, disks, pipes, signals, weights.
. tests/cli/lib_infer.sh

bad_ones_do_not_stop() {
    model
    photo "$T/a.ppm" 16 16
    photo "$T/d.ppm" 16 16
    echo "no photograph" >"$T/b.jpg"
    mkdir "$T/folder.png"
    head -c 200 "$T/a.ppm" >"$T/e.ppm"
    cp "$T/b.jpg" "$T/notes.txt"
    expect 1 infer "$T/a.ppm" "$T/b.jpg" "$T/c.png" "$T/folder.png" "$T/e.ppm" "$T/notes.txt" "$T/gone/" \
        "$T/d.ppm" -o "$T/o"
    complete "$T/o/a"
    complete "$T/o/d"
    lines "$T/out" 2
    for f in b.jpg c.png folder.png e.ppm; do says "$T/err" "$T/$f"; done
    says "$T/err" "$T/notes.txt: is no image, or one in a format that is not read"
    says "$T/err" "$T/gone/: No such file or directory"
    says "$T/err" "4 of 6"
    [ "$(ls -A "$T/o" | tr '\n' ' ')" = "a d results.jsonl " ] || fail "left over: $(ls -A "$T/o")"
}

same_stem() {
    mkdir "$T/x" "$T/y"
    photo "$T/x/wall.ppm" 8 8
    photo "$T/y/wall.ppm" 8 8
    expect 2 infer "$T/x/wall.ppm" "$T/y/wall.ppm" -o "$T/o"
    says "$T/err" "$T/x/wall.ppm"
    says "$T/err" "$T/y/wall.ppm"
    says "$T/err" "(1 such pair in all)"
    [ ! -e "$T/o" ] || fail "work was begun"
    cp "$T/x/wall.ppm" "$T/x/floor.ppm"
    cp "$T/x/wall.ppm" "$T/x/floor.pnm"
    expect 2 infer "$T/x" "$T/x/floor.pnm" "$T/y/wall.ppm" -o "$T/o"
    says "$T/err" "(2 such pairs in all)"
    says "$T/err" "@LIST"
    # the same file once more, by another name of its folder
    ln -s x "$T/link"
    expect 0 infer "$T/x/wall.ppm" "$T/x/wall.ppm" "$T/link/wall.ppm" -o "$T/o"
    lines "$T/out" 1
}

# What would have no effect is refused before any work.
without_effect() {
    model
    photo "$T/p.ppm" 8 8
    for bad in "--exr half --maps diffuse" "--normal dx --maps roughness" "--normal gl --maps page" \
        "--workflow metallic --maps roughness" "--workflow specular --maps height,exr" "--mask $T/p.ppm -i 0"; do
        # shellcheck disable=SC2086
        expect 2 infer $bad "$T/p.ppm" -o "$T/o"
        says "$T/err" "${bad%% *}"
    done
    [ ! -e "$T/o" ] || fail "the folder was made"
    for good in "--exr float --maps diffuse,exr" "--normal dx --maps exr" "--normal gl --maps glb" \
        "--workflow metallic --maps basecolor,orm" "--workflow specular --maps materialx" "--mask $T/p.ppm -i 1"; do
        # shellcheck disable=SC2086
        expect 0 infer $good "$T/p.ppm" -o "$T/o"
    done
}

odd_stems() {
    model
    mkdir "$T/in"
    photo "$T/in/...ppm" 8 8
    photo "$T/in/a b.c.ppm" 8 8
    photo "$T/in/-o.ppm" 8 8
    photo "$T/in/.ppm" 8 8
    cd "$T/in" || exit 1
    expect 0 infer -o ../o -- ...ppm "a b.c.ppm" -o.ppm .ppm
    for f in ...ppm "a b.c" -o .ppm; do complete "$T/o/$f"; done
    [ "$(ls -A "$T" | grep -cE '^(in|o|out|err)$')" = 4 ] && [ "$(ls -A "$T/in" | wc -l)" = 4 ] ||
        fail "something was written beside the output folder"
    expect 1 infer .. -o ../o
    says "$T/err" ".."
}

output_beside_input() {
    model
    mkdir "$T/d" "$T/d/diffuse"
    photo "$T/d/p.ppm" 16 16
    cp "$T/d/p.ppm" "$T/before"
    expect 0 infer "$T/d/p.ppm" -o "$T/d"
    complete "$T/d/p"
    cmp -s "$T/d/p.ppm" "$T/before" || fail "the photograph changed"
    cp "$T/d/p/render.png" "$T/d/diffuse/diffuse.png"
    expect 2 infer "$T/d/diffuse/diffuse.png" -o "$T/d"
    says "$T/err" "diffuse/diffuse.png"
    cp "$T/d/p.ppm" "$T/d/plain"
    expect 2 infer "$T/d/plain" -o "$T/d"
    cmp -s "$T/d/plain" "$T/before" || fail "the photograph without extension changed"
    # a mask, photographs of a sheet but the first, and those of a capture
    mkdir "$T/d/q"
    cp "$T/d/p.ppm" "$T/d/q.ppm"
    cp "$T/d/p/render.png" "$T/d/q/diffuse.png"
    expect 2 infer --mask "$T/d/q/diffuse.png" "$T/d/q.ppm" -o "$T/d"
    says "$T/err" "q/diffuse.png would replace the mask"
    expect 2 infer --sheet "$T/d/q.ppm" "$T/d/q/diffuse.png" -o "$T/d"
    says "$T/err" "q/diffuse.png would replace the photograph"
    printf '[a]\nfile = diffuse.png\nlight = 0, 0, 1\ncamera = 0, 0, 1\n' >"$T/d/q/capture.ini"
    expect 2 infer --capture "$T/d/q/capture.ini" -o "$T/d"
    says "$T/err" "q/diffuse.png would replace the photograph"
    cmp -s "$T/d/p/render.png" "$T/d/q/diffuse.png" || fail "a file that was read changed"
}

unwritable_output() {
    model
    photo "$T/p.ppm" 8 8
    echo file >"$T/file"
    for o in "$T/file" "$T/file/x" /proc/lgd-test; do
        expect 1 infer "$T/p.ppm" -o "$o"
        says "$T/err" "$o"
        lines "$T/err" 1
    done
    mkdir "$T/o"
    echo file >"$T/o/p"
    expect 1 infer "$T/p.ppm" -o "$T/o"
    says "$T/err" "$T/o/p"
    [ "$(ls -A "$T/o")" = p ] && [ "$(cat "$T/o/p")" = file ] || fail "left over: $(ls -A "$T/o")"
}

output_of_another() {
    model
    not_root "$BIN/lgd-infer"
    photo "$T/p.ppm" 8 8
    mkdir -m 555 "$T/ro"
    expect 1 $NOT_ROOT "$BIN/lgd-infer" -s 8 -i 0 "$T/p.ppm" -o "$T/ro"
    says "$T/err" "$T/ro"
    lines "$T/err" 1
}

# A file may not grow beyond a few blocks, as on a disk that fills up in the middle.
full_disk() {
    model
    photo "$T/p.ppm" 64 64
    mkdir "$T/o"
    ( trap '' XFSZ
      ulimit -f 4
      "$BIN/lgd-infer" --size 64 --iterations 0 "$T/p.ppm" -o "$T/o" >"$T/out" 2>"$T/err" )
    [ $? -eq 1 ] || fail "it does not fail"
    says "$T/err" "$T/p.ppm"
    [ -z "$(ls -A "$T/o")" ] || fail "left over: $(ls -A "$T/o")"
}

full_file_system() {
    model
    mkdir "$T/disk"
    mount -t tmpfs -o size=48k tmpfs "$T/disk" 2>/dev/null || skip "a small file system cannot be mounted here"
    photo "$T/p.ppm" 64 64
    "$BIN/lgd-infer" --size 64 --iterations 0 "$T/p.ppm" -o "$T/disk" >"$T/out" 2>"$T/err"
    code=$?
    rest=$(ls -A "$T/disk")
    umount "$T/disk"
    [ $code -eq 1 ] || fail "it does not fail"
    says "$T/err" "$T/p.ppm"
    [ -z "$rest" ] || fail "left over: $rest"
}

closed_pipe() {
    model
    photo "$T/p.ppm" 16 16
    { sleep 1; infer "$T/p.ppm" -o "$T/o" 2>"$T/err"; echo $? >"$T/code"; } | true
    [ "$(cat "$T/code")" = 1 ] || fail "exit status $(cat "$T/code")"
    says "$T/err" "standard output"
    complete "$T/o/p"
    infer "$T/p.ppm" -o "$T/o2" >&- 2>"$T/err"
    [ $? -eq 1 ] || fail "a closed standard output is no failure"
    complete "$T/o2/p"
}

interrupted() {
    model
    mkdir "$T/in"
    photo "$T/in/0.ppm" 32 32
    i=1
    while [ $i -lt 200 ]; do ln -s 0.ppm "$T/in/$i.ppm"; i=$((i + 1)); done
    for s in INT TERM; do
        "$BIN/lgd-infer" --size 96 --threads 1 "$T"/in/*.ppm -o "$T/$s" >"$T/out.$s" 2>"$T/err" &
        pid=$!
        n=0
        while [ ! -s "$T/out.$s" ] && [ $n -lt 600 ]; do sleep 0.1; n=$((n + 1)); done
        kill -$s $pid
        wait $pid
        [ $? -eq 130 ] || fail "$s: exit status is not 130"
        says "$T/err" "interrupted"
        done=$(wc -l <"$T/out.$s")
        [ "$done" -ge 1 ] && [ "$done" -lt 200 ] || fail "$s: $done photographs are done"
        lines "$T/$s/results.jsonl" "$done"
        [ "$(ls -A "$T/$s" | wc -l)" -eq $((done + 1)) ] ||
            fail "$s: $done are reported and there are: $(ls -A "$T/$s" | tr '\n' ' ')"
        while read -r folder; do complete "$folder"; done <"$T/out.$s"
    done
}

weights() {
    model
    photo "$T/p.ppm" 8 8
    expect 1 infer --model "$T/absent" "$T/p.ppm" -o "$T/o"
    says "$T/err" "$T/absent"
    head -c 5000 "$MODEL" >"$T/short"
    expect 1 infer --model "$T/short" "$T/p.ppm" -o "$T/o"
    says "$T/err" "$T/short"
    lines "$T/err" 1
    : >"$T/empty"
    expect 1 infer --model "$T/empty" "$T/p.ppm" -o "$T/o"
    says "$T/err" "$T/empty"
    # valid safetensors of something else
    header='{"w":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}'
    { printf "\\$(printf %03o ${#header})\\000\\000\\000\\000\\000\\000\\000"; printf '%s1234' "$header"; } >"$T/other"
    expect 1 infer --model "$T/other" "$T/p.ppm" -o "$T/o"
    says "$T/err" "$T/other"
    expect 1 env LGD_MODEL="$T/absent" "$BIN/lgd-infer" -s 8 "$T/p.ppm" -o "$T/o"
    says "$T/err" "$T/absent"
    expect 0 env LGD_MODEL="$T/absent" "$BIN/lgd-infer" -s 8 --model "$MODEL" "$T/p.ppm" -o "$T/o"
}

model_lookup() {
    model
    unset LGD_MODEL
    photo "$T/p.ppm" 8 8
    mkdir -p "$T/i/bin" "$T/i/share/lgd"
    cp "$BIN/lgd-infer" "$T/i/bin"
    cp -R "$BUILD/lib" "$T/i"
    "$T/i/bin/lgd-infer" -i 0 -s 8 "$T/p.ppm" -o "$T/o" >"$T/out" 2>"$T/err"
    code=$?
    if [ $code -ne 0 ]; then
        says "$T/err" "--model"
        says "$T/err" "LGD_MODEL"
        lines "$T/err" 1
    fi
    cp "$MODEL" "$T/i/share/lgd/phone.safetensors"
    expect 0 "$T/i/bin/lgd-infer" -i 0 -s 8 "$T/p.ppm" -o "$T/o"
    mkdir -p "$T/j/build/bin" "$T/j/models"
    cp "$BIN/lgd-infer" "$T/j/build/bin"
    cp -R "$BUILD/lib" "$T/j/build"
    cp "$MODEL" "$T/j/models/phone.safetensors"
    expect 0 "$T/j/build/bin/lgd-infer" -i 0 -s 8 "$T/p.ppm" -o "$T/o"
}

without_the_image_library() {
    model
    photo "$T/p.ppm" 8 8
    mkdir -p "$T/i/bin" "$T/d"
    cp "$BIN/lgd-infer" "$T/i/bin"
    expect 0 infer "$T/p.ppm" -o "$T/d"
    cp "$T/d/p/diffuse.png" "$T/q.png"
    expect 0 "$T/i/bin/lgd-infer" -i 0 -s 8 "$T/q.png" "$ROOT/demo/flash.jpg" -o "$T/o" # a PNG or a JPEG needs none
    "$T/i/bin/lgd-infer" -i 0 -s 8 "$T/p.ppm" -o "$T/o" >"$T/out" 2>"$T/err" && skip "the image library is installed"
    lines "$T/err" 1
    says "$T/err" "p.ppm: this image needs liblgd_image.so"
    mkdir -p "$T/i/lib/lgd"
    echo "no library" >"$T/i/lib/lgd/liblgd_image.so"
    expect 1 "$T/i/bin/lgd-infer" -i 0 -s 8 "$T/p.ppm" -o "$T/o"
    says "$T/err" "liblgd_image.so"
}

too_many_pixels() {
    model
    printf 'P6\n1000000 1000000\n255\n' >"$T/huge.ppm"
    expect 1 infer "$T/huge.ppm" -o "$T/o"
    says "$T/err" "huge.ppm"
    says "$T/err" "--max-pixels"
    photo "$T/p.ppm" 10 10
    expect 1 infer --max-pixels 99 "$T/p.ppm" -o "$T/o"
    expect 0 infer --max-pixels 100 "$T/p.ppm" -o "$T/o"
}

max_memory() {
    model
    photo "$T/p.ppm" 40 40
    expect 2 infer --max-memory 4T "$T/p.ppm" -o "$T/o"
    says "$T/err" "--max-memory: '4T'"
    expect 1 infer --max-memory 1M "$T/p.ppm" -o "$T/o"
    says "$T/err" "p.ppm: "
    says "$T/err" "(lgd-infer --max-memory)"
    lines "$T/err" 1
    [ -z "$(ls -A "$T/o")" ] || fail "left over: $(ls -A "$T/o")"
    expect 0 infer --max-memory 1G "$T/p.ppm" -o "$T/o"
}

empty_names() {
    photo "$T/p.ppm" 10 10
    for option in --model --mask --capture -o; do
        expect 2 infer "$T/p.ppm" -o "$T/o" $option ""
        says "$T/err" "$option: the name is empty"
    done
    [ ! -e "$T/o" ] || fail "the folder was made"
}

check infer_empty_names empty_names
check infer_bad_photographs_do_not_stop_the_rest bad_ones_do_not_stop
check infer_same_stem same_stem
check infer_odd_stems odd_stems
check infer_without_effect without_effect
check infer_output_beside_input output_beside_input
check infer_unwritable_output unwritable_output
check infer_output_of_another output_of_another
check infer_full_disk full_disk
check infer_full_file_system full_file_system
check infer_closed_pipe closed_pipe
check infer_interrupted interrupted
check infer_weights_of_another_kind weights
check infer_model_lookup model_lookup
check infer_without_the_image_library without_the_image_library
check infer_too_many_pixels too_many_pixels
check infer_max_memory max_memory
