# Runs of lgd-train that end early, and that go on.
. tests/cli/lib_train.sh

complete_run() {
    config
    expect 0 train
    cp "$T/run/last.safetensors" "$T/last"
    rm "$T/run/last.safetensors" "$T/run/best.safetensors"
    expect 0 train --resume
    says "$T/err" "complete at step 10 of 10"
    says "$T/err" "done: $T/run/last.safetensors"
    cmp -s "$T/last" "$T/run/last.safetensors" || fail "the last weights are others, or none"
}

changed_configuration_is_refused() {
    config
    expect 0 train
    expect 1 train --resume --set train.rate=0.5
    says "$T/err" "train.rate is 0.5"
    expect 1 train --resume --set model.h_gru=8
    says "$T/err" "model.h_gru"
    expect 0 train --resume --set data.threads=2
}

interrupt_saves_and_resume_is_exact() {
    config
    set -- --set train.steps=200 --set validate.every=100
    expect 0 train "$@"
    mv "$T/run" "$T/whole"
    for signal in INT TERM HUP; do
        rm -rf "$T/run"
        # A job in the background has SIGINT ignored; the program's handler is set all the same. One that began under
        # nohup has SIGHUP ignored, which the program keeps.
        env --default-signal=HUP "$TRAIN" "$T/small.ini" --set output.folder="$T/run" --threads 1 "$@" \
            --set train.checkpoint_every=1 >"$T/out" 2>"$T/err" &
        job=$!
        await "$T/run/last.safetensors"
        halted_before 205 # it ends at the step that it has come to, however fast it is
        kill -$signal $job
        kill -CONT $job
        if [ $signal = HUP ]; then kill -HUP $job 2>/dev/null; fi # a closed terminal sends it twice
        wait $job
        [ $? -eq 130 ] || fail "SIG$signal: exit status is not 130: $(tail -n 1 "$T/err")"
        says "$T/err" "interrupted at step"
        expect 0 train "$@" --resume
        cmp -s "$T/whole/checkpoint.safetensors" "$T/run/checkpoint.safetensors" ||
            fail "SIG$signal: the checkpoint differs"
        cmp -s "$T/whole/best.safetensors" "$T/run/best.safetensors" || fail "SIG$signal: the best weights differ"
        lines "$T/run/log.csv" 205
    done
}

# Under nohup a run goes on when the terminal is closed.
hangup_is_ignored_under_nohup() {
    config
    command -v nohup >/dev/null || skip "no nohup(1)"
    nohup "$TRAIN" "$T/small.ini" --set output.folder="$T/run" --threads 1 --set train.steps=400 >"$T/out" 2>"$T/err" &
    job=$!
    await "$T/run/last.safetensors"
    halted_before 405
    kill -HUP $job || fail "it has ended: the test is none"
    kill -CONT $job
    wait $job || fail "it was stopped: $(tail -n 1 "$T/err")"
    lines "$T/run/log.csv" 405
}

# A run that was killed before its first checkpoint after step 1 goes on, and in a folder without a checkpoint one
# begins.
killed_before_a_checkpoint() {
    config
    "$TRAIN" "$T/small.ini" --set output.folder="$T/run" --threads 1 --set train.steps=100000 \
        --set train.checkpoint_every=100000 >"$T/out" 2>"$T/err" &
    job=$!
    await "$T/run/best.safetensors"
    kill -KILL $job
    wait $job 2>/dev/null
    [ ! -e "$T/run/last.safetensors" ] || fail "it was killed too late: the test is none"
    : >"$T/err"
    "$TRAIN" "$T/small.ini" --set output.folder="$T/run" --threads 1 --set train.steps=100000 \
        --set train.checkpoint_every=100000 --set train.log_every=1 --resume \
        >"$T/out" 2>"$T/err" &
    job=$!
    await "$T/err"
    kill -TERM $job
    wait $job
    [ $? -eq 130 ] || fail "it does not go on: $(tail -n 1 "$T/err")"
    says "$T/err" "interrupted at step"
    rm "$T/run/checkpoint.safetensors"
    cp "$T/run/best.safetensors" "$T/best"
    cp "$T/run/log.csv" "$T/log"
    expect 0 train --resume
    says "$T/err" "no checkpoint to resume from"
    lines "$T/run/log.csv" 11
    cmp -s "$T/best" "$T/run/best-1.safetensors" && cmp -s "$T/log" "$T/run/log-1.csv" ||
        fail "weights without a checkpoint are not kept"
    rm "$T/run/checkpoint.safetensors"
    expect 0 train
    says "$T/err" "best-2.safetensors"
    cmp -s "$T/run/best.safetensors" "$T/run/best-2.safetensors" || fail "the same run gives other weights"
    expect 1 train
    expect 1 "$TRAIN" "$T/small.ini" --set output.folder="$T/none" --resume
    says "$T/err" "$T/none: there is no run to resume"
}

other_instruction_set_is_said() {
    config
    LGD_ISA=avx2 "$TRAIN" --version >/dev/null 2>&1 || skip "this CPU has one instruction set"
    LGD_ISA=base expect 0 train
    LGD_ISA=base expect 0 train --resume
    if grep -q "instruction set" "$T/err"; then fail "the same one is said"; fi
    LGD_ISA=avx2 expect 0 train --resume
    says "$T/err" "was made with the instruction set base and goes on with avx2"
}

check train_complete_run_has_its_weights complete_run
check train_changed_configuration_is_refused changed_configuration_is_refused
check train_interrupt_saves_and_resume_is_exact interrupt_saves_and_resume_is_exact
check train_hangup_is_ignored_under_nohup hangup_is_ignored_under_nohup
check train_killed_before_a_checkpoint killed_before_a_checkpoint
check train_other_instruction_set_is_said other_instruction_set_is_said
