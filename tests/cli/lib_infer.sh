# What the tests of lgd-infer share: the shipped weights, a photograph without test data, the files of a result.
. tests/cli/lib.sh
. tests/support/small_model.sh
MODEL=${LGD_TEST_MODEL:-$ROOT/models/single.safetensors}
export LGD_MODEL="$MODEL"
FILES="diffuse.png maps.exr meta.txt normal.png preview.png render.png roughness.png specular.png"

model() { [ -f "$MODEL" ] || fail "$MODEL is absent: the weights that the project ships"; }

# A photograph without test data: a binary PPM of $2 x $3 pixels with the grey levels of a smooth bump, or of the
# constant $4.
photo() {
    { printf 'P6\n%d %d\n255\n' "$2" "$3"
      awk -v w="$2" -v h="$3" -v v="${4-}" 'BEGIN { for (y = 0; y < h; y++) for (x = 0; x < w; x++) {
          g = v != "" ? v : int(200 - 120 * ((x / w - .5) ^ 2 + (y / h - .5) ^ 2) - 20 * ((x + y) % 2))
           printf "\\%03o\\%03o\\%03o", g, g * .9, g * .7 } }' |
      while IFS= read -r line || [ -n "$line" ]; do printf "$line"; done; } >"$1"
}

# Weights whose h refines at the photograph's size, which the shipped ones do not have: those that training starts with,
# as $T/h.safetensors.
make_weights_with_h() {
    first_weights 24 >"$T/h.ini"
    expect 0 "$BIN/lgd-train" "$T/h.ini" --set output.folder="$T/h" --threads 1
    mv "$T/h/last.safetensors" "$T/h.safetensors"
}

# Fails unless the folder has exactly the eight files, none empty.
complete() {
    [ "$(ls -A "$1" | tr '\n' ' ')" = "$FILES " ] || fail "$1 has: $(ls -A "$1" | tr '\n' ' ')"
    for f in $FILES; do [ -s "$1/$f" ] || fail "$1/$f is empty"; done
}

# One thread: at these sizes more only wait for each other when the machine is busy.
infer() { "$BIN/lgd-infer" --size 32 --iterations 1 --threads 1 "$@"; }
