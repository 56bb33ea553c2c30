#!/bin/sh
# Runs CI, or COMMAND, in a Debian of another release: what is committed and changed here, in a chroot that debootstrap
# makes once, with ../shared beside it where that is there. As root. Without debootstrap it says so and ends with 77.
# Usage: .ci/chroot.sh SUITE [COMMAND...]     SUITE: bookworm, trixie; COMMAND: .ci/run
# LGD_CHROOTS: the folder of the chroots, about 2 GB each (default: ../chroots). LGD_MIRROR: the mirror.
cd "$(dirname "$0")/.." || exit 1
suite=${1:-}
case $suite in
bookworm | trixie) shift ;;
*) echo "usage: .ci/chroot.sh bookworm|trixie [COMMAND...]" >&2; exit 2 ;;
esac
[ $# -gt 0 ] || set -- .ci/run
PATH=$PATH:/usr/sbin:/sbin
if ! command -v debootstrap >/dev/null; then echo "chroot: skipped: debootstrap is not installed" >&2; exit 77; fi
if [ "$(id -u)" -ne 0 ]; then echo "chroot: must be run as root" >&2; exit 1; fi
mkdir -p "${LGD_CHROOTS:=../chroots}" || exit 1
root=$(cd "$LGD_CHROOTS" && pwd)/$suite
packages=ca-certificates,gcc,g++,make,pkg-config
packages=$packages,libopenimageio-dev,libopenexr-dev,libpng-dev,libjpeg-dev,liblcms2-dev,libisal-dev,zlib1g-dev
packages=$packages,file,git,procps,python3,valgrind,clang-format-14
# .ci/format.sh says that it is absent
[ "$suite" = bookworm ] || packages=$(echo "$packages" | sed s/,clang-format-14//)
if [ ! -e "$root/.complete" ]; then
    rm -rf "$root"
    debootstrap --variant=minbase --include="$packages" "$suite" "$root" "${LGD_MIRROR:-http://deb.debian.org/debian}" \
        || exit 1
    echo "$packages" >"$root/.complete"
fi
mounted=
end() { for m in $mounted; do umount "$m"; done; }
trap end EXIT
trap 'exit 1' INT TERM
bind() {
    mkdir -p "$root$2"
    mount --bind "$1" "$root$2" || exit 1
    mounted="$root$2 $mounted"
}
bind /proc /proc
[ ! -d /sys ] || bind /sys /sys # Open MPI reads it
bind /dev /dev
[ ! -d /dev/pts ] || bind /dev/pts /dev/pts # tests ask on terminals
if [ "$packages" != "$(cat "$root/.complete")" ]; then # made for another list
    cp /etc/resolv.conf "$root/etc/resolv.conf"
    chroot "$root" /usr/bin/env DEBIAN_FRONTEND=noninteractive PATH=/usr/sbin:/usr/bin:/sbin:/bin sh -c \
        'apt-get update -qq && apt-get install -y -qq --no-install-recommends $(echo "$1" | tr , " ")' sh "$packages" \
        || exit 1
    echo "$packages" >"$root/.complete"
fi
if [ -d ../shared ]; then
    bind "$(cd ../shared && pwd -P)" /src/shared
    mount -o remount,bind,ro "$root/src/shared"
fi
# The files as they are here. What is the same there stays as it is, so that make builds the rest alone.
new=$root/src/new old=$root/src/lgd
rm -rf "$new" && mkdir -p "$new" "$old" || exit 1
git ls-files -co --exclude-standard | while read -r f; do [ ! -f "$f" ] || echo "$f"; done |
    tar -cf - --verbatim-files-from -T - | tar -xf - -C "$new" || exit 1
(cd "$old" && find . \( -path './build*' -o -path ./.git \) -prune -o -type f -print) |
    while read -r f; do [ -e "$new/$f" ] || rm "$old/$f"; done
(cd "$new" && find . -type f) | while read -r f; do
    cmp -s "$new/$f" "$old/$f" || { mkdir -p "$old/${f%/*}" && cp -p "$new/$f" "$old/$f" && touch "$old/$f"; }
done
# .ci/format.sh asks git which files there are.
chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin CI=1 LC_ALL=C.UTF-8 \
    sh -c 'cd /src/lgd && git init -q && git add -A && exec "$@"' sh "$@"
