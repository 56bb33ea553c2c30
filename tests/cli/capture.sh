# lgd-infer on several photographs of one sample under known lights.
. tests/cli/lib.sh

# Weights of a small network of three photographs, hardly trained.
several() {
    cat >"$T/several.ini" <<'END'
[model]
images = 3
g_width = 4
g_levels = 2
g_size = 16
h_width = 8
h_gru = 4
iterations = 2
[data]
patch = 16
[train]
batch = 1
steps = 2
[validate]
every = 0
END
    expect 0 "$BIN/lgd-train" "$T/several.ini" --set "output.folder=$T/run"
    LGD_MODEL=$T/run/last.safetensors
    export LGD_MODEL
}

infer() { "$BIN/lgd-infer" --size 16 --threads 1 "$@"; }

folder() {
    several
    expect 0 "$BIN/lgd-data" --format captures --count 1 --size 16 -o "$T/c"
    one=$(ls -d "$T"/c/*)
    expect 0 infer --capture "$one/" -o "$T/o"
    says "$T/out" "$T/o/$(basename "$one")"
    says "$T/err" "the first 3 of its 9"
    for f in diffuse.png maps.exr render.png; do [ -s "$T/o/$(basename "$one")/$f" ] || fail "$f is absent"; done
    LGD_MODEL=$ROOT/models/single.safetensors expect 0 infer --capture "$one" -o "$T/single"
    says "$T/err" "the first 1 of its 9"
    # The default model reads all, finds their exposures or believes the lights.
    unset LGD_MODEL
    expect 0 infer --capture "$one" -o "$T/found"
    says "$T/err" "light power"
    if grep -q "of its 9" "$T/err"; then fail "phone does not read all nine: $(cat "$T/err")"; fi
    expect 0 infer --capture "$one" --light-power 1 -o "$T/known"
    if grep -q "of its 9\|light power" "$T/err"; then fail "the lights are not believed: $(cat "$T/err")"; fi
    if cmp -s "$T/found/$(basename "$one")/maps.exr" "$T/known/$(basename "$one")/maps.exr"; then
        fail "exposures that are found are those that are believed"
    fi
}

# Pictures of a capture, listed in an INI file with other units, give the same maps as the folder.
list() {
    several
    expect 0 "$BIN/lgd-data" --format captures --count 1 --size 16 -o "$T/c"
    one=$(ls -d "$T"/c/*)
    side=$(cat "$one/image_size.txt")
    power=$(cut -d, -f1 "$one/light_power.txt")
    for k in 0 1 2; do
        printf '[photo_%d]\nfile = %s/0%d.png\nlight = %s\ncamera = %s\n' $k "$(basename "$one")" $k \
            "$(sed -n "$((k + 1))p" "$one/light_pos.txt")" "$(sed -n "$((k + 1))p" "$one/camera_pos.txt")"
    done >"$T/photos"
    { printf '[capture]\nside = %s ; centimetres\npower = %s\n' "$side" "$power"; cat "$T/photos"; } >"$T/c/three.ini"
    expect 0 infer --capture "$T/c/three.ini" -o "$T/o"
    [ -s "$T/o/three/diffuse.png" ] || fail "no maps of three.ini"
    { printf '[capture]\nside = %s\npower = %s\n' "$side" "$power"; sed -n 5,8p "$T/photos"; sed -n 1,4p "$T/photos"
    } >"$T/c/two.ini"
    expect 0 infer --capture "$T/c/two.ini" -o "$T/o"
    expect 1 infer --capture "$T/c/two.ini" --orientations 4 -o "$T/turned"
    says "$T/err" "two.ini: --orientations is for one photograph"
    [ ! -e "$T/turned/two" ] || fail "maps in spite of --orientations"
    if cmp -s "$T/o/two/maps.exr" "$T/o/three/maps.exr"; then
        fail "the order and number of photographs change nothing"
    fi
    expect 0 infer "$one/00.png" -o "$T/o"
    if cmp -s "$T/o/00/maps.exr" "$T/o/three/maps.exr"; then fail "one photograph gives what three give"; fi
}

# Files that are all called capture.ini go to folders of their folders' names; meta.txt says by what they were made.
names() {
    several
    for s in wood stone; do
        mkdir "$T/$s"
        printf 'P6\n2 2\n255\n............' >"$T/$s/a.ppm"
        printf '[a]\nfile = a.ppm\nlight = 0, 0, 1\ncamera = 0, 0, 1\n' >"$T/$s/capture.ini"
    done
    expect 0 infer --capture "$T/wood/capture.ini" -o "$T/o"
    expect 0 infer --capture "$T/stone/capture.ini" -o "$T/o"
    (cd "$T/stone" && expect 0 infer --capture capture.ini -o "$T/here") || exit 1
    [ "$(ls "$T/o" | tr '\n' ' ')" = "stone wood " ] || fail "folders: $(ls "$T/o" | tr '\n' ' ')"
    [ "$(ls "$T/here")" = stone ] || fail "of the working folder: $(ls "$T/here")"
    says "$T/o/wood/meta.txt" "weights: \"last.safetensors\" "
    says "$T/o/wood/meta.txt" "options: lgd-infer "
    says "$T/o/wood/meta.txt" '"hash": null'
    if grep -q "^photograph: " "$T/o/wood/meta.txt"; then fail "one hash for several photographs"; fi
    # maps of a photograph that goes to the same folder
    cp "$T/wood/a.ppm" "$T/wood.ppm"
    printf 'P6\n2 2\n255\nmmmmmmmmmmmm' >"$T/wood/wood.ppm"
    expect 0 infer "$T/wood.ppm" -o "$T/o"
    if grep -q "another photograph" "$T/err"; then fail "of a capture nothing tells"; fi
    expect 0 infer "$T/wood.ppm" -o "$T/o"
    if grep -q "another photograph" "$T/err"; then fail "the same photograph: $(cat "$T/err")"; fi
    expect 0 infer "$T/wood/wood.ppm" -o "$T/o"
    says "$T/err" "wood/wood.ppm: note: the maps of another photograph in $T/o/wood were replaced"
}

# Each photograph of a capture is looked at.
looked_at() {
    several
    for f in a b c; do printf '[%s]\nfile = %s.ppm\nlight = 0, 0, 1\ncamera = 0, 0, 1\n' $f $f; done >"$T/c.ini"
    for f in a b c; do { printf 'P6\n20 20\n255\n'; head -c 1200 /dev/zero | tr '\000' 'm'; } >"$T/$f.ppm"; done
    expect 0 infer --capture "$T/c.ini" -o "$T/o"
    if grep -q "warning: the\|upsampled" "$T/err"; then fail "nothing is wrong: $(cat "$T/err")"; fi
    { printf 'P6\n20 20\n255\n'; head -c 1200 /dev/zero; } >"$T/b.ppm"
    { printf 'P6\n9 8\n255\n'; head -c 216 /dev/zero | tr '\000' '\377'; } >"$T/c.ppm"
    expect 0 infer --capture "$T/c.ini" -o "$T/o"
    says "$T/err" "$T/b.ppm: warning: the photograph is black"
    says "$T/err" "$T/c.ppm: warning: the photograph is overexposed (100% of the values)"
    says "$T/err" "$T/c.ppm: note: upsampled: its square has 8 pixels a side and --size is 16"
    if grep -q "a.ppm: " "$T/err"; then fail "a.ppm: $(cat "$T/err")"; fi
    says "$T/o/c/meta.txt" '"warnings": ["black", "overexposed"'
}

# A message with the file and the line for each mistake.
mistakes() {
    several
    good='[capture]
side = 2
[a]
file = a.ppm
light = 0, 0, 2
camera = 0, 0, 2'
    printf 'P6\n2 2\n255\n............' >"$T/a.ppm"
    printf '%s\n' "$good" >"$T/c.ini"
    expect 0 infer --capture "$T/c.ini" --orientations 4 -o "$T/o"
    while IFS='|' read -r edit word; do
        printf '%s\n' "$good" | sed "$edit" >"$T/c.ini"
        expect 1 infer --capture "$T/c.ini" -o "$T/bad"
        says "$T/err" "$word"
        [ ! -e "$T/bad/c" ] || fail "maps in spite of $edit"
    done <<'END'
s/side = 2/side = 0/|c.ini:2: capture.side
s/side = 2/size = 2/|c.ini:2: [capture] has the keys side and power, not size
s/light = .*/light = 0, 0/|c.ini:5: a.light
s/light = .*/light = 0, 0, -2/|above the sample
s/camera = .*/camera = 0, 0, nan/|c.ini:6: a.camera
/camera/d|[a] has no camera
s/file = .*/file = b.ppm/|b.ppm
s/file = .*/name = a.ppm/|c.ini:4
3,6d|lists no photograph
END
    expect 1 infer --capture "$T/absent.ini" -o "$T/bad"
    says "$T/err" absent.ini
    expect 2 infer --capture "$T/c.ini" "$T/a.ppm" -o "$T/bad"
    says "$T/err" --capture
    expect 2 infer --capture "" -o "$T/bad"
    mkdir "$T/folder"
    cp "$T/a.ppm" "$T/folder"
    expect 1 infer --capture "$T/folder" -o "$T/bad"
    says "$T/err" "$T/folder: is no folder of a capture: it has no camera_pos.txt"
}

check capture_folder folder
check capture_list list
check capture_names names
check capture_looked_at looked_at
check capture_mistakes mistakes
