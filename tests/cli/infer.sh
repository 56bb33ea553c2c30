# lgd-infer as people use it: the shipped weights, real photographs, sizes, what is written.
. tests/cli/lib_infer.sh

help_names_the_options() {
    expect 0 "$BIN/lgd-infer" --help
    for o in size iterations model threads maps normal max-pixels quiet output; do says "$T/out" "--$o"; done
}

wrong_usage() {
    photo "$T/p.ppm" 8 8
    for o in --size=0 --iterations=-1 --nonsense; do # tests/infer/test_infer_files.c has the others
        expect 2 "$BIN/lgd-infer" "$o" "$T/p.ppm" -o "$T/o"
        says "$T/err" "${o%%=*}"
        [ ! -e "$T/o" ] || fail "$o makes a folder"
    done
    expect 2 "$BIN/lgd-infer" "$T/p.ppm"
    expect 2 "$BIN/lgd-infer" -o "$T/o"
    says "$T/err" "--help"
}

whole_run() {
    model
    photo "$T/wall.ppm" 48 40
    expect 0 "$BIN/lgd-infer" --size 32 "$T/wall.ppm" -o "$T/a/b"
    complete "$T/a/b/wall"
    [ "$(cat "$T/out")" = "$T/a/b/wall" ] || fail "standard output is: $(cat "$T/out")"
    grep -Eq 'wall.ppm: difference from the photograph 0\.[0-9]+ at first -> 0\.[0-9]+ after [0-9]+ steps' "$T/err" ||
        fail "no difference: $(cat "$T/err")"
    expect 0 "$BIN/lgd-infer" --size 32 --iterations 0 -q "$T/wall.ppm" -o "$T/c"
    [ ! -s "$T/err" ] && [ ! -s "$T/out" ] || fail "--quiet says: $(cat "$T/err" "$T/out")"
    expect 0 "$BIN/lgd-infer" --size 32 --iterations 0 "$T/wall.ppm" -o "$T/c"
    says "$T/err" " at first"
    if cmp -s "$T/a/b/wall/maps.exr" "$T/c/wall/maps.exr"; then fail "refinement changes nothing"; fi
}

# A folder that nothing came into is not left; one that was there stays.
empty_folders() {
    model
    echo text >"$T/notes.txt"
    expect 1 infer -q "$T/notes.txt" -o "$T/new/o"
    [ ! -e "$T/new" ] || fail "an empty folder is left"
    mkdir "$T/there"
    expect 1 infer -q "$T/notes.txt" -o "$T/there"
    [ -d "$T/there" ] || fail "a folder that was there is removed"
}

# A folder stands for the photographs in it, @FILE for those that it names; at the end it is said how it went.
folders_and_lists() {
    model
    mkdir -p "$T/in/deeper" "$T/empty"
    photo "$T/in/b.ppm" 32 32
    photo "$T/in/a.ppm" 32 32 0
    photo "$T/in/.hidden.ppm" 32 32
    photo "$T/in/deeper/c.ppm" 32 32
    echo text >"$T/in/notes.txt"
    expect 0 infer --maps render "$T/in" -o "$T/o"
    [ "$(cat "$T/out")" = "$(printf '%s\n' "$T/o/a" "$T/o/b")" ] || fail "not a and b: $(cat "$T/out")"
    grep -Eq '^lgd-infer: 2 of 2 photographs done in [0-9.]+ s; look at:$' "$T/err" ||
        fail "no summary: $(cat "$T/err")"
    says "$T/err" "lgd-infer:   $T/in/a.ppm: black"
    { printf '\357\273\277%s\r\n\r\n' "$T/in/b.ppm"; echo "$T/in/deeper"; } >"$T/list.txt"
    expect 0 infer --maps render "@$T/list.txt" -o "$T/l"
    [ "$(cat "$T/out")" = "$(printf '%s\n' "$T/l/b" "$T/l/c")" ] || fail "not b and c: $(cat "$T/out")"
    # a list may be a pipe; a photograph that is named twice is done once
    echo "$T/in/b.ppm" >"$T/one.txt"
    expect 0 infer --maps render @- "$T/in" -o "$T/r" <"$T/one.txt"
    [ "$(cat "$T/out")" = "$(printf '%s\n' "$T/r/b" "$T/r/a")" ] || fail "not b and a: $(cat "$T/out")"
    mkfifo "$T/pipe"
    cat "$T/list.txt" >"$T/pipe" &
    expect 0 infer --maps render "@$T/pipe" -o "$T/s"
    [ "$(cat "$T/out")" = "$(printf '%s\n' "$T/s/b" "$T/s/c")" ] || fail "not b and c: $(cat "$T/out")"
    expect 1 infer @- -o "$T/u" </dev/null
    says "$T/err" "@-: the list has no names"
    # a name with an @ is not a list
    cp "$T/in/b.ppm" "$T/@b.ppm"
    (cd "$T" && expect 1 infer --maps render @b.ppm -o s && says err "write ./@b.ppm for the photograph" &&
        expect 0 infer --maps render ./@b.ppm -o s) || exit 1
    # a link that leads nowhere is named, the rest of the folder is done
    mkdir "$T/links"
    ln -s "$T/absent.png" "$T/links/gone.png"
    cp "$T/in/b.ppm" "$T/links"
    expect 1 infer --maps render "$T/links" -o "$T/t"
    says "$T/err" "$T/links/gone.png: "
    [ "$(cat "$T/out")" = "$T/t/b" ] || fail "not b: $(cat "$T/out")"
    # what has no photographs is named, the others are done
    expect 1 infer --maps render "$T/empty" "$T/in/b.ppm" "@$T/none.txt" -o "$T/p"
    [ "$(cat "$T/out")" = "$T/p/b" ] || fail "not b: $(cat "$T/out")"
    says "$T/err" "$T/empty: there is no photograph in this folder: name one with JPEG, PNG or HEIC files"
    says "$T/err" "$T/none.txt: "
    expect 1 infer -q "$T/empty" -o "$T/q"
    lines "$T/err" 1
    [ ! -e "$T/q" ] || fail "a folder is made"
    : >"$T/blank.txt"
    expect 1 infer "@$T/blank.txt" -o "$T/q"
    says "$T/err" "blank.txt"
}

# What the trained steps leave far from the photograph is said, with what may help, and that helps.
far_from_the_photograph() {
    model
    {
        printf 'P3 64 64 255\n'
        awk 'BEGIN { for (v = 1; i++ < 3 * 64 * 64;) print int((v = v * 16807 % 2147483647) / 8388608) }'
    } >"$T/noise.ppm"
    expect 0 "$BIN/lgd-infer" -s 64 --maps diffuse "$T/noise.ppm" -o "$T/o"
    says "$T/err" "; --iterations auto may come nearer"
    left=$(sed -n 's/.*-> \([0-9.]*\) .*/\1/p' "$T/err")
    expect 0 "$BIN/lgd-infer" -s 64 --maps diffuse -i auto "$T/noise.ppm" -o "$T/o"
    if grep -q "may come nearer" "$T/err"; then fail "it is said of --iterations auto itself"; fi
    awk -v a="$left" -v b="$(sed -n 's/.*-> \([0-9.]*\) .*/\1/p' "$T/err")" 'BEGIN { exit !(b < a && a > 0.05) }' ||
        fail "$left before, after: $(cat "$T/err")"
}

threads_agree() {
    model
    photo "$T/p.ppm" 33 33
    expect 0 infer --threads 1 "$T/p.ppm" -o "$T/1"
    for n in 0 2 3; do
        expect 0 infer --threads $n "$T/p.ppm" -o "$T/$n"
        for f in $FILES; do cmp -s "$T/1/p/$f" "$T/$n/p/$f" || fail "$f differs with $n threads"; done
    done
}

# LGD_TRACE=1 shows every operation and changes no byte; without it nothing is shown.
trace() {
    model
    photo "$T/p.ppm" 32 32
    expect 0 infer -q "$T/p.ppm" -o "$T/0"
    [ ! -s "$T/err" ] || fail "untraced says: $(cat "$T/err")"
    expect 0 env LGD_TRACE=1 "$BIN/lgd-infer" --size 32 --iterations 1 --threads 1 -q "$T/p.ppm" -o "$T/1"
    grep -Eq '^trace: conv +forward +1x[0-9x]+ -> 1x[0-9x]+, with [0-9x]+, [A-Za-z0-9]+, [0-9.]+ ms$' "$T/err" ||
        fail "no convolution: $(head -3 "$T/err")"
    if grep -v '^trace: ' "$T/err"; then fail "other lines"; fi
    for f in $FILES; do cmp -s "$T/0/p/$f" "$T/1/p/$f" || fail "$f differs when traced"; done
}

# The field of view that is told, or assumed with a warning; what is no angle is refused.
field_of_view() {
    model
    photo "$T/p.ppm" 32 32
    expect 0 infer --maps render "$T/p.ppm" -o "$T/0"
    says "$T/err" "p.ppm: warning: a field of view of 54.2 degrees is assumed: it has no focal length in its EXIF; "
    says "$T/err" "; --fov DEG sets it"
    says "$T/0/p/meta.txt" \
        "field of view: 54.22 degrees across the square (assumed: it has no focal length in its EXIF)"
    expect 0 infer --fov 28 --maps render,preview "$T/p.ppm" -o "$T/28"
    says "$T/err" "p.ppm: field of view 28.0 degrees (--fov)"
    says "$T/28/p/meta.txt" "field of view: 28.00 degrees across the square (--fov)"
    says "$T/28/p/meta.txt" "camera: 0.0000 0.0000 2.0054"
    expect 0 infer --fov 54.2249 "$T/p.ppm" -o "$T/54"
    expect 0 infer "$T/p.ppm" -o "$T/usual"
    cmp "$T/54/p/diffuse.png" "$T/usual/p/diffuse.png" || fail "told the default the maps differ"
    if cmp -s "$T/28/p/render.png" "$T/0/p/render.png"; then fail "the field of view changes no rendering"; fi
    for degrees in 0 180 -20 wide; do
        expect 2 infer --fov=$degrees "$T/p.ppm" -o "$T/none"
        says "$T/err" "--fov: '$degrees' is not an angle in 1 .. 170 degrees"
    done
    [ ! -e "$T/none" ] || fail "a folder is made"
}

only_what_is_asked_for() {
    model
    photo "$T/p.ppm" 32 32
    expect 0 infer "$T/p.ppm" -o "$T/all"
    for list in diffuse specular roughness normal exr render preview; do
        expect 0 infer --maps $list "$T/p.ppm" -o "$T/$list"
        for f in "$T/$list/p"/*.[pe]*; do cmp -s "$f" "$T/all/p/${f##*/}" || fail "--maps $list: ${f##*/} differs"; done
        case $list in render|preview) want="meta.txt $list.png " ;; exr) want="maps.exr meta.txt " ;; *) \
            want=$(printf '%s\n' "$list.png" meta.txt | sort | tr '\n' ' ') ;; esac
        [ "$(ls -A "$T/$list/p" | tr '\n' ' ')" = "$want" ] ||
            fail "--maps $list writes $(ls -A "$T/$list/p" | tr '\n' ' ')"
    done
    expect 0 infer --maps render,normal "$T/p.ppm" -o "$T/all"
    complete "$T/all/p"
}

# Photographs in the same order, with the same words and the same bytes, whether several are computed at once or they
# come one at a time.
overlap_changes_nothing() {
    model
    list=
    for i in 1 2 3 4 5 6 7; do
        photo "$T/$i.ppm" $((20 + i)) 33
        list="$list $T/$i.ppm"
    done
    echo bad >"$T/4.ppm"
    : >"$T/one_names"
    : >"$T/one_words"
    for p in $list; do
        infer "$p" -o "$T/one" >>"$T/one_names" 2>>"$T/one_words"
    done
    for n in 1 2 3 5 20; do
        # shellcheck disable=SC2086
        expect 1 infer --threads $n $list -o "$T/o"
        sed "s|$T/one/|$T/o/|" "$T/one_names" | cmp -s - "$T/out" ||
            fail "$n threads: other folders, or in another order"
        grep -Ev "1 of 7 photographs failed|6 of 7 photographs done|^lgd-infer:   " "$T/err" |
            cmp -s - "$T/one_words" ||
            fail "$n threads: other words: $(grep -v photographs "$T/err" | diff - "$T/one_words" | head -n 3)"
        diff -r -x results.jsonl "$T/o" "$T/one" >/dev/null || fail "$n threads: other files"
        rm -r "$T/o"
    done
}

old_results() {
    model
    photo "$T/p.ppm" 32 32
    expect 0 infer "$T/p.ppm" -o "$T/o"
    cp "$T/o/p/maps.exr" "$T/first"
    echo old >"$T/o/p/maps.exr"
    echo mine >"$T/o/p/notes.txt"
    expect 0 infer "$T/p.ppm" -o "$T/o"
    cmp -s "$T/first" "$T/o/p/maps.exr" || fail "the old file is still there"
    [ "$(cat "$T/o/p/notes.txt")" = mine ] || fail "somebody's file is gone"
    rm "$T/o/p/notes.txt"
    complete "$T/o/p"
}

poor_photographs() {
    model
    photo "$T/black.ppm" 32 32 0
    photo "$T/white.ppm" 32 32 255
    expect 0 infer "$T/black.ppm" -o "$T/o"
    complete "$T/o/black"
    says "$T/err" "black.ppm: warning"
    # the writer tints: a white that is white in all channels
    { printf 'P6\n32 32\n255\n'; head -c 3072 /dev/zero | tr '\000' '\377'; } >"$T/white.ppm"
    expect 0 infer "$T/white.ppm" -o "$T/o"
    complete "$T/o/white"
    says "$T/err" "overexposed"
    # a little-endian float image, two thirds of it 4.0
    { printf 'PF\n12 1\n-1.0\n'; for v in 1 2 3 4 5 6 7 8 9 10 11 12
    do printf '\000\000\200\100\000\000\200\100\000\000\000\077'; done; } >"$T/bright.pfm"
    expect 0 infer --size 1 "$T/bright.pfm" -o "$T/o"
    says "$T/err" "66.7% of the values are above 1"
    # TGA files of 4 x 4 pixels with alpha, all of it opaque or one pixel not
    for last in 377 000; do
        { printf '\0\0\2\0\0\0\0\0\0\0\0\0\4\0\4\0\40\10'
          for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15; do printf '\100\120\140\377'; done
          printf "\\100\\120\\140\\$last"; } >"$T/alpha.tga"
        expect 0 infer --size 4 "$T/alpha.tga" -o "$T/$last"
    done
    says "$T/err" "alpha.tga: warning: it is transparent in places"
    says "$T/000/alpha/meta.txt" '"transparent in places"'
    if grep -q transparent "$T/377/alpha/meta.txt"; then fail "what is opaque is transparent"; fi
}

sizes() {
    model
    photo "$T/p.ppm" 20 31
    for n in 1 2 3 17; do
        expect 0 infer --size $n "$T/p.ppm" -o "$T/$n"
        complete "$T/$n/p"
    done
    expect 0 "$BIN/lgd-infer" --size 255 -i 1 "$T/p.ppm" -o "$T/255"
    complete "$T/255/p"
    says "$T/err" "upsampled"
    photo "$T/line.ppm" 1 40
    photo "$T/dot.ppm" 1 1
    expect 0 infer "$T/line.ppm" "$T/dot.ppm" -o "$T/o"
    complete "$T/o/line"
    complete "$T/o/dot"
}

comma_locale() {
    model
    if ! locale -a 2>/dev/null | grep -qi '^de_DE.utf-\?8$'; then
        localedef -i de_DE -f UTF-8 "$T/de_DE.UTF-8" 2>/dev/null ||
            skip "there is no comma-decimal locale and none can be made"
        # the C library never frees what it makes of LOCPATH
        export LOCPATH="$T" ASAN_OPTIONS="${ASAN_OPTIONS-}:detect_leaks=0"
    fi
    photo "$T/p.ppm" 24 24
    expect 0 infer "$T/p.ppm" -o "$T/c"
    cp "$T/err" "$T/plain"
    expect 0 env LC_ALL=de_DE.UTF-8 "$BIN/lgd-infer" --size 32 --iterations 1 "$T/p.ppm" -o "$T/de"
    cmp -s "$T/err" "$T/plain" || fail "other words: $(cat "$T/err")"
    for f in $FILES; do cmp -s "$T/c/p/$f" "$T/de/p/$f" || fail "$f differs"; done
}

directx_normals() {
    model
    photo "$T/p.ppm" 16 16
    expect 0 infer "$T/p.ppm" -o "$T/gl"
    expect 0 infer --normal dx "$T/p.ppm" -o "$T/dx"
    if cmp -s "$T/gl/p/normal.png" "$T/dx/p/normal.png"; then fail "the normals are the same"; fi
    for f in diffuse.png specular.png roughness.png render.png preview.png; do
        cmp -s "$T/gl/p/$f" "$T/dx/p/$f" || fail "$f differs"
    done
}

precision() {
    model
    photo "$T/p.ppm" 33 33
    expect 2 infer --precision f16 "$T/p.ppm" -o "$T/o"
    says "$T/err" "--precision"
    for p in f32 bf16; do expect 0 infer --precision $p --maps normal,exr "$T/p.ppm" -o "$T/$p"; done
    expect 0 infer --maps normal,exr "$T/p.ppm" -o "$T/usual"
    cmp -s "$T/usual/p/maps.exr" "$T/f32/p/maps.exr" || fail "f32 is not the default"
    # how near they are: tests/nn/test_precision.c
    cmp -s "$T/bf16/p/maps.exr" "$T/f32/p/maps.exr" && fail "bf16 gives the maps of f32"
    for isa in base avx2 avx512 avx512bf16 amx; do
        if LGD_ISA=$isa infer --help >/dev/null 2>&1
        then expect 0 env LGD_ISA=$isa "$BIN/lgd-infer" --size 32 --threads 1 --precision bf16 "$T/p.ppm" -o "$T/$isa"
        else expect 2 env LGD_ISA=$isa "$BIN/lgd-infer" --precision bf16 "$T/p.ppm" -o "$T/$isa"; fi
    done
}

instruction_sets() {
    photo "$T/p.ppm" 8 8
    expect 2 env LGD_ISA=mmx "$BIN/lgd-infer" "$T/p.ppm" -o "$T/o"
    says "$T/err" "mmx"
    model
    expect 0 env LGD_ISA=base "$BIN/lgd-infer" -s 8 "$T/p.ppm" -o "$T/o"
    complete "$T/o/p"
}

all_photographs() {
    [ -d "$TESTDATA/photos" ] || skip "$TESTDATA/photos is absent"
    model
    n=$(ls "$TESTDATA/photos" | wc -l)
    expect 0 "$BIN/lgd-infer" --size 64 --threads 1 "$TESTDATA"/photos/* -o "$T/o"
    lines "$T/out" "$n"
    [ "$(ls -d "$T"/o/*/ | wc -l)" -eq "$n" ] || fail "$n photographs, $(ls -d "$T"/o/*/ | wc -l) folders"
    lines "$T/o/results.jsonl" "$n"
    while read -r folder; do complete "$folder"; done <"$T/out"
    [ "$(grep -c 'difference from the photograph' "$T/err")" -eq "$n" ] || fail "not every photograph has its figures"
    awk '/difference from the photograph/ { for (i = 1; i <= NF; i++)
            if ($i == "photograph") { a += $(i + 1); b += $(i + 5) } }
        END { exit !(b < a && a > 0) }' "$T/err" ||
        fail "refinement does not bring the renderings nearer to the photographs"
}

# The power of the light is reported when it is not the usual one, and changes the maps; the wrong ones are refused.
light_power() {
    model
    photo "$T/p.ppm" 16 16
    expect 0 infer --light-power 1 "$T/p.ppm" -o "$T/one"
    if grep -q 'light power' "$T/err"; then fail "the usual power is reported"; fi
    expect 0 infer --light-power 2.5 "$T/p.ppm" -o "$T/more"
    says "$T/err" "light power 2.50"
    if cmp -s "$T/one/p/maps.exr" "$T/more/p/maps.exr"; then fail "the power changes nothing"; fi
    expect 0 infer "$T/p.ppm" -o "$T/default"
    expect 0 infer --light-power auto "$T/p.ppm" -o "$T/auto"
    cmp -s "$T/default/p/maps.exr" "$T/auto/p/maps.exr" || fail "auto is not the default"
    for power in 0 -1 1e9 bright; do
        expect 2 infer --light-power=$power "$T/p.ppm" -o "$T/bad"
        says "$T/err" --light-power
    done
}

check infer_help_names_the_options help_names_the_options
check infer_wrong_usage wrong_usage
check infer_whole_run whole_run
check infer_folders_and_lists folders_and_lists
check infer_far_from_the_photograph far_from_the_photograph
check infer_threads_agree threads_agree
check infer_trace trace
check infer_field_of_view field_of_view
check infer_writes_only_what_is_asked_for only_what_is_asked_for
check infer_overlap_changes_nothing overlap_changes_nothing
check infer_old_results_are_replaced old_results
check infer_empty_folders_are_not_left empty_folders
check infer_poor_photographs poor_photographs
check infer_light_power light_power
check infer_sizes sizes
check infer_comma_locale comma_locale
check infer_directx_normals directx_normals
check infer_precision precision
check infer_instruction_sets instruction_sets
check infer_all_photographs all_photographs
