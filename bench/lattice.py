#!/usr/bin/env python3
"""How much more maps repeat with the squares that g writes than with others: lattice.py "FILES"...

FILES is a quoted pattern of maps of lgd-infer. With P a map's mean over 8 x 8 squares of p x p pixels, less its mean,
prints the RMS of P for p = 4 less the mean of those for 3 and 5, its mean and its largest value over the maps
(docs/training-phone.md). Values are those of the files. Needs numpy and Pillow."""
import glob
import sys

import numpy as np
from PIL import Image

from messages import fail, usage

SQUARES = 8


def repeats(value, period):
    side = SQUARES * period
    count = len(value) // side
    value = value[: count * side, : count * side].reshape(count, SQUARES, period, count, SQUARES, period).mean((1, 4))
    value = value - value.mean((1, 3), keepdims=True)
    return np.sqrt((value**2).mean((1, 3))).mean()


def excess(path):
    value = np.asarray(Image.open(path), np.float64)
    value = (value[..., 0] if value.ndim == 3 else value) / (65535 if value.max() > 255 else 255)
    return repeats(value, 4) - (repeats(value, 3) + repeats(value, 5)) / 2


def main():
    if len(sys.argv) < 2:
        usage(__doc__)
    for pattern in sys.argv[1:]:
        rows = [excess(path) for path in sorted(glob.glob(pattern))]
        if not rows:
            fail(f"{pattern}: there is no such file")
        print(f"{pattern} {len(rows)} mean {np.mean(rows):.4f} largest {np.max(rows):.4f}")


main()
