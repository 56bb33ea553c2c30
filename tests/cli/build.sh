#!/bin/sh
# What make promises: who includes whom, how it installs packages, and what every program shares. The library:
# library.sh
. tests/cli/lib.sh
PROGRAMS="train infer eval data convert capture"

includes_follow_the_layout() { expect 0 sh .ci/includes.sh; }
check includes_follow_the_layout includes_follow_the_layout

includes_check_catches_a_breach() {
    mkdir -p "$T/c/tensor" "$T/c/autograd" "$T/c/render" "$T/c/nn" "$T/c/data" "$T/c/cli" "$T/c/train" "$T/c/infer" \
        "$T/c/eval"
    echo '#include "nn/model.h"' >"$T/c/tensor/bad.c"
    cd "$T/c" && expect 1 sh "$ROOT/.ci/includes.sh" && says "$T/err" "tensor/bad.c includes nn/"
}
check includes_check_catches_a_breach includes_check_catches_a_breach

help_version_and_usage() {
    for p in $PROGRAMS; do
        expect 0 "$BIN/lgd-$p" --help
        says "$T/out" "Usage: lgd-$p"
        [ -s "$T/err" ] && fail "lgd-$p --help writes to stderr"
        expect 0 "$BIN/lgd-$p" --version
        says "$T/out" "lgd-$p (lgd) "
        lines "$T/out" 1
        expect 2 "$BIN/lgd-$p" --no-such-option
        says "$T/err" "lgd-$p"
    done
}
check help_version_and_usage help_version_and_usage

isa_is_checked() {
    for p in $PROGRAMS; do
        LGD_ISA=vax expect 2 "$BIN/lgd-$p" --help
        says "$T/err" "LGD_ISA=vax"
    done
}
check isa_is_checked isa_is_checked

threads_of_the_environment_are_checked() {
    for p in $PROGRAMS; do
        OMP_NUM_THREADS=many expect 2 "$BIN/lgd-$p" --help
        says "$T/err" 'OMP_NUM_THREADS is "many"'
        OMP_NUM_THREADS=2,1 OMP_THREAD_LIMIT='' expect 0 "$BIN/lgd-$p" --help
    done
}
check threads_of_the_environment_are_checked threads_of_the_environment_are_checked

help_to_a_full_disk_fails() {
    [ -w /dev/full ] || skip "no /dev/full"
    for p in $PROGRAMS; do
        "$BIN/lgd-$p" --help >/dev/full 2>"$T/err"
        [ $? -eq 1 ] || fail "lgd-$p --help >/dev/full does not exit with 1"
        lines "$T/err" 1
    done
    # What a later call fails at is not the reason.
    LGD_MODEL=$ROOT/models/single.safetensors "$BIN/lgd-infer" --size 32 -i 0 --threads 1 "$ROOT/demo/flash.jpg" \
        -o "$T/o" >/dev/full 2>"$T/err"
    [ $? -eq 1 ] || fail "lgd-infer does not exit with 1"
    says "$T/err" "cannot write to standard output: No space left on device"
}
check help_to_a_full_disk_fails help_to_a_full_disk_fails

deps_name_what_is_missing() {
    mkdir "$T/bin"
    for tool in sh command id; do ln -s "$(command -v $tool)" "$T/bin/" 2>/dev/null; done
    PATH="$T/bin" expect 1 "$T/bin/sh" .ci/deps.sh OpenImageIO OpenEXR libpng libjpeg
    says "$T/err" "libopenimageio-dev"
    says "$T/err" "libopenexr-dev"
    says "$T/err" "libpng-dev"
    says "$T/err" "libjpeg-dev"
    says "$T/err" "g++"
}
check deps_name_what_is_missing deps_name_what_is_missing

# What the build does without is no error where it cannot be installed.
deps_go_on_without_mpi() {
    mkdir "$T/bin"
    for tool in sh gcc g++; do ln -s "$(command -v $tool)" "$T/bin/"; done
    printf '#!/bin/sh\nexit 1\n' >"$T/bin/pkg-config"
    chmod +x "$T/bin/pkg-config"
    CC=gcc CXX=g++ PATH="$T/bin" expect 0 "$T/bin/sh" .ci/deps.sh ompi-c
    says "$T/err" "without libopenmpi-dev openmpi-bin left out: lgd-train under mpirun"
}
check deps_go_on_without_mpi deps_go_on_without_mpi

# A machine on which nothing is installed, with an apt-get that writes down how it is called.
bare_machine() {
    mkdir "$T/bin"
    for tool in sh cat; do ln -s "$(command -v $tool)" "$T/bin/"; done
    printf '#!/bin/sh\necho 0\n' >"$T/bin/id"
    printf '#!/bin/sh\necho "$*" >>"%s"\n' "$T/apt" >"$T/bin/apt-get"
    chmod +x "$T/bin/id" "$T/bin/apt-get"
}

deps_go_on_without_a_terminal() {
    bare_machine
    unset YES CI
    PATH="$T/bin" expect 0 "$T/bin/sh" .ci/deps.sh zlib </dev/null
    says "$T/err" "gcc g++ pkg-config zlib1g-dev"
    says "$T/apt" "gcc g++ pkg-config zlib1g-dev"
}
check deps_go_on_without_a_terminal deps_go_on_without_a_terminal

deps_ask_on_a_terminal() {
    command -v script >/dev/null || skip "no script(1), which makes a terminal"
    bare_machine
    unset YES CI
    terminal="$(command -v script) -qec"
    ask="PATH=$T/bin $T/bin/sh .ci/deps.sh zlib; echo ended: \$?"
    $terminal "$ask" /dev/null </dev/null >"$T/out" 2>&1 # the end of the input instead of Enter
    says "$T/out" "zlib1g-dev"
    says "$T/out" "Enter installs them"
    says "$T/out" "ended: 1"
    [ -e "$T/apt" ] && fail "packages are installed before Enter"
    echo | $terminal "$ask" /dev/null >"$T/out" 2>&1
    says "$T/out" "ended: 0"
    says "$T/apt" "zlib1g-dev"
    rm "$T/apt"
    YES=1 $terminal "$ask" /dev/null </dev/null >"$T/out" 2>&1
    grep -q "Enter installs" "$T/out" && fail "YES=1 asks"
    says "$T/apt" "zlib1g-dev"
}
check deps_ask_on_a_terminal deps_ask_on_a_terminal

make_says_what_it_does() {
    expect 0 make --no-print-directory help
    for target in demo test install YES=1 V=1; do says "$T/out" "$target"; done
    expect 0 env -u MAKEFLAGS -u MAKELEVEL make -n --no-print-directory # two makes, one below the other
    if grep -q "warning" "$T/err"; then fail "make warns: $(cat "$T/err")"; fi
    # Two objects of this tree in a folder of their own: a line each, the commands with V=1.
    expect 0 make --no-print-directory -j1 BUILD="$T/b" "$T/b/obj/tensor/status.o" "$T/b/obj/data/folders.o"
    says "$T/out" "  CC    tensor/status.c"
    lines "$T/out" 2
    expect 0 make --no-print-directory -j1 BUILD="$T/b" V=1 PREFIX=/elsewhere "$T/b/obj/tensor/status.o" \
        "$T/b/obj/data/folders.o"
    says "$T/out" "data/folders.c"
    says "$T/out" "-std=c11"
    grep -q "tensor/status.c" "$T/out" && fail "another PREFIX compiles everything again"
    :
}
# All that this build has, as another PREFIX would have it: one object is compiled. What make notes of its variables is
# put back.
install_compiles_one_file() {
    cp -p "$BUILD/gen/prefix" "$BUILD/gen/flags" "$T" || skip "$BUILD was not built by make"
    make -n --no-print-directory -j1 BUILD="$BUILD" V=1 PREFIX=/elsewhere programs >"$T/out" 2>"$T/err"
    code=$?
    cmp -s "$T/flags" "$BUILD/gen/flags" || other=1
    cp -p "$T/prefix" "$T/flags" "$BUILD/gen"
    [ -z "${other-}" ] || skip "$BUILD was built with other flags"
    [ $code -eq 0 ] || fail "make -n ends with $code: $(tail -n 1 "$T/err")"
    [ "$(grep -c -- ' -c -o ' "$T/out")" = 1 ] || fail "$(grep -c -- ' -c -o ' "$T/out") objects are compiled"
    says "$T/out" "-c -o $BUILD/obj/data/folders.o"
}


check make_says_what_it_does make_says_what_it_does
check make_install_compiles_one_file install_compiles_one_file
