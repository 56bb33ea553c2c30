# material.glb in Blender: `make test-blender`. PYTHON: an interpreter that has bpy (pip install bpy in a venv of Python 3.11).
. tests/cli/lib.sh
: "${PYTHON:=python3}"
export LGD_MODEL="${LGD_TEST_MODEL:-$ROOT/models/single.safetensors}"

glb_renders_as_preview() {
    "$PYTHON" -c 'import bpy' 2>/dev/null || skip "$PYTHON has no bpy: pip install bpy, then make test-blender PYTHON=venv/bin/python"
    expect 0 "$BIN/lgd-infer" --size 128 --maps glb,preview,normal "$ROOT/demo/flash.jpg" -o "$T/o"
    "$PYTHON" tests/blender/compare.py "$T/o/flash" >"$T/all" 2>&1 || fail "$(grep -m 1 WRONG "$T/all" || tail -n 1 "$T/all")"
    [ "$(grep -c '^light .: mean ratio' "$T/all")" = 4 ] || fail "not four lights: $(tail -n 1 "$T/all")"
    grep '^light' "$T/all" >&3
}

exec 3>&1
check blender_glb_renders_as_preview glb_renders_as_preview
