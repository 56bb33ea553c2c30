"""The BRDF under a point light (docs/math.md, M1 to M5) on a patch of SIDE pixels a side, for scripts beside it."""
import numpy as np

SIDE = 256
rows, columns = np.mgrid[0:SIDE, 0:SIDE]
PLACE = np.stack([(columns + 0.5) / SIDE - 0.5, 0.5 - (rows + 0.5) / SIDE, 0 * rows], -1)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def dot(a, b):
    return (a * b).sum(-1, keepdims=True)


def upright(x, y):
    """Unit normals of these x and y, whose z is above 0."""
    return unit(np.stack([x, y, np.sqrt(np.maximum(1 - x * x - y * y, 1e-4))], -1))


def encoded(x):
    """Linear values as sRGB, clamped."""
    x = np.clip(x, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)


def radiance(normal, diffuse, roughness, specular, camera, light):
    """Linear, of a light of power 1; maps [SIDE, SIDE, 3] but for roughness [SIDE, SIDE, 1], places in patch widths."""
    to_light = light - PLACE
    l, v = unit(to_light), unit(camera - PLACE)
    h = unit(l + v)
    alpha = np.maximum(roughness, 0.02) ** 2
    k = alpha / 2
    nl, nv, vh = np.maximum(dot(normal, l), 0), np.maximum(dot(normal, v), 1e-3), dot(v, h)
    d = alpha**2 / (np.pi * (dot(normal, h) ** 2 * (alpha**2 - 1) + 1) ** 2)
    g = 1 / ((nl * (1 - k) + k) * (nv * (1 - k) + k))
    f = specular + (1 - specular) * 2 ** ((-5.55473 * vh - 6.98316) * vh)
    return ((1 - specular) * diffuse / np.pi + d * g * f / 4) * nl / dot(to_light, to_light)
