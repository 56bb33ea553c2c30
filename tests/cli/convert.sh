#!/bin/sh
# lgd-convert as a user meets it.
. tests/cli/lib.sh
C=tests/corpus/torch

usage() {
    for a in "" "--list" "a.pth" "a.pth b.pth c.pth" "--list a b" "a.pth b.bin" "--dtype f8 a.pth b.pth" \
        "--list --dtype f16 a.pth" "--what a b"; do
        # shellcheck disable=SC2086
        expect 2 "$BIN/lgd-convert" $a
        says "$T/err" "lgd-convert:"
    done
    expect 2 "$BIN/lgd-convert" "" b.pth
    says "$T/err" "IN: the name is empty"
    expect 2 "$BIN/lgd-convert" a.pth ""
    says "$T/err" "OUT: the name is empty"
    expect 0 "$BIN/lgd-convert" --help
    for o in list dtype prefix safetensors .pth; do says "$T/out" "$o"; done
    expect 0 "$BIN/lgd-convert" --version
}

lists() {
    expect 0 "$BIN/lgd-convert" --list $C/shared.pth
    says "$T/out" "$(printf 'b\tF32\t[2, 2]')"
    says "$T/out" "PyTorch, ZIP archive: 4 tensors, 10 numbers"
    expect 0 "$BIN/lgd-convert" --list $C/old_two.pth
    says "$T/out" "PyTorch before 1.6"
    expect 1 "$BIN/lgd-convert" --list $C/evil_system.pth
    says "$T/err" "posix.system"
    expect 1 "$BIN/lgd-convert" --list "$T/none.pth"
    says "$T/err" "none.pth"
}

there_and_back() {
    for f in shared deflated big old_view types state_dict nested; do
        expect 0 "$BIN/lgd-convert" $C/$f.pth "$T/a.safetensors"
        expect 0 "$BIN/lgd-convert" "$T/a.safetensors" "$T/b.pth"
        expect 0 "$BIN/lgd-convert" "$T/b.pth" "$T/c.safetensors"
        "$BIN/lgd-convert" --list "$T/c.safetensors" >"$T/list"
        expect 0 "$BIN/lgd-convert" --list "$T/a.safetensors"
        cmp -s "$T/list" "$T/out" || fail "$f: another list"
        cmp -s "$T/a.safetensors" "$T/c.safetensors" || fail "$f: other bytes"
    done
    cp "$T/a.safetensors" "$T/d.safetensors"
    expect 0 "$BIN/lgd-convert" "$T/d.safetensors" "$T/d.safetensors" # onto itself
    cmp -s "$T/a.safetensors" "$T/d.safetensors" || fail "changed by a conversion onto itself"
    expect 0 "$BIN/lgd-convert" --dtype bf16 "$T/a.safetensors" "$T/e.pth"
    expect 0 "$BIN/lgd-convert" --list "$T/e.pth"
    says "$T/out" "$(printf 'g.w\tBF16\t[2, 3]')"
    expect 0 "$BIN/lgd-convert" --prefix g. $C/nested.pth "$T/g.pth"
    expect 0 "$BIN/lgd-convert" --list "$T/g.pth"
    says "$T/out" "$(printf 'w\tF32\t[2, 3]')"
    says "$T/out" "1 tensors"
    expect 1 "$BIN/lgd-convert" --prefix x. $C/nested.pth "$T/x.pth"
    [ ! -e "$T/x.pth" ] || fail "a file of nothing"
    [ "$(ls -A "$T" | wc -l)" -eq 10 ] || fail "left over: $(ls -A "$T")"
}

# The files' bytes are what the script makes, and what is written is what Python's own zipfile and pickletools take for
# a sound archive.
with_python() {
    command -v python3 >/dev/null 2>&1 || skip "python3 is absent"
    mkdir "$T/again"
    python3 tests/nn/make_torch_files.py "$T/again" || fail "tests/nn/make_torch_files.py"
    cut -f 1 $C/expected.tsv | sort >"$T/names"
    ( cd "$T/again" && ls | grep -v expected.tsv | sort ) | cmp -s - "$T/names" || fail "other files"
    while IFS=$(printf '\t') read -r f what why; do
        "$BIN/lgd-convert" --list "$T/again/$f" >"$T/out" 2>"$T/err"
        code=$?
        if [ "$what" = ok ]; then [ $code -eq 0 ] || fail "$f: $(cat "$T/err")"
        else
            [ $code -eq 1 ] || fail "$f: exit status $code"
            says "$T/err" "$why"
        fi
    done <"$T/again/expected.tsv"
    expect 0 "$BIN/lgd-convert" $C/types.pth "$T/w.pth"
    python3 - "$T/w.pth" <<'PY' || fail "zipfile or pickletools refuses what was written"
import io, pickletools, struct, sys, zipfile
z = zipfile.ZipFile(sys.argv[1])
assert z.testzip() is None
pickletools.dis(z.read('archive/data.pkl'), io.StringIO())
assert z.read('archive/byteorder') == b'little'
for i in z.infolist():
    z.fp.seek(i.header_offset + 26)
    n, x = struct.unpack('<HH', z.fp.read(4))
    assert (i.header_offset + 30 + n + x) % 64 == 0 and i.compress_type == 0, i
assert struct.unpack('<3d', z.read('archive/data/1')) == (0, 1, 1)
PY
}

with_torch() {
    for python in "${TORCH_PYTHON:-python3}" /usr/bin/python3; do
        command -v "$python" >/dev/null 2>&1 && "$python" -c 'import torch' 2>/dev/null && break
        python=
    done
    [ -n "$python" ] || skip "PyTorch is absent (TORCH_PYTHON names a Python that has it)"
    "$python" tests/nn/torch_files.py "$BIN/lgd-convert" "$T" || fail "tests/nn/torch_files.py"
}

unwritable() {
    expect 1 "$BIN/lgd-convert" $C/shared.pth "$T/none/a.pth"
    says "$T/err" "none/a.pth"
    ( trap '' XFSZ
      ulimit -f 0
      "$BIN/lgd-convert" $C/shared.pth "$T/a.pth" 2>/dev/null )
    [ $? -eq 1 ] || fail "a full disk is no failure"
    rm -f "$T/out" "$T/err"
    [ -z "$(ls "$T")" ] || fail "left over: $(ls "$T")"
    "$BIN/lgd-convert" --list $C/shared.pth >/dev/full 2>"$T/err"
    [ $? -eq 1 ] || fail "a full standard output is no failure"
}

check convert_usage usage
check convert_list lists
check convert_there_and_back there_and_back
check convert_files_by_python with_python
check convert_files_by_pytorch with_torch
check convert_unwritable unwritable
