#!/bin/sh
# Installs what the build needs with the system's package manager, as root or through sudo; where that is not possible
# it prints the names of what is missing and ends with 1. On a terminal it asks first, unless YES or CI is set.
# Arguments: the pkg-config modules, help2man.
missing=
optional=
lost=
have() { command -v "$1" >/dev/null 2>&1; }
cc=${CC:-gcc} cxx=${CXX:-g++}
have "${cc%% *}" || missing="$missing gcc" # they may be of two words, such as ccache gcc
have "${cxx%% *}" || missing="$missing g++"
have pkg-config || missing="$missing pkg-config"
for module in "$@"; do
    if [ "$module" = help2man ]; then # manual pages
        have help2man || missing="$missing help2man"
        continue
    fi
    if have pkg-config && pkg-config --exists "$module"; then continue; fi
    case $module in
    OpenImageIO) missing="$missing libopenimageio-dev" ;;
    OpenEXR) missing="$missing libopenexr-dev" ;;
    lcms2) missing="$missing liblcms2-dev" ;; # colour profiles with look-up tables
    libpng) missing="$missing libpng-dev" ;;
    libisal) missing="$missing libisal-dev" ;; # PNG files of maps
    zlib) missing="$missing zlib1g-dev" ;; # nn/weights/zip.c: compressed entries of PyTorch's files
    # train/mpi/mpi.c, and mpirun for its tests
    ompi-c) optional="$optional libopenmpi-dev openmpi-bin" lost="$lost lgd-train under mpirun" ;;
    libjpeg) missing="$missing libjpeg-dev" ;;
    # lgd-infer --sheet and lgd-capture; the rest works without
    apriltag) optional="$optional libapriltag-dev" lost="$lost printed sheets (lgd-infer --sheet)" ;;
    *) echo "deps: no package is known for $module" >&2; exit 1 ;;
    esac
done
# What is optional is installed where that is possible, and otherwise not asked for.
without() { echo "deps: without$optional left out:$lost" >&2; exit 0; }
if [ -z "$missing" ]; then
    [ -z "$optional" ] && exit 0
    have apt-get || without
    if [ "$(id -u)" -ne 0 ] && ! { have sudo && sudo -n true 2>/dev/null; }; then without; fi
fi
if ! have apt-get; then
    echo "deps: missing (Debian's names):$missing; install them with your package manager and run make again" >&2
    exit 1
fi
if [ "$(id -u)" -eq 0 ]; then run=
elif have sudo && sudo -n true 2>/dev/null; then run=sudo
elif have sudo && [ -t 0 ]; then run=sudo
else
    echo "deps: missing:$missing; as root: apt-get install$missing" >&2
    exit 1
fi
echo "deps: the build needs these packages, which apt-get installs${run:+ through $run}:$missing$optional" >&2
if [ -t 0 ] && [ -t 2 ] && [ -z "${YES:-}${CI:-}" ]; then
    printf 'deps: Enter installs them, Ctrl-C ends (make YES=1 does not ask) ' >&2
    read -r _ || exit 1
fi
export DEBIAN_FRONTEND=noninteractive
get() { $run apt-get install -y -qq --no-install-recommends "$@" >&2; }
if $run apt-get update -qq >&2 && { [ -z "$missing" ] || get $missing; }; then
    [ -z "$optional" ] || get $optional || without
    exit 0
fi
[ -z "$missing" ] && without
echo "deps: could not install$missing (no network?); install them and run make again" >&2
exit 1
