# material.glb and the add-on in Blender: `make test-blender`. PYTHON: an interpreter that has bpy (pip install bpy in a
# venv of Python 3.11).
. tests/cli/lib.sh
: "${PYTHON:=python3}"
PHOTO=$ROOT/demo/flash.jpg
export LGD_MODEL="${LGD_TEST_MODEL:-$ROOT/models/single.safetensors}"

has_bpy() {
    "$PYTHON" -c 'import bpy' 2>/dev/null ||
        skip "$PYTHON has no bpy: pip install bpy, then make test-blender PYTHON=venv/bin/python"
}

# compare ARGUMENT...: what compare.py says of the folder, a line for each light
compare() {
    has_bpy
    expect 0 "$BIN/lgd-infer" --size 128 --maps glb,preview,normal "$PHOTO" -o "$T/o"
    "$PYTHON" tests/blender/compare.py "$T/o/flash" "$@" >"$T/all" 2>&1 ||
        fail "$(grep -m 1 WRONG "$T/all" || tail -n 1 "$T/all")"
    [ "$(grep -c '^light .: mean ratio' "$T/all")" = 4 ] || fail "not four lights: $(tail -n 1 "$T/all")"
    grep '^light' "$T/all" >&3
}

glb_renders_as_preview() { compare; }

addon_renders_as_preview() {
    export PYTHONPATH="$ROOT/python:$ROOT/python/blender" LGD_LIBRARY="$BUILD/liblgd.so" PYTHONDONTWRITEBYTECODE=1
    compare "$PHOTO"
}

# Installed as people do, into folders of its own, with the wheel that the extension brings.
addon_makes_a_material() {
    has_bpy
    "$PYTHON" -c 'import bpy, sys; sys.exit(bpy.app.version < (4, 2))' || skip "this bpy is older than extensions (4.2)"
    expect 0 make --no-print-directory blender BUILD="$BUILD" PYTHON="$PYTHON" WHEELS="$T/wheels"
    unset LGD_MODEL LGD_LIBRARY PYTHONPATH
    export BLENDER_USER_RESOURCES="$T/user" HOME="$T"
    "$PYTHON" tests/blender/addon.py "$T"/wheels/lgd_material-*.zip "$PHOTO" >"$T/all" 2>&1 ||
        fail "$(grep -m 1 WRONG "$T/all" || tail -n 1 "$T/all")"
    says "$T/all" "addon: fine"
}

exec 3>&1
check blender_glb_renders_as_preview glb_renders_as_preview
check blender_addon_renders_as_preview addon_renders_as_preview
check blender_addon_makes_a_material addon_makes_a_material
