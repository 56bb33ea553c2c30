#!/bin/sh
# Debian packages of what `make install` installs, for the machine that they are made on: deb.sh VERSION DIR, called by
# `make deb`. Environment: BUILD, MAKE; DEBFULLNAME and DEBEMAIL, of the maintainer (default: as git knows).
#   lgd          programs, manual pages, completions        liblgd0      the library, and what reads other image formats
#   liblgd-dev   lgd.h, the archive, pkg-config             lgd-models   the weights
#   python3-lgd  the Python package
set -eu
version=$1 out=$2
fail() { echo "deb: $*" >&2; exit 1; }
for tool in dpkg-deb dpkg-shlibdeps dpkg-architecture help2man; do
    command -v $tool >/dev/null || fail "there is no $tool: apt-get install dpkg-dev help2man"
done
name=${DEBFULLNAME:-$(git config user.name 2>/dev/null || :)} \
    mail=${DEBEMAIL:-$(git config user.email 2>/dev/null || :)}
[ -n "$name" ] && [ -n "$mail" ] || fail "who maintains them? Set DEBFULLNAME and DEBEMAIL"
arch=$(dpkg-architecture -qDEB_HOST_ARCH) libdir=/usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)
# The sources' date: what packages of several architectures share must be the same bytes.
: "${SOURCE_DATE_EPOCH:=$(git log -1 --format=%ct 2>/dev/null || date +%s)}"
day=$(LC_ALL=C date -R -u -d "@$SOURCE_DATE_EPOCH")
mkdir -p "$out"
work=$(mktemp -d "$out/.lgd-deb.XXXXXX")
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM
umask 022
work=$(cd "$work" && pwd)
root=$work/root
"${MAKE:-make}" --no-print-directory install BUILD="$BUILD" DESTDIR="$root" PREFIX=/usr LIBDIR="$libdir"

# take PACKAGE PATH...: what of the installation goes into which package
take() {
    package=$1
    shift
    for path in "$@"; do
        mkdir -p "$work/$package${path%/*}"
        mv "$root$path" "$work/$package${path%/*}/"
    done
}
take lgd /usr/bin /usr/share/man /usr/share/bash-completion /usr/share/zsh
mkdir -p "$work/lgd/usr/share/zsh/vendor-completions"
mv "$work"/lgd/usr/share/zsh/site-functions/* "$work/lgd/usr/share/zsh/vendor-completions/" # Debian's place
rmdir "$work/lgd/usr/share/zsh/site-functions"
gzip -9n "$work"/lgd/usr/share/man/man1/*.1
take liblgd-dev "$libdir/liblgd.so" "$libdir/liblgd.a" "$libdir/pkgconfig" /usr/include
for file in "$root$libdir"/liblgd.so.*; do take liblgd0 "$libdir/${file##*/}"; done
rm -f "$root$libdir"/lgd/liblgd_openmpi.so "$root$libdir"/lgd/liblgd_mpich.so # or the package would need both MPIs
take liblgd0 "$libdir/lgd"
take lgd-models /usr/share/lgd
left=$(find "$root" ! -type d)
[ -z "$left" ] || fail "no package takes $left"
mkdir -p "$work/python3-lgd/usr/lib/python3/dist-packages/lgd"
cp python/lgd/*.py python/lgd/py.typed "$work/python3-lgd/usr/lib/python3/dist-packages/lgd/"

# needs PACKAGE: the packages whose libraries its files are linked with
needs() {
    mkdir -p "$work/debian"
    printf 'Source: lgd\n\nPackage: %s\nArchitecture: any\n' "$1" >"$work/debian/control"
    (cd "$work" && dpkg-shlibdeps -O $(find "$1" -type f -exec sh -c 'readelf -h "$1" >/dev/null 2>&1' - {} \; -print) \
        >"$work/substvars" 2>"$work/warnings") || fail "$(cat "$work/warnings")"
    sed -n 's/^shlibs:Depends=//p' "$work/substvars"
}

# make_deb PACKAGE SECTION ARCHITECTURE DEPENDS SHORT LONG FIELD...
make_deb() {
    package=$1 section=$2 its_arch=$3 depends=$4 short=$5 long=$6
    shift 6
    doc=$work/$package/usr/share/doc/$package
    mkdir -p "$doc" "$work/$package/DEBIAN"
    {
        printf 'lgd (%s) unstable; urgency=medium\n\n' "$version"
        printf '  * CHANGELOG.md of the sources has the changes.\n\n -- %s <%s>  %s\n' "$name" "$mail" "$day"
    } | gzip -9n >"$doc/changelog.gz"
    {
        printf 'Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: lgd\n\n'
        printf 'Files: *\nCopyright: 2026 the lgd authors\nLicense: Apache-2.0\n'
        printf ' On Debian systems the license is in /usr/share/common-licenses/Apache-2.0.\n'
    } >"$doc/copyright"
    find "$work/$package" -type d -exec chmod 755 {} +
    size=$(du -k -s --apparent-size "$work/$package" | cut -f1)
    {
        printf 'Package: %s\nSource: lgd\nVersion: %s\nArchitecture: %s\n' "$package" "$version" "$its_arch"
        printf 'Maintainer: %s <%s>\nInstalled-Size: %s\n' "$name" "$mail" "$size"
        [ -z "$depends" ] || printf 'Depends: %s\n' "$depends"
        [ $# -eq 0 ] || printf '%s\n' "$@"
        printf 'Section: %s\nPriority: optional\nDescription: %s\n%s\n' "$section" "$short" "$long"
    } | grep -v '^Source: lgd$' >"$work/$package/DEBIAN/control.new"
    [ "$package" = lgd ] || sed -i 's/^Version:/Source: lgd\nVersion:/' "$work/$package/DEBIAN/control.new"
    mv "$work/$package/DEBIAN/control.new" "$work/$package/DEBIAN/control"
    (cd "$work/$package" && find usr -type f -print0 | LC_ALL=C sort -z | xargs -0 md5sum >DEBIAN/md5sums)
    dpkg-deb --root-owner-group --build "$work/$package" "$work" >"$work/log" || fail "$(cat "$work/log")"
}

mkdir -p "$work/liblgd0/DEBIAN"
printf 'liblgd 0 liblgd0 (>= %s)\n' "$version" >"$work/liblgd0/DEBIAN/shlibs"
echo 'activate-noawait ldconfig' >"$work/liblgd0/DEBIAN/triggers"
what=' lgd recovers the material of a flat surface from one photograph taken
 with a flash: diffuse and specular colour, roughness and normals, with a
 neural network and a differentiable renderer, on a CPU.'
depends=$(needs lgd)
make_deb lgd graphics "$arch" "$depends, liblgd0 (= $version), lgd-models (= $version)" \
    'material of a surface from one flash photograph' "$what
 .
 These are the programs: for photographs, for training, evaluation and weights."
depends=$(needs liblgd0)
make_deb liblgd0 libs "$arch" "$depends" 'material of a surface from one flash photograph - library' "$what
 .
 This is the library, with its reader of image formats other than PNG and JPEG." \
    'Multi-Arch: same' "Suggests: lgd-models (= $version)"
make_deb liblgd-dev libdevel "$arch" \
    "liblgd0 (= $version), libpng-dev, libjpeg-dev, libisal-dev, liblcms2-dev, libopenexr-dev, zlib1g-dev" \
    'material of a surface from one flash photograph - development' "$what
 .
 This is what programs that use the library are compiled with." 'Multi-Arch: same'
make_deb lgd-models graphics all '' 'material of a surface from one flash photograph - weights' "$what
 .
 These are the weights of its networks." 'Multi-Arch: foreign'
mkdir -p "$work/python3-lgd/DEBIAN"
{
    printf '#!/bin/sh\nset -e\n# what Python compiled\n'
    printf 'rm -rf /usr/lib/python3/dist-packages/lgd/__pycache__\n'
} >"$work/python3-lgd/DEBIAN/prerm"
chmod 755 "$work/python3-lgd/DEBIAN/prerm"
make_deb python3-lgd python all "python3 (>= 3.9), python3-numpy, liblgd0 (>= $version), lgd-models (= $version)" \
    'material of a surface from one flash photograph - Python' "$what
 .
 This is the package for Python 3: numpy arrays in and out."
for file in "$work"/*.deb; do
    mv "$file" "$out/"
    echo "$out/${file##*/}"
done
