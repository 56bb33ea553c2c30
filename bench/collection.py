#!/usr/bin/env python3
"""Map folders of the textures in Debian packages, for data.collection: collection.py OUT PACKAGE.deb...

Takes colours that have a normal map beside them (NAME.png and NAME_norm.png, for instance), also from the archives in a
package, if the package's copyright file gives each of them one of the licences below. OUT/sources.tsv has the source
and the licence of each. Games say nothing of metal, and of gloss little: roughness gets a level by chance, and what
varies is the gloss map or else the colours' luminance; albedos are a fifth to all of what is stored, by chance too, and
most of the grey ones get a colour. The same packages give the same files. Needs numpy, Pillow, scipy and dpkg-deb."""
import colorsys
import hashlib
import io
import os
import re
import subprocess
import sys
import tempfile
import zipfile
import zlib
from fnmatch import fnmatchcase

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

from messages import fail, usage

SIDE = 512
LICENCES = re.compile(r"(CC-?0|CC-BY|CC-BY-SA|public-domain|Expat|MIT|zlib)(-[\d.]+\+?)?", re.I)
IMAGE = re.compile(r"\.(png|jpg|jpeg|tga|dds)$", re.I)
NORMAL = "_norm _normal _normals _normalmap _nrm _nm _n _local _nmap -normal -norm".split()
GLOSS = "_gloss _spec _specular _s _gm _sm _glossiness".split()
COLOUR = ["", "_d", "_diff", "_diffuse", "_c", "_color", "_albedo"]
# What is no surface that lies flat in the picture: models, skies, water, plants, lights, signs.
OTHER = re.compile(
    r"/karts/|/skybox|/gui/|/skins/|/props/|/ui/|actors|weapons|vanities|flame|glass|light|sky|water|lava|leaf|leaves|"
    r"glow|foliage|_fx|vegetation|caustic|particle|blendbrush|crosshair|sara|tree_|window|monitor|screen|computer|"
    r"server|clock|/nieb/|sign"
)
WEIGHTS = np.array([0.2126, 0.7152, 0.0722], np.float32)  # of luminance
METAL = re.compile(r"metal|steel|iron|pipe|grate|alu|copper|brass|gold|chrome")


def licences(root):
    """Pairs of patterns and licence, in the order of the copyright file (DEP-5): the last that fits holds."""
    rules = []
    folder = os.path.join(root, "usr/share/doc")
    for name in os.listdir(folder):
        path = os.path.join(folder, name, "copyright")
        if not os.path.exists(path):
            continue
        with open(path, errors="replace") as file:
            text = file.read()
        for paragraph in re.split(r"\n\s*\n", text):
            files = re.search(r"^Files:(.*(?:\n[ \t].*)*)", paragraph, re.M)
            licence = re.search(r"^License:[ \t]*(.*)", paragraph, re.M)
            if files and licence:
                rules.append((files[1].split(), licence[1].strip()))
    return rules


def fits(pattern, path):
    """Either may begin farther up: the pattern in the source, the path in the package."""
    return fnmatchcase("/" + path, "*/" + pattern) or pattern.endswith("/" + path)


def licence_of(rules, path):
    fitting = [licence for patterns, licence in rules if any(fits(p, path) for p in patterns)]
    return fitting[-1] if fitting else ""


def allows(licence):
    """Whether all of what is joined by and, or one of what is joined by or, is in LICENCES."""
    return any(all(LICENCES.fullmatch(t) for t in re.split(r",? and ", s)) for s in re.split(r",? or ", licence))


def images(root):
    """Path (as in the package, or in an archive of it) and a function that gives the bytes."""
    for folder, _, names in os.walk(root):
        for name in names:
            path = os.path.join(folder, name)
            if IMAGE.search(name):
                yield os.path.relpath(path, root), lambda path=path: open(path, "rb").read()
            elif name.endswith((".zip", ".pk3")):
                archive = zipfile.ZipFile(path)
                for inside in archive.namelist():
                    if IMAGE.search(inside):
                        yield inside, lambda a=archive, i=inside: a.read(i)


def stem(path):
    """The path without its extensions, in small letters."""
    return re.sub(r"(\.(png|jpg|jpeg|tga|dds|cached))+$", "", path.lower())


def with_suffix(found, base, suffixes):
    return next((found[base + s] for s in suffixes if base + s in found), None)


def candidates(root):
    """Colour, normal and gloss (or None), each a path and a function."""
    found = {stem(path): (path, read) for path, read in images(root)}
    for base, colour in sorted(found.items()):
        for ending in COLOUR:
            if not base.endswith(ending):
                continue
            short = base[: len(base) - len(ending)]
            normal = with_suffix(found, short, NORMAL)
            if normal:
                yield colour, normal, with_suffix(found, short, GLOSS)
                break


def opened(image):
    path, read = image
    picture = Image.open(io.BytesIO(read()))
    if picture.mode.startswith("I"):  # 16 bits of grey, which convert() would clip
        picture = Image.fromarray((np.asarray(picture) // 256).astype(np.uint8))
    if picture.mode == "P":
        picture = picture.convert("RGBA")
    # The textures of 0 A.D. (.dds) keep where a player's colour goes in alpha; elsewhere it is a hole.
    clear = picture.mode in ("RGBA", "LA") and not path.endswith(".dds") and np.mean(picture.getchannel("A")) < 250
    return None if clear else picture.convert("RGB")


def square(picture):
    side = min(picture.size)
    return np.asarray(picture.crop((0, 0, side, side)).resize((SIDE, SIDE), Image.LANCZOS), np.float32) / 255


def bends(normals):
    """The correlation of the slopes' derivatives across: 1 for the normals of a relief whose y is up, -1 for down."""
    z = np.maximum(normals[..., 2], 0.2)
    right, down = (gaussian_filter(v / z, 1, mode="wrap") for v in (-normals[..., 0], normals[..., 1]))
    a, b = np.gradient(right, axis=0), np.gradient(down, axis=1)
    return float((a * b).sum() / np.sqrt((a * a).sum() * (b * b).sum() + 1e-12))


def usable(colour, normal):
    a, b = colour.size, normal.size
    return min(a + b) >= 256 and max(a) <= 2 * min(a) and a[0] * b[1] == a[1] * b[0]


def is_relief(normals, luminance):
    length, relief = np.linalg.norm(normals, axis=-1), np.sqrt((normals[..., :2] ** 2).mean())
    flat = relief <= 0.012
    return (
        normals[..., 2].mean() >= 0.5
        and abs(length - 1).mean() <= 0.15
        and abs(normals[..., :2].mean((0, 1))).max() <= 0.25
        and (flat or abs(bends(normals)) >= 0.08)
        and not (flat and luminance.std() < 0.08 * luminance.mean())
    )


def roughness_of(chance, luminance, gloss, metal):
    logarithm = np.log(luminance + 0.003)
    varies, amount = (logarithm - logarithm.mean()) / (logarithm.std() + 1e-6), chance.uniform(-0.07, 0.07)
    if gloss is not None and gloss.std() >= 0.01:
        varies, amount = (gloss - gloss.mean()) / gloss.std(), -chance.uniform(0.02, 0.12)
    level = chance.uniform(0.15, 0.55) if metal else chance.uniform(0.22, 0.85)
    return np.clip(level + amount * np.clip(varies, -3, 3), 0.05, 1)


def tint(chance, linear):
    """A colour of the same luminance for what is grey: games colour such textures when they draw them."""
    hue, saturation, wanted = chance.random(), chance.uniform(0, 0.8), chance.random() < 0.7
    if not wanted or (linear.max(-1) - linear.min(-1)).mean() > 0.08 * linear.max(-1).mean():
        return linear
    colour = np.array(colorsys.hsv_to_rgb(hue, saturation, 1), np.float32) ** 2.2
    return linear * (colour / (colour @ WEIGHTS))


def save(folder, name, values):
    Image.fromarray((np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)).save(os.path.join(folder, name))


def write(folder, path, colour, normals, gloss):
    chance = np.random.default_rng(zlib.crc32(path.encode()))
    linear = colour**2.2
    luminance = linear @ WEIGHTS
    metal = bool(METAL.search(path.lower())) and chance.random() < 0.6
    roughness = roughness_of(chance, luminance, gloss, metal)
    if metal:
        linear = np.clip(linear * (chance.uniform(0.35, 0.7) / max(luminance.mean(), 0.02)), 0, 0.98)
    else:
        linear = tint(chance, linear * (np.exp(chance.uniform(np.log(0.2), 0)) * min(1, 0.7 / luminance.mean())))
    os.makedirs(folder)
    save(folder, "basecolor.png", linear ** (1 / 2.2))
    save(folder, "normal.png", normals * 0.5 + 0.5)
    save(folder, "roughness.png", roughness)
    if metal:
        save(folder, "metallic.png", np.ones((SIDE, SIDE), np.float32))
    with open(os.path.join(folder, "meta.txt"), "w") as file:
        file.write(f"normal: {'OpenGL' if bends(normals) > 0 else 'DirectX'} y\n")


def convert(out, package, root, seen, sources):
    rules = licences(root)
    for colour, normal, gloss in candidates(root):
        path, terms = colour[0], {licence_of(rules, c[0]) for c in (colour, normal)}
        if OTHER.search(path.lower()) or not all(map(allows, terms)):
            continue
        if gloss and not allows(licence_of(rules, gloss[0])):
            gloss = None
        a, b = opened(colour), opened(normal)
        if a is None or b is None or not usable(a, b):
            continue
        digest = hashlib.md5(a.tobytes() + b.tobytes()).digest()
        pixels, normals = square(a), square(b) * 2 - 1
        luminance = (pixels**2.2) @ WEIGHTS
        dark = not 0.004 <= luminance.mean() <= 0.85 or (luminance < 0.0008).mean() > 0.25
        if digest in seen or dark or not is_relief(normals, luminance):
            continue
        seen.add(digest)
        name = f"{len(seen):04d}_" + re.sub(r"\W+", "_", os.path.basename(stem(path)))[:40]
        shiny = opened(gloss) if gloss else None
        write(os.path.join(out, name), path, pixels, normals, None if shiny is None else square(shiny).mean(-1))
        sources.write("\t".join([name, package, path, ", ".join(sorted(terms))]) + "\n")


def unpack(package, root):
    try:
        subprocess.run(["dpkg-deb", "-x", package, root], check=True, stderr=subprocess.PIPE, text=True)
    except FileNotFoundError:
        fail("dpkg-deb is not installed")
    except subprocess.CalledProcessError as error:
        fail(f"{package}: cannot be unpacked: {(error.stderr.strip().splitlines() or ['no reason'])[-1]}")


def collect(out, packages):
    seen = set()
    os.mkdir(out)
    with open(os.path.join(out, "sources.tsv"), "w") as sources:
        for package in packages:
            with tempfile.TemporaryDirectory() as root:
                unpack(package, root)
                before = len(seen)
                convert(out, os.path.basename(package), root, seen, sources)
                print(f"{package}: {len(seen) - before} map folders")


def main():
    if len(sys.argv) < 3:
        usage(__doc__)
    out, packages = sys.argv[1], sys.argv[2:]
    Image.MAX_IMAGE_PIXELS = None
    if os.path.lexists(out):
        fail(f"{out}: is there already")
    for package in packages:
        if not os.path.isfile(package):
            fail(f"{package}: no such file")
    parent = os.path.dirname(os.path.abspath(out))
    os.makedirs(parent, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".", dir=parent) as hidden:  # out appears when it is complete
        collect(os.path.join(hidden, "sets"), packages)
        os.rename(os.path.join(hidden, "sets"), out)


main()
