#!/bin/sh
# Figures of the tree's structure: files and lines of each room, arrows between files, circles of them, lines over the
# limits (.ci/format.sh). Usage: .ci/figures.sh [TREE], a checkout (default: this one), so that two can be compared.
cd "${1:-$(dirname "$0")/..}" || exit 1
files=$(git ls-files)
of() { printf '%s\n' "$files" | grep -E "$1"; }
sources=$(of '\.(c|h|cpp)$') rooms=$(printf '%s\n' "$sources" | grep -Ev '^(tests|bench)/')
echo "room: files, lines of C and C++"
printf '%s\n' $sources | xargs awk '{ lines[FILENAME]++ }
    END { for (f in lines) { room = f; sub("/[^/]*$", "", room); n[room]++; sum[room] += lines[f] }
          for (r in n) printf "%-18s %4d %7d\n", r, n[r], sum[r] }' | LC_ALL=C sort
echo "in all $(printf '%s\n' $sources | wc -l) files, $(cat $sources | wc -l) lines;" \
    "the longest: $(wc -l $sources | sort -rn | sed -n '2s/^ *//p')"
# X.c, X.h and X_internal.h are one; from each to what it includes.
arrows=$(mktemp) || exit 1
trap 'rm -f "$arrows"' EXIT
grep -oE '^ *# *include "[^"]*"' $rooms /dev/null | sed -E 's/:.*"(.*)"/ \1/; s/(_internal)?\.(c|h|cpp)( |$)/\3/g' |
    while read -r from to; do
        [ "$from" = "$to" ] || [ ! -e "${to%/*}" ] || [ "${to%/*}" = "$to" ] || echo "$from $to"
    done | sort -u >"$arrows"
loops() { tsort 2>&1 >/dev/null | grep -c 'contains a loop'; }
echo "arrows between files: $(wc -l <"$arrows"), circles $(loops <"$arrows")"
sed -E 's|(^\| )([a-z]*)/[^ ]*|\1\2|g' "$arrows" | awk '$1 != $2' | sort -u >"$arrows.top"
echo "arrows between top-level folders: $(wc -l <"$arrows.top"), circles $(loops <"$arrows.top")"
rm -f "$arrows.top"
long() {
    LC_ALL=C awk -v most="$1" '{ text = $0; gsub(/[\200-\277]/, "", text) }
        length(text) > most { n++ } END { print n + 0 }'
}
scripts=$(of '(\.sh|\.py|\.js|\.css|^Makefile|^\.ci/run)$')
echo "lines over 120 columns: C and C++ $(cat $sources | long 120), scripts $(cat $scripts | long 120)"
echo "lines over 100 columns: Markdown without tables $(cat $(of '\.md$') | grep -v '^|' | long 100)"
echo "files over 400 lines: $(wc -l $sources | awk '$1 > 400 && $2 != "total"' | wc -l)"
