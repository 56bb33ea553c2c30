#!/usr/bin/env python3
"""How photographs are exposed: brightness.py NAME=FILES...

FILES is a quoted pattern of sRGB images; of one whose width is a multiple of its height the first square is read.
Prints the 5, 25, 50, 75 and 95% quantiles of the linear mean, and of the share of pixels of which a channel is burnt
out (docs/materials.md). Needs numpy and Pillow."""
import glob
import sys

import numpy as np
from PIL import Image

from messages import fail, usage

SIDE, QUANTILES = 128, (0.05, 0.25, 0.5, 0.75, 0.95)


def measure(path):
    image = Image.open(path).convert("RGB")
    if image.width % image.height == 0:
        image = image.crop((0, 0, image.height, image.height))
    srgb = np.asarray(image.resize((SIDE, SIDE), Image.Resampling.BOX), float) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return linear.mean(), (srgb.max(-1) > 0.99).mean()


def main():
    sets = [argument.split("=", 1) for argument in sys.argv[1:]]
    for _, pattern in sets:
        if not glob.glob(pattern):
            fail(f"{pattern}: no such file")
    print(f"{'':12}{'images':>7}  linear mean, quantiles               burnt out, quantiles")
    for name, pattern in sets:
        found = np.array([measure(path) for path in sorted(glob.glob(pattern))])
        mean, burnt = np.quantile(found, QUANTILES, axis=0).T
        print(f"{name:12}{len(found):7}  " + " ".join(f"{x:.3f}" for x in mean) + "   " +
              " ".join(f"{x:.3f}" for x in burnt))


if __name__ == "__main__":
    if len(sys.argv) < 2 or any("=" not in a for a in sys.argv[1:]):
        usage(__doc__)
    main()
