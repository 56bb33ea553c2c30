#!/bin/sh
# lgd-data: what it writes, that it writes the same bytes however it runs, and what it says when it cannot.
. tests/cli/lib.sh
DATA=$BIN/lgd-data

# How many entries of a folder match a pattern.
entries() { find "$1" -mindepth 1 -maxdepth 1 -name "$2" | wc -l; }

data_folders() {
    expect 0 "$DATA" -o "$T/o/deep" --count 3 --size 32
    [ "$(entries "$T/o/deep" '0000[012]_*')" -eq 3 ] || fail "not three folders: $(ls "$T/o/deep")"
    for d in "$T"/o/deep/*; do
        for f in diffuse.png specular.png roughness.png normal.png maps.exr; do
            [ -s "$d/$f" ] || fail "$d/$f is missing"
        done
    done
    [ -s "$T/out" ] && fail "writes to stdout"
    return 0
}
check data_folders data_folders

data_same_bytes_for_any_threads_and_range() {
    expect 0 "$DATA" -o "$T/a" --count 6 --size 24 --threads 1 --format strips --photographs --seed 9
    expect 0 "$DATA" -o "$T/b" --count 6 --size 24 --threads 4 --format strips --photographs --seed 9
    expect 0 diff -r "$T/a" "$T/b"
    expect 0 "$DATA" -o "$T/c" --first 4 --count 1 --size 24 --format strips --seed 9
    strip=$(cd "$T/c" && ls)
    expect 0 cmp "$T/a/$strip" "$T/c/$strip"
    expect 0 "$DATA" -o "$T/d" --first 4 --count 1 --size 24 --format strips --seed 10
    cmp -s "$T/d/$(ls "$T/d")" "$T/c/$strip" && fail "two seeds give the same strip"
    [ "$(entries "$T/a" '*.png')" -eq 6 ] && [ "$(entries "$T/a" '*.jpg')" -eq 6 ] ||
        fail "not six strips and photographs: $(ls "$T/a")"
}
check data_same_bytes_for_any_threads_and_range data_same_bytes_for_any_threads_and_range

data_camera() {
    expect 0 "$DATA" -o "$T/a" --count 2 --size 96 --photographs
    for fault in "--fov-min 20 --fov-max 40" "--flash 0.2" "--flash-size 0.02" "--glare 0.2" "--ambient 0.5" \
        "--tone 1" "--sharpen 3" "--noise-spread 2" "--exposure 2"; do
        # shellcheck disable=SC2086
        expect 0 "$DATA" -o "$T/b" --count 2 --size 96 --photographs $fault
        diff -r "$T/a" "$T/b" >/dev/null && fail "$fault changes nothing"
    done
    return 0
}
check data_camera data_camera

data_families() {
    expect 0 "$DATA" -o "$T/o" --count 8 --size 8 --photographs --families wood,rust
    [ "$(find "$T/o" -name '*wood*.jpg' -o -name '*rust*.jpg' | wc -l)" -eq 8 ] || fail "other families: $(ls "$T/o")"
    expect 2 "$DATA" -o "$T/o" --families wood,velociraptor
    says "$T/err" "velociraptor"
    expect 2 "$DATA" -o "$T/o" --families ,
}
check data_families data_families

data_contact_sheet() {
    expect 0 "$DATA" -o "$T" --contact-sheet --size 16 --count 20
    [ -s "$T/contact-sheet.png" ] || fail "no contact sheet"
    [ "$(entries "$T" '0*')" -eq 0 ] || fail "materials were written that nobody asked for"
    expect 1 "$DATA" -o "$T" --contact-sheet --size 2048 --count 900
    says "$T/err" "too large"
}
check data_contact_sheet data_contact_sheet

data_wrong_usage() {
    expect 2 "$DATA"
    says "$T/err" "-o DIR"
    for bad in "--count 0" "--tilt 31" "--fov-min 20" "--fov-min 40 --fov-max 30" "--flash 0.6" "--tone 2" \
        "--ambient x" "--vignette 1" "--off-centre -1" "--exposure nan" "--count x" "--size 4" "--size 1e3" \
        "--format exe" "--noise 2" "--noise nan" "--seed -1" "--quality 0" "--threads -1" "stray" "--statistics" \
        "--testdata ." "--collected 0.5" "--collection ." \
        "--contact-sheet --collection . --collected 0.5"; do
        # shellcheck disable=SC2086
        expect 2 "$DATA" -o "$T/o" $bad
        [ -e "$T/o" ] && fail "$bad made the folder"
    done
    return 0
}
check data_wrong_usage data_wrong_usage

data_letters_and_all_threads() {
    expect 0 "$DATA" -h
    says "$T/out" "lgd-data --histograms --testdata DIR"
    expect 0 "$DATA" -V
    says "$T/out" "lgd-data (lgd)"
    expect 0 "$DATA" -o "$T/o" --threads 0 --count 1 --size 8
}
check data_letters_and_all_threads data_letters_and_all_threads

data_options_without_use() {
    expect 2 "$DATA" -o "$T/o" --quality 50
    says "$T/err" "--quality is for --photographs and --format sheet-captures"
    expect 2 "$DATA" -o "$T/o" --noise 0.2 --format sheet-captures
    says "$T/err" "--noise is for --photographs"
    expect 2 "$DATA" -o "$T/o" --photo-width 600 --photographs
    says "$T/err" "--photo-width is for --format sheet-captures"
    [ ! -e "$T/o" ] || fail "the folder was made"
    expect 0 "$DATA" -o "$T/o" --quality 50 --noise 0.2 --photographs --count 1 --size 16
}
check data_options_without_use data_options_without_use

data_empty_names() {
    for option in -o --testdata --collection; do
        expect 2 "$DATA" --statistics --collected 1 $option ""
        says "$T/err" "$option: the name is empty"
    done
}
check data_empty_names data_empty_names

data_cannot_write() {
    : >"$T/file"
    for what in "" --contact-sheet --photographs "--format strips"; do
        # shellcheck disable=SC2086
        expect 1 "$DATA" -o "$T/file/o" --count 2 --size 8 $what
        lines "$T/err" 1
        says "$T/err" "$T/file"
    done
    mkdir -p "$T/o/contact-sheet.png/x"
    expect 1 "$DATA" -o "$T/o" --contact-sheet --count 1 --size 8
    says "$T/err" "contact-sheet.png"
}
check data_cannot_write data_cannot_write

# The largest file of a set does not fit: of the set that is there none is replaced, of one that is not none is left.
set_is_whole() {
    for format in "$@"; do
        set -- "$DATA" --count 1 --threads 1 --format $format
        [ $format != sheet-captures ] || set -- "$@" --photo-width 600
        expect 0 "$@" --size 32 -o "$T/$format"
        expect 0 "$@" --size 96 -o "$T/large"
        largest=$(find "$T/large" -type f -printf '%s\n' | sort -n | tail -n 1)
        cp -r "$T/$format" "$T/before"
        ( trap '' XFSZ
          ulimit -f $((largest / 512 - 2))
          expect 1 "$@" --size 96 -o "$T/$format"
          expect 1 "$@" --size 96 -o "$T/fresh" ) || exit 1
        lines "$T/err" 1
        says "$T/err" "cannot be written"
        expect 0 diff -r "$T/before" "$T/$format"
        [ ! -e "$T/fresh" ] || fail "left: $(find "$T/fresh")"
        expect 0 "$@" --size 96 -o "$T/$format"
        expect 0 diff -r "$T/large" "$T/$format"
        rm -r "$T/before" "$T/large"
    done
}
data_set_is_whole() { set_is_whole folders captures; }
check data_set_is_whole data_set_is_whole
data_sheet_set_is_whole() {
    "$DATA" --count 1 --size 8 --format sheet-captures --photo-width 600 -o "$T/o" >"$T/out" 2>"$T/err" ||
        { says "$T/err" apriltag; skip "lgd is built without libapriltag"; }
    set_is_whole sheet-captures
}
check data_sheet_set_is_whole data_sheet_set_is_whole

data_interrupted() {
    "$DATA" -o "$T/o" --count 100000 --size 64 --photographs >"$T/out" 2>"$T/err" &
    pid=$!
    while [ "$(find "$T/o" -name '*.jpg' 2>/dev/null | wc -l)" -lt 2 ]; do
        kill -0 $pid 2>/dev/null || fail "it ended: $(cat "$T/err")"
    done
    kill -TERM $pid
    wait $pid
    [ $? -eq 130 ] || fail "does not exit with 130"
    says "$T/err" "interrupted"
    [ "$(find "$T/o" ! -name '*.jpg' -type f | wc -l)" -eq 0 ] || fail "temporary files are left: $(ls "$T/o")"
}
check data_interrupted data_interrupted

# A library of one's own, here of two procedural materials.
data_collection() {
    expect 0 "$DATA" -o "$T/own" --count 2 --size 32
    expect 0 "$DATA" -o "$T/parts" --collection "$T/own" --collected 1 --count 3 --size 32
    [ "$(entries "$T/parts" '0*_collected_[01]')" -eq 3 ] || fail "these are no parts: $(ls "$T/parts")"
    expect 1 "$DATA" -o "$T/o" --collection "$T/nowhere" --collected 1
    says "$T/err" "$T/nowhere"
    [ ! -e "$T/o" ] || fail "the folder was made"
    rm "$T"/own/*/normal.png
    expect 1 "$DATA" -o "$T/o" --collection "$T/own" --collected 1
    says "$T/err" "no normal map"
}
check data_collection data_collection

# $T/out: both sides are the same materials, those of --testdata through files: only 8 and 16 bits lie between.
same_materials() {
    awk '/^(relief|F0|roughness) / && NF == 11 { n++; for (k = 2; k <= 6; k++) if (($k - $(k + 5))^2 > 1e-4) exit 1 }
        END { exit n != 3 }' \
        "$T/out" || fail "quantiles: $(tail -n 16 "$T/out")"
    awk '/^distance of/ { if ($NF > 0.1) exit 1 }' "$T/out" || fail "$(grep '^distance of' "$T/out")"
}

data_statistics() {
    for wrong in "$T/none: No such file or directory" "$T/.log: is not a folder"; do
        expect 1 "$DATA" --statistics --testdata "${wrong%%: *}"
        says "$T/err" "$wrong"
        expect 1 "$DATA" --histograms --testdata "${wrong%%: *}" -o "$T/h"
        says "$T/err" "$wrong"
    done
    [ ! -e "$T/h" ] || fail "the folder was made"
    mkdir -p "$T/own"
    expect 0 "$DATA" -o "$T/own/maps" --count 24 --size 32
    expect 0 "$DATA" -o "$T/own/strips" --first 24 --count 24 --size 32 --format strips
    for folder in maps strips; do echo "where they are from" >"$T/own/$folder/README.txt"; done
    expect 0 "$DATA" --statistics --testdata "$T/own" --count 48 --size 32
    says "$T/out" "distance of 48 procedural materials from 48"
    same_materials
    mkdir "$T/later"
    mv "$T/own/strips" "$T/later"
    expect 0 "$DATA" --statistics --testdata "$T/later" --first 24 --count 24 --size 32
    says "$T/out" "distance of 24 procedural materials from 24"
    same_materials
    [ -w /dev/full ] || return 0
    "$DATA" --statistics --testdata "$T/own" --count 4 --size 32 >/dev/full 2>"$T/err"
    [ $? -eq 1 ] || fail "a full disk goes unnoticed"
}
check data_statistics data_statistics

data_histograms() {
    expect 2 "$DATA" --histograms --testdata "$T/own"
    expect 2 "$DATA" --histograms -o "$T/h"
    mkdir -p "$T/own" "$T/empty"
    expect 1 "$DATA" --histograms --testdata "$T/empty" -o "$T/h"
    says "$T/err" "$T/empty"
    [ ! -e "$T/h" ] || fail "an empty folder is left"
    expect 0 "$DATA" -o "$T/own/maps" --count 8 --size 32
    expect 0 "$DATA" --histograms --testdata "$T/own" --count 8 --size 32 -o "$T/h"
    # The same materials through files: nearly all is in common; every column adds up to one for each map.
    awk '/in common/ { n++; if ($2 + 0 < 93) exit 1 } END { exit n != 5 }' "$T/out" || fail "$(cat "$T/out")"
    awk -F, 'NR > 1 { a[$1] += $4; b[$1] += $5; n++ }
        END { for (k in a) if ((a[k] - 1)^2 + (b[k] - 1)^2 > 1e-6) exit 1; exit n != 160 }' \
        "$T/h/histograms.csv" || fail "$(head -40 "$T/h/histograms.csv")"
    grep -q '</svg>' "$T/h/histograms.svg" || fail "the picture is cut short"
}
check data_histograms data_histograms

data_resembles_artists_maps() {
    [ -d "$TESTDATA/maps" ] || skip "no $TESTDATA"
    expect 0 "$DATA" --statistics --testdata "$TESTDATA" --count 200 --size 64
    awk '/^distance of/ { d = $NF } /^distance between/ { sub(/.*halvings: /, ""); h = $1 }
        END { exit !(d > 0 && h > 0 && d <= 2 * h) }' "$T/out" || fail "$(tail -n 2 "$T/out" | tr '\n' ' ')"
}
check data_resembles_artists_maps data_resembles_artists_maps
