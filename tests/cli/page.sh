# view.html in a browser: what it shows, and how it is used.
. tests/cli/lib_infer.sh
PHOTO=$ROOT/demo/flash.jpg

views() {
    command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null ||
        skip "no chromium is installed"
    command -v python3 >/dev/null || skip "python3 is not installed"
    model
    cp "$PHOTO" "$T/a <b> & \"c\" {{photo}} 100%#1.jpg"
    expect 0 "$BIN/lgd-infer" --size 64 -i 1 --threads 1 --maps page,preview "$T/a <b> & \"c\" {{photo}} 100%#1.jpg" \
        -o "$T/o"
    says "$T/o/a <b> & \"c\" {{photo}} 100%#1/view.html" \
        '<title>a &lt;b&gt; &amp; &quot;c&quot; {{photo}} 100%#1 - material</title>'
    # an odd size, a long lens, normals that files have upside down; maps that repeat, brighter light
    expect 0 "$BIN/lgd-infer" --size 37 -i 1 --threads 1 --fov 28 --normal dx \
        --maps page,preview,normal "$PHOTO" -o "$T/odd"
    expect 0 "$BIN/lgd-infer" --size 48 -i 1 --threads 1 --seamless --light-power 3 --maps page,preview "$PHOTO" \
        -o "$T/seamless"
    for f in "$T"/o/*/view.html "$T/odd/flash/view.html"; do
        if grep -qE 'https?://' "$f"; then fail "$f loads something"; fi
    done
    mv "$T"/o/* "$T/o/view"
    TMPDIR=$T timeout 300 python3 tests/browser/page.py view "$T/o/view" "$T/odd/flash" "$T/seamless/flash" >"$T/out" \
        2>"$T/err" ||
        fail "$(tail -n 1 "$T/err")"
}

check page_in_a_browser views

# Of a folder: every material has a card that leads to its page, what failed is named.
lists() {
    command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null ||
        skip "no chromium is installed"
    command -v python3 >/dev/null || skip "python3 is not installed"
    model
    mkdir "$T/in"
    cp "$PHOTO" "$T/in/a <b> 100%#1?.jpg"
    photo "$T/in/bump.ppm" 40 30
    echo "no picture" >"$T/in/broken.png"
    expect 1 "$BIN/lgd-infer" --size 16 -i 1 --threads 1 --maps page "$T/in" -o "$T/o"
    says "$T/err" "$T/o/index.html shows all of them"
    says "$T/o/index.html" "2 materials"
    says "$T/o/index.html" "1 photograph failed"
    says "$T/o/index.html" "broken.png"
    TMPDIR=$T timeout 200 python3 tests/browser/page.py index "$T/o/index.html" "a <b> 100%#1?" bump >"$T/out" \
        2>"$T/err" ||
        fail "$(tail -n 1 "$T/err")"
}

# Who gets one, and what it never replaces.
is_asked_for() {
    model
    photo "$T/a.ppm" 20 20
    photo "$T/b.ppm" 20 20
    expect 0 infer --maps page "$T/a.ppm" -o "$T/one"
    [ "$(ls "$T/one")" = a ] || fail "an index of one photograph"
    expect 0 infer --maps diffuse "$T/a.ppm" "$T/b.ppm" -o "$T/maps"
    [ ! -e "$T/maps/index.html" ] || fail "an index without pages"
    expect 0 infer -q --maps page "$T/a.ppm" "$T/b.ppm" -o "$T/o"
    [ "$(ls "$T/o" | tr '\n' ' ')" = "a b index.html results.jsonl " ] || fail "files: $(ls "$T/o")"
    if grep -q '{{' "$T/o/index.html" "$T/o/a/view.html"; then fail "a slot is not filled"; fi
    cp "$T/a.ppm" "$T/index.html.ppm"
    expect 2 infer --maps page "$T/index.html.ppm" "$T/a.ppm" -o "$T/p"
    says "$T/err" "the page of all: rename it"
    mkdir "$T/q"
    cp "$T/a.ppm" "$T/q/index.html"
    expect 2 infer --maps page "$T/q/index.html" "$T/a.ppm" -o "$T/q"
    says "$T/err" "would replace the photograph"
    cmp "$T/a.ppm" "$T/q/index.html" || fail "a photograph was replaced"
    mkdir -p "$T/r/index.html"
    expect 2 infer --maps page "$T/a.ppm" "$T/b.ppm" -o "$T/r"
    says "$T/err" "it is a folder"
    mkdir "$T/t"
    echo mine >"$T/t/index.html"
    expect 2 infer --maps page "$T/a.ppm" "$T/b.ppm" -o "$T/t"
    says "$T/err" "lgd-infer did not make it"
    [ "$(cat "$T/t/index.html")" = mine ] || fail "a page of the user's was replaced"
    expect 0 infer --maps page "$T/a.ppm" "$T/b.ppm" -o "$T/o"
    # what failed is listed where nothing else is
    echo "no picture" >"$T/c.png"
    echo "no picture" >"$T/d.png"
    expect 1 infer --maps page "$T/c.png" "$T/d.png" -o "$T/s"
    says "$T/s/index.html" "2 photographs failed"
}

check page_index_lists_materials lists
check page_index_is_asked_for is_asked_for
