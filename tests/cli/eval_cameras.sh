# lgd-eval where light and camera are others' or not known: captures, photographs, fields of view, tilts, powers.
. tests/cli/lib_eval.sh

# Column NAME of a CSV file whose names of sets have no commas.
column() { awk -F, -v name="$2" 'NR == 1 { for (k = 1; k <= NF; k++) if ($k == name) c = k } NR > 1 { print $c }' \
    "$1"; }

captures() {
    model
    expect 0 "$BIN/lgd-data" --format captures --count 2 --size 32 -o "$T/c"
    [ "$(ls "$T"/c/*/ | grep -c 'png$')" = 18 ] || fail "pictures: $(ls "$T"/c/*)"
    expect 0 evaluate --told --set "multiview:$T/c" --images -o "$T/o"
    says "$T/out" exposure
    says "$T/out" "but the input, the nearest to the sample's axis"
    lines "$T/o/results.csv" 7
    awk -F, 'NR > 1 && !($5 == "" && $9 > 0 && $9 < 0.5 && $13 > 0.3 && $13 < 3) { exit 1 }' "$T/o/results.csv" ||
        fail "$(cat "$T/o/results.csv")"
    [ "$(ls "$T/o/images" | wc -l)" = 2 ] || fail "images: $(ls "$T/o/images")"
    one=$(ls -d "$T"/c/* | head -n 1)
    expect 0 evaluate --set "multiview:$one" -o "$T/p"
    expect 0 evaluate --set "multiview:$one" --method lgd:power=auto,orientations=auto,label=lgd -o "$T/same"
    cmp -s "$T/p/results.csv" "$T/same/results.csv" || fail "the default is not as lgd-infer estimates"
    step_back "$one"
    expect 0 evaluate --set "multiview:$one" -o "$T/p"
    expect 0 evaluate --told --set "multiview:$one" -o "$T/told"
    if cmp -s "$T/p/results.csv" "$T/told/results.csv"; then fail "--told changes nothing"; fi
    expect 2 evaluate --set "multiview:$one" --set procedural:1,1 -o "$T/mixed"
    says "$T/err" "give --method, --told or --untold"
    expect 2 evaluate --told --untold --set "multiview:$one" --set procedural:1,1 -o "$T/mixed"
    says "$T/err" "give --method"
    if grep -q -- "or --untold" "$T/err"; then fail "advice that was followed: $(cat "$T/err")"; fi
    rm "$one/light_pos.txt"
    expect 1 evaluate --set "multiview:$T/c" -o "$T/q"
    says "$T/err" light_pos.txt
    lines "$T/q/results.csv" 4
}

# The camera of capture $1, twice as far away.
step_back() {
    awk -F, '{ print $1 "," $2 "," 2 * $3 }' "$1/camera_pos.txt" >"$T/far" && mv "$T/far" "$1/camera_pos.txt"
}

# A field of view is told by the set, by --fov, or not at all, and changes what the steps make.
field_of_view() {
    for degrees in 0 180; do
        expect 2 "$BIN/lgd-eval" --set procedural:1,1 --fov $degrees -o "$T/o"
        says "$T/err" "--fov: '$degrees' is not an angle in 1 .. 170 degrees"
    done
    model
    expect 0 "$BIN/lgd-data" --format captures --count 1 --size 32 -o "$T/c"
    one=$(ls -d "$T"/c/*)
    step_back "$one"
    untold=lgd:power=auto,label=untold told=lgd:power=auto,view=told,label=told
    expect 0 evaluate --set "multiview:$one" --method $untold --method $told -o "$T/m"
    awk -F, '$3 == "untold" && $4 == 2 { a = $9 }
        $3 == "told" && $4 == 2 { b = $9 } END { exit !(a > 0 && b > 0 && a != b) }' "$T/m/results.csv" ||
        fail "told the steps make the same: $(cat "$T/m/results.csv")"
    for fov in 54.2249 30; do
        expect 0 evaluate --fov $fov --set procedural:1,1 --method lgd:label=set --method lgd:view=told,label=told \
            --method lgd:view=unknown,label=unknown -o "$T/$fov"
        awk -F, -v fov=$fov '$5 == 2 { v[$4] = $10 } function near(a, b) { return a > 0 && (a - b) ^ 2 < 1e-8 }
            END { exit !(near(v["set"], v["told"]) && near(v["unknown"], v["told"]) == (fov > 54)) }' \
            "$T/$fov/results.csv" || fail "at $fov degrees: $(cat "$T/$fov/results.csv")"
    done
}

# g reads what it is told of camera and light, and its own maps are those of that reading.
what_g_is_told() {
    expect 0 "$BIN/lgd-eval" --fast --model models/phone.safetensors --fov 30 --set procedural:1,1 \
        --method unet-joint:label=all --method unet-joint:view=told,label=fov \
        --method unet-joint:power=auto,view=told,label=power --method unet-joint:power=auto,view=unknown,label=none \
        -o "$T/o"
    [ "$(awk -F, 'NR > 1 { print $10 }' "$T/o/results.csv" | sort -u | wc -l)" = 4 ] ||
        fail "g makes the same of what it is told and not: $(cat "$T/o/results.csv")"
}

# A tilted camera: a method that knows it makes something else of the photograph than one that does not.
tilt() {
    for degrees in -1 90 x; do
        expect 2 "$BIN/lgd-eval" --set procedural:1,1 --tilt=$degrees -o "$T/o"
        says "$T/err" "--tilt: '$degrees' is not an angle in 0 .. 60 degrees"
    done
    model
    for tilt in 0 20; do
        expect 0 evaluate --tilt $tilt --set procedural:1,1 --method lgd:label=set --method lgd:view=told,label=told \
            --method lgd:view=unknown,label=unknown -o "$T/$tilt"
        awk -F, -v tilt=$tilt '$5 == 2 { v[$4] = $10 } function near(a, b) { return a > 0 && (a - b) ^ 2 < 1e-8 }
            END { exit !(near(v["told"], v["unknown"]) && near(v["set"], v["told"]) == (tilt == 0)) }' \
            "$T/$tilt/results.csv" || fail "at $tilt degrees: $(cat "$T/$tilt/results.csv")"
    done
    if cmp -s "$T/0/results.csv" "$T/20/results.csv"; then fail "--tilt changes nothing"; fi
}

# --camera draws where the photographs are taken from; a field of view that it does not draw is --fov's.
camera_draws_the_view() {
    for o in "phone --fov 30" "fov-min=20,fov-max=40 --fov 30" "tilt=5 --tilt 10" "off-centre=0.1 --tilt 10"; do
        expect 2 "$BIN/lgd-eval" --set procedural:1,1 --camera $o -o "$T/o"
        says "$T/err" "--camera draws where the photographs are taken from"
    done
    model
    set -- --set procedural:1,1 --method lgd:view=told,label=told --method lgd:label=set
    expect 0 evaluate --camera blur=0 --fov 30 "$@" -o "$T/fov"
    awk -F, '$5 == 2 { v[$4] = $10 } END { exit !(v["told"] > 0 && (v["told"] - v["set"]) ^ 2 < 1e-8) }' \
        "$T/fov/results.csv" || fail "$(cat "$T/fov/results.csv")"
}

# Photographs without known maps, and what others made of them.
photographs() {
    model
    mkdir "$T/photos" "$T/peers"
    cp demo/flash.jpg "$T/photos/a.jpg"
    cp demo/flash.jpg "$T/photos/b.jpg"
    expect 0 evaluate --set "photos:$T/photos" --images -o "$T/o"
    says "$T/out" "2 materials"
    for c in residue_diffuse residue_specular residue_roughness residue_hue relief; do
        [ "$(column "$T/o/results.csv" $c | awk '$1 >= 0 && $1 < 1' | wc -l)" = 6 ] ||
            fail "$c: $(column "$T/o/results.csv" $c)"
    done
    [ "$(column "$T/o/results.csv" render | tr -d '\n')" = "" ] || fail "an error without a truth"
    [ "$(ls "$T/o/images" | tr '\n' ' ')" = "1-a.png 1-b.png contact.png " ] || fail "images: $(ls "$T/o/images")"
    [ "$(grep -c 'data:image/png' "$T/o/report.html")" = 2 ] || fail "no pictures in the report"
    expect 1 evaluate --set "peers:$T/photos" -o "$T/q"
    says "$T/err" "a.jpg"
}

# A peer's maps of some of the photographs: each line says of how many materials it is. That there are none is said
# before any work.
peers() {
    model
    mkdir "$T/photos" "$T/peers"
    cp demo/flash.jpg "$T/photos/a.jpg"
    cp demo/flash.jpg "$T/photos/b.jpg"
    set -- "$BIN/lgd-eval" --size 32 --threads 1 --set "photos:$T/photos" --method mean --method peer -o "$T/o"
    expect 1 "$@" --peer-maps "$T/absent"
    says "$T/err" "--peer-maps $T/absent: cannot be read"
    expect 1 "$@" --peer-maps "$T/peers"
    says "$T/err" "--peer-maps $T/peers: has maps of none of the photographs"
    expect 2 "$@"
    says "$T/err" "--method peer: no set has a peer's maps"
    expect 2 evaluate --peer-maps "$T/peers" --set procedural:1,1 -o "$T/o"
    says "$T/err" "--peer-maps"
    [ ! -e "$T/o" ] || fail "work was begun"
    # four grey panels; what an image is, its first bytes say
    { printf 'P6\n128 32\n255\n'; head -c 12288 /dev/zero | tr '\0' '\200'; } >"$T/peers/b.png"
    expect 0 "$@" --peer-maps "$T/peers"
    says "$T/out" "2 materials"
    grep -q '^mean  *2 ' "$T/out" && grep -q '^peer  *1 ' "$T/out" || fail "the lines are of: $(cat "$T/out")"
    if grep -q nan "$T/out"; then fail "nan: $(cat "$T/out")"; fi
    [ "$(column "$T/o/summary.csv" materials | tr '\n' ' ')" = "2 1 " ] || fail "$(cat "$T/o/summary.csv")"
    says "$T/o/report.html" "peer <small>1 of 2</small>"
    expect 0 "$BIN/lgd-eval" --size 32 --peer-maps "$T/peers" --set "photos:$T/photos" --method peer -o "$T/p"
    says "$T/out" "1 material,"
}

# Nobody tells the light: one factor is fitted, and the estimate finds the power.
untold() {
    model
    expect 0 evaluate --set procedural:3,2 --untold -o "$T/o"
    says "$T/out" exposure
    says "$T/out" over_flat
    says "$T/out" band_8_32
    expect 0 evaluate --set procedural:3,2 --untold --method lgd:power=auto,orientations=auto,label=lgd -o "$T/p"
    cmp -s "$T/o/results.csv" "$T/p/results.csv" || fail "the default is not as lgd-infer estimates"
}

# Photographs under a stronger light: what is told of it is not known to the method, and the comparison fits one factor.
light() {
    model
    expect 2 evaluate --set procedural:1,1 --told -o "$T/o"
    says "$T/err" "told"
    expect 2 "$BIN/lgd-eval" --size 32 --set procedural:1,1 --tune --method lgd:tolerance=0.1 -o "$T/o"
    says "$T/err" "tolerance"
    for o in --exposure=0 --exposure=x --light=1 --light=a,b --light=9,0; do
        expect 2 "$BIN/lgd-eval" --set procedural:1,1 "$o" -o "$T/o"
        says "$T/err" "${o%%=*}"
    done
    expect 0 evaluate --set procedural:3,2 --exposure 1 -o "$T/one"
    expect 0 evaluate --set procedural:3,2 --exposure 2 -o "$T/two"
    expect 0 evaluate --set procedural:3,2 --exposure 2 --method lgd:power=known -o "$T/known"
    expect 0 evaluate --set procedural:3,2 --exposure 2 --method lgd:power=auto -o "$T/auto"
    for a in one two known auto; do
        sed 's/"[^"]*"/set/' "$T/$a/results.csv" |
            awk -F, 'NR == 1 { while ($++k != "exposure" && k < NF); } NR > 1 && !($k > 0.1 && $k < 10) { exit 1 }' ||
            fail "$a: no factor is fitted"
        for b in one two known auto; do
            [ "$a" = "$b" ] || ! cmp -s "$T/$a/results.csv" "$T/$b/results.csv" ||
                fail "$a and $b give the same numbers"
        done
    done
    expect 0 evaluate --set procedural:3,2 --light 0.5,0 -o "$T/side"
    expect 0 evaluate --set procedural:3,2 -o "$T/middle"
    if cmp -s "$T/side/results.csv" "$T/middle/results.csv"; then fail "--light changes nothing"; fi
}

# An option that no set uses is wrong usage; beside one that uses it a set may have none.
unused() {
    model
    mkdir "$T/photos"
    cp demo/flash.jpg "$T/photos/a.jpg"
    for o in --camera=phone --light=1,1 --noise=1 --exposure=2 --fov=30 --tilt=10 --told --untold --tune --pareto \
        --figure=methods --normal=opengl --workflow=specular --colour=linear; do
        expect 2 "$BIN/lgd-eval" --set "photos:$T/photos" $o -o "$T/o"
        says "$T/err" "${o%%=*}: no set that is given uses it"
        lines "$T/err" 2
    done
    for o in --camera=phone --light=1,1 --noise=1 --fov=30 --tilt=10; do
        expect 2 "$BIN/lgd-eval" --set "photos:$T/photos" $o -o "$T/o"
        says "$T/err" "or add generated materials, strips or map folders"
    done
    for m in lgd:photos=5 descent:photos=2; do
        expect 2 "$BIN/lgd-eval" --set procedural:1,1 --set "photos:$T/photos" --method $m -o "$T/o"
        says "$T/err" "--set photos:$T/photos has one of each material"
    done
    expect 2 "$BIN/lgd-eval" --set procedural:1,1 -i 3 --method mean --method descent -o "$T/o"
    says "$T/err" "--iterations: no method that is given has iterations"
    [ ! -e "$T/o" ] || fail "work was begun"
    expect 0 evaluate --told --camera phone --set procedural:1,1 -o "$T/p"
    expect 0 evaluate --noise 1 --light 1,1 --method lgd --set procedural:1,1 --set "photos:$T/photos" -o "$T/q"
}

check eval_captures captures
check eval_field_of_view field_of_view
check eval_tells_g_what_is_known what_g_is_told
check eval_tilt tilt
check eval_camera_draws_the_view camera_draws_the_view
check eval_photographs photographs
check eval_peers peers
check eval_untold untold
check eval_light light
check eval_unused_options unused
