#!/bin/sh
# Kills lgd-infer over a folder of photographs with SIGKILL at random moments and begins it again, then checks that
# every photograph is done exactly once: what was complete at a kill is never made again, and at the end results.jsonl
# has a line of each. Usage: tests/kill_folder.sh [PHOTOGRAPHS [KILLS [PROCESSES]]], by default 10000, 10 and 1; of
# several processes each does a part, and all are killed. The last line says what was done.
count=${1:-10000} kills=${2:-10} parts=${3:-1}
. tests/folder_photos.sh
running=
trap 'for p in $running; do kill -9 "$p" 2>/dev/null; done; rm -rf "$T"' EXIT
trap 'exit 1' INT TERM
no() { echo "kill_folder: $*" >&2; exit 1; }
make_tiny 24 || no "no photographs: $(tail -n 1 "$T/log")"
make_photos "$count"
mkdir "$T/o"

# All parts at once; they end by themselves or are killed after some of the work.
begin() {
    running=
    for part in $(seq "$parts"); do
        "$BUILD/bin/lgd-infer" -m "$T/tiny.safetensors" --skip-existing --shard "$part/$parts" --size 16 \
            --iterations 0 \
            --maps diffuse --threads 1 "$T/in" -o "$T/o" >>"$T/names" 2>"$T/err.$part" &
        running="$running $!"
    done
}
# The folders that are complete, with what meta.txt is: its inode and time. In hidden ones it is not yet any.
complete()
{
    find "$T/o" -mindepth 2 -maxdepth 2 -name meta.txt ! -path '*/.lgd-*' -exec grep -q '^estimate: ' {} \; \
        -printf '%h %i %T@\n' 2>/dev/null | sort
}
noted() { if [ -f "$T/o/results.jsonl" ]; then wc -l <"$T/o/results.jsonl"; else echo 0; fi; }
random() { od -An -N4 -tu4 /dev/urandom | tr -d ' '; }

killed=0
: >"$T/names"
: >"$T/seen"
while [ $killed -lt "$kills" ]; do
    # The moment: when so many more lines are there, and up to 20 ms after. On a fast machine all may be done before the
    # last kill.
    had=$(noted)
    [ "$had" -lt "$count" ] || break
    share=$(((count - had) / (kills - killed + 1)))
    until=$((had + 1 + $(random) % (share > 0 ? share : 1)))
    begin
    while [ "$(noted)" -lt $until ]; do
        alive=
        for p in $running; do if kill -0 "$p" 2>/dev/null; then alive=1; fi; done
        [ "$alive" ] || no "the work ended before it was killed: $(head -n 1 "$T/err.1")"
        sleep 0.01
    done
    sleep "0.0$(printf %02d $(($(random) % 20)))"
    for p in $running; do kill -9 "$p" 2>/dev/null; done
    for p in $running; do wait "$p" 2>/dev/null; done
    running=
    killed=$((killed + 1))
    complete >"$T/now"
    [ -z "$(comm -23 "$T/seen" "$T/now")" ] || no "made again: $(comm -23 "$T/seen" "$T/now" | head -n 1)"
    mv "$T/now" "$T/seen"
done
[ $killed -gt 0 ] || no "nothing was killed"
at_last=$(wc -l <"$T/seen")
begin
for p in $running; do wait "$p" || no "the last run fails: $(tail -n 1 "$T"/err.*)"; done
running=
complete >"$T/now"
[ -z "$(comm -23 "$T/seen" "$T/now")" ] || no "made again: $(comm -23 "$T/seen" "$T/now" | head -n 1)"
[ "$(wc -l <"$T/now")" -eq "$count" ] || no "$(wc -l <"$T/now") of $count photographs are complete"
[ "$(ls -A "$T/o" | wc -l)" -eq $((count + 1)) ] || no "left over: $(ls -A "$T/o" | grep -v '^p' | head -n 3)"
[ -z "$(sort "$T/names" | uniq -d)" ] || no "done twice: $(sort "$T/names" | uniq -d | head -n 1)"
[ "$(wc -l <"$T/o/results.jsonl")" -eq "$count" ] || no "results.jsonl has $(wc -l <"$T/o/results.jsonl") lines"
sed 's/^{"folder": "\([^"]*\)", .*, "warnings": .*}$/\1/' "$T/o/results.jsonl" | sort >"$T/listed"
ls "$T/in" | sed 's/\.png$//' | sort | cmp -s - "$T/listed" || no "results.jsonl has other names"
owed=$(grep -c '"seconds": null' "$T/o/results.jsonl")
echo "$count photographs, $killed kills of $parts process(es), $at_last complete at the last:" \
    "each done once, each once in results.jsonl ($owed lines made from meta.txt)"
