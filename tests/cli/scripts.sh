#!/bin/sh
# The scripts in bench/ that read people's files: what they say where there are none.
. tests/cli/lib.sh
: "${PYTHON:=python3}"
export PYTHONDONTWRITEBYTECODE=1

# wrong STATUS TEXT SCRIPT ARGUMENTS...: one line of the script's, with the text.
wrong() {
    status=$1 text=$2 script=$3
    shift 3
    expect "$status" "$PYTHON" "bench/$script.py" "$@"
    [ ! -s "$T/out" ] || fail "$script.py prints $(head -n 1 "$T/out")"
    lines "$T/err" 1
    says "$T/err" "$script.py: $text"
}

usage() {
    "$PYTHON" -c 'import numpy, PIL, scipy' 2>/dev/null || skip "$PYTHON has no numpy, Pillow and scipy"
    for script in relight evenness slopes lattice brightness collection; do
        expect 2 "$PYTHON" "bench/$script.py"
        says "$T/err" "$script.py"
    done
}
check scripts_usage usage

missing_files() {
    "$PYTHON" -c 'import numpy, PIL, scipy' 2>/dev/null || skip "$PYTHON has no numpy, Pillow and scipy"
    wrong 1 "$T/none: there is no *.png in it" relight "$T/none" "$T/o"
    for script in evenness slopes brightness; do wrong 1 "$T/none: no such file" $script "a=$T/none"; done
    wrong 1 "$T/none: there is no such file" lattice "$T/none"
    for script in evenness slopes; do
        wrong 2 "a=demo/flash.jpg:x: the panel 'x' is neither a number nor q" $script a=demo/flash.jpg:x
        wrong 1 "demo/flash.jpg: has no panel 7" $script a=demo/flash.jpg:7
    done
    [ ! -e "$T/o" ] || fail "a folder is left"
}
check scripts_missing_files missing_files

exchange() {
    "$PYTHON" -c 'import numpy, PIL, scipy, OpenEXR' 2>/dev/null || skip "$PYTHON has no scipy or no OpenEXR"
    expect 2 "$PYTHON" bench/exchange.py
    wrong 1 "$T/none: there is no */materialgan_tex.jpg in it" exchange "$T/none" "$T/none"
    mkdir -p "$T/captures/book"
    cp demo/flash.jpg "$T/captures/book/materialgan_tex.jpg"
    wrong 1 "$T/none/book: there is no */maps.exr in it" exchange "$T/captures" "$T/none"
}
check scripts_exchange exchange

# Captures that the program rendered, with their own maps as everybody's: no error but that of bytes and of the falloff,
# whose power is found, and with another material's maps a large one.
exchange_numbers() {
    "$PYTHON" -c 'import numpy, PIL, scipy, OpenEXR' 2>/dev/null || skip "$PYTHON has no scipy or no OpenEXR"
    expect 0 "$BUILD/bin/lgd-data" --format captures --count 1 --first 1 -o "$T/rendered"
    expect 0 "$BUILD/bin/lgd-data" --count 2 -o "$T/truth"
    expect 0 "$PYTHON" tests/cli/beside_captures.py "$T/rendered" "$T/truth"
    expect 0 "$PYTHON" bench/exchange.py "$T/rendered" "$T/truth"
    tail -n 1 "$T/out" | awk '{ for (i = 2; i < 15; i++) bad += $i <= 0 || $i > .02
                                exit bad || $15 < 1.9 || $15 > 2.1 }' || fail "$(cat "$T/out")"
    mv "$T"/truth/00000*/maps.exr "$T"/truth/00001*/own/
    expect 0 "$PYTHON" bench/exchange.py "$T/rendered" "$T/truth"
    tail -n 1 "$T/out" | awk '{ exit $2 < .05 || $11 > .02 }' || fail "$(cat "$T/out")"
}
check scripts_exchange_numbers exchange_numbers

# An angle for each kind, and what is wrong in one line.
view_guess() {
    "$PYTHON" -c 'import numpy, PIL, OpenEXR' 2>/dev/null || skip "$PYTHON has no Pillow or no OpenEXR"
    expect 2 "$PYTHON" bench/view_guess.py
    wrong 1 "$T/none: there is no */maps.exr in it" view_guess "$T/none"
    expect 0 "$BUILD/bin/lgd-data" --count 1 --size 64 -o "$T/small"
    wrong 2 "wide: is no angle of 5 to 120 degrees" view_guess "$T/small" wide
    wrong 1 "$(echo "$T"/small/*/maps.exr): has not 256 x 256 pixels" view_guess "$T/small"
    expect 0 "$BUILD/bin/lgd-data" --count 2 -o "$T/materials"
    PATH=$BUILD/bin:$PATH expect 0 "$PYTHON" bench/view_guess.py "$T/materials"
    lines "$T/out" 6
    [ "$(awk '$2 > 5 && $2 <= $3 && $3 <= $4 && $4 < 120' "$T/out" | wc -l)" = 6 ] || fail "$(cat "$T/out")"
}
check scripts_view_guess view_guess

without_pytorch() {
    command -v "$PYTHON" >/dev/null || skip "$PYTHON is not installed"
    "$PYTHON" -c 'import torch' 2>/dev/null && skip "$PYTHON has PyTorch"
    wrong 1 "there is no PyTorch here" curve_torch configs/curve.ini "$T/loss.svg"
}
check scripts_without_pytorch without_pytorch
