#!/usr/bin/env python3
"""Which map a capture's error is in: exchange.py CAPTURES ESTIMATES

CAPTURES holds folders in MaterialGAN's layout with the maps that others made of all pictures (materialgan_tex.jpg),
ESTIMATES a folder NAME/STEM of lgd-infer for each, with maps.exr. Prints the render RMSE of docs/real.md of the
estimates, of the estimates with some maps of the others in place of their own (d diffuse, s specular, r roughness,
n normal), and with the others' normals but for what is finer than a sigma in pixels; and k: pictures over renderings
of the others' maps go with the k-th power of the cosine of the angle with the camera's axis. Needs numpy, Pillow,
scipy and OpenEXR."""
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

from maps import read
from messages import fail, usage
from shading import PLACE, SIDE, radiance, unit, upright

EXCHANGED = "d s r n dn sr dsr srn dsrn".split()
SIGMAS = 2, 12, 80


def numbers(path):
    return np.array([[float(x) for x in line.replace(",", " ").split()] for line in open(path) if line.strip()])


def capture(folder):
    """Encoded pictures, cameras and lights in patch widths; first the picture nearest to the sample's axis."""
    side = numbers(folder / "image_size.txt").flat[0]
    cameras, lights = numbers(folder / "camera_pos.txt") / side, numbers(folder / "light_pos.txt") / side
    first = int(np.argmin(np.hypot(cameras[:, 0], cameras[:, 1])))
    order = [first] + [i for i in range(len(cameras)) if i != first]
    pictures = [np.asarray(Image.open(folder / f"{i:02d}.png").convert("RGB"), np.float64) / 255 for i in order]
    return pictures, cameras[order], lights[order]


def others(folder):
    image = np.asarray(Image.open(folder / "materialgan_tex.jpg").convert("RGB"), np.float64) / 255
    half = len(image) // 2
    normal = image[:half, :half] * 2 - 1
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    full = {"n": normal[..., :2], "d": image[:half, half:] ** 2.2, "s": image[half:, :half] ** 2.2}
    full["r"] = image[half:, half:, :1] ** 2.2
    k = half // SIDE
    return {name: v.reshape(SIDE, k, SIDE, k, -1).mean((1, 3)) for name, v in full.items()}


def render(maps, camera, light):
    normal = upright(maps["n"][..., 0], maps["n"][..., 1])
    return radiance(normal, maps["d"], maps["r"], maps["s"], camera, light)


def error(picture, rendered, factor):
    return np.sqrt(((np.clip(rendered * factor, 0, 1) ** (1 / 2.2) - picture) ** 2).mean())


def score(maps, pictures, cameras, lights):
    """The factor is the one that makes the first rendering most like the first picture."""
    first = render(maps, cameras[0], lights[0])
    stops = np.arange(-10, 14, 0.5)
    for step in (0.05, 0.005):
        best = min(stops, key=lambda s: error(pictures[0], first, 2**s))
        stops = np.arange(best - 10 * step, best + 10.5 * step, step)
    factor = 2 ** min(stops, key=lambda s: error(pictures[0], first, 2**s))
    seen = zip(pictures[1:], cameras[1:], lights[1:])
    return np.mean([error(picture, render(maps, camera, light), factor) for picture, camera, light in seen])


def smooth(v, sigma):
    return np.stack([gaussian_filter(v[..., k], sigma, mode="nearest") for k in (0, 1)], -1)


def falloff(maps, pictures, cameras, lights):
    """By least squares over the logarithms of what is neither dark nor burnt out, a factor free for each picture."""
    product = square = 0
    for picture, camera, light in zip(pictures, cameras, lights):
        seen = (picture.max(-1) < 0.9) & (picture.min(-1) > 0.05)
        cosine = np.log((unit(PLACE - camera) @ unit(-camera))[seen])
        left = np.log((picture**2.2).mean(-1)[seen] / np.maximum(render(maps, camera, light).mean(-1)[seen], 1e-4))
        cosine, left = cosine - np.median(cosine), np.clip(left - np.median(left), -1.5, 1.5)
        product, square = product + cosine @ left, square + cosine @ cosine
    return product / square


def main():
    if len(sys.argv) != 3:
        usage(__doc__)
    captures, estimates = map(Path, sys.argv[1:])
    folders = [path.parent for path in sorted(captures.glob("*/materialgan_tex.jpg"))]
    if not folders:
        fail(f"{captures}: there is no */materialgan_tex.jpg in it")
    found = [next((estimates / folder.name).glob("*/maps.exr"), None) for folder in folders]
    if None in found:
        fail(f"{estimates / folders[found.index(None)].name}: there is no */maps.exr in it")
    titles = ["own", *EXCHANGED, *(f"n/{s}" for s in SIGMAS), "k"]
    print(f"{'':26}" + "".join(f"{t:>8}" for t in titles))
    table = []
    for folder, path in zip(folders, found):
        scene, own, other = capture(folder), read(path), others(folder)
        tried = [own] + [own | {k: other[k] for k in which} for which in EXCHANGED]
        tried += [own | {"n": own["n"] - smooth(own["n"], s) + smooth(other["n"], s)} for s in SIGMAS]
        table.append([*(score(maps, *scene) for maps in tried), falloff(other, *scene)])
        print(f"{folder.name:26}" + "".join(f"{x:8.4f}" for x in table[-1]))
    print(f"{'mean':26}" + "".join(f"{x:8.4f}" for x in np.mean(table, 0)))


main()
