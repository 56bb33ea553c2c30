#!/usr/bin/env python3
"""Writes tests/data/scikit_values.h: what scikit-image's transform.resize makes of small pictures, for
tests/data/test_resize_scikit.c.

    python3 tests/data/make_scikit.py > tests/data/scikit_values.h        needs scikit-image (pip install scikit-image);
    0.20 and 0.26 give the same

The pictures are a formula's, byte i of the picture being bits 24 to 31 of i * 2654435761 mod 2^32, so that the test can
make them too."""
import numpy
import skimage
from skimage.transform import resize

CASES = [(23, 7), (40, 11), (30, 4), (7, 2), (3, 1), (1, 3), (2, 5), (5, 13), (16, 16), (9, 8)]
LARGE, LARGE_TO, STEP = 1001, 256, 4099


def picture(side):
    i = numpy.arange(side * side * 3, dtype=numpy.uint64)
    return (((i * 2654435761) % 2**32) >> 24).astype(numpy.float64).reshape(side, side, 3) / 255


def values(numbers):
    return ",\n    ".join(", ".join(f"{v:.8e}f" for v in numbers[i : i + 8]) for i in range(0, len(numbers), 8))


print(f"/* Made by tests/data/make_scikit.py with scikit-image {skimage.__version__}: do not edit. */")
print("static const struct {\n    int from, to;\n} scikit_cases[] = {" + 
    ", ".join(f"{{{a}, {b}}}" for a, b in CASES) + "};")
flat = numpy.concatenate([resize(picture(a), (b, b)).ravel() for a, b in CASES])
print(f"/* [case][to][to][3] */\nstatic const float scikit_values[] = {{\n    {values(flat)}}};")
print(f"/* Every {STEP}th value of {LARGE} x {LARGE} to {LARGE_TO} x {LARGE_TO}. */")
print(f"enum {{ SCIKIT_LARGE = {LARGE}, SCIKIT_LARGE_TO = {LARGE_TO}, SCIKIT_STEP = {STEP} }};")
print(f"static const float scikit_large[] = {{\n"
    f"    {values(resize(picture(LARGE), (LARGE_TO, LARGE_TO)).ravel()[::STEP])}}};")
