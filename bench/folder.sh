#!/bin/sh
# folder.sh INFER_A INFER_B ROUNDS [OPTION...]: two lgd-infer in turn, so many times, each over 64 photographs (links to
# demo/flash.jpg) of 256 pixels a side and four maps; the median of their photographs a second, and of B's over A's
# within a round. The first round warms up. Options are for both.
set -eu
[ $# -ge 3 ] || { echo "usage: bench/folder.sh INFER_A INFER_B ROUNDS [OPTION...]" >&2; exit 2; }
a=$1 b=$2 rounds=$3
shift 3
for infer in "$a" "$b"; do
    [ -x "$infer" ] || { echo "$infer: is no program" >&2; exit 1; }
done
photograph=$(realpath demo/flash.jpg)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
trap 'exit 130' INT TERM
mkdir "$folder/in"
for i in $(seq 64); do ln -s "$photograph" "$folder/in/$i.jpg"; done
for round in $(seq 0 "$rounds"); do
    for infer in "$a" "$b"; do
        begin=$(date +%s%N)
        "$infer" -q --size 256 --maps diffuse,specular,roughness,normal "$@" "$folder"/in/*.jpg -o "$folder/out" \
            >/dev/null || { echo "$infer: failed" >&2; exit 1; }
        end=$(date +%s%N)
        rm -rf "$folder/out"
        [ "$round" -eq 0 ] || echo "$((end - begin))" >>"$folder/times"
    done
done
paste - - <"$folder/times" | awk '
    function median(v, n, i, j, t) {
        for (i = 2; i <= n; i++) for (j = i; j > 1 && v[j] < v[j - 1]; j--) { t = v[j]; v[j] = v[j - 1]; v[j - 1] = t }
        return n % 2 ? v[(n + 1) / 2] : (v[n / 2] + v[n / 2 + 1]) / 2
    }
    { x[NR] = 64e9 / $1; y[NR] = 64e9 / $2; q[NR] = $1 / $2 }
    END { printf "A %.1f, B %.1f photographs/s, B/A %.3f (medians of %d, in turn)\n", median(x, NR), median(y, NR),
                 median(q, NR), NR }'
