#!/usr/bin/env python3
"""The field of view that is guessed of plain samples: view_guess.py MATERIALS [DEGREES]

MATERIALS holds folders of lgd-data with maps.exr of 256 x 256 pixels. Each is rendered at DEGREES (30) across the
square (docs/math.md, M1 to M5), as bright for all: as it is, then flat with an F0 of .04 and one roughness (.2, .35,
.5, .65, .8), so that its picture is in the diffuse colour alone. Prints the quartiles of what lgd-infer, of the PATH,
with the model of LGD_MODEL, guesses, in degrees. Needs numpy, Pillow and OpenEXR."""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

from messages import fail, usage
from shading import SIDE, radiance, unit

ROUGHNESSES = 0.2, 0.35, 0.5, 0.65, 0.8
MEDIAN = 0.16  # of the pictures


def read(path):
    with OpenEXR.File(str(path)) as file:
        c = {k: v.pixels.astype(np.float64) for k, v in file.channels().items()}
    x, y = c["normal.X"], c["normal.Y"]
    normal = unit(np.stack([x, y, np.sqrt(np.maximum(1 - x * x - y * y, 1e-4))], -1))
    return normal, c["diffuse"], c["roughness.Y"][..., None], c["specular"]


def write(maps, place, path):
    x = radiance(*maps, place, place)
    x = np.clip(x * MEDIAN / np.median(x.mean(-1)), 0, 1)
    x = np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)
    Image.fromarray((x * 255 + 0.5).astype(np.uint8)).save(path)


def guesses(folder, out):
    command = ["lgd-infer", "-q", "--maps", "roughness", "-o", out, folder]
    run = subprocess.run(command, capture_output=True, text=True)
    if run.returncode:
        fail(run.stderr.strip())
    texts = [path.read_text() for path in Path(out).glob("*/meta.txt")]
    return [float(re.search(r"field of view: ([\d.]+)", text).group(1)) for text in texts]


def main():
    if len(sys.argv) not in (2, 3):
        usage(__doc__)
    paths = sorted(Path(sys.argv[1]).glob("*/maps.exr"))
    if not paths:
        fail(f"{sys.argv[1]}: there is no */maps.exr in it")
    degrees = float(sys.argv[2]) if len(sys.argv) == 3 else 30
    place = np.array([0, 0, 0.5 / np.tan(np.radians(degrees / 2))])
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("own", *ROUGHNESSES):
            pictures = Path(folder) / f"{kind}"
            pictures.mkdir()
            for path in paths:
                normal, diffuse, roughness, specular = read(path)
                if diffuse.shape != (SIDE, SIDE, 3):
                    fail(f"{path}: has not {SIDE} x {SIDE} pixels")
                if kind != "own":
                    normal = normal * 0 + (0, 0, 1)
                    diffuse, roughness, specular = diffuse + 1e-4, roughness * 0 + kind, specular * 0 + 0.04
                write((normal, diffuse, roughness, specular), place, pictures / f"{path.parent.name}.png")
            low, middle, high = np.percentile(guesses(pictures, f"{pictures}-maps"), (25, 50, 75))
            print(f"{kind:>5}: {low:.1f} {middle:.1f} {high:.1f}", flush=True)


main()
