#!/bin/sh
# The peak of memory (VmHWM) of lgd-infer over 100, 1,000 and 10,000 photographs (or the numbers given) at SIZE pixels
# (64) with four maps and two threads: links to the 256 x 256 photographs of TESTDATA, or to demo/flash.jpg.
: "${BUILD:=build}" "${TESTDATA:=../shared/testdata}" "${SIZE:=64}"
case $TESTDATA in /*) ;; *) TESTDATA=$(pwd)/$TESTDATA ;; esac
[ $# -gt 0 ] || set -- 100 1000 10000
T=$(mktemp -d) || exit 1
trap 'rm -rf "$T"' EXIT
trap 'exit 1' INT TERM
for count in "$@"; do
    rm -rf "$T/in" "$T/o"
    mkdir "$T/in"
    i=0
    while [ $i -lt "$count" ]; do
        for p in "$TESTDATA"/photos/IMG_*.png; do
            [ -f "$p" ] || p=$(pwd)/demo/flash.jpg
            [ $i -lt "$count" ] || break
            ln -s "$p" "$T/in/p$i.${p##*.}"
            i=$((i + 1))
        done
    done
    "$BUILD/bin/lgd-infer" -q --threads 2 --size "$SIZE" --maps diffuse,specular,roughness,normal "$T/in" -o "$T/o" >/dev/null &
    while kill -0 $! 2>/dev/null; do
        now=$(sed -n 's/^VmHWM:[^0-9]*//p' "/proc/$!/status" 2>/dev/null)
        if [ "$now" ]; then peak=$now; fi
        sleep 0.05
    done
    wait $! || exit 1
    echo "$count photographs: peak $peak"
done
