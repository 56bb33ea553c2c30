#!/bin/sh
# The style of the sources: prints each file that clang-format would change and each line over 120 columns, of Markdown
# over 100 (rows of tables cannot be broken and may be longer), and ends with 1; `.ci/format.sh fix` formats in place.
# Releases of clang-format differ in detail, so that only release 14 is asked (Debian 12; elsewhere
# `pip install clang-format==14.0.6`); without it that half is skipped by name.
cd "$(dirname "$0")/.." || exit 1
all='--cached --others --exclude-standard' # new files too, before they are added
sources=$(git ls-files $all '*.c' '*.h' '*.cpp')
scripts=$(git ls-files $all '*.sh' '*.py' '*.js' '*.css' '*.html' .ci/run Makefile)
for format in clang-format-14 clang-format none; do
    case $("$format" --version 2>/dev/null) in *" version 14."*) break ;; esac
done
[ "${1:-}" = fix ] && [ "$format" != none ] && "$format" -i $sources
long=$(awk 'length > 120 { print FILENAME ":" FNR ": " length " columns, the most are 120" }' $sources $scripts)
[ -z "$long" ] || { echo "$long" >&2; exit 1; }
# Bytes 200 to 277 continue a character of UTF-8: columns are characters.
long=$(git ls-files $all '*.md' | LC_ALL=C xargs awk '{ text = $0; gsub(/[\200-\277]/, "", text) }
    length(text) > 100 && !/^\|/ { print FILENAME ":" FNR ": " length(text) " columns, the most are 100" }')
[ -z "$long" ] || { echo "$long" >&2; exit 1; }
[ "$format" = none ] && { echo "skip format: clang-format 14 is not installed" >&2; exit 0; }
"$format" --dry-run --Werror $sources
