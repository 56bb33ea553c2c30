#!/bin/sh
# Completions of a program's options, made of its --help: completions.sh bash|zsh PROGRAM >FILE
# A line "  -o, --output DIR  text" has one space before a value and two or more before the text, which may begin on the
# next line. Values: a|b are words, DIR and FOLDER folders, FILE, WEIGHTS, TRUNK and WHERE files; others are not
# completed. What the text says "may be repeated" of may be.
shell=$1 program=$2
help=$("$program" --help) || exit 1
printf '%s\n' "$help" | LC_ALL=C awk -v shell="$shell" -v program="${program##*/}" -v quote="'" '
/^ +-/ {
    line = $0
    sub(/^ +/, "", line)
    n++
    while (match(line, /^--?[A-Za-z0-9][-A-Za-z0-9]*,? */)) {
        word = substr(line, 1, RLENGTH)
        line = substr(line, RLENGTH + 1)
        gap = word
        gsub(/[^ ]/, "", gap)
        comma = word ~ /,/
        gsub(/[, ]/, "", word)
        names[n] = names[n] (names[n] ? " " : "") word
        if (!comma) break
    }
    if (length(gap) == 1 && line != "") {
        value[n] = line
        sub(/  .*/, "", value[n])
        line = substr(line, length(value[n]) + 1)
    }
    sub(/^ +/, "", line)
    text[n] = line
    open = 1
    next
}
open && /^ / { sub(/^ +/, ""); text[n] = text[n] (text[n] ? " " : "") $0; next }
{ open = 0 }
function kind(v) {
    if (v ~ /\|/) return "words"
    if (v ~ /^(DIR|FOLDER)/) return "folders"
    if (v ~ /^(FILE|WEIGHTS|TRUNK|WHERE)/) return "files"
    return v ? "other" : ""
}
# a|b|N: what is written as it stands
function words(v,   part, k, count, all) {
    count = split(v, part, "|")
    for (k = 1; k <= count; k++) if (part[k] !~ /[A-Z]/) all = all (all ? " " : "") part[k]
    return all
}
function bash(   k, all, pattern, name, what, reply) {
    name = program
    gsub(/-/, "_", name)
    print "# Made from " program " --help."
    print "_" name "()\n{"
    print "    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]}"
    print "    if [[ $cur == = ]]; then cur=; elif [[ $prev == = ]]; then prev=${COMP_WORDS[COMP_CWORD-2]}; fi"
    print "    COMPREPLY=()\n    case $prev in"
    for (k = 1; k <= n; k++) {
        all = all (all ? " " : "") names[k]
        pattern = names[k]
        gsub(/ /, "|", pattern)
        what = kind(value[k])
        reply = what == "words" ? "-W " quote words(value[k]) quote : what == "folders" ? "-d" : "-f"
        if (what != "other") reply = "mapfile -t COMPREPLY < <(compgen " reply " -- \"$cur\"); "
        if (what == "folders" || what == "files") reply = "compopt -o filenames; " reply
        if (what) print "    " pattern ") " (what == "other" ? "" : reply) "return ;;"
    }
    print "    esac\n    if [[ $cur == -* ]]; then"
    print "        mapfile -t COMPREPLY < <(compgen -W " quote all quote " -- \"$cur\")"
    print "    else\n        compopt -o filenames\n        mapfile -t COMPREPLY < <(compgen -f -- \"$cur\")\n    fi\n}"
    print "complete -F _" name " " program
}
function zsh(   k, m, one, count, about, action, all) {
    print "#compdef " program "\n# Made from " program " --help.\nlocal -a specs=("
    for (k = 1; k <= n; k++) {
        about = text[k]
        sub(/[;:(].*/, "", about)
        sub(/ +$/, "", about)
        gsub(/\[/, "\\[", about); gsub(/\]/, "\\]", about)
        gsub(quote, quote "\\" quote quote, about)
        one = value[k]
        gsub(/:/, "\\:", one); gsub(/\[/, "\\[", one); gsub(/\]/, "\\]", one)
        action = kind(value[k]) == "words" ? ":" one ":(" words(value[k]) ")" : \
            kind(value[k]) == "folders" ? ":" one ":_files -/" : \
            kind(value[k]) == "files" ? ":" one ":_files" : value[k] ? ":" one ": " : ""
        count = split(names[k], part, " ")
        for (m = 1; m <= count; m++) {
            all = text[k] ~ /may be repeated/ ? "*" : text[k] == "" || count == 1 ? "" : "(" names[k] ")"
            print "    " quote all part[m] "[" about "]" action quote
        }
    }
    print ")\n_arguments -s -S $specs " quote "*:file:_files" quote
}
END {
    if (!n) { print program " --help shows no option" >"/dev/stderr"; exit 1 }
    if (shell == "bash") bash(); else zsh()
}'
