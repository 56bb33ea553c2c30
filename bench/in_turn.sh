#!/bin/sh
# in_turn.sh BUILD_A BUILD_B ROUNDS WORD...: runs lgd-bench WORD... of two builds in turn, so many times, and prints for
# each row with a time the median of A's and of B's milliseconds, and of B's over A's within a round.
set -eu
[ $# -ge 4 ] || { echo "usage: bench/in_turn.sh BUILD_A BUILD_B ROUNDS WORD..." >&2; exit 2; }
a=$1 b=$2 rounds=$3
shift 3
for build in "$a" "$b"; do
    [ -x "$build/bin/lgd-bench" ] || { echo "$build/bin/lgd-bench: make it first" >&2; exit 1; }
done
out=$(mktemp)
rows=$(mktemp)
trap 'rm -f "$out" "$rows"' EXIT
trap 'exit 130' INT TERM
for round in $(seq "$rounds"); do
    for side in a b; do
        [ $side = a ] && build=$a || build=$b
        "$build/bin/lgd-bench" "$@" >"$out" || { echo "$build/bin/lgd-bench $*: failed" >&2; exit 1; }
        awk -v round="$round" -v build=$side '
            match($0, / +[0-9.]+ ms/) {
                time = $0; sub(/ ms.*/, "", time); sub(/.* /, "", time)
                label = substr($0, 1, RSTART - 1); seen[label]++
                print build "\t" round "\t" label " " seen[label] "\t" time
            }' "$out" >>"$rows"
    done
done
[ -s "$rows" ] || { echo "lgd-bench $*: no row has a time" >&2; exit 1; }
awk -F '\t' '
    function median(v, n, i, j, t) {
        for (i = 2; i <= n; i++) for (j = i; j > 1 && v[j] < v[j - 1]; j--) { t = v[j]; v[j] = v[j - 1]; v[j - 1] = t }
        return n % 2 ? v[(n + 1) / 2] : (v[n / 2] + v[n / 2 + 1]) / 2
    }
    $1 == "a" { if (!($3 in count)) label[++labels] = $3; first[$3, $2] = $4; count[$3] = $2 }
    $1 == "b" { second[$3, $2] = $4 }
    END {
        for (l = 1; l <= labels; l++) {
            n = 0
            for (r = 1; r <= count[label[l]]; r++) {
                if (!((label[l], r) in second)) continue
                n++; x[n] = first[label[l], r]; y[n] = second[label[l], r]; q[n] = y[n] / x[n]
            }
            if (n) printf "%-60s %10.3f %10.3f ms  B/A %.3f\n", label[l], median(x, n), median(y, n), median(q, n)
        }
    }' "$rows"
