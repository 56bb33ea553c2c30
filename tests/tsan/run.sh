#!/bin/sh
# What runs in threads of our own, built with ThreadSanitizer: lgd-infer's pipeline with many photographs, some of which
# fail, and lgd-train's loader with several makers. Prints a line each; a report is printed and ends with 1.
# Environment: BUILD.
set -u
. tests/support/small_model.sh
: "${BUILD:=build-tsan}"
T=$(mktemp -d) || exit 1
trap 'rm -rf "$T"' EXIT
export LC_ALL=C TSAN_OPTIONS="exitcode=66 log_path=$T/report suppressions=tests/tsan/suppressions.txt ${TSAN_OPTIONS:-}"
bad=0
# watched NAME STATUS COMMAND...
watched() {
    name=$1 want=$2
    shift 2
    "$@" >"$T/out" 2>&1
    got=$?
    if ls "$T"/report.* >/dev/null 2>&1; then
        cat "$T"/report.*
        rm -f "$T"/report.*
        echo "FAIL tsan: $name"
        bad=1
    elif [ "$got" -ne "$want" ]; then
        tail -n 3 "$T/out"
        echo "FAIL tsan: $name: exit status $got"
        bad=1
    else
        echo "ok tsan: $name"
    fi
}
small_model >"$T/small.ini"
cat >>"$T/small.ini" <<'INI'
threads = 4
prefetch = 3
[train]
batch = 2
pretrain_steps = 4
steps = 12
warmup = 1
checkpoint_every = 4
[validate]
every = 8
count = 2
size = 16
INI
watched "the loader" 0 "$BUILD/bin/lgd-train" "$T/small.ini" --set output.folder="$T/run" --threads 2
watched "photographs" 0 "$BUILD/bin/lgd-data" -o "$T/photos" --count 12 --size 32 --format strips --photographs \
    --threads 1
rm -f "$T"/photos/*.png
watched "12 photographs" 0 "$BUILD/bin/lgd-infer" --size 32 --threads 4 -m "$T/run/last.safetensors" \
    -o "$T/maps" "$T"/photos/*.jpg
echo damaged >"$T/photos/damaged.jpg"
watched "12 photographs, one damaged, with pages" 1 "$BUILD/bin/lgd-infer" --size 32 --threads 4 --maps page,gltf \
    -m "$T/run/last.safetensors" \
    -o "$T/pages" "$T"/photos/*.jpg
exit $bad
