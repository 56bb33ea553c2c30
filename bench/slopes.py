#!/usr/bin/env python3
"""How far materials are from flat: slopes.py NAME=FILES[:PANEL]...

FILES is a quoted pattern of normal maps (y up or down), or of images of square panels of which number PANEL, from 0,
is one; a PANEL of q is the upper left quarter. Prints the medians of a patch's mean slope and of the RMS slope below 2,
and from 2 to 8, 8 to 32 and 32 to 64 cycles a patch, at 128 x 128 pixels (docs/materials.md). Needs numpy and
Pillow."""
import numpy as np
from PIL import Image

from sets import cut, sets

SIDE = 128
BANDS = (0.5, 2), (2, 8), (8, 32), (32, 64)


def slopes(path, panel):
    image = np.asarray(Image.open(path).convert("RGB"), np.float32) / 255
    if panel == "q":
        image = image[: image.shape[0] // 2, : image.shape[1] // 2]
    elif panel:
        image = cut(image, path, panel)
    normal = image * 2 - 1
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
    slope = normal[..., :2] / np.maximum(normal[..., 2:], 0.1)
    k = len(slope) // SIDE
    return slope[: k * SIDE, : k * SIDE].reshape(SIDE, k, SIDE, k, 2).mean((1, 3))


def row(path, panel):
    slope = slopes(path, panel)
    mean = slope.mean((0, 1))
    power = np.abs(np.fft.fft2(slope - mean, axes=(0, 1)) / SIDE**2) ** 2
    cycles = np.fft.fftfreq(SIDE, 1 / SIDE)
    cycles = np.hypot(cycles[:, None], cycles)
    return [np.hypot(*mean)] + [np.sqrt(power[(cycles >= lo) & (cycles < hi)].sum() / 2) for lo, hi in BANDS]


def main():
    for name, paths, panel in sets(__doc__):
        print(f"{name} {len(paths)}", *(f"{v:.3f}" for v in np.median([row(p, panel) for p in paths], axis=0)))


main()
