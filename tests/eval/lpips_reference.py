#!/usr/bin/env python3
"""LPIPS (version 0.1, AlexNet) of formula pictures with formula weights, evaluated by PyTorch in float64: what
tests/eval/lpips_reference.txt holds and tests/eval/test_lpips.c is compared with. Needs torch and numpy. Usage:
lpips_reference.py >tests/eval/lpips_reference.txt

A tensor's numbers: number i of the tensor called NAME is u in [-1, 1) of splitmix64 at fnv1a64(NAME) + i *
0x9E3779B97F4A7C15 (its upper 24 bits), times sqrt(6 / fan_in) for convolutions, 0.1 for biases; |u| for the heads.
Picture NAME of h x w: clamp(0.5 + 0.35 cos(0.07 x + 0.11 y + c) + 0.25 u, 0, 1), c the channel, u in the order [h, w,
3]."""
import numpy as np, torch
import torch.nn.functional as F

def uniform(name, n):
    h = 0xcbf29ce484222325
    for b in name.encode(): h = (h ^ b) * 0x100000001b3 & 0xffffffffffffffff
    with np.errstate(over='ignore'):
        z = np.uint64(h) + np.arange(n, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ z >> np.uint64(30)) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ z >> np.uint64(27)) * np.uint64(0x94D049BB133111EB)
        z = z ^ z >> np.uint64(31)
    return (z >> np.uint64(40)).astype(np.float64) / 2**23 - 1

def tensor(name, shape, scale):
    numbers = np.float32(scale) * uniform(name, int(np.prod(shape))).astype(np.float32)
    return torch.from_numpy(numbers.astype(np.float64)).reshape(shape)

layers = [(0, 3, 64, 11, 4, 2, False), (3, 64, 192, 5, 1, 2, True), (6, 192, 384, 3, 1, 1, True),
    (8, 384, 256, 3, 1, 1, False), (10, 256, 256, 3, 1, 1, False)]
net = []
for l, (n, i, o, k, s, p, pool) in enumerate(layers):
    net.append((tensor('features.%d.weight' % n, (o, i, k, k), (6 / (i * k * k)) ** .5),
        tensor('features.%d.bias' % n, (o,), .1), s, p, pool,
                tensor('lin%d.model.1.weight' % l, (1, o, 1, 1), 1).abs()))

def picture(name, h, w):
    u = uniform(name, h * w * 3).astype(np.float32).reshape(h, w, 3).astype(np.float64)
    y, x, c = np.meshgrid(np.arange(h), np.arange(w), np.arange(3), indexing='ij')
    v = np.clip(.5 + .35 * np.cos(.07 * x + .11 * y + c) + .25 * u, 0, 1).astype(np.float32)
    return torch.from_numpy(v.astype(np.float64)).permute(2, 0, 1)[None]

def taps(v):
    shift = torch.tensor([-.030, -.088, -.188]).double().reshape(1, 3, 1, 1)
    scale = torch.tensor([.458, .448, .450]).double().reshape(1, 3, 1, 1)
    v = (2 * v - 1 - shift) / scale
    for weight, bias, s, p, pool, _ in net:
        if pool: v = F.max_pool2d(v, 3, 2)
        v = F.relu(F.conv2d(v, weight, bias, s, p))
        yield v

print('# made by tests/eval/lpips_reference.py: height, width, the five terms')
for h, w in ((31, 31), (64, 64), (47, 83), (128, 96), (256, 256)):
    terms = []
    for fa, fb, n in zip(taps(picture('a', h, w)), taps(picture('b', h, w)), net):
        d = [f / (f.pow(2).sum(1, keepdim=True).sqrt() + 1e-10) for f in (fa, fb)]
        terms.append(F.conv2d((d[0] - d[1]) ** 2, n[5]).mean().item())
    print(h, w, *('%.12e' % t for t in terms))
