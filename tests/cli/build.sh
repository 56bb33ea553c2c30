#!/bin/sh
# What make promises: who includes whom, install and uninstall, a program linked against the installed library, and what every program shares.
. tests/cli/lib.sh
PROGRAMS="train infer eval data"

includes_follow_the_layout() { expect 0 sh .ci/includes.sh; }
check includes_follow_the_layout includes_follow_the_layout

includes_check_catches_a_breach() {
    mkdir -p "$T/c/tensor" "$T/c/autograd" "$T/c/render" "$T/c/nn" "$T/c/data" "$T/c/cli" "$T/c/train" "$T/c/infer" "$T/c/eval"
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

help_to_a_full_disk_fails() {
    [ -w /dev/full ] || skip "no /dev/full"
    for p in $PROGRAMS; do
        "$BIN/lgd-$p" --help >/dev/full 2>"$T/err"
        [ $? -eq 1 ] || fail "lgd-$p --help >/dev/full does not exit with 1"
        lines "$T/err" 1
    done
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

install_link_uninstall() {
    case ${MAKEFLAGS:-} in *fsanitize*) skip "the sanitizers' build is not installed" ;; esac
    command -v pkg-config >/dev/null || skip "no pkg-config"
    expect 0 make --no-print-directory install BUILD="$BUILD" DESTDIR="$T/root" PREFIX=/usr/local
    find "$T/root" -type f | sed "s|$T/root||" | sort >"$T/files"
    for f in bin/lgd-infer bin/lgd-train bin/lgd-eval bin/lgd-data lib/liblgd.a lib/lgd/liblgd_image.so include/lgd.h share/lgd/single.safetensors lib/pkgconfig/lgd.pc; do
        grep -qx "/usr/local/$f" "$T/files" || fail "$f is not installed"
    done
    sed -n '/^## As a library/,/^## /s/^    //p' README.md >"$T/user.c" # the README's own program
    PKG_CONFIG_PATH=$T/root/usr/local/lib/pkgconfig
    export PKG_CONFIG_PATH
    # shellcheck disable=SC2046
    expect 0 ${CC:-gcc} -o "$T/user" "$T/user.c" $(pkg-config --define-prefix --cflags --libs lgd)
    expect 0 "$T/user" "$T/root/usr/local/share/lgd/single.safetensors"
    says "$T/out" "roughness of the first pixel: 0."
    expect 1 "$T/user" "$T/absent.safetensors"
    says "$T/out" "absent.safetensors"
    expect 0 make --no-print-directory uninstall BUILD="$BUILD" DESTDIR="$T/root" PREFIX=/usr/local
    [ -z "$(find "$T/root" -type f)" ] || fail "left behind: $(find "$T/root" -type f | head -n 3)"
}
check install_link_uninstall install_link_uninstall
