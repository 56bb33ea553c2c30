# Manual pages and completions: every option of --help is in them, and they do what they should.
. tests/cli/lib.sh
PROGRAMS=$(cd "$BIN" && for p in lgd-*; do case $p in lgd-test | lgd-bench | lgd-stress | lgd-faults) ;; *) echo "$p" \
    ;; esac; done)
SHARE=$BUILD/share

made() {
    has_help2man
    expect 0 make --no-print-directory manuals BUILD="$BUILD"
    [ "$(echo "$PROGRAMS" | wc -l)" -ge 5 ] || fail "the programs are: $PROGRAMS"
}

# The options of a program's --help, one a line, to $T/options.
options() {
    expect 0 "$BIN/$1" --help
    sed -n 's/^  *\(-.*\)/\1/p' "$T/out" | sed 's/  .*//' | tr ' ,' '\n\n' | grep '^-' | sort -u >"$T/options"
    grep -qx -- --help "$T/options" && [ "$(wc -l <"$T/options")" -gt 4 ] ||
        fail "$1 has the options $(tr '\n' ' ' <"$T/options")"
}

same() { cmp -s "$1" "$T/options" || fail "$2: $(diff "$1" "$T/options" | grep '^[<>]' | head -n 3 | tr '\n' ' ')"; }

manual_pages() {
    made
    for p in $PROGRAMS; do
        options "$p"
        page=$SHARE/man/man1/$p.1
        sed 's/\\f[A-Z]//g; s/\\//g' "$page" >"$T/page"
        grep -q "^$p - [a-z]" "$T/page" || fail "$p.1 does not say what it is about"
        sed -n 's/^\(-.*\)/\1/p' "$T/page" | tr ' ,' '\n\n' | grep '^-' | sort -u >"$T/found"
        same "$T/found" "$p.1"
        command -v man >/dev/null || continue
        MANROFFSEQ='' MANWIDTH=80 LC_ALL=C.UTF-8 man --warnings -E UTF-8 -l -Tutf8 -Z "$page" >/dev/null 2>"$T/err"
        [ -s "$T/err" ] && fail "$p.1: $(head -n 1 "$T/err")"
    done
    :
}
check manual_pages_have_every_option manual_pages

# What bash completes behind the words.
bash_completes() {
    bash -c 'compopt() { :; }
        . "$1"; COMP_WORDS=("${@:2}"); COMP_CWORD=$(($# - 2))
        complete -p "$2" >/dev/null || exit 1
        "_${2//-/_}" && printf "%s\n" "${COMPREPLY[@]}"' - "$SHARE/bash-completion/completions/$1" "$@" 2>"$T/err" |
            sort -u
    [ -s "$T/err" ] && fail "$1: $(head -n 1 "$T/err")"
    :
}

of_bash() {
    made
    command -v bash >/dev/null || skip "bash is not installed"
    for p in $PROGRAMS; do
        options "$p"
        bash_completes "$p" - >"$T/found"
        same "$T/found" "$p in bash"
    done
    mkdir -p "$T/files/a folder"
    : >"$T/files/a photo.jpg"
    cd "$T/files" || exit 1
    [ "$(bash_completes lgd-infer --precision b)" = bf16 ] ||
        fail "--precision: $(bash_completes lgd-infer --precision b)"
    [ "$(bash_completes lgd-infer --precision = b)" = bf16 ] ||
        fail "--precision=: $(bash_completes lgd-infer --precision = b)"
    [ "$(bash_completes lgd-infer -o '')" = "a folder" ] || fail "-o: $(bash_completes lgd-infer -o '')"
    [ "$(bash_completes lgd-infer 'a p')" = "a photo.jpg" ] || fail "photographs: $(bash_completes lgd-infer 'a p')"
    [ -z "$(bash_completes lgd-infer --size '')" ] || fail "--size is a number"
}
check bash_completes_every_option of_bash

of_zsh() {
    made
    command -v zsh >/dev/null || skip "zsh is not installed"
    for p in $PROGRAMS; do
        options "$p"
        # what _arguments gets: names are before the brackets
        zsh -f -c '_arguments() { print -rl -- "$@" }
            load() { . "$1" }; load "$1"' - "$SHARE/zsh/site-functions/_$p" >"$T/specs" 2>"$T/err" ||
                fail "$p: $(head -n 1 "$T/err")"
        [ -s "$T/err" ] && fail "$p: $(head -n 1 "$T/err")"
        sed -n 's/^\(([^)]*)\)\{0,1\}\*\{0,1\}\(--*[A-Za-z][-A-Za-z0-9]*\)\[.*/\2/p' "$T/specs" | sort -u >"$T/found"
        same "$T/found" "$p in zsh"
    done
}
check zsh_has_every_option of_zsh
