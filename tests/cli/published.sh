#!/bin/sh
# Weights of the published kind as a user has them: under the published names, with metadata and, as .pth, without.
. tests/cli/lib_infer.sh

# A small network of that kind, with random weights. The published size of g is what a file without metadata is taken to
# have.
small() {
    cat >"$T/small.ini" <<INI
[model]
channels = 10
g_width = 3
g_width_max = 6
g_levels = 3
g_kernel = 5
g_size = 256
h_width = 6
h_gru = 2
iterations = 2
recurrent = no
descent = none
mean_before_norm = no
rmse = batch
encoding = raw
compat = published
[train]
steps = 1
INI
    expect 0 "$BIN/lgd-train" "$T/small.ini" --initial "$T/a.safetensors"
    photo "$T/p.ppm" 300 290
}

runs_with_and_without_metadata() {
    small
    expect 0 "$BIN/lgd-convert" "$T/a.safetensors" "$T/a.pth"
    expect 0 "$BIN/lgd-infer" --threads 1 --iterations 2 --model "$T/a.safetensors" "$T/p.ppm" -o "$T/one"
    says "$T/err" "after 2 steps"
    expect 0 "$BIN/lgd-infer" --threads 1 --iterations 2 --model "$T/a.pth" "$T/p.ppm" -o "$T/two"
    complete "$T/one/p"
    for f in diffuse.png specular.png roughness.png normal.png maps.exr render.png; do
        cmp -s "$T/one/p/$f" "$T/two/p/$f" || fail "$f: the .pth gives another"
    done
    expect 2 "$BIN/lgd-infer" --tolerance 0.1 --model "$T/a.pth" "$T/p.ppm" -o "$T/three"
    says "$T/err" "--tolerance: $T/a.pth: "
    says "$T/err" "no mask and no tolerance"
    # light and camera are at one place
    expect 1 "$BIN/lgd-infer" --sheet --model "$T/a.pth" "$T/p.ppm" -o "$T/three"
    says "$T/err" "no --sheet"
    printf '[a]\nfile = p.ppm\nlight = 0, 0, 1\ncamera = 0, 0, 1\n' >"$T/at_one.ini"
    sed 's/light = 0/light = 0.1/' "$T/at_one.ini" >"$T/apart.ini"
    expect 0 "$BIN/lgd-infer" --threads 1 -i 1 --capture "$T/at_one.ini" --model "$T/a.pth" -o "$T/three"
    expect 1 "$BIN/lgd-infer" --threads 1 -i 1 --capture "$T/apart.ini" --model "$T/a.pth" -o "$T/three"
    says "$T/err" "a.pth: the published weights know light and camera at one place"
    [ ! -e "$T/three/apart" ] || fail "maps in spite of a light beside the camera"
}

# The paper's own size: 640 MB of weights are too many for a test, so that only the configuration is read.
configuration_is_understood() {
    expect 0 "$BIN/lgd-train" configs/paper.ini --print-config
    says "$T/out" "compat = published"
}

other_tensors_are_refused() {
    model
    expect 1 "$BIN/lgd-infer" --model tests/corpus/torch/state_dict.pth "$T/p.ppm" -o "$T/one"
    says "$T/err" "state_dict.pth"
    says "$T/err" "published"
}

check published_runs_with_and_without_metadata runs_with_and_without_metadata
check published_configuration_is_understood configuration_is_understood
check published_other_tensors_are_refused other_tensors_are_refused
