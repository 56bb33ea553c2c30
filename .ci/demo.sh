#!/bin/sh
# make demo: the shipped photograph to maps, with the shipped weights.
set -e
: "${BUILD:=build}"
out=$BUILD/demo
echo "The photograph is rendered (lgd-data --photographs: a procedural material under a flash, sensor noise, JPEG)," \
    "not taken with a camera."
"$BUILD/bin/lgd-infer" demo/flash.jpg -o "$out"
echo
echo "Maps, the re-rendered photograph and a preview under four other lights:"
ls "$out"/flash/* | sed 's/^/  /'
echo "Look at $out/flash/preview.png first. Your own photograph: $BUILD/bin/lgd-infer PHOTO.jpg -o DIR"
