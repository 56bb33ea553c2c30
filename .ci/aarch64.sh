#!/bin/sh
# The build for 64-bit ARM by a cross compiler, run by qemu-user: that the inner loops of the convolution multiply and
# add in registers (FMLA, nothing spilled), and that an estimate, with products that are not fused, is that of x86's
# base path bit for bit. Skipped by name where Debian's crossbuild tools, qemu-user or the libraries are absent:
#   dpkg --add-architecture arm64; apt-get update
#   apt-get install gcc-aarch64-linux-gnu qemu-user
# The libraries need not be installed: they are downloaded and unpacked into build-aarch64/root.
# Usage: .ci/aarch64.sh [PHOTO...]     default: photographs of TESTDATA
cd "$(dirname "$0")/.." || exit 1
: "${TESTDATA:=../shared/testdata}"
skip() { echo "skip aarch64: $*"; exit 0; }
cross=aarch64-linux-gnu
for tool in $cross-gcc $cross-objdump qemu-aarch64 apt-get dpkg python3; do
    command -v $tool >/dev/null || skip "$tool is not installed"
done
[ "$(uname -m)" = x86_64 ] || skip "the machine is no x86-64, whose base path is the measure"
dpkg --print-foreign-architectures | grep -qx arm64 || skip "dpkg does not know arm64"
mkdir -p build-aarch64/debs
root=$(pwd)/build-aarch64/root
# The numbers in the libraries' names differ between releases of Debian: what the -dev packages depend on.
packages=$({ printf '%s:arm64\n' libopenexr-dev libimath-dev libpng-dev libjpeg62-turbo-dev liblcms2-dev \
    libisal-dev zlib1g-dev
    apt-cache depends libopenexr-dev:arm64 libimath-dev:arm64 libpng-dev:arm64 libjpeg62-turbo-dev:arm64 \
        liblcms2-dev:arm64 libisal-dev:arm64 zlib1g-dev:arm64 |
        sed -n 's/^  Depends: \(lib[A-Za-z0-9.+-]*\|zlib1g\)\(:arm64\)*$/\1:arm64/p' |
        grep -E '^(lib(openexr|imath|png|jpeg|lcms|isal)|zlib)'; } | sort -u)
if [ "$packages" != "$(cat "$root/.complete" 2>/dev/null)" ]; then
    (cd build-aarch64/debs && apt-get download -qq $packages 2>/dev/null) ||
        skip "the libraries for arm64 cannot be downloaded"
    for d in build-aarch64/debs/*.deb; do dpkg -x "$d" "$root" || exit 1; done
    echo "$packages" >"$root/.complete"
fi
lib=$root/usr/lib/$cross
build() { # FOLDER CONTRACT
    PKG_CONFIG_LIBDIR=$lib/pkgconfig PKG_CONFIG_SYSROOT_DIR=$root make --no-print-directory BUILD="$1" CONTRACT="$2" \
        CC=$cross-gcc CXX=$cross-g++ AR=$cross-ar OBJCOPY=$cross-objcopy \
        CPPFLAGS="-I$root/usr/include -I$root/usr/include/$cross" \
        LDLIBS="-L$lib -L$root/lib/$cross -Wl,-rpath-link,$lib:$root/lib/$cross" "$1/bin/lgd-infer" "$1/liblgd.a"
}
build build-aarch64/fused fast || exit 1
build build-aarch64/plain off || exit 1
make --no-print-directory programs || exit 1

# A loop is what a branch leads back to. Of each kernel the innermost with the most FMLAs is its inner loop.
$cross-objdump -d --no-show-raw-insn build-aarch64/fused/obj/tensor/kernels/conv.base.o | awk '
    /^[0-9a-f]+ <.*>:$/ { name = $2; gsub(/[<>:]/, "", name); n = 0; next }
    /^ *[0-9a-f]+:\t/ {
        split($0, part, "\t")
        n++
        at[n] = part[1]; gsub(/[ :]/, "", at[n])
        code[n] = part[2]; operands[n] = part[3]
        if (code[n] !~ /^(b|b\..*|cbn?z)$/ || !match(operands[n], /[0-9a-f]+ </)) next
        to = substr(operands[n], RSTART); sub(/ <.*/, "", to)
        for (i = n; i > 0 && at[i] != to; i--) if (i < n && code[i] ~ /^(b|b\..*|cbn?z)$/ && code[i] != "b.eq") break
        if (i == 0 || at[i] != to) next
        fused = spilled = 0
        for (k = i; k <= n; k++) {
            if (code[k] == "fmla") fused++
            if (code[k] ~ /^(ldr|str|ldp|stp|ldur|stur)$/ && operands[k] ~ /^[qsd][0-9]/ &&
                operands[k] ~ /\[sp/) spilled++
        }
        if (fused > most[name]) { most[name] = fused; spills[name] = spilled }
    }
    END {
        for (name in most) if (name ~ /^(tile|sum|near)_8_2$/) {
            found++
            printf "aarch64: %s: %d FMLA in its inner loop, %d spills\n", name, most[name], spills[name]
            if (spills[name] || most[name] < 32) bad = 1
        }
        exit found != 3 || bad
    }' || { echo "FAIL aarch64: the inner loops of the convolution are not FMLA on registers" >&2; exit 1; }

[ $# -gt 0 ] || { [ -d "$TESTDATA/photos" ] ||
    skip "no photograph is given, and $TESTDATA is absent"
    set -- "$TESTDATA"/photos/028.png "$TESTDATA"/photos/h_0231_IMG_0794.jpg; }
T=$(mktemp -d) || exit 1
trap 'rm -rf "$T"' EXIT
options="-q --size 64 --threads 1 --iterations 2 -m models/single.safetensors"
arm()
{
    folder=$1
    shift
    qemu-aarch64 -L /usr/$cross -E LD_LIBRARY_PATH="$lib:$root/lib/$cross" "$folder/bin/lgd-infer" $options "$@" \
        >/dev/null
}
LGD_ISA=base build/bin/lgd-infer $options "$@" -o "$T/x86" >/dev/null && arm build-aarch64/plain "$@" -o "$T/arm" &&
    arm build-aarch64/fused "$@" -o "$T/fused" || { echo "FAIL aarch64: an estimate" >&2; exit 1; }
# The pixels of PNG files: how ISA-L packs them depends on the CPU. Of results.jsonl all but the time.
python3 - "$T/x86" "$T/arm" <<'END' || { echo "FAIL aarch64: the maps are not those of x86's base path" >&2; exit 1; }
import os, re, struct, sys, zlib
def content(path):
    data = open(path, "rb").read()
    if path.endswith(".jsonl"):
        return re.sub(rb'"seconds": [0-9.]+', b"", data)
    if not path.endswith(".png"):
        return data
    at, chunks, packed = 8, [], b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IDAT": packed += data[at + 8:at + 8 + size]
        else: chunks.append((kind, data[at + 8:at + 8 + size]))
        at += size + 12
    return chunks, zlib.decompress(packed)
def files(top):
    return sorted(os.path.relpath(os.path.join(f, n), top) for f, _, names in os.walk(top) for n in names)
a, b = sys.argv[1:]
differ = [n for n in files(a) if n in files(b) and content(os.path.join(a, n)) != content(os.path.join(b, n))]
if differ or files(a) != files(b) or not files(a):
    sys.exit("aarch64: differ: " + " ".join(differ or ["the names of the files"]))
END
echo "ok aarch64: $# photographs as by x86's base path, bit for bit"
