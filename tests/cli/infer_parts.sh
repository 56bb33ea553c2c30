# lgd-infer --mask and --tolerance: where a photograph is refined, and how long.
. tests/cli/lib_infer.sh

# A grey TIFF of 16 x 16 pixels whose stored upper half is white, as orientation $2 shows it.
half_white() {
    { printf 'II*\000\010\000\000\000\012\000'
      # width, height, bits, compression, photometric, offset, orientation, samples, rows, bytes
      for entry in '\000\001 \003 \020\000' '\001\001 \003 \020\000' '\002\001 \003 \010\000' '\003\001 \003 \001\000' \
          '\006\001 \003 \001\000' \
          '\021\001 \004 \206\000' "\\022\\001 \\003 \\00$2\\000" '\025\001 \003 \001\000' '\026\001 \003 \020\000' \
          '\027\001 \004 \000\001'; do
          set -- "$1" "$2" $entry
          printf "$3$4\\000\\001\\000\\000\\000$5\\000\\000"
      done
      printf '\000\000\000\000'
      for v in 377 000; do i=0; while [ $i -lt 128 ]; do printf "\\$v"; i=$((i + 1)); done; done; } >"$1"
}

# A mask that was turned by its camera lies over the photograph as it is seen.
mask_is_turned() {
    make_weights_with_h
    photo "$T/p.ppm" 32 32
    half_white "$T/upper.tif" 1
    half_white "$T/lower.tif" 3
    for m in upper lower; do
        expect 0 infer --size 256 --maps exr --model "$T/h.safetensors" --mask "$T/$m.tif" "$T/p.ppm" -o "$T/$m"
    done
    cmp -s "$T/upper/p/maps.exr" "$T/lower/p/maps.exr" && fail "the orientation of a mask is ignored"
    # the same as stored the other way round
    { head -c 134 "$T/upper.tif"; tail -c 128 "$T/upper.tif"; head -c 262 "$T/upper.tif" | tail -c 128; } \
        >"$T/stored.tif"
    expect 0 infer --size 256 --maps exr --model "$T/h.safetensors" --mask "$T/stored.tif" "$T/p.ppm" -o "$T/stored"
    cmp -s "$T/stored/p/maps.exr" "$T/lower/p/maps.exr" || fail "a mask that is turned by half is not its other half"
}

mask_and_tolerance() {
    model
    photo "$T/p.ppm" 40 40
    photo "$T/black.ppm" 40 40 0
    photo "$T/white.ppm" 20 20 255
    photo "$T/long.ppm" 40 20 255
    expect 0 infer --iterations 3 "$T/p.ppm" -o "$T/plain"
    expect 0 infer --iterations 2 "$T/p.ppm" -o "$T/first" # the coarse steps are always those of the whole
    expect 0 infer --iterations 3 --mask "$T/white.ppm" "$T/p.ppm" -o "$T/all"
    expect 0 infer --iterations 3 --mask "$T/black.ppm" "$T/p.ppm" -o "$T/none"
    says "$T/err" "black.ppm is black"
    expect 0 infer --quiet --mask "$T/white.ppm" "$T/p.ppm" -o "$T/all"
    [ ! -s "$T/err" ] || fail "a mask that wants something is warned of: $(cat "$T/err")"
    expect 0 infer --iterations 3 --mask "$T/white.ppm" "$T/p.ppm" -o "$T/all"
    cmp -s "$T/all/p/normal.png" "$T/plain/p/normal.png" || fail "a mask that wants everything changes the maps"
    cmp -s "$T/none/p/normal.png" "$T/first/p/normal.png" ||
        fail "a mask that wants nothing does not give what the coarse steps leave"
    expect 1 infer --mask "$T/long.ppm" "$T/p.ppm" -o "$T/o"
    says "$T/err" "long.ppm is 40 x 20"
    expect 1 infer --mask "$T/absent.png" "$T/p.ppm" -o "$T/o"
    says "$T/err" "absent.png"
    expect 2 infer --model single --sample metal "$T/p.ppm" -o "$T/o"
    says "$T/err" "--sample: "
    says "$T/err" "single.safetensors: these weights do not guess the scene"
    [ ! -e "$T/o" ] || fail "something was written"
    # a folder of the model's name hides nothing
    mkdir "$T/named" "$T/named/phone"
    (cd "$T/named" && expect 0 infer --model phone "$T/p.ppm" -o "$T/hidden") || exit 1
    expect 2 infer --sample wood "$T/p.ppm" -o "$T/o"
    says "$T/err" "--sample: 'wood' is not metal, dielectric or auto"
    expect 0 infer --model phone --sample metal "$T/p.ppm" -o "$T/metal"
    says "$T/metal/p/meta.txt" ", sample metal"
    expect 2 infer --orientations 3 "$T/p.ppm" -o "$T/o"
    says "$T/err" "--orientations"
    for x in -1 2 x 0,5; do
        expect 2 infer --tolerance $x "$T/p.ppm" -o "$T/o"
        says "$T/err" "--tolerance"
    done
    make_weights_with_h
    one="$BIN/lgd-infer --size 32 --threads 1 --model $T/h.safetensors $T/p.ppm"
    expect 0 $one --iterations 1 -o "$T/step"
    expect 0 $one --tolerance 1 -o "$T/one"
    cmp -s "$T/one/p/normal.png" "$T/step/p/normal.png" ||
        fail "with a tolerance above every change it is not the first step that counts"
    expect 0 infer --size 520 "$T/p.ppm" -o "$T/large" # in tiles
    complete "$T/large/p"
    says "$T/err" "after 1 step"
}

usual_tolerance() {
    photo "$T/p.ppm" 64 64 120
    make_weights_with_h
    run="$BIN/lgd-infer --size 64 --threads 1 --maps normal,exr --model $T/h.safetensors $T/p.ppm"
    expect 0 $run -o "$T/usual"
    expect 0 $run --tolerance 0.003 -o "$T/same"
    expect 0 $run --tolerance 0 -o "$T/all"
    expect 0 $run --iterations 24 -o "$T/fixed"
    expect 0 $run --exact -o "$T/exact"
    expect 0 $run --exact --tolerance 0 -o "$T/exact_all"
    cmp -s "$T/usual/p/maps.exr" "$T/same/p/maps.exr" || fail "the usual tolerance is not 0.003"
    cmp -s "$T/usual/p/maps.exr" "$T/all/p/maps.exr" && fail "it ends nothing early"
    cmp -s "$T/fixed/p/maps.exr" "$T/all/p/maps.exr" || fail "there is a tolerance where the number of steps is given"
    cmp -s "$T/exact/p/maps.exr" "$T/exact_all/p/maps.exr" || fail "there is a tolerance with --exact"
    run="$BIN/lgd-infer --size 64 --threads 1 --maps normal,exr $T/p.ppm" # no network refines at the photograph's size
    expect 0 $run -o "$T/usual"
    expect 0 $run --tolerance 0 -o "$T/all"
    cmp -s "$T/usual/p/maps.exr" "$T/all/p/maps.exr" || fail "there is a tolerance where it saves nothing"
}

check infer_mask_is_turned mask_is_turned
check infer_mask_and_tolerance mask_and_tolerance
check infer_usual_tolerance usual_tolerance
