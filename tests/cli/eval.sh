# lgd-eval as people use it.
. tests/cli/lib_eval.sh

help_names_the_options() {
    expect 0 "$BIN/lgd-eval" --help
    for o in method repeat pin tune figure pareto fast set iterations model threads seed noise images size output told \
        untold peer-maps shard; do grep -qE -- "--$o( |\$)" "$T/out" || fail "no --$o"; done
    for word in procedural: strips: maps: photos: peers: " descent" " finetune"; do says "$T/out" "$word"; done
    says "$T/out" "default: of mean, lgd, descent, newton and finetune"
    says "$T/out" "phone or single (default: \$LGD_MODEL, else phone)"
}

wrong_usage() {
    for o in --size=0 --iterations=-1 --threads=x --noise=2 --noise=0,5 --seed=-1 --repeat=0 --nonsense \
        --set=procedural:1 --set=pictures:x; do
        expect 2 "$BIN/lgd-eval" --set procedural:1,1 "$o" -o "$T/o"
        says "$T/err" "${o%%=*}"
    done
    expect 2 "$BIN/lgd-eval" --set procedural:1,1 --model "" -o "$T/o"
    says "$T/err" "the name of the weights is empty"
    expect 2 "$BIN/lgd-eval" --set procedural:1,1 --size 16 --lpips-weights a.pth b.pth -o "$T/o"
    says "$T/err" "at least 31 x 31 pixels"
    [ ! -e "$T/o" ] || fail "work was begun"
    expect 2 "$BIN/lgd-eval" -o "$T/o"
    expect 2 "$BIN/lgd-eval" --set procedural:1,1
    expect 2 "$BIN/lgd-eval" procedural:1,1 -o "$T/o"
    says "$T/err" "--set"
    expect 1 "$BIN/lgd-eval" --set "maps:$T/absent" -o "$T/o"
    says "$T/err" "$T/absent"
    expect 1 "$BIN/lgd-eval" --set "strips:$T" -o "$T/o"
    says "$T/err" "$T"
}

procedural() {
    model
    expect 0 evaluate --set procedural:3,3 -o "$T/o"
    lines "$T/out" 5
    says "$T/out" "3 materials"
    for t in 0 1 2; do grep -q "^R_$t  *0\.[0-9]* +- 0\." "$T/out" || fail "no line for R_$t"; done
    lines "$T/o/results.csv" 10
    lines "$T/o/summary.csv" 4
    [ "$(ls -A "$T/o" | tr '\n' ' ')" = "report.html results.csv results.json summary.csv times.csv " ] ||
        fail "other files: $(ls -A "$T/o")"
    # the summary is the mean of the results
    for t in 0 2; do
        mean=$(awk -F, -v t=$t 'NR > 1 && $5 == t { s += $10; n++ } END { printf "%.4f", s / n }' "$T/o/results.csv")
        told=$(awk -F, -v t=$t 'NR > 1 && $5 == t { printf "%.4f", $14 }' "$T/o/summary.csv")
        [ "$mean" = "$told" ] || fail "step $t: mean $mean, summary $told"
    done
    # a single pixel has no relief
    expect 0 "$BIN/lgd-eval" --size 1 --threads 1 --set procedural:1,2 -o "$T/p"
    for f in "$T/out" "$T/p"/*.csv; do
        if grep -E 'nan|inf' "$f" >"$T/none"; then fail "$f: $(cut -c1-200 "$T/none")"; fi
    done
}

same_numbers() {
    model
    expect 0 evaluate --set procedural:5,2 --threads 1 --noise 0.5 -o "$T/a"
    for n in 2 3; do
        expect 0 evaluate --set procedural:5,2 --threads $n --noise 0.5 -o "$T/b"
        cmp -s "$T/a/results.csv" "$T/b/results.csv" || fail "$n threads give other numbers"
    done
    # a material's numbers do not depend on what else is evaluated
    expect 0 evaluate --set procedural:8,1 --set procedural:5,2 --noise 0.5 -o "$T/b"
    grep '^"procedural:5,2"' "$T/a/results.csv" >"$T/one"
    grep '^"procedural:5,2"' "$T/b/results.csv" >"$T/two"
    cmp -s "$T/one" "$T/two" || fail "another set changes the numbers"
    says "$T/out" "all sets"
    expect 0 evaluate --set procedural:5,2 --seed 2 --noise 0.5 -o "$T/c"
    if cmp -s "$T/a/results.csv" "$T/c/results.csv"; then fail "another seed gives the same numbers"; fi
}

real_sets() {
    [ -d "$TESTDATA/maps" ] && [ -d "$TESTDATA/strips" ] || skip "$TESTDATA/maps or strips is absent"
    model
    expect 0 evaluate --set "maps:$TESTDATA/maps" --set "strips:$TESTDATA/strips" -o "$T/o"
    maps=$(ls "$TESTDATA/maps" | wc -l)
    strips=$(ls "$TESTDATA/strips" | wc -l)
    lines "$T/o/results.csv" $((1 + 3 * (maps + strips)))
    says "$T/out" "$maps materials"
    says "$T/out" "$((maps + strips)) materials"
    # set,material,method,step, five errors, angle, then ssim and flip of the first and the last step
    awk -F, 'NR > 1 { for (i = 5; i <= 9; i++) if (!($i >= 0 && $i < 2)) exit 1
        if (!($10 > 0 && $10 < 90) || $4 != 1 && !($11 < 1 && $11 > -1 && $12 > 0 && $12 < 1)) exit 1 }' \
            "$T/o/results.csv" || fail "an error is out of range"
}

images() {
    model
    expect 0 evaluate --set procedural:3,2 --images -o "$T/o"
    [ "$(ls "$T/o/images" | tr '\n' ' ')" = "1-000000.png 1-000001.png " ] || fail "images: $(ls "$T/o/images")"
    for f in "$T"/o/images/*; do [ -s "$f" ] || fail "$f is empty"; done
}

bad_material() {
    [ -d "$TESTDATA/strips" ] || skip "$TESTDATA/strips is absent"
    model
    mkdir "$T/s"
    cp "$(ls "$TESTDATA"/strips/*.png | head -n 1)" "$T/s/good.png"
    echo "no strip" >"$T/s/bad.png"
    expect 1 evaluate --set "strips:$T/s" -o "$T/o"
    says "$T/err" "bad.png"
    lines "$T/o/results.csv" 4
    cp "$T/s/good.png" "$T/s/good.jpg"
    expect 2 evaluate --set "strips:$T/s" -o "$T/none"
    says "$T/err" "good.jpg and good.png would have the same name"
    rm "$T/s"/good.*
    expect 1 evaluate --set "strips:$T/s" -o "$T/none"
    [ ! -e "$T/none/results.csv" ] || fail "results of nothing"
}

unwritable() {
    model
    echo file >"$T/file"
    expect 1 evaluate --set procedural:1,1 -o "$T/file"
    says "$T/err" "$T/file"
    # before the work, which would take hours
    expect 1 timeout 60 "$BIN/lgd-eval" --threads 1 --tune --set procedural:1,100000 -o /proc/self
    says "$T/err" "/proc/self: nothing can be written there"
    # a disk that fills up later: the numbers are printed
    mkdir "$T/o"
    for task in --fast "--tune --method mean"; do
        { ( trap '' XFSZ
            ulimit -f 0
            # shellcheck disable=SC2086
            "$BIN/lgd-eval" $task --size 8 --set procedural:1,1 -o "$T/o" 2>&1
            echo "exit status $?" ) } | cat >"$T/out"
        says "$T/out" "exit status 1"
        says "$T/out" "1 material, 8 x 8 pixels"
        says "$T/out" "cannot be written"
        [ -z "$(ls -A "$T/o")" ] || fail "left over: $(ls -A "$T/o")"
    done
    { sleep 1; evaluate --set procedural:1,1 -o "$T/o" 2>"$T/err"; echo $? >"$T/code"; } | true
    [ "$(cat "$T/code")" = 1 ] || fail "a closed pipe: exit status $(cat "$T/code")"
    says "$T/err" "standard output"
    lines "$T/o/results.csv" 4
}

folder_of_another() {
    model
    not_root "$BIN/lgd-eval"
    mkdir -m 555 "$T/ro"
    expect 1 $NOT_ROOT timeout 60 "$BIN/lgd-eval" --threads 1 --tune --set procedural:1,100000 -o "$T/ro"
    says "$T/err" "$T/ro: nothing can be written there"
}

interrupted() {
    model
    "$BIN/lgd-eval" --size 32 --threads 1 --set procedural:1,100000 -o "$T/o" --images >"$T/out" 2>"$T/err" &
    pid=$!
    n=0
    while [ -z "$(ls "$T/o/images" 2>/dev/null)" ] && [ $n -lt 600 ]; do sleep 0.1; n=$((n + 1)); done
    kill -INT $pid
    wait $pid
    [ $? -eq 130 ] || fail "exit status is not 130"
    says "$T/err" "interrupted"
    [ "$(ls -A "$T/o")" = images ] || fail "half a result: $(ls -A "$T/o")"
}

# What the project promises of its weights: on 64 materials that nobody trained on, at the size that people use,
# refinement takes at least 15% off the renderings' error.
refinement_helps() {
    model
    case ${MAKEFLAGS:-} in *fsanitize*) skip "64 materials at 256 x 256 take too long with sanitizers" ;; esac
    expect 0 "$BIN/lgd-eval" --fast --set procedural:1000003,64 -o "$T/o"
    awk -F, 'NR == 2 { first = $14 } { last = $14 } END { exit !(last < 0.85 * first) }' "$T/o/summary.csv" ||
        fail "$(awk -F, 'NR == 2 { first = $14 } { last = $14 } END { print "render RMSE", first, "->", last }' \
        "$T/o/summary.csv")"
}

check eval_help_names_the_options help_names_the_options
check eval_wrong_usage wrong_usage
check eval_procedural procedural
check eval_same_numbers_for_any_threads same_numbers
check eval_real_sets real_sets
check eval_images images
check eval_bad_material_is_reported bad_material
check eval_unwritable_output unwritable

told() {
    for o in --normal=up --workflow=mixed --colour=p3; do
        expect 2 "$BIN/lgd-eval" --set "maps:$T" $o -o "$T/o"
        says "$T/err" "${o%%=*}"
    done
    model
    expect 0 "$BIN/lgd-data" --count 1 --size 32 -o "$T/m"
    expect 0 evaluate --set "maps:$T/m" -o "$T/gl"
    echo 'normal = directx' >"$T/m/set.ini"
    expect 0 evaluate --set "maps:$T/m" -o "$T/dx"
    if cmp -s "$T/gl/results.csv" "$T/dx/results.csv"; then fail "set.ini is not read"; fi
    expect 0 evaluate --set "maps:$T/m" --normal opengl -o "$T/again"
    cmp -s "$T/gl/results.csv" "$T/again/results.csv" || fail "the option does not win"
    echo 'normals = directx' >"$T/m/set.ini"
    expect 1 evaluate --set "maps:$T/m" -o "$T/bad"
    says "$T/err" set.ini:1
}

# LPIPS with weights that are not trained, but have the names and shapes: a program to make them is the test of the
# library.
lpips() {
    model
    expect 2 "$BIN/lgd-eval" --set procedural:1,1 -o "$T/o" --lpips-weights a.pth
    says "$T/err" "lpips-weights"
    expect 1 evaluate --set procedural:1,1 --images -o "$T/o" --lpips-weights "$T/none.pth" "$T/none.safetensors"
    [ ! -e "$T/o" ] || fail "an empty folder is left"
    says "$T/err" "none.pth"
    LPIPS_OUT=$T "$BIN/lgd-test" eval_lpips_is >/dev/null || fail "the weights cannot be made"
    expect 0 "$BIN/lgd-eval" -i 1 --fast --size 48 --set procedural:1,3 -o "$T/p" \
        --lpips-weights "$T/alexnet.pth" "$T/alex.safetensors"
    says "$T/out" "lpips"
    awk -F, 'NR == 1 && $14 != "lpips" || NR > 1 && !($15 > 0 && $15 < 5) { exit 1 }' "$T/p/results.csv" ||
        fail "$(cat "$T/p/results.csv")"
    says "$T/p/summary.csv" "lpips_mean,lpips_deviation"
    says "$T/p/results.json" '"lpips": 0.'
    says "$T/p/report.html" 'data-key="lpips"'
    expect 0 "$BIN/lgd-eval" -i 0 --fast --size 48 --set procedural:1,1 -o "$T/q"
    if grep -q 'data-key="lpips"' "$T/q/report.html"; then fail "LPIPS without weights"; fi
}

methods() {
    model
    for m in nothing lgd:steps=3 lgd:iterations=x descent:start=here descent:rate descent:rate= descent:rate=1,rate=2 \
        unet latent lgd-nograd mean:label=; do
        expect 2 "$BIN/lgd-eval" --set procedural:1,1 --method "$m" -o "$T/o"
        says "$T/err" "--method $m"
    done
    expect 2 "$BIN/lgd-eval" --set procedural:1,1 --method mean --method mean -o "$T/o"
    says "$T/err" label=
    for m in "unet:model=$T/none" "latent:model=$MODEL" "lgd-nograd:model=$MODEL"; do
        expect 1 "$BIN/lgd-eval" --set procedural:1,1 --method "$m" -o "$T/o"
        says "$T/err" "${m#*=}"
        lines "$T/err" 1
    done
    expect 0 evaluate --set procedural:3,2 --method lgd --method mean --method descent:steps=3 \
        --method "unet:label=g alone,model=$MODEL" --images -o "$T/o"
    lines "$T/out" 6
    grep -q '^descent:steps=3  *0\.' "$T/out" || fail "no line for descent: $(cat "$T/out")"
    lines "$T/o/summary.csv" 10 # three of lgd, one of mean, four of descent (0, 1, 2, 3), one of unet
    lines "$T/o/times.csv" 10
    says "$T/o/results.csv" ',g alone,0,'
    [ "$(ls "$T/o/images" | wc -l)" = 8 ] || fail "images: $(ls "$T/o/images")"
    # the default is lgd
    expect 0 evaluate --set procedural:3,2 -o "$T/p"
    expect 0 evaluate --set procedural:3,2 --method lgd --pin -o "$T/q"
    says "$T/out" "1 thread, pinned"
    expect 1 "$BIN/lgd-eval" --set procedural:3,2 --pin --threads 1024 -o "$T/x"
    says "$T/err" "--pin"
    cmp -s "$T/p/results.csv" "$T/q/results.csv" || fail "the default is not lgd"
    # a method's numbers depend neither on the others nor on the threads
    expect 0 "$BIN/lgd-eval" --size 32 --threads 2 --repeat 2 --set procedural:3,2 --method descent:steps=3 -o "$T/r"
    grep descent "$T/o/results.csv" >"$T/one"
    grep descent "$T/r/results.csv" | cmp -s - "$T/one" || fail "descent gives other numbers"
}

searches_and_figures() {
    model
    for o in "--tune --pareto" "--tune --figure methods" "--pareto --method mean" "--figure pie" "--tune --images" \
        "--tune --iterations 2" "--pareto --size 64" "--pareto --lpips-weights a b" "--tune --lpips-weights a b"; do
        expect 2 "$BIN/lgd-eval" --set procedural:1,1 $o -o "$T/o"
        lines "$T/err" 2
    done
    expect 0 "$BIN/lgd-eval" --size 16 --threads 1 --set procedural:1000001,2 --tune --method mean \
        --method descent:rate=0.01,start=r0 -o "$T/t"
    lines "$T/out" 3
    says "$T/out" "mean            2 tried"
    says "$T/out" "descent        10 tried"
    lines "$T/t/tune.csv" 13
    [ "$(ls -A "$T/t")" = tune.csv ] || fail "$(ls -A "$T/t")"
    # the best is the least of its method's
    best=$(awk '/^descent/ { print $(NF - 3) }' "$T/out")
    least=$(grep descent "$T/t/tune.csv" |
        awk -F, '{ v = $(NF - 2); if (!n++ || v < m) m = v } END { printf "%.4f", m }')
    [ "$best" = "$least" ] || fail "the best is $best, the least $least"
    # rows say which model they are of
    set -- "$BIN/lgd-eval" --size 16 --threads 1 --set procedural:1000001,1 --tune --method mean
    expect 2 "$@" --method mean:fit=no -o "$T/u"
    says "$T/err" "another method's rows are 'mean:fit=no' too: give one of them a label="
    expect 2 "$@" --method "mean:label=$(printf %60s | tr ' ' m)" -o "$T/u"
    says "$T/err" "give a shorter label="
    [ ! -e "$T/u" ] || fail "work was begun"
    expect 0 "$@" --method mean:label=two -o "$T/u"
    [ "$(awk -F, 'NR > 1 { print $1 }' "$T/u/tune.csv" | xargs)" = \
        "mean:fit=no mean:fit=yes two:fit=no two:fit=yes" ] || fail "$(cat "$T/u/tune.csv")"
    expect 0 "$BIN/lgd-eval" --fast --size 16 --threads 1 --set procedural:1,2 --figure iterations --figure methods \
        --method lgd --method mean -o "$T/f"
    lines "$T/f/iterations.csv" 27 # T = 0 .. 24 and mean
    lines "$T/f/methods.csv" 27
    for f in iterations methods; do
        says "$T/f/$f.svg" "</svg>"
        says "$T/f/$f.svg" ">mean</text>"
    done
}

# A file name is bytes; a report is UTF-8.
names_of_any_bytes() {
    model
    mkdir -p "$T/m"
    expect 0 "$BIN/lgd-data" --count 1 --size 16 -o "$T/d"
    mv "$T/d"/* "$T/m/$(printf 'caf\351 \303\251')" 2>/dev/null || skip "this file system takes no such name"
    expect 0 evaluate --size 16 --set "maps:$T/m" -o "$T/o"
    for f in results.csv summary.csv times.csv results.json report.html; do
        iconv -f UTF-8 -t UTF-8 "$T/o/$f" >/dev/null 2>&1 || fail "$f is not UTF-8"
    done
    says "$T/o/results.csv" "$(printf 'caf\\xE9 \303\251')"
    says "$T/o/results.json" "$(printf 'caf\\\\xE9 \303\251')"
}

check eval_lpips lpips
check eval_maps_options told
check eval_methods methods
check eval_searches_and_figures searches_and_figures
check eval_interrupted interrupted
check eval_refinement_helps refinement_helps
check eval_names_of_any_bytes names_of_any_bytes
