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
from PIL import Image

from maps import read
from messages import fail, usage
from shading import SIDE, encoded, radiance, upright

ROUGHNESSES = 0.2, 0.35, 0.5, 0.65, 0.8
MEDIAN = 0.16  # of the pictures


def write(maps, place, path):
    x = radiance(*maps, place, place)
    x = encoded(x * MEDIAN / np.median(x.mean(-1)))
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
    text = sys.argv[2] if len(sys.argv) == 3 else "30"
    try:
        degrees = float(text)
    except ValueError:
        degrees = 0
    if not 5 <= degrees <= 120:
        fail(f"{text}: is no angle of 5 to 120 degrees", 2)
    place = np.array([0, 0, 0.5 / np.tan(np.radians(degrees / 2))])
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("own", *ROUGHNESSES):
            pictures = Path(folder) / f"{kind}"
            pictures.mkdir()
            for path in paths:
                maps = read(path)
                normal, diffuse = upright(maps["n"][..., 0], maps["n"][..., 1]), maps["d"]
                roughness, specular = maps["r"], maps["s"]
                if diffuse.shape != (SIDE, SIDE, 3):
                    fail(f"{path}: has not {SIDE} x {SIDE} pixels")
                if kind != "own":
                    normal = normal * 0 + (0, 0, 1)
                    diffuse, roughness, specular = diffuse + 1e-4, roughness * 0 + kind, specular * 0 + 0.04
                write((normal, diffuse, roughness, specular), place, pictures / f"{path.parent.name}.png")
            low, middle, high = np.percentile(guesses(pictures, f"{pictures}-maps"), (25, 50, 75))
            print(f"{kind:>5}: {low:.1f} {middle:.1f} {high:.1f}", flush=True)


main()
