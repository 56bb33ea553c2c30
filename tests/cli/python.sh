# The Python package: in the tree, installed by pip in a venv with the library of the system and with its own, as a
# wheel.
. tests/cli/lib_infer.sh
: "${PYTHON:=python3}"
PHOTO=$ROOT/demo/flash.jpg
export PHOTO
case "$BUILD ${MAKEFLAGS:-}" in *asan* | *fsanitize*) SANITIZED=1 ;; *) SANITIZED= ;; esac

numpy() {
    command -v "$PYTHON" >/dev/null || skip "$PYTHON is not installed"
    "$PYTHON" -c 'import numpy' 2>/dev/null || skip "$PYTHON has no numpy"
    [ -z "$SANITIZED" ] || skip "the sanitizers must be loaded before Python"
    model
}

works_in_the_tree() {
    numpy
    export PYTHONPATH="$ROOT/python" PYTHONDONTWRITEBYTECODE=1 LGD_LIBRARY="$BUILD/liblgd.so"
    "$PYTHON" -W error tests/python/test_lgd.py >"$T/out" 2>"$T/err" ||
        fail "$(grep -m 1 '^FAIL\|^ERROR' "$T/err") $(tail -n 3 "$T/err" | tr '\n' ' ')"
    says "$T/err" "OK"
    LGD_LIBRARY=$T/absent.so expect 1 "$PYTHON" -c 'import lgd'
    says "$T/err" "$T/absent.so: not there"
}
check python_package works_in_the_tree

example_runs() {
    numpy
    export PYTHONPATH="$ROOT/python" PYTHONDONTWRITEBYTECODE=1 LGD_LIBRARY="$BUILD/liblgd.so"
    expect 0 "$PYTHON" -W error python/examples/material.py "$PHOTO" "$T/o/flash"
    says "$T/out" "100%"
    says "$T/out" "roughness: 0."
    for f in diffuse.png specular.png roughness.png normal.png preview.png material.glb meta.txt; do
        [ -s "$T/o/flash/$f" ] || fail "$f is not written"
    done
}
check python_example_runs example_runs

# The maps of the program and of the package are the same numbers.
is_as_lgd_infer() {
    numpy
    export PYTHONPATH="$ROOT/python" PYTHONDONTWRITEBYTECODE=1 LGD_LIBRARY="$BUILD/liblgd.so"
    expect 0 infer --fov 40 "$PHOTO" -o "$T/o"
    expect 0 "$PYTHON" -c 'import lgd, sys
maps = lgd.estimate(sys.argv[1], fov=40, size=32, iterations=1, threads=1)
maps.fov_from = "--fov"
maps.save(sys.argv[2])' "$PHOTO" "$T/p"
    for f in diffuse.png specular.png render.png preview.png; do
        cmp -s "$T/o/flash/$f" "$T/p/$f" || fail "$f is another than lgd-infer's"
    done
    grep -v '^estimate: \|^photograph: \|^weights: \|^options: \|^result: ' "$T/o/flash/meta.txt" >"$T/theirs"
    grep -v '^estimate: \|^photograph: \|^weights: \|^options: \|^result: ' "$T/p/meta.txt" >"$T/ours"
    cmp -s "$T/theirs" "$T/ours" || fail "meta.txt: $(diff "$T/theirs" "$T/ours" | head -n 2 | tr '\n' ' ')"
}
check python_writes_what_lgd_infer_writes is_as_lgd_infer

# What multiprocessing does on Linux before Python 3.14: the child computes as the parent does, which has workers
# waiting.
forks() {
    numpy
    export PYTHONPATH="$ROOT/python" PYTHONDONTWRITEBYTECODE=1 LGD_LIBRARY="$BUILD/liblgd.so"
    expect 0 "$PYTHON" -c 'import lgd, os, sys
def bytes_of(): return lgd.estimate(sys.argv[1], size=32, iterations=1, threads=3).array.tobytes()
before = bytes_of()
for _ in range(3):
    child = os.fork()
    if child == 0: os._exit(bytes_of() != before)
    assert bytes_of() == before
    assert os.waitpid(child, 0)[1] == 0' "$PHOTO"
}
check python_package_in_a_forked_process forks

# A venv that sees the numpy of its Python, so that nothing is fetched.
venv() {
    numpy
    "$PYTHON" -m venv --system-site-packages "$T/venv" >"$T/out" 2>&1 && [ -x "$T/venv/bin/pip" ] ||
        skip "$PYTHON makes no venv with pip (Debian: python3-venv)"
    unset PYTHONPATH LGD_MODEL LGD_LIBRARY
    export LGD_BUILD="$BUILD"
}

# Outside the tree, with the library and the weights that the wheel brings.
installed_works() {
    (cd "$T" && expect 0 "$T/venv/bin/python" -W error -c 'import lgd, sys
maps = lgd.estimate(sys.argv[1], size=32, iterations=1, threads=1)
assert maps.array.shape == (32, 32, 9)
from lgd import _maps
print(_maps.lib._name)' "$PHOTO") || exit 1
}

installs_with_its_own_library() {
    venv
    LGD_WHEEL=own expect 0 "$T/venv/bin/pip" install --no-index --no-deps --disable-pip-version-check ./python
    installed_works
    says "$T/out" "$T/venv/"
    place=$(find "$T/venv" -name liblgd.so.0)
    readelf -SW "$place" | grep -qF .symtab && fail "the library is not stripped"
    expect 0 "$T/venv/bin/pip" uninstall -y --disable-pip-version-check lgd
    [ -z "$(find "$T/venv" -path '*/lgd/*.so*')" ] || fail "left behind: $(find "$T/venv" -path '*/lgd/*' | head -n 2)"
}
check python_pip_install_brings_the_library installs_with_its_own_library

installs_with_the_systems_library() {
    venv
    has_help2man
    expect 0 make --no-print-directory install BUILD="$BUILD" DESTDIR="$T/root" PREFIX=/usr/local
    LD_LIBRARY_PATH=$T/root/usr/local/lib
    export LD_LIBRARY_PATH
    expect 0 "$T/venv/bin/pip" install --no-index --no-deps --disable-pip-version-check ./python
    [ -z "$(find "$T/venv" -name 'liblgd*')" ] || fail "the system's library is in the wheel too"
    installed_works
    says "$T/out" "liblgd.so.0"
}
check python_pip_install_takes_the_systems_library installs_with_the_systems_library

make_wheel() {
    venv
    expect 0 make --no-print-directory wheel BUILD="$BUILD" PYTHON="$PYTHON" WHEELS="$T"
    expect 0 "$T/venv/bin/pip" install --no-index --no-deps --disable-pip-version-check "$T"/lgd-*.whl
    installed_works
}
check python_make_wheel make_wheel
