# make deb: what is in the packages, that it works where they are unpacked, and what lintian says.
. tests/cli/lib.sh
case "$BUILD ${MAKEFLAGS:-}" in *asan* | *fsanitize*) SANITIZED=1 ;; *) SANITIZED= ;; esac

unpacked_works() {
    PATH=$T/root/usr/bin:$PATH
    export LD_LIBRARY_PATH="$T/root$libdir"
    for p in infer train eval data convert capture; do
        expect 0 "lgd-$p" --version
        says "$T/out" "lgd-$p (lgd) "
        readelf -SW "$T/root/usr/bin/lgd-$p" | grep -qF .symtab && fail "lgd-$p is not stripped"
        for f in man/man1/lgd-$p.1.gz bash-completion/completions/lgd-$p zsh/vendor-completions/_lgd-$p; do
            [ -s "$T/root/usr/share/$f" ] || fail "$f is in no package"
        done
    done
    unset LGD_MODEL # the weights beside the program
    expect 0 lgd-infer --size 16 -i 1 --threads 1 demo/flash.jpg -o "$T/o"
    [ "$(readlink "$T/root$libdir/liblgd.so")" = liblgd.so.0 ] || fail "liblgd.so is no link to liblgd.so.0"
    [ -s "$T/root$libdir/lgd/liblgd_image.so" ] || fail "liblgd_image.so is in no package"
    says "$T/root$libdir/pkgconfig/lgd.pc" "libdir=\${prefix}${libdir#/usr}"
    python3 -c 'import numpy' 2>/dev/null || return 0
    export PYTHONPATH="$T/root/usr/lib/python3/dist-packages" PYTHONDONTWRITEBYTECODE=1
    cd "$T" && LGD_MODEL="$T/root/usr/share/lgd/phone.safetensors" expect 0 python3 -c 'import lgd, sys
print(lgd.__file__, lgd.estimate(sys.argv[1], size=16, iterations=1, threads=1).array.shape)' "$ROOT/demo/flash.jpg"
    says "$T/out" "$T/root/usr/lib/python3/dist-packages/lgd/__init__.py (16, 16, 9)"
}

packages() {
    [ -z "$SANITIZED" ] || skip "the sanitizers' build is not packed"
    for tool in dpkg-deb dpkg-shlibdeps dpkg-architecture; do
        command -v $tool >/dev/null || skip "there is no $tool (dpkg-dev)"
    done
    has_help2man
    libdir=/usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH) arch=$(dpkg-architecture -qDEB_HOST_ARCH)
    # Another PREFIX links the programs again. Without the peers of the bench, which are gigabytes.
    mkdir "$T/b"
    tar -C "$BUILD" --exclude=./venv -cf "$T/b.tar" . && tar -C "$T/b" -xf "$T/b.tar" && rm "$T/b.tar" ||
        fail "$BUILD cannot be copied: $(tail -n 1 "$T/.log")"
    export DEBFULLNAME='A Packager' DEBEMAIL=packager@debian.org
    expect 0 make --no-print-directory deb BUILD="$T/b" DEBS="$T/debs"
    want="lgd-models_*_all.deb lgd_*_$arch.deb liblgd-dev_*_$arch.deb liblgd0_*_$arch.deb python3-lgd_*_all.deb"
    [ "$(ls -A "$T/debs" | sed 's/_[0-9.]*_/_*_/' | LC_ALL=C sort | tr '\n' ' ')" = "$want " ] ||
        fail "there are: $(ls -A "$T/debs" | tr '\n' ' ')"
    for deb in "$T"/debs/*.deb; do
        expect 0 dpkg-deb --info "$deb"
        says "$T/out" "Maintainer: A Packager <packager@debian.org>"
        dpkg-deb --contents "$deb" | grep -v ' root/root ' >"$T/others"
        [ -s "$T/others" ] && fail "not root's: $(head -n 1 "$T/others")"
        expect 0 dpkg-deb -x "$deb" "$T/root"
    done
    for library in libpng16 libc6 liblcms2 libisal2; do
        dpkg-deb --field "$T"/debs/liblgd0_*.deb Depends | grep -q "$library" ||
            fail "liblgd0 does not depend on $library"
    done
    (unpacked_works) || exit $?
    command -v lintian >/dev/null || skip "they work; lintian is not installed"
    lintian --fail-on error,warning "$T"/debs/*.deb >"$T/lintian" 2>&1 ||
        fail "$(grep -m 1 '^[EW]:' "$T/lintian" || tail -n 1 "$T/lintian")"
}
check deb_packages packages

says_who_is_missing() {
    [ -z "$SANITIZED" ] || skip "the sanitizers' build is not packed"
    command -v dpkg-shlibdeps >/dev/null || skip "there is no dpkg-shlibdeps (dpkg-dev)"
    unset DEBFULLNAME DEBEMAIL
    GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_SYSTEM=/dev/null GIT_DIR="$T" expect 1 env BUILD="$BUILD" sh .ci/deb.sh 1 \
        "$T/debs"
    says "$T/err" "Set DEBFULLNAME and DEBEMAIL"
    [ ! -e "$T/debs" ] || fail "something is left"
}
check deb_asks_for_a_maintainer says_who_is_missing
