# bench/collection.py: map folders of a Debian package's textures.
. tests/cli/lib.sh
: "${PYTHON:=python3}"
DATA=$BIN/lgd-data

# A texture under $1: colour and normal are material number $2's.
texture() {
    mkdir -p "$(dirname "$1")"
    cp "$T"/made/0000"$2"_*/diffuse.png "$1.png"
    cp "$T"/made/0000"$2"_*/normal.png "$1_norm.png"
}

package() {
    command -v dpkg-deb >/dev/null || skip "dpkg-deb is not installed"
    "$PYTHON" -c 'import numpy, PIL, scipy' 2>/dev/null || skip "$PYTHON has no numpy, Pillow and scipy"
    expect 0 "$DATA" -o "$T/made" --families stone --count 4 --size 256
    root=$T/root/usr/share/games/quarry/data
    texture "$root/wall/free" 0
    texture "$root/wall/closed" 1
    texture "$root/wall/again" 0
    texture "$root/skybox/above" 2
    cp "$T"/made/00003_*/diffuse.png "$root/wall/alone.png"
    copyright=$T/root/usr/share/doc/quarry-data/copyright
    mkdir -p "$T/root/DEBIAN" "$T/root/usr/share/doc/quarry-data"
    printf 'Package: quarry-data\nVersion: 1\nArchitecture: all\nMaintainer: x <x@x>\nDescription: x\n' \
        >"$T/root/DEBIAN/control"
    printf 'Format: x\n\nFiles: *\nCopyright: x\nLicense: CC-BY-3.0\n\nFiles: data/wall/closed*\nLicense: GPL-2\n' \
        >"$copyright"
    dpkg-deb --root-owner-group -b "$T/root" "$T/quarry.deb" >/dev/null || fail "no package"
}

# Of five textures two may be used and are no sky, and these are the same.
collection_takes_what_it_may() {
    package
    expect 0 "$PYTHON" bench/collection.py "$T/sets" "$T/quarry.deb"
    says "$T/out" "1 map folders"
    [ "$(cut -f 3,4 "$T/sets/sources.tsv")" = "usr/share/games/quarry/data/wall/again.png	CC-BY-3.0" ] ||
        fail "$(cat "$T/sets/sources.tsv")"
    says "$T/sets/0001_again/meta.txt" "OpenGL y"
    expect 0 "$DATA" --collection "$T/sets" --collected 1 --count 2 --size 64 -o "$T/o"
    [ "$(find "$T/o" -name '0*_collected_0' | wc -l)" -eq 2 ] || fail "$(ls "$T/o")"
}
check collection_takes_what_it_may collection_takes_what_it_may

collection_says_what_is_wrong() {
    package
    expect 2 "$PYTHON" bench/collection.py "$T/o"
    echo "no package" >"$T/bad.deb"
    for wrong in "$T/absent.deb: no such file" "$T/bad.deb: cannot be unpacked: "; do
        expect 1 "$PYTHON" bench/collection.py "$T/new/o" "$T/quarry.deb" "${wrong%%: *}"
        lines "$T/err" 1
        says "$T/err" "collection.py: $wrong"
        [ -z "$(ls -A "$T/new" 2>/dev/null)" ] || fail "left: $(ls -A "$T/new")"
    done
    expect 1 "$PYTHON" bench/collection.py "$T/made" "$T/quarry.deb"
    says "$T/err" "$T/made: is there already"
}
check collection_says_what_is_wrong collection_says_what_is_wrong

# A gloss map that may not be used changes nothing, one that may does.
collection_leaves_closed_gloss() {
    package
    expect 0 "$PYTHON" bench/collection.py "$T/without" "$T/quarry.deb"
    for gloss in closed free; do
        cp "$T"/made/00001_*/roughness.png "$root/wall/again_gloss.png"
        [ "$gloss" = free ] || printf '\nFiles: data/wall/again_gloss*\nLicense: CC-BY-NC-3.0\n' >>"$copyright"
        dpkg-deb --root-owner-group -b "$T/root" "$T/quarry.deb" >/dev/null || fail "no package"
        expect 0 "$PYTHON" bench/collection.py "$T/$gloss" "$T/quarry.deb"
        sed -i '/again_gloss/,$d' "$copyright"
    done
    cmp -s "$T/without/0001_again/roughness.png" "$T/closed/0001_again/roughness.png" || fail "closed gloss was used"
    cmp -s "$T/without/0001_again/roughness.png" "$T/free/0001_again/roughness.png" && fail "free gloss was not"
    return 0
}
check collection_leaves_closed_gloss collection_leaves_closed_gloss
