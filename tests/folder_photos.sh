# What tests/kill_folder.sh and tests/folder_memory.sh share. Folders are about files, not about networks:
# $T/tiny.safetensors are weights that take a millisecond, as training begins with them, and the photographs are one
# small picture.
T=$(mktemp -d) || exit 1
. tests/support/small_model.sh
: "${BUILD:=build}"
case $BUILD in /*) ;; *) BUILD=$(pwd)/$BUILD ;; esac

make_tiny() {
    first_weights >"$T/tiny.ini"
    "$BUILD/bin/lgd-train" "$T/tiny.ini" --set output.folder="$T/run" --threads 1 >"$T/log" 2>&1 &&
        mv "$T/run/last.safetensors" "$T/tiny.safetensors" &&
        "$BUILD/bin/lgd-infer" -q -m "$T/tiny.safetensors" --size "$1" -i 0 --maps diffuse demo/flash.jpg \
        -o "$T/small" >>"$T/log" 2>&1
}

# $1 photographs in $T/in: one file's bytes so many times, and cut again.
make_photos() {
    rm -rf "$T/in"
    mkdir "$T/in"
    cp "$T/small/flash/diffuse.png" "$T/all"
    size=$(wc -c <"$T/all")
    while [ "$(wc -c <"$T/all")" -lt $(($1 * size)) ]; do
        cat "$T/all" "$T/all" >"$T/twice"
        mv "$T/twice" "$T/all"
    done
    head -c $(($1 * size)) "$T/all" | split -a 6 -d -b "$size" --additional-suffix=.png - "$T/in/p"
    rm "$T/all"
}
