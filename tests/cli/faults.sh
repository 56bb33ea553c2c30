# Calls of the programs that fail, one at a time: a part of `make faults`.
. tests/cli/lib.sh

faults() {
    [ -e "$BUILD/lib/lgd-faults.so" ] || skip "lgd-faults.so is not built"
    case $(cat "$BUILD/gen/flags") in *-fsanitize=*) skip "the sanitizers have a malloc of their own" ;; esac
    ONLY_ONCE=1 SCENARIOS="$1" BUILD="$BUILD" sh tests/faults/run.sh --every "$2" >"$T/out" 2>&1 || fail "$(head -n 1 "$T/out")"
    says "$T/out" " 0 scenarios with defects"
}
of_infer() { faults infer 40; }
of_convert() { faults "convert torch" 20; }
of_data() { faults strips 40; }

check faults_of_infer of_infer
check faults_of_convert of_convert
check faults_of_data of_data
