# How many threads programs compute on, and what becomes of one that the system refuses.
. tests/cli/lib_infer.sh

shim() { [ -e "$BUILD/lib/lgd-faults.so" ] || skip "lgd-faults.so is not built"
         case $(cat "$BUILD/gen/flags") in *-fsanitize=*) skip "the sanitizers are to be loaded first" ;; esac; }

# started COMMAND...: prints how many threads lgd-infer starts for one photograph: one that decodes, and those that
# compute beside it.
started() {
    LD_PRELOAD=$BUILD/lib/lgd-faults.so LGD_FAULT_COUNT=$T/counts expect 0 "$@" -q --size 32 --iterations 1 "$T/p.ppm" \
        -o "$T/o"
    sed -n 's/^pthread_create //p' "$T/counts"
}

threads_asked_for() {
    shim
    model
    photo "$T/p.ppm" 33 33
    unset OMP_NUM_THREADS OMP_THREAD_LIMIT
    all=$(started "$BIN/lgd-infer") || exit 1
    while read -r want words; do
        # shellcheck disable=SC2086
        got=$(started env $words) || exit 1
        [ "$got" = "$want" ] || fail "$words: $got threads are started, not $want"
    done <<TABLE
1 OMP_NUM_THREADS=1 $BIN/lgd-infer
3 OMP_NUM_THREADS=3 $BIN/lgd-infer
2 OMP_NUM_THREADS=2,4 $BIN/lgd-infer
2 OMP_NUM_THREADS=3 OMP_THREAD_LIMIT=2 $BIN/lgd-infer
1 OMP_THREAD_LIMIT=1 $BIN/lgd-infer
$all OMP_THREAD_LIMIT=1000 $BIN/lgd-infer
3 OMP_NUM_THREADS=1 OMP_THREAD_LIMIT=1 $BIN/lgd-infer --threads 3
1 OMP_NUM_THREADS=3 $BIN/lgd-infer --threads 1
1 taskset -c $(taskset -pc $$ | sed 's/.*: //; s/[-,].*//') $BIN/lgd-infer
TABLE
}
check threads_environment_affinity_and_option threads_asked_for

# Slower, with one line; the same bytes.
refused() {
    shim
    model
    photo "$T/p.ppm" 33 33
    expect 0 infer --threads 1 "$T/p.ppm" -o "$T/1"
    for fault in "2" "3" "2+"; do
        LD_PRELOAD=$BUILD/lib/lgd-faults.so LGD_FAULT="pthread_create $fault" expect 0 \
            infer --threads 3 "$T/p.ppm" -o "$T/$fault"
        [ "$(grep -c "lgd-infer: the system refuses threads (see ulimit -u): [12] of 3 compute" "$T/err")" -eq 1 ] ||
            fail "pthread_create $fault: $(cat "$T/err")"
        for f in $FILES; do
            cmp -s "$T/1/p/$f" "$T/$fault/p/$f" || fail "$f differs where thread $fault is refused"
        done
    done
}
check threads_that_are_refused refused
