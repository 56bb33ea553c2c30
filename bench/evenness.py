#!/usr/bin/env python3
"""How much the diffuse colour of materials varies over a patch: evenness.py NAME=FILES[:PANEL]...

FILES is a quoted pattern of diffuse maps (sRGB), or of images of square panels of which number PANEL, from 0, is one,
in linear light; a PANEL of q is the upper right quarter, v^(1/2.2). Prints quarter, median and three quarters of the
RMS of the logarithm of the mean colour, from .4 to 1.6 and from 1.6 to 4 cycles a patch, mirrored at its borders, at
128 x 128 pixels (docs/materials.md). Needs numpy and Pillow."""
import numpy as np
from PIL import Image

from sets import cut, sets

SIDE = 128
DARKEST = 0.004
BANDS = (0.4, 1.6), (1.6, 4)


def linear(path, panel):
    image = np.asarray(Image.open(path).convert("RGB"), np.float32) / 255
    if panel == "q":
        half = image.shape[0] // 2
        return image[:half, half:] ** 2.2
    if panel:
        return cut(image, path, panel)
    return np.where(image <= 0.04045, image / 12.92, ((image + 0.055) / 1.055) ** 2.4)


def row(path, panel):
    mean = linear(path, panel).mean(-1)
    k = len(mean) // SIDE
    mean = mean[: k * SIDE, : k * SIDE].reshape(SIDE, k, SIDE, k).mean((1, 3))
    value = np.log(np.maximum(mean, DARKEST))
    value = np.pad(value - value.mean(), ((0, SIDE), (0, SIDE)), "symmetric")
    power = np.abs(np.fft.fft2(value) / value.size) ** 2
    cycles = np.fft.fftfreq(2 * SIDE, 1 / SIDE)
    cycles = np.hypot(cycles[:, None], cycles)
    return [np.sqrt(power[(cycles >= lo) & (cycles < hi)].sum()) for lo, hi in BANDS]


def main():
    for name, paths, panel in sets(__doc__):
        rows = np.percentile([row(p, panel) for p in paths], [25, 50, 75], axis=0)
        print(f"{name} {len(paths)}", *("%.3f %.3f %.3f;" % tuple(band) for band in rows.T))


main()
