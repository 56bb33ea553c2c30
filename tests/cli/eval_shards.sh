# lgd-eval in parts: --shard, and processes that mpirun starts.
. tests/cli/lib_eval.sh

evaluate() { "$BIN/lgd-eval" --size 32 --iterations 1 --threads 1 --set procedural:1,5 --set procedural:9,2 "$@"; }

same() {
    for f in results.csv summary.csv; do
        cmp -s "$1/$f" "$2/$f" || fail "$f of the parts differs from one process's"
    done
    [ "$(ls "$2")" = "$(ls "$1")" ] || fail "the parts leave: $(ls "$2" | tr '\n' ' ')"
    [ -z "$(find "$2" -name '.*')" ] || fail "left over: $(ls -A "$2")"
}

parts() {
    model
    expect 0 evaluate --method lgd --method mean -o "$T/one"
    cut -c1-60 "$T/out" >"$T/table"
    for i in 1 2 3; do
        evaluate --method lgd --method mean --shard $i/3 -o "$T/o" >"$T/out.$i" 2>"$T/err.$i" || echo "$i" >>"$T/bad" &
    done
    wait
    [ ! -e "$T/bad" ] || fail "part $(cat "$T/bad"): $(cat "$T"/err.?)"
    same "$T/one" "$T/o"
    cat "$T"/out.? | cut -c1-60 | cmp -s - "$T/table" ||
        fail "another table, or more than one: $(cat "$T"/out.? | head -n 3)"
    # more parts than materials, one after the other; the report has every picture
    for i in 1 2 3 4 5 6 7 8 9; do expect 0 evaluate --method lgd --method mean --shard $i/9 -o "$T/p"; done
    same "$T/one" "$T/p"
    [ "$(grep -o 'data:image/png' "$T/p/report.html" | wc -l)" -eq \
        "$(grep -o 'data:image/png' "$T/one/report.html" | wc -l)" ] || fail "the report has other pictures"
    for bad in 0/2 3/2 x; do expect 2 evaluate --shard $bad -o "$T/o"; done
    expect 2 evaluate --pareto --shard 1/2 -o "$T/o"
}

# What is not of the same evaluation is not put together with it, and what is damaged is named.
strangers() {
    model
    expect 0 evaluate --fast -o "$T/one"
    expect 0 evaluate --fast --seed 2 --shard 1/2 -o "$T/o"
    expect 0 evaluate --fast --shard 2/2 -o "$T/o"
    says "$T/err" "the first is part 1"
    says "$T/err" "o: 1 of the missing parts have files of other options"
    lines "$T/out" 0
    [ ! -e "$T/o/results.csv" ] || fail "parts of two evaluations are put together"
    expect 0 evaluate --fast -q --shard 2/2 -o "$T/o"
    lines "$T/err" 1
    says "$T/err" "1 of the missing parts have files of other options"
    mv "$T/o/part-1-of-2" "$T/other"
    expect 0 evaluate --fast -q --shard 2/2 -o "$T/o"
    lines "$T/err" 0
    mv "$T/other" "$T/o/part-1-of-2"
    cp "$T/o/part-2-of-2" "$T/whole"
    head -c 3000 "$T/whole" >"$T/o/part-2-of-2"
    expect 1 evaluate --fast --shard 1/2 -o "$T/o"
    says "$T/err" "part-2-of-2: is damaged"
    [ ! -e "$T/o/results.csv" ] || fail "results of a damaged part"
    expect 0 evaluate --fast --shard 2/2 -o "$T/o"
    same "$T/one" "$T/o"
}

# Nor are parts whose weights are no longer the same.
other_weights() {
    model
    cp "$MODEL" "$T/w.safetensors"
    expect 0 evaluate --fast --method "lgd:model=$T/w.safetensors" --shard 1/2 -o "$T/o"
    expect 0 "$BIN/lgd-train" configs/tiny.ini --initial "$T/w.safetensors"
    expect 0 evaluate --fast --method "lgd:model=$T/w.safetensors" --shard 2/2 -o "$T/o"
    says "$T/err" "the first is part 1"
    [ ! -e "$T/o/results.csv" ] || fail "parts of two models are put together"
}

# A material that fails does so in its part and in the results.
failures() {
    model
    mkdir "$T/maps"
    expect 0 "$BIN/lgd-data" --format folders --count 3 --size 32 --seed 1 -o "$T/maps"
    second=$(ls "$T/maps" | sed -n 2p)
    for f in "$T/maps/$second"/*.png; do echo bad >"$f"; done
    expect 1 "$BIN/lgd-eval" --size 32 -i 1 --fast --set "maps:$T/maps" -o "$T/one"
    for i in 1 2 3; do
        "$BIN/lgd-eval" --size 32 -i 1 --fast --set "maps:$T/maps" --shard $i/3 -o "$T/o" >"$T/out" 2>"$T/err.$i"
        echo $? >>"$T/codes"
    done
    [ "$(tr '\n' ' ' <"$T/codes")" = "0 1 1 " ] || fail "exit status: $(tr '\n' ' ' <"$T/codes")"
    says "$T/err.3" "1 of 3 materials failed"
    same "$T/one" "$T/o"
}

tuning() {
    model
    set -- --tune --method mean --method descent:rate=0.01,start=r0
    tune() { "$BIN/lgd-eval" --size 32 --threads 1 --set procedural:1,5 --set procedural:9,2 "$@"; }
    expect 0 tune "$@" -o "$T/one"
    for i in 1 2; do expect 0 tune "$@" --shard $i/2 -o "$T/o"; done
    for d in one o; do sed 's/,[^,]*$//' "$T/$d/tune.csv" >"$T/$d.csv"; done # without the seconds
    cmp -s "$T/one.csv" "$T/o.csv" || fail "tune.csv: $(diff "$T/one.csv" "$T/o.csv" | head -n 2)"
    [ "$(ls "$T/o")" = tune.csv ] || fail "left over: $(ls "$T/o")"
}

launchers() {
    model
    expect 0 evaluate --fast -o "$T/one"
    for names in OMPI_COMM_WORLD_RANK=%d:OMPI_COMM_WORLD_SIZE=2 PMI_RANK=%d:PMI_SIZE=2; do
        rm -rf "$T/o"
        for rank in 0 1; do
            # shellcheck disable=SC2046,SC2059
            env $(printf "$names" $rank | tr ':' ' ') "$BIN/lgd-eval" --size 32 --iterations 1 --threads 1 \
                --set procedural:1,5 --set procedural:9,2 --fast -o "$T/o" >>"$T/out.$rank" 2>&1 &
        done
        wait
        same "$T/one" "$T/o"
    done
}

# With the launcher of $1: Open MPI names a process's rank in other variables than MPICH does.
under_mpirun() {
    model
    for launch in mpirun.$1 mpiexec.$1 mpirun mpiexec; do
        command -v "$launch" >/dev/null || continue
        case $1:$("$launch" --version 2>&1) in
        openmpi:*"Open MPI"*) launch="$launch --oversubscribe --allow-run-as-root"; break ;;
        mpich:*HYDRA*) break ;;
        esac
        launch=
    done
    [ "$launch" ] && command -v "${launch%% *}" >/dev/null || skip "no mpirun of $1"
    expect 0 evaluate --fast -o "$T/one"
    for n in 1 2 4; do
        rm -rf "$T/o"
        # shellcheck disable=SC2086
        expect 0 timeout 120 $launch -np $n "$BIN/lgd-eval" --size 32 --iterations 1 --threads 1 --set procedural:1,5 \
            --set procedural:9,2 --fast -o "$T/o"
        same "$T/one" "$T/o"
    done
}

check eval_shards_parts parts
check eval_shards_strangers strangers
check eval_shards_other_weights other_weights
check eval_shards_failures failures
check eval_shards_tuning tuning
check eval_shards_launchers launchers
openmpi() { under_mpirun openmpi; }
mpich() { under_mpirun mpich; }
check eval_shards_openmpi openmpi
check eval_shards_mpich mpich
