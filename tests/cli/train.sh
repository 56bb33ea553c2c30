# lgd-train on the command line.
. tests/cli/lib_train.sh

run_makes_its_files() {
    config
    expect 0 train
    says "$T/out" "validation at step 10: render RMSE"
    says "$T/err" "step 10/10  g and h"
    lines "$T/run/log.csv" 11
    for name in "first estimate, training" "last step, training" "first estimate, validation" "last step, validation" \
        "</svg>"; do says "$T/run/curve.svg" "$name"; done
    lines "$T/run/val.csv" 3
    for f in best.safetensors last.safetensors checkpoint.safetensors config.ini; do
        [ -s "$T/run/$f" ] || fail "no $f"
    done
    [ -z "$(find "$T/run" -name '.*')" ] || fail "temporary files are left"
    "$TRAIN" "$T/run/config.ini" --print-config | cmp -s - "$T/run/config.ini" || fail "config.ini does not read back"
    expect 0 train --resume
    says "$T/err" "complete at step 10 of 10"
    expect 1 train
    says "$T/err" "there is a run already"
    rm "$T/run/checkpoint.safetensors"
    expect 0 train
    for f in best-1.safetensors log-1.csv curve-1.svg curve.svg; do [ -s "$T/run/$f" ] || fail "no $f"; done
    rm -r "$T/run"
    expect 0 train --set train.g_rate=0
    says "$T/err" "step 10/10  h alone"
}

auto_encoder() {
    config
    expect 0 train --set coder.code=4 --set coder.width=4 --set coder.width_max=8 --set coder.levels=2 \
        --set model.h_width=0 --set model.iterations=0 --set train.pretrain_steps=0
    says "$T/err" "step 6/6  auto-encoder  loss"
}

# A drawing is not worth a run.
no_curve() {
    config
    mkdir -p "$T/run/curve.svg"
    expect 0 train
    says "$T/err" "curve.svg is not drawn: "
    says "$T/err" "step 10/10  g and h"
}

# A small network of the published kind: its weights before training are a file, and it trains, its tenth channel
# included.
published_kind() {
    config
    set -- --set model.channels=10 --set model.compat=published --set model.descent=none --set model.rmse=batch \
        --set model.recurrent=no \
        --set train.pretrain_steps=0 --set train.steps=2
    expect 0 train "$@" --initial "$T/a.safetensors"
    [ ! -e "$T/run" ] || fail "a run was begun"
    expect 0 train "$@"
    expect 0 "$BIN/lgd-convert" --list "$T/a.safetensors"
    says "$T/out" "preprocess_net.down1.conv.fullyconnect4.weight"
    expect 0 "$BIN/lgd-convert" --list "$T/run/last.safetensors"
    says "$T/out" "main_net.rnn.layers.0.rnn_cell.hh.bias"
    cmp -s "$T/a.safetensors" "$T/run/last.safetensors" && fail "nothing was learned"
    expect 2 train --resume --initial "$T/b.safetensors"
    expect 2 train "$@" --set model.rmse=start
    says "$T/err" "compat"
    expect 1 train "$@" --initial "$T/none/a.safetensors"
    says "$T/err" "none/a.safetensors"
}

default_folder_has_the_files_name() {
    config
    cd "$T" || exit 1
    expect 0 "$TRAIN" small.ini --set train.steps=1 --set train.pretrain_steps=0
    [ -s runs/small/last.safetensors ] || fail "runs/small has no weights"
}

options_and_usage() {
    config
    expect 0 "$TRAIN" --help
    says "$T/out" "Usage: lgd-train"
    expect 0 "$TRAIN" -h
    says "$T/out" "Usage: lgd-train"
    expect 0 "$TRAIN" --version
    expect 0 "$TRAIN" -V
    says "$T/out" "lgd-train (lgd)"
    expect 0 "$TRAIN" --threads 0 --print-config
    expect 0 "$TRAIN" --help-config
    says "$T/out" "map_weight = 1"
    expect 0 "$TRAIN" --print-config
    says "$T/out" "[validate]"
    expect 2 "$TRAIN"
    expect 2 "$TRAIN" a.ini b.ini
    expect 2 "$TRAIN" --nonsense
    says "$T/err" "lgd-train: there is no option --nonsense"
    expect 2 train --threads -1
    expect 2 train --threads two
    expect 2 train --resume --init x.safetensors
    for empty in --init --initial; do
        expect 2 train $empty ""
        says "$T/err" "$empty: the name is empty"
    done
    expect 2 "$BIN/lgd-train" ""
    says "$T/err" "CONFIG: the name is empty"
    expect 1 "$TRAIN" "$T/none.ini"
    says "$T/err" "$T/none.ini"
    expect 1 "$TRAIN" "$T"
    [ ! -e "$T/run" ] || fail "a folder was made by a wrong call"
}

errors_name_file_and_line() {
    printf '\357\273\277[train]\r\nbatch = 2\r\nbach = 3\r\n' >"$T/small.ini"
    expect 2 train
    says "$T/err" "$T/small.ini:3: there is no key train.bach, did you mean train.batch?"
    printf '[train]\nbatch = 2\nbatch = 3\n' >"$T/small.ini"
    expect 2 train
    says "$T/err" "$T/small.ini:3: train.batch is given twice"
    printf '[train]\n\nrate = 0,001\n' >"$T/small.ini"
    expect 2 train
    says "$T/err" "$T/small.ini:3: train.rate must be a number"
    config
    expect 2 train --set train.bach=3
    says "$T/err" "did you mean train.batch"
    expect 2 train --set train.steps=-1
    expect 2 train --set validate.seed=1
}

comma_locale() {
    config
    found=$(locale -a 2>/dev/null | grep -m1 -E '^(de|fr|nl|it)_') || skip "no locale with a decimal comma is installed"
    LC_ALL=$found expect 0 train --set train.rate=0.0005
    says "$T/run/config.ini" "rate = 0.0005"
}

# A library of one's own: it is read, it changes what is trained on, and a run goes on with it.
own_collection() {
    config
    expect 0 "$BIN/lgd-data" -o "$T/own" --count 2 --size 32
    expect 0 train
    mv "$T/run" "$T/plain"
    expect 1 train --set data.collection="$T/nowhere" --set data.collected=0.5
    says "$T/err" "data.collection: $T/nowhere"
    expect 0 train --set data.collection="$T/own" --set data.collected=0.5
    cmp -s "$T/run/last.safetensors" "$T/plain/last.safetensors" && fail "trained on the same materials"
    expect 0 "$BIN/lgd-data" -o "$T/other" --count 2 --size 32 --seed 2
    expect 1 train --resume --set data.collection="$T/other" --set data.collected=0.5
    says "$T/err" "$T/other: has other maps than the run was begun with"
    echo "another file" >>"$T/own/$(ls "$T/own" | head -n 1)/notes.txt"
    expect 1 train --resume --set data.collection="$T/own" --set data.collected=0.5
    rm "$T/own"/*/notes.txt
    mv "$T/own" "$T/moved"
    expect 0 train --resume --set data.collection="$T/moved" --set data.collected=0.5
}

threads_do_not_change_bytes() {
    config
    expect 0 train --threads 1
    mv "$T/run" "$T/one"
    expect 0 train --threads 3
    for f in best last checkpoint; do cmp -s "$T/one/$f.safetensors" "$T/run/$f.safetensors" || fail "$f differs"; done
}

second_trainer_is_refused() {
    config
    "$TRAIN" "$T/small.ini" --set output.folder="$T/run" --set train.steps=100000 >/dev/null 2>"$T/first" &
    job=$!
    await "$T/run/config.ini"
    "$TRAIN" "$T/small.ini" --set output.folder="$T/run" >"$T/out" 2>"$T/err"
    code=$?
    kill -TERM $job
    wait $job
    [ $code -eq 1 ] || fail "the second one exited with $code"
    says "$T/err" "another lgd-train"
}

init_from_weights() {
    config
    expect 0 train
    mv "$T/run" "$T/first"
    expect 0 train --init "$T/first/last.safetensors"
    says "$T/err" "parameters begin as in"
    cmp -s "$T/first/last.safetensors" "$T/run/last.safetensors" && fail "the weights had no effect"
    rm -rf "$T/run"
    expect 1 train --init "$T/nothing.safetensors"
    says "$T/err" "$T/nothing.safetensors"
    expect 1 train --init "$T/small.ini"
    says "$T/err" "$T/small.ini"
    # The second file gives what the first does not have: here g is the other's and h this one's, or the other way
    # round.
    expect 0 train --set train.seed=5 --set model.h_width=0 --set train.steps=0 --initial "$T/g.safetensors"
    expect 0 train --init "$T/g.safetensors" --init "$T/first/last.safetensors" --initial "$T/both.safetensors"
    expect 0 train --init "$T/first/last.safetensors" --initial "$T/first.safetensors"
    expect 0 train --init "$T/g.safetensors" --initial "$T/drawn.safetensors"
    for other in first drawn; do
        cmp -s "$T/both.safetensors" "$T/$other.safetensors" && fail "two files give what one gives ($other)"
    done
    expect 1 train --init "$T/first/last.safetensors" --init "$T/first/last.safetensors" \
        --initial "$T/twice.safetensors"
    says "$T/err" "$T/first/last.safetensors"
    expect 2 train --init "$T/a" --init "$T/b" --init "$T/c"
}

divergence_stops_with_a_reason() {
    config
    expect 1 train --set train.rate=1e6 --set train.pretrain_rate=1e6 --set train.clip=0 --set train.warmup=0 \
        --set train.steps=400 \
        --set train.max_skipped=2
    says "$T/err" "is skipped"
    says "$T/err" "3 steps in a row"
    # What is on disk can be read: it is finite.
    [ ! -e "$T/run/last.safetensors" ] ||
        expect 0 "$TRAIN" "$T/small.ini" --set output.folder="$T/next" --set train.steps=0 \
        --set train.pretrain_steps=1 --init "$T/run/last.safetensors"
}

unwritable_folder() {
    config
    : >"$T/file"
    expect 1 "$TRAIN" "$T/small.ini" --set output.folder="$T/file/run"
    says "$T/err" "$T/file"
    expect 1 "$TRAIN" "$T/small.ini" --set output.folder="$T/file"
    says "$T/err" "$T/file"
}

folder_of_another() {
    config
    not_root "$TRAIN"
    mkdir -m 555 "$T/closed"
    expect 1 $NOT_ROOT "$TRAIN" "$T/small.ini" --set output.folder="$T/closed/run"
    says "$T/err" "$T/closed"
}

# A limit on the size of files stands for a full disk.
full_disk() {
    config
    (
        trap '' XFSZ
        ulimit -f 16
        train >"$T/out" 2>"$T/err"
    )
    [ $? -eq 1 ] || fail "exit status is not 1"
    says "$T/err" ".safetensors: "
    [ -z "$(find "$T/run" -name '*.safetensors*')" ] || fail "half a file is left"
    expect 0 train # the first checkpoint failed: nothing stands in the way
    rm -r "$T/run"
    "$TRAIN" --help-config >/dev/full 2>"$T/err"
    [ $? -eq 1 ] || fail "a full standard output went unnoticed"
}

shipped_configurations_are_valid() {
    for f in configs/*.ini configs/ablation/*.ini; do expect 0 "$TRAIN" "$f" --print-config; done
}

check train_run_makes_its_files run_makes_its_files
check train_auto_encoder auto_encoder
check train_goes_on_without_a_curve no_curve
check train_published_kind published_kind
check train_default_folder_has_the_files_name default_folder_has_the_files_name
check train_options_and_usage options_and_usage
check train_errors_name_file_and_line errors_name_file_and_line
check train_comma_locale comma_locale
check train_own_collection own_collection
check train_threads_do_not_change_bytes threads_do_not_change_bytes
check train_second_trainer_is_refused second_trainer_is_refused
check train_init_from_weights init_from_weights
check train_divergence_stops_with_a_reason divergence_stops_with_a_reason
check train_unwritable_folder unwritable_folder
check train_folder_of_another folder_of_another
check train_full_disk full_disk
check train_shipped_configurations_are_valid shipped_configurations_are_valid
