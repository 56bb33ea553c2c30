# lgd-capture and lgd-infer --sheet: a printed sheet, photographs of it, one result.
. tests/cli/lib_infer.sh

capture() { "$BIN/lgd-capture" "$@"; }

tags() {
    if ! capture sheet -o "$T/sheet.svg" 2>"$T/err"; then
        if grep -q libapriltag "$T/err"; then skip "$(cat "$T/err")"; else fail "$(cat "$T/err")"; fi
    fi
}

photographs() {
    tags
    expect 0 "$BIN/lgd-data" --format sheet-captures --seed 5 --count 1 --size 64 --photo-width 1000 --threads 1 \
        -o "$T/s"
    one=$(ls -d "$T"/s/*)
}

drawing() {
    tags
    [ "$(grep -c '<rect' "$T/sheet.svg")" -gt 300 ] || fail "few rectangles"
    # No word goes over the window's line or the paper's edge, with any font (0.6 of the size for a letter is much).
    awk -F'[\">=<]+' '/^<text/ { n++; if ($3 + 0.6 * $9 * length($10) > ($5 < 210 ? 165 : 210)) exit 1 }
        END { if (n != 4) exit 1 }' \
        "$T/sheet.svg" || fail "words that go too far: $(grep '<text' "$T/sheet.svg")"
    # A line narrower than a pixel of a screen, 25.4/96 mm, may be left out there.
    awk -F'"' '/^<rect x/ { n++; if ($6 < 25.4 / 96 || $8 < 25.4 / 96) exit 1 } END { if (n < 300) exit 1 }' \
        "$T/sheet.svg" || fail "thin lines"
    for paper in a4 letter; do
        expect 0 capture sheet --paper $paper -o "$T/$paper.pdf"
        [ "$(head -c 8 "$T/$paper.pdf")" = "%PDF-1.4" ] || fail "$paper.pdf is no PDF"
        at=$(tail -n 2 "$T/$paper.pdf" | head -n 1)
        [ "$(tail -c "+$((at + 1))" "$T/$paper.pdf" | head -n 1)" = xref ] || fail "the table is not at $at"
    done
    if cmp -s "$T/a4.pdf" "$T/letter.pdf"; then fail "the paper changes nothing"; fi
    expect 2 capture sheet -o "$T/sheet.png"
    expect 2 capture sheet --paper a5 -o "$T/sheet.pdf"
    expect 2 capture sheet
    for option in "--fov 40" "--max-pixels 9"; do
        # shellcheck disable=SC2086
        expect 2 capture sheet $option -o "$T/none.svg"
        says "$T/err" "sheet reads no photograph: no ${option% *}"
    done
    [ ! -e "$T/none.svg" ] || fail "a sheet was drawn"
    expect 2 capture check --paper letter a.jpg
    says "$T/err" "no --paper"
    expect 2 capture draw
    expect 2 capture
    expect 2 capture check
    expect 1 capture sheet -o "$T/absent/sheet.pdf"
    says "$T/err" absent
}

infers() {
    model
    photographs
    expect 0 infer --sheet "$one/photo_1.jpg" "$one/photo_2.jpg" "$one/photo_3.jpg" -o "$T/o"
    complete "$T/o/photo_1"
    says "$T/err" "3 of 3 photographs"
    expect 0 infer --sheet "$one/photo_1.jpg" "$one/../${one##*/}/photo_1.jpg" "$one/photo_2.jpg" "$one/photo_2.jpg" \
        "$one/photo_3.jpg" -o "$T/again"
    says "$T/err" "3 of 3 photographs"
    cmp -s "$T/o/photo_1/diffuse.png" "$T/again/photo_1/diffuse.png" || fail "a photograph given twice counts twice"
    says "$T/err" "1 of its 3 photographs are used, the most different"
    says "$T/o/photo_1/meta.txt" "the sheet, 3 photographs"
    says "$T/o/photo_1/meta.txt" "options: lgd-infer "
    if grep -q upsampled "$T/err"; then fail "the windows are larger than the maps: $(cat "$T/err")"; fi
    expect 0 infer --size 800 -i 0 --maps roughness --sheet "$one/photo_2.jpg" -o "$T/large"
    grep -q "photo_2.jpg: note: upsampled: its square has [2-7][0-9][0-9] pixels a side and --size is 800" "$T/err" ||
        fail "not said to be upsampled: $(cat "$T/err")"
    expect 0 infer --sheet "$one/photo_1.jpg" -o "$T/p"
    complete "$T/p/photo_1"
}

# One photograph is no use: it is named, the others are used, and the exit status tells.
leaves_out() {
    model
    photographs
    photo "$T/bare.ppm" 200 150
    expect 1 infer --sheet "$one/photo_1.jpg" "$T/bare.ppm" -o "$T/o"
    complete "$T/o/photo_1"
    says "$T/err" "bare.ppm: no tag of the sheet is seen"
    expect 1 infer --sheet "$T/bare.ppm" -o "$T/p"
    lines "$T/err" 1
    [ ! -e "$T/p/bare" ] || fail "maps of a photograph without a sheet"
    expect 2 infer --sheet --corners 1,1 9,1 9,9 1,9 "$T/bare.ppm" -o "$T/p"
    expect 2 infer --sheet --orientations 2 "$T/bare.ppm" -o "$T/p"
    says "$T/err" "--orientations"
}

checks() {
    photographs
    expect 0 capture check "$one"/photo_1.jpg "$one"/photo_3.jpg "$one"/photo_4.jpg
    [ "$(grep -c '; fine$' "$T/out")" -eq 3 ] || fail "not fine: $(cat "$T/out")"
    expect 1 capture check "$one/photo_1.jpg" "$one/photo_2.jpg" # two tags of the second are outside of its picture
    says "$T/out" "tags are missing"
    cp "$one/photo_1.jpg" "$T/again.jpg"
    expect 1 capture check "$one/photo_1.jpg" "$T/again.jpg"
    says "$T/out" "from the same place"
    photo "$T/bare.ppm" 200 150
    expect 1 capture check "$one/photo_1.jpg" "$T/bare.ppm"
    says "$T/out" "bare.ppm: no tag"
    mkdir "$T/folder" "$T/empty"
    cp "$one/photo_1.jpg" "$one/photo_3.jpg" "$T/folder"
    expect 0 capture check "$T/folder"
    [ "$(grep -c '; fine$' "$T/out")" -eq 2 ] || fail "not both of the folder: $(cat "$T/out")"
    expect 1 capture check "$T/folder" "$T/empty"
    says "$T/err" "$T/empty: there is no photograph in this folder"
    [ "$(grep -c '; fine$' "$T/out")" -eq 2 ] || fail "an empty folder stops the rest: $(cat "$T/out")"
    expect 1 capture check "$T/empty"
}

# Materials under a sheet are evaluated from what is found in their photographs, and from the truth.
measures() {
    model
    photographs
    expect 0 "$BIN/lgd-eval" --fast --size 32 --threads 1 --method lgd:iterations=1 --set "sheets:$T/s" \
        --set "sheets-exact:$T/s" -o "$T/e"
    lines "$T/e/results.csv" 5
    awk -F, -v last=1 '$4 == 1 { n++; v[n] = $9 }
        END { exit !(n == 2 && v[1] > 0 && v[1] < 0.3 && v[1] != v[2] && (v[1] - v[2]) ^ 2 < 0.03 ^ 2) }' \
        "$T/e/results.csv" || fail "$(cat "$T/e/results.csv")"
    expect 2 "$BIN/lgd-eval" --camera phone --set "sheets:$T/s" -o "$T/f"
    says "$T/err" "--camera: no set that is given uses it"
    cp "$one/photo_1.jpg" "$T/first.jpg"
    photo "$one/photo_1.jpg" 200 150
    expect 1 "$BIN/lgd-eval" --size 32 --set "sheets:$T/s" -o "$T/f"
    says "$T/err" "photo_1.jpg: no tag"
    expect 1 "$BIN/lgd-eval" --size 32 --set "sheets:$one" -o "$T/f"
    says "$T/err" "there is no folder with maps/"
}

# A field of view that cannot be, wherever it is given.
no_field_of_view() {
    for degrees in 0 180; do
        expect 2 infer --sheet --fov $degrees a.jpg -o "$T/o"
        says "$T/err" "'$degrees' is not an angle"
        lines "$T/err" 2
        expect 2 infer --corners 1,1 9,1 9,9 1,9 --fov $degrees a.jpg -o "$T/o"
        says "$T/err" "'$degrees' is not an angle"
        expect 2 capture check --fov $degrees a.jpg
        says "$T/err" "'$degrees' is not an angle"
    done
}

empty_names() {
    expect 2 capture sheet -o ""
    says "$T/err" "-o: the name is empty"
    expect 2 capture check ""
    says "$T/err" "check: the name is empty"
}

check sheet_empty_names empty_names
check sheet_drawing drawing
check sheet_measures measures
check sheet_no_field_of_view no_field_of_view
check sheet_infers infers
check sheet_leaves_out leaves_out
check sheet_checks checks
