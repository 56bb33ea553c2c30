#!/bin/sh
# Every `FILE:FUNCTION` in docs/math.md and docs/methods.md is defined in that file: prints those that are not and
# ends with 1.
cd "$(dirname "$0")/.." || exit 1
bad=0
named=$(grep -ho '`[a-z_0-9/]*\.[ch]:[A-Za-z_0-9]*`' docs/math.md docs/methods.md | tr -d '`' | sort -u)
[ -n "$named" ] || { echo "docs/math.md and docs/methods.md name no function" >&2; exit 1; }
for place in $named; do
    file=${place%:*} function=${place#*:}
    if [ ! -f "$file" ]; then
        echo "docs: there is no $file (for $function)" >&2
        bad=1
    # A definition begins in the first column, and its { comes before any ;
    elif ! awk -v name="$function" '
        $0 ~ "^[A-Za-z].*[ *]" name "\\(" { text = ""; open = 1 }
        open { text = text $0; if (match(text, /[{;]/)) { if (substr(text, RSTART, 1) == "{") found = 1; open = 0 } }
        END { exit !found }' "$file"; then
        echo "docs: $file defines no $function" >&2
        bad=1
    fi
done
exit $bad
