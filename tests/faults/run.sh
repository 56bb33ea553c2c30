#!/bin/sh
# Every program with each of its calls failing, one at a time (tests/faults/main.c). Prints a line a scenario and the
# sum. Usage: sh tests/faults/run.sh [OPTION... of lgd-faults]; SCENARIOS="infer train" chooses. Environment: BUILD;
# ONLY_ONCE=1: without the second round, in which calls keep failing.
set -u
. tests/support/small_model.sh
: "${BUILD:=build}"
case $BUILD in /*) ;; *) BUILD=$(pwd)/$BUILD ;; esac
BIN=$BUILD/bin SHIM=$BUILD/lib/lgd-faults.so
export LC_ALL=C
T=$(mktemp -d) || exit 1
trap 'rm -rf "$T"' EXIT
bad=0 injected=0
for name in ${SCENARIOS:-}; do
    grep -q "^scenario $name " "$0" && continue
    echo "run.sh: SCENARIOS: there is no $name, but $(sed -n 's/^scenario \([a-z]*\) .*/\1/p' "$0" | xargs)" >&2
    exit 2
done

# scenario NAME OPTIONS... -- PROGRAM ARGUMENTS...: %o stands for the folder that the program writes below.
scenario() {
    name=$1
    shift
    case " ${SCENARIOS:-$name} " in *" $name "*) ;; *) return ;; esac
    own=
    while [ "$1" != -- ]; do own="$own $1"; shift; done
    shift
    for round in once on; do
        [ "$round" = once ] || [ -z "${ONLY_ONCE:-}" ] || continue
        [ "$round" = once ] && on= || on=--on
        # shellcheck disable=SC2086
        "$BIN/lgd-faults" $OPTIONS $own $on "$SHIM" "$T/$name" "$@" >"$T/result" 2>&1 || bad=$((bad + 1))
        sed -n '$!p' "$T/result"
        echo "$name, $round: $(tail -n 1 "$T/result")"
        n=$(sed -n '$s/^\([0-9]*\) failures.*/\1/p' "$T/result")
        injected=$((injected + ${n:-0}))
    done
}
OPTIONS=$*

# What the programs read: weights as training starts with, a material, its photograph, a configuration.
small_model >"$T/small.ini"
cat >>"$T/small.ini" <<'INI'
[train]
batch = 2
pretrain_steps = 1
steps = 3
warmup = 1
checkpoint_every = 1
log_every = 1
[validate]
every = 2
count = 1
size = 16
INI
{ "$BIN/lgd-train" "$T/small.ini" --set output.folder="$T/begun" --threads 1 &&
  "$BIN/lgd-data" -o "$T/data" --count 1 --size 24 &&
  "$BIN/lgd-data" -o "$T/data" --count 1 --size 24 --format strips --photographs &&
  mv "$T"/data/*/ "$T/material" && mv "$T"/data/*.jpg "$T/photo.jpg" &&
  mv "$T"/data/*.png "$T/strip.png"; } >"$T/log" 2>&1 ||
    { cat "$T/log" >&2; exit 2; }
cp "$T/material/diffuse.png" "$T/photo.png"
cp "$T/photo.png" "$T/a.png" && cp "$T/photo.jpg" "$T/b.jpg" && cp "$T/strip.png" "$T/c.png"
W=$T/begun/last.safetensors
for s in infer many formats libraries train resume eval data strips convert torch sheet; do mkdir -p "$T/$s"; done
# A run that ended early, since a checkpoint could not be renamed.
mkdir "$T/resume/out"
LD_PRELOAD=$SHIM LGD_FAULT="rename 7" "$BIN/lgd-train" "$T/small.ini" --set output.folder="$T/resume/out/run" \
    --threads 1 >"$T/log" 2>&1
mv "$T/resume/out" "$T/resume/start"

scenario infer --whole -- "$BIN/lgd-infer" --size 16 --threads 1 -m "$W" "$T/photo.png" -o "$T/infer/out"
scenario formats --whole -- "$BIN/lgd-infer" --size 16 --threads 1 -m "$W" --mask "$T/photo.png" \
    --maps basecolor,metallic,height,gltf,materialx,render \
    -i 1 "$T/photo.jpg" -o "$T/formats/out"
# A line a photograph that failed, and one that says how many.
scenario many --whole --lines 4 -- "$BIN/lgd-infer" --size 16 --threads 2 -m "$W" --maps diffuse,exr,page "$T"/[abc].* \
    -o "$T/many/out"
scenario libraries --every 3 --whole --lines 2 --libraries -- "$BIN/lgd-infer" --size 16 --threads 1 -m "$W" \
    --maps diffuse,exr "$T"/[ab].* \
    -o "$T/libraries/out"
scenario train --steps -- "$BIN/lgd-train" "$T/small.ini" --set output.folder="$T/train/out/run" --threads 1
scenario resume --steps -- "$BIN/lgd-train" "$T/small.ini" --set output.folder="$T/resume/out/run" --resume --threads 1
# A line a material that failed, and one that says how many.
scenario eval --lines 2 -- "$BIN/lgd-eval" --size 16 --iterations 1 --threads 1 -m "$W" --set procedural:1,1 \
    -o "$T/eval/out"
scenario data -- "$BIN/lgd-data" -o "$T/data/out" --count 2 --size 16 --threads 1
scenario strips -- "$BIN/lgd-data" -o "$T/strips/out" --count 1 --size 16 --format strips --threads 1
scenario convert -- "$BIN/lgd-convert" "$W" "$T/convert/out/w.pth"
scenario torch -- "$BIN/lgd-convert" tests/corpus/torch/deflated.pth "$T/torch/out/w.safetensors"
scenario sheet -- "$BIN/lgd-capture" sheet -o "$T/sheet/out/sheet.pdf"

echo "$injected failures injected, $bad scenarios with defects"
[ "$bad" -eq 0 ]
