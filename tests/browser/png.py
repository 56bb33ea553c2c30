"""PNG files of 8 or 16 bits a channel, not interlaced, as rows of bytes; without libraries.

png.py FILE... prints a checksum of each as sha256sum does: of a PNG that of its pixels, of others of their bytes."""
import hashlib
import struct
import sys
import zlib


def read(path):
    """(width, height, bytes of a pixel, rows)."""
    data = open(path, "rb").read()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", path + ": not a PNG"
    at, stream = 8, b""
    while at < len(data):
        n, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + n]
        if kind == b"IHDR":
            width, height, bits, colours, _, _, interlaced = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            stream += body
        at += 12 + n
    assert bits in (8, 16) and not interlaced and colours in (0, 2, 6), path + ": not the kind that is read here"
    channels = {0: 1, 2: 3, 6: 4}[colours] * bits // 8
    raw, stride, rows, above = zlib.decompress(stream), width * channels, [], bytes(width * channels)
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left, up = line[i - channels] if i >= channels else 0, above[i]
            corner = above[i - channels] if i >= channels else 0
            if kind == 1:
                line[i] = line[i] + left & 255
            elif kind == 2:
                line[i] = line[i] + up & 255
            elif kind == 3:
                line[i] = line[i] + (left + up) // 2 & 255
            elif kind == 4:
                guess = left + up - corner
                a, b, c = abs(guess - left), abs(guess - up), abs(guess - corner)
                line[i] = line[i] + (left if a <= b and a <= c else up if b <= c else corner) & 255
        rows.append(bytes(line))
        above = line
    return width, height, channels, rows


def rmse(a, b):
    """Of two files' first three channels of 8 bits, values in 0 .. 1. Both have one size."""
    (w, h, n, rows), (w2, h2, n2, rows2) = read(a), read(b)
    assert (w, h) == (w2, h2), "%s is %d x %d, %s %d x %d" % (a, w, h, b, w2, h2)
    total = sum((r[x * n + c] - s[x * n2 + c])**2 for r, s in zip(rows, rows2) for x in range(w) for c in range(3))
    return (total / (3 * w * h))**0.5 / 255


def checksum(path):
    if not path.endswith(".png"):
        return hashlib.sha256(open(path, "rb").read()).hexdigest()
    width, height, size, rows = read(path)
    return hashlib.sha256(b"%d %d %d\n" % (width, height, size) + b"".join(rows)).hexdigest()


if __name__ == "__main__":
    for name in sys.argv[1:]:
        print(checksum(name), name, sep="  ")
