#!/usr/bin/env python3
"""A published suite under our own light: relight.py SUITE OUT

SUITE is a folder of lgd-eval's peers: (docs/real.md). Places of light and camera and the light's power are fitted to
each photograph, given the true maps (docs/math.md, M1 to M5). OUT/default, OUT/power, OUT/place and OUT/both get the
suite with other photographs: rendered from the true maps under the default camera, with the fitted power, from the
fitted places, and both; lgd-eval --set peers:OUT/... says what of an error is the camera's (docs/training-phone.md).
Needs numpy, Pillow and scipy."""
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.optimize import least_squares

from messages import fail, usage
from shading import SIDE, encoded, radiance, unit

DISTANCE = 250 / 256
POWER = 329288 / SIDE**2 / DISTANCE**2  # over the distance's square
STARTS = [(d, x, y) for d in (1, 2) for x, y in ((0, 0), (0.2, 0.2), (-0.2, 0.2), (0.2, -0.2), (-0.2, -0.2))]


def panels(path):
    image = np.asarray(Image.open(path).convert("RGB"), np.float64) / 255
    photo, normal, diffuse, roughness, specular = (image[:, i * SIDE : (i + 1) * SIDE] for i in range(5))
    return photo, (unit(normal * 2 - 1), diffuse, roughness[..., :1], specular)


def render(maps, camera, light, power):
    """Encoded as sRGB; power is over the distance's square, of a light as far as the camera."""
    return encoded(radiance(*maps, camera, light) * power * light[2] ** 2)


def places(t):
    distance = np.exp(t[0])
    return np.array([t[1], t[2], distance]), np.array([t[3], t[4], distance])


def fit(photo, maps):
    def residual(t):
        return (render(maps, *places(t), np.exp(t[5])) - photo)[::4, ::4].ravel()

    starts = ([np.log(d), 0, 0, x, y, np.log(8)] for d, x, y in STARTS)
    fits = (least_squares(residual, start, loss="soft_l1", f_scale=0.05) for start in starts)
    return min(fits, key=lambda fitted: fitted.cost).x


def main():
    if len(sys.argv) != 3:
        usage(__doc__)
    paths = sorted(Path(sys.argv[1]).glob("*.png"))
    if not paths:
        fail(f"{sys.argv[1]}: there is no *.png in it")
    straight = np.array([0, 0, DISTANCE])
    for path in paths:
        photo, maps = panels(path)
        t = fit(photo, maps)
        error = np.sqrt(np.mean((render(maps, *places(t), np.exp(t[5])) - photo) ** 2))
        found = f"power {np.exp(t[5]) / POWER:.2f}, distance {np.exp(t[0]):.2f}, RMSE {error:.3f}"
        print(f"{path.name}: {found}", flush=True)
        for name, (camera, light), power in (
            ("default", (straight, straight), POWER),
            ("power", (straight, straight), np.exp(t[5])),
            ("place", places(t), POWER),
            ("both", places(t), np.exp(t[5])),
        ):
            image = Image.open(path).convert("RGB")
            rendered = render(maps, camera, light, power)
            image.paste(Image.fromarray((rendered * 255 + 0.5).astype(np.uint8)), (0, 0))
            folder = Path(sys.argv[2]) / name
            folder.mkdir(parents=True, exist_ok=True)
            image.save(folder / path.name)


main()
