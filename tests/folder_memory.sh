#!/bin/sh
# The peak of memory (VmHWM) of lgd-infer over 100, 1,000 and 10,000 photographs (or the numbers given), four maps of 64
# x 64 pixels, two threads.
[ $# -gt 0 ] || set -- 100 1000 10000
. tests/folder_photos.sh
trap 'rm -rf "$T"' EXIT
trap 'exit 1' INT TERM
make_tiny 64 || { tail -n 1 "$T/log" >&2; exit 1; }
for count in "$@"; do
    rm -rf "$T/o"
    make_photos "$count"
    "$BUILD/bin/lgd-infer" -q -m "$T/tiny.safetensors" --threads 2 --size 64 \
        --maps diffuse,specular,roughness,normal "$T/in" -o "$T/o" >/dev/null &
    while kill -0 $! 2>/dev/null; do
        now=$(sed -n 's/^VmHWM:[^0-9]*//p' "/proc/$!/status" 2>/dev/null)
        if [ "$now" ]; then peak=$now; fi
        sleep 0.05
    done
    wait $! || exit 1
    echo "$count photographs: peak $peak"
done
