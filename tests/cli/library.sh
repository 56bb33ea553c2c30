#!/bin/sh
# liblgd: which symbols it has, that it installs and goes away, and that the README's program runs with both forms of
# it.
. tests/cli/lib.sh
case "$BUILD ${MAKEFLAGS:-}" in *asan* | *fsanitize*) SANITIZED=1 ;; *) SANITIZED= ;; esac

# The functions that lgd.h declares for others, by name.
api() {
    sed -n 's/^LGD_API .*[ *]\(lgd_[a-z_]*\)(.*/\1/p' infer/lgd.h | sort >"$T/api"
    [ "$(wc -l <"$T/api")" -gt 5 ] || fail "lgd.h declares $(wc -l <"$T/api") functions"
}

same() { cmp -s "$1" "$2" || fail "$3: $(diff "$1" "$2" | grep '^[<>]' | head -n 3 | tr '\n' ' ')"; }

exports_are_those_of_the_header() {
    [ -z "$SANITIZED" ] || skip "the sanitizers add symbols of their own"
    api
    nm -g --defined-only "$BUILD/liblgd.a" | awk 'NF == 3 { print $3 }' | sort >"$T/static"
    nm -D --defined-only "$BUILD/liblgd.so" | awk 'NF == 3 { print $3 }' | sort >"$T/shared"
    same "$T/api" "$T/static" "liblgd.a exports"
    same "$T/api" "$T/shared" "liblgd.so exports"
    readelf -d "$BUILD/liblgd.so" >"$T/dynamic"
    says "$T/dynamic" "soname: [liblgd.so.0]"
}
check library_exports_are_those_of_the_header exports_are_those_of_the_header

holds_no_program() {
    nm "$BUILD/liblgd.a" >"$T/symbols" 2>/dev/null
    for name in tr_ cl_ ev_; do
        grep -q " $name" "$T/symbols" && fail "liblgd.a holds or needs $(grep -m 1 -o " $name.*" "$T/symbols")"
    done
    :
}
check library_holds_no_program holds_no_program

# The files are those of lgd-infer. The numbers in maps.exr went through another encoding: their last bit may differ.
is_as_of_the_program() {
    expect 0 "$root/bin/lgd-infer" --quiet demo/flash.jpg -o "$T/program"
    [ "$(ls "$T/program/flash")" = "$(ls "$T/shared")" ] || fail "other files: $(ls "$T/shared" | tr '\n' ' ')"
    for f in diffuse.png specular.png render.png preview.png; do
        same "$T/program/flash/$f" "$T/shared/$f" "$f is another than lgd-infer's"
    done
    says "$T/shared/meta.txt" "(estimated: it has no focal length in its EXIF)"
    grep -v '^estimate: \|^photograph: \|^weights: \|^options: \|^result: ' "$T/program/flash/meta.txt" >"$T/meta"
    grep -v '^estimate: ' "$T/shared/meta.txt" >"$T/meta_shared"
    cmp -s "$T/meta" "$T/meta_shared" || fail "meta.txt is another: $(diff "$T/meta" "$T/meta_shared" | head -n 2)"
}

# Workers that wait for the next loop when a program gives the library back go on in its code.
unloaded_with_workers_waiting() {
    [ -z "$SANITIZED" ] || skip "the sanitizers' libraries are not loaded later"
    cat >"$T/unload.c" <<'EOT'
#include "infer/lgd.h"
#include <dlfcn.h>
#include <stdio.h>
#include <string.h>
static float maps[64 * 64 * 9], image[64 * 64 * 3];
int main(int count, char **words)
{
    const float light[3] = {0, 0, 1};
    for (int i = 0; i < 50 && count == 2; i++) {
        int (*render)(const float *, int, const float *, const float *, float, float *, lgd_error *);
        void *library = dlopen(words[1], RTLD_NOW), *f = library ? dlsym(library, "lgd_render") : NULL;
        if (!f) return puts(dlerror()), 1;
        memcpy(&render, &f, sizeof render);
        lgd_error e;
        if (render(maps, 64, light, light, 1, image, &e)) return puts(e.message), 1;
        dlclose(library);
    }
    return 0;
}
EOT
    expect 0 ${CC:-gcc} -I. -o "$T/unload" "$T/unload.c" -ldl
    OMP_NUM_THREADS=4 expect 0 "$T/unload" "$BUILD/liblgd.so"
}
check library_unloaded_with_workers_waiting unloaded_with_workers_waiting

# By a name that is relative to the working folder of then: it finds what ships beside it from any other.
loaded_by_a_relative_name() {
    [ -z "$SANITIZED" ] || skip "the sanitizers' libraries are not loaded later"
    cat >"$T/relative.c" <<'EOT'
#include "infer/lgd.h"
#include <dlfcn.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
int main(int count, char **words)
{
    int (*find)(const char *, char *, size_t, lgd_error *);
    void *library = count == 2 ? dlopen(words[1], RTLD_NOW) : NULL;
    void *f = library ? dlsym(library, "lgd_find_weights") : NULL;
    char path[4096];
    lgd_error e;
    if (!f || chdir("/")) return puts(dlerror()), 1;
    memcpy(&find, &f, sizeof find);
    return find("phone", path, sizeof path, &e) ? puts(e.message), 1 : 0;
}
EOT
    expect 0 ${CC:-gcc} -I. -o "$T/relative" "$T/relative.c" -ldl
    mkdir "$T/lib" "$T/models"
    cp "$BUILD/liblgd.so" "$T/lib"
    ln -s "$ROOT/models/phone.safetensors" "$T/models"
    (cd "$T" && expect 0 "$T/relative" ./lib/liblgd.so) || exit 1
}
check library_loaded_by_a_relative_name loaded_by_a_relative_name

# What stands in $(...) of the README's command that begins so, for an installation that has been moved.
linked_by() {
    grep -F -m 1 "$1" README.md | sed 's/.*cc user.c $(\(.*\)) -o user.*/\1/; s/pkg-config/& --define-prefix/'
}

install_link_uninstall() {
    [ -z "$SANITIZED" ] || skip "the sanitizers' build is not installed"
    command -v pkg-config >/dev/null || skip "no pkg-config"
    has_help2man
    (umask 077 # what is installed is for all, whatever the umask is
     expect 0 make --no-print-directory install BUILD="$BUILD" DESTDIR="$T/root" PREFIX=/usr/local) || exit 1
    root=$T/root/usr/local
    find "$root" ! -type l ! -perm -444 >"$T/closed"
    [ ! -s "$T/closed" ] || fail "not for all: $(head -n 3 "$T/closed")"
    for f in bin/lgd-infer bin/lgd-train bin/lgd-eval bin/lgd-data bin/lgd-convert bin/lgd-capture lib/liblgd.a \
        lib/liblgd.so \
        lib/liblgd.so.0 lib/lgd/liblgd_image.so include/lgd.h share/lgd/phone.safetensors lib/pkgconfig/lgd.pc \
        share/man/man1/lgd-infer.1 share/bash-completion/completions/lgd-train share/zsh/site-functions/_lgd-eval; do
        [ -s "$root/$f" ] || fail "$f is not installed"
    done
    for f in "$root"/bin/* "$root"/lib/liblgd.so "$root"/lib/lgd/*.so "$root"/lib/liblgd.a; do
        readelf -SW "$f" | grep -qF .debug_info && fail "$f is not stripped"
    done
    for f in "$root"/bin/* "$root"/lib/lgd/*.so; do
        readelf -SW "$f" | grep -qF .symtab && fail "$f is not stripped"
    done
    sed -n '/^## As a library/,/^## /s/^    //p' README.md >"$T/user.c" # the README's own program
    # Names that a program may well have itself.
    printf '%s\n' 'int zip_open; int json_parse; int ts_fail; int nn_model_load; int io_unit;' >"$T/clash.c"
    PKG_CONFIG_PATH=$root/lib/pkgconfig
    export PKG_CONFIG_PATH
    shared=$(eval "$(linked_by "cc user.c \$(pkg-config --cflags")")
    static=$(eval "$(linked_by "cc user.c \$(pkg-config --static")")
    # shellcheck disable=SC2086
    expect 0 ${CC:-gcc} "$T/user.c" "$T/clash.c" $shared -Wall -Werror -o "$T/with_shared"
    # shellcheck disable=SC2086
    expect 0 ${CC:-gcc} "$T/user.c" "$T/clash.c" $static -Wall -Werror -o "$T/with_static"
    readelf -d "$T/with_shared" >"$T/needed"
    says "$T/needed" "liblgd.so.0"
    readelf -d "$T/with_static" >"$T/needed"
    grep -q liblgd "$T/needed" && fail "what is linked with the archive needs the shared library"
    export LD_LIBRARY_PATH="$root/lib"
    unset LGD_MODEL # the installation's own weights
    expect 0 "$T/with_shared" demo/flash.jpg "$T/shared"
    says "$T/out" "roughness of the first pixel: 0."
    cp "$T/out" "$T/first"
    expect 1 "$T/with_shared" "$T/absent.jpg" "$T/none"
    says "$T/out" "absent.jpg"
    unset LD_LIBRARY_PATH
    LGD_MODEL=$root/share/lgd/phone.safetensors
    export LGD_MODEL
    expect 0 "$T/with_static" demo/flash.jpg "$T/static"
    same "$T/first" "$T/out" "the two libraries differ"
    diff -r "$T/shared" "$T/static" >"$T/diff" || fail "the two libraries differ: $(head -n 1 "$T/diff")"
    is_as_of_the_program
    printf '#include <lgd.h>\nint main() { lgd_options o = lgd_options_default(); return o.size != sizeof o; }\n' \
        >"$T/user.cpp"
    # shellcheck disable=SC2086
    expect 0 ${CXX:-g++} -Wall -Werror -o "$T/cpp" "$T/user.cpp" $static
    expect 0 "$T/cpp"
    expect 0 make --no-print-directory uninstall BUILD="$BUILD" DESTDIR="$T/root" PREFIX=/usr/local
    [ -z "$(find "$T/root" ! -type d)" ] || fail "left behind: $(find "$T/root" ! -type d | head -n 3)"
}
check install_link_uninstall install_link_uninstall
