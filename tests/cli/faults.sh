# Calls of the programs that fail, one at a time: a part of `make faults`.
. tests/cli/lib.sh

# faults SCENARIOS OPTION...
faults() {
    [ -e "$BUILD/lib/lgd-faults.so" ] || skip "lgd-faults.so is not built"
    case $(cat "$BUILD/gen/flags") in *-fsanitize=*) skip "the sanitizers have a malloc of their own" ;; esac
    chosen=$1
    shift
    ONLY_ONCE=1 SCENARIOS=$chosen BUILD=$BUILD sh tests/faults/run.sh "$@" >"$T/out" 2>&1 ||
        fail "$(head -n 1 "$T/out")"
    says "$T/out" " 0 scenarios with defects"
}
of_infer() { faults infer --every 40; }
of_sheet() { faults sheet --call ftell; }
of_convert() { faults "convert torch" --every 20; }
of_data() { faults "data strips" --every 40; }
# The first memory is refused; texts in memory and config.ini are cut.
of_train()
{
    faults train --call malloc --every 2000 && faults train --call fprintf --every 200 &&
        faults train --call fputs --every 200
}
# A checkpoint or a log that cannot be opened now is not one that is not there.
of_resume() { faults resume --call access && faults resume --call fopen; }
of_threads() { faults many --call pthread_create && faults many --call open_memstream; }
# What libpng, libjpeg, zlib and OpenEXR are refused: an error must not wait for a lock that its file holds.
of_libraries() { faults libraries --call malloc; }

check faults_of_infer of_infer
check faults_of_convert of_convert
check faults_of_data of_data
check faults_of_sheet of_sheet
check faults_of_train of_train
check faults_of_resume of_resume
check faults_of_several_threads of_threads
check faults_of_libraries of_libraries
