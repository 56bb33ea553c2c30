"""Estimates of lgd-data's captures as exchange.py reads them: beside_captures.py CAPTURES MATERIALS

Moves MATERIALS/NAME/maps.exr to NAME/own/ and writes the same maps as those of others, materialgan_tex.jpg. The light
of every picture falls off with the square of the cosine of the angle with the camera's axis."""
import sys
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.insert(0, "bench")
from maps import read
from shading import PLACE, unit, upright

captures, materials = map(Path, sys.argv[1:])
for folder in captures.iterdir():
    own = materials / folder.name / "own"
    own.mkdir()
    (own.parent / "maps.exr").rename(own / "maps.exr")
    m = read(own / "maps.exr")
    normal = upright(m["n"][..., 0], m["n"][..., 1]) / 2 + 0.5
    d, s, r = (np.broadcast_to(m[k], normal.shape) ** (1 / 2.2) for k in "dsr")
    panels = np.concatenate([np.concatenate([normal, d], 1), np.concatenate([s, r], 1)])
    image = Image.fromarray((panels * 255 + 0.5).astype(np.uint8))
    image.save(folder / "materialgan_tex.jpg", quality=98, subsampling=0)
    side = float((folder / "image_size.txt").read_text().split()[0].strip(","))
    for path, line in zip(sorted(folder.glob("0*.png")), (folder / "camera_pos.txt").read_text().splitlines()):
        camera = np.array([float(x) for x in line.replace(",", " ").split()]) / side
        cosine = unit(PLACE - camera) @ unit(-camera)
        darker = np.asarray(Image.open(path)) * cosine[..., None] ** (2 / 2.2)
        Image.fromarray((darker + 0.5).astype(np.uint8)).save(path)
