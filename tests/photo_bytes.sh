#!/bin/sh
# Prints one checksum of all files that lgd-infer writes for the photographs of TESTDATA/photos (32 of them) at its
# default options, as LGD_ISA=avx2, so that a change that must not change results can be held against the commit before.
# Of PNG files it is that of the pixels: how they are compressed is no result.
# Usage: tests/photo_bytes.sh [LGD-INFER [MODEL]]
: "${TESTDATA:=../shared/testdata}"
infer=${1:-build/bin/lgd-infer} model=${2:-single} tests=$(cd "$(dirname "$0")" && pwd)
out=$(mktemp -d) || exit 1
trap 'rm -rf "$out"' EXIT
LGD_ISA=avx2 "$infer" -q -m "$model" "$TESTDATA"/photos/*.* -o "$out" >/dev/null || exit 1
cd "$out" && find . -mindepth 2 -type f | LC_ALL=C sort | xargs -d '\n' python3 -B "$tests/browser/png.py" >sums ||
    exit 1
echo "$(wc -l <sums) files, sha256 $(sha256sum <sums | cut -c1-64)"
