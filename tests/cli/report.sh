# The report of lgd-eval in a browser.
. tests/cli/lib.sh
MODEL=${LGD_TEST_MODEL:-$ROOT/models/single.safetensors}
export LGD_MODEL="$MODEL"

# The page as it is once it has loaded and its script has run, in $T/dom.
browse() {
    timeout 120 "$BROWSER" --headless --no-sandbox --disable-gpu --user-data-dir="$T/profile" \
        --virtual-time-budget=10000 --dump-dom "file://$1" >"$T/dom" 2>"$T/browser.log" ||
        fail "$BROWSER: $(tail -n 1 "$T/browser.log")"
}
keys() { grep -o "data-$1=\"[^\"]*\"" "$T/dom" | cut -d'"' -f2; }

opens_and_sorts() {
    BROWSER=$(command -v chromium || command -v chromium-browser || command -v google-chrome) ||
        skip "no chromium is installed"
    [ -f "$MODEL" ] || fail "$MODEL is absent: the weights that the project ships"
    expect 0 "$BIN/lgd-data" --format captures --count 1 --size 32 -o "$T/c"
    expect 0 "$BIN/lgd-eval" --size 32 -i 1 --threads 1 --told --set procedural:3,4 --set "multiview:$T/c" -o "$T/o"
    browse "$T/o/report.html"
    says "$T/dom" 'data-failed="0"'
    [ "$(keys render | wc -l)" = 5 ] || fail "$(keys render | wc -l) materials"
    for key in render flip diffuse; do # worst first; the capture has no diffuse error
        browse "$T/o/report.html#$key"
        says "$T/dom" "data-sorted=\"$key\""
        says "$T/dom" 'data-failed="0"'
        keys $key >"$T/keys"
        sed 's/^$/-1/' "$T/keys" | sort -g -r -c || fail "not sorted by $key: $(tr '\n' ' ' <"$T/keys")"
    done
    # a column a method, and sorting by the chosen one's errors
    expect 0 "$BIN/lgd-eval" --fast --size 32 -i 1 --threads 1 --set procedural:3,3 --method lgd --method mean -o "$T/m"
    browse "$T/m/report.html#render"
    says "$T/dom" 'data-failed="0"'
    says "$T/dom" '<th>lgd</th><th>mean</th>'
    [ "$(grep -o '<figcaption>' "$T/dom" | wc -l)" = 6 ] || fail "pictures"
    sed 's|<option value="1">|<option value="1" selected>|' "$T/m/report.html" >"$T/m/mean.html"
    browse "$T/m/mean.html#render"
    keys render-1 >"$T/keys"
    sort -g -r -c "$T/keys" || fail "not sorted by mean's error: $(tr '\n' ' ' <"$T/keys")"
    # and the page would tell if something failed
    sed 's|src="data:image/png;base64,....|src="http://127.0.0.1:9/x.png?|' "$T/o/report.html" >"$T/o/bad.html"
    browse "$T/o/bad.html"
    if grep -q 'data-failed="0"' "$T/dom"; then fail "a picture from elsewhere goes unnoticed"; fi
}

check report_opens_and_sorts opens_and_sorts

# A phone's width, and the names of what pictures show: of known maps, a capture, a photograph.
names_columns_and_fits_a_phone() {
    command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null ||
        skip "no chromium is installed"
    command -v python3 >/dev/null || skip "python3 is not installed"
    [ -f "$MODEL" ] || fail "$MODEL is absent: the weights that the project ships"
    mkdir "$T/photos"
    cp demo/flash.jpg "$T/photos"
    expect 0 "$BIN/lgd-data" --format captures --count 1 --size 32 -o "$T/c"
    expect 0 "$BIN/lgd-eval" --fast --size 32 -i 1 --threads 1 --told --set procedural:3,1 --set "multiview:$T/c" \
        -o "$T/known"
    expect 0 "$BIN/lgd-eval" --fast --size 32 -i 1 --threads 1 --set "photos:$T/photos" -o "$T/photo"
    TMPDIR=$T timeout 200 python3 tests/browser/page.py report "$T/known/report.html" "$T/photo/report.html" >"$T/out" \
        2>"$T/err" ||
        fail "$(tail -n 1 "$T/err")"
}

check report_names_columns_and_fits_a_phone names_columns_and_fits_a_phone
