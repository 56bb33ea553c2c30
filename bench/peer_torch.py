#!/usr/bin/env python3
"""The peers of lgd-bench: our networks and single convolutions in PyTorch, in torch.compile and in OpenVINO
(peer_engines.py), on the CPU. The networks are in peer_networks.py.

Reads jobs from standard input, one a line, and answers each with its median time in seconds (or "-" and a reason):
    threads N
    clock cpu                                    processor time of all threads over their number, in place of wall time
    ENGINE version                               eager, compile or openvino: its name, and nothing to do with time
    ENGINE conv N H W IC OC K DILATION PAD       forward, PAD: zero or replicate
    ENGINE gradient N H W IC OC K DILATION PAD   gradients of input and weights together; eager alone
    ENGINE infer G_WIDTH G_MAX G_LEVELS G_FIRST G_KERNEL G_SIZE H_WIDTH H_GRU CHANNELS RECURRENT T COARSE_T COARSE_SIZE
    COARSE_WIDTH COARSE_GRU SIDE
    ENGINE train (the same up to COARSE_GRU) BATCH PATCH WINDOW FIXED   T 0: g alone; FIXED 1: all but g; H_WIDTH 0: the
    coarse steps alone
    ENGINE guess G_WIDTH G_MAX G_LEVELS G_FIRST G_KERNEL G_SIZE UNSHUFFLE DETAIL TRUNK HALF   g at full detail
    ENGINE train_guess (the same) BATCH          a step of its training
    ENGINE bf16 conv ..., infer ..., train ..., guess ...   the same with the networks in bfloat16
Weights are random: time does not depend on them. Renderer's gradients are included.
"""
import math
import sys
import time

try:
    import torch
    import torch.nn.functional as F
    from torch import nn

    import peer_engines as engines
    from peer_networks import Detailed, Refiner, UNet, padded
except ImportError:
    print("- there is no PyTorch here", flush=True)
    sys.exit(0)


wall, clock, threads = time.perf_counter, time.perf_counter, 1


def median_time(f, least=0.7, most=10.0):
    """Warmed up, at least three runs."""
    f()
    f()
    times, begin = [], wall()
    while len(times) < 3 or wall() - begin < least:
        start = clock()
        f()
        times.append(clock() - start)
        if wall() - begin > most and len(times) >= 2:
            break
    return sorted(times)[len(times) // 2]


class Convolution(nn.Module):
    def __init__(self, ic, oc, k, dilation, pad):
        super().__init__()
        self.conv = nn.Conv2d(ic, oc, k, padding=0 if pad == "replicate" else dilation * (k // 2), dilation=dilation)
        self.border = k, dilation, pad

    def forward(self, x):
        return self.conv(padded(x, *self.border))


def convolution(engine, n, h, w, ic, oc, k, dilation, pad):
    best = math.inf
    for layout in engine.layouts:
        x = torch.randn(n, ic, h, w).contiguous(memory_format=layout)
        with torch.no_grad(), engine.autocast():
            run = engine.module(Convolution(ic, oc, k, dilation, pad).to(memory_format=layout).eval(), [x])
            best = min(best, median_time(lambda: run(x)))
    return best


def gradient(engine, n, h, w, ic, oc, k, dilation, pad):
    if type(engine) is not engines.Eager:
        raise engines.Absent("a convolution's gradients alone are those of eager PyTorch")
    best = math.inf
    for layout in engine.layouts:
        x = torch.randn(n, ic, h, w).contiguous(memory_format=layout).requires_grad_()
        net = Convolution(ic, oc, k, dilation, pad).to(memory_format=layout)
        y = net(x)
        dy = torch.randn_like(y)
        best = min(best, median_time(lambda: torch.autograd.grad(y, (x, net.conv.weight), dy, retain_graph=True)))
    return best


def dot(a, b):
    return (a * b).sum(1, keepdim=True)


def radiance(maps, l, v, strength):
    """f n.l strength of each pixel (render/brdf.h); maps [N, 9.., H, W] in [-1, 1], l and v of length 1."""
    maps = maps.float().clamp(-1, 1)
    xy = maps[:, 3:5]
    n = F.normalize(torch.cat([xy, (1 - (xy * xy).sum(1, keepdim=True)).clamp_min(1e-6).sqrt()], 1), dim=1)
    half = F.normalize(l + v, dim=1)
    n_l, n_v, n_h, v_h = dot(n, l), dot(n, v), dot(n, half), dot(v, half)
    seen = (n_l > 0) & (n_v > 0)
    across = torch.cross(n, half.expand_as(n), dim=1)
    diffuse, specular, rough = (maps[:, 0:3] + 1) / 2, (maps[:, 6:9] + 1) / 2, ((maps[:, 5:6] + 1) / 2).clamp_min(0.01)
    alpha2, k = rough ** 4, rough ** 2 / 2
    d = alpha2 / (math.pi * (alpha2 * n_h * n_h + dot(across, across)) ** 2)
    g = 1 / ((n_l.clamp_min(0) * (1 - k) + k) * (n_v.clamp_min(0) * (1 - k) + k))
    f = specular + (1 - specular) * torch.exp2((-5.55473 * v_h - 6.98316) * v_h)
    return torch.where(seen, ((1 - specular) * diffuse / math.pi + d * f * g / 4) * n_l * strength, torch.zeros(()))


def positions(h, w, side):
    y, x = torch.meshgrid(torch.arange(h), torch.arange(w), indexing="ij")
    return torch.stack([(x + 0.5) / side - 0.5, 0.5 - (y + 0.5) / side, torch.zeros(h, w)])[None]


def flash(maps, place):
    """The flash photograph."""
    to = torch.tensor([0, 0, 250 / 256])[None, :, None, None] - place
    square = (to * to).sum(1, keepdim=True)
    l = to / square.sqrt()
    return radiance(maps, l, l, (329288 / 65536) / square).clamp(0, 1)


def rendered(maps, place, light, camera, near):
    l, v = (light - place, camera - place) if near else (light + 0 * place, camera + 0 * place)
    l, v = F.normalize(l, dim=1), F.normalize(v, dim=1)
    return radiance(maps, l, v, math.pi / l[:, 2:3].clamp_min(1e-3))


def error(maps, image, place):
    return (flash(maps, place) - image).square().sum() / 2


def gradient_of_loss(maps, image, place, rmse):
    r = maps.detach().requires_grad_()
    with torch.enable_grad():
        slope = torch.autograd.grad(error(r, image, place), r)[0]
    return torch.asinh(10 * slope * (1e5 / (3 * 65536) / rmse))


def gradient_of_function(maps, image, place, rmse):
    """The same as torch.compile takes it."""
    return torch.asinh(10 * torch.func.grad(error)(maps.detach(), image, place) * (1e5 / (3 * 65536) / rmse))


class LGD(nn.Module):
    def __init__(self, a):
        super().__init__()
        self.a = a
        self.g = UNet(a["g_width"], a["g_max"], a["g_levels"], a["g_first"], a["g_kernel"], a["channels"])
        self.h = Refiner(a["h_width"], a["h_gru"], a["channels"], a["recurrent"]) if a["h_width"] else None
        self.coarse = Refiner(a["c_width"], a["c_gru"], a["channels"], a["recurrent"]) if a["c_steps"] else None
        self.descent = gradient_of_loss

    def forward(self, whole, image, y0, x0):
        side, size, (h, w) = whole.shape[2], self.a["g_size"], image.shape[2:]
        x = whole if side == size else F.interpolate(whole, size=(size, size), mode="area")
        def seen(maps):
            if side != maps.shape[2]:
                maps = F.interpolate(maps, size=(side, side), mode="bilinear")
            return maps[:, :, y0:y0 + h, x0:x0 + w]

        maps = self.g(2 * torch.log((x + 0.01) / 0.01) / math.log(101) - 1)
        first = seen(maps)
        if self.coarse is not None:
            small = min(self.a["c_size"], side)
            maps, x = (v if v.shape[2] == small else F.interpolate(v, size=(small, small), mode="bilinear")
                for v in (maps, whole))
            maps = refined(self.coarse, self.descent, self.a["c_gru"], self.a["c_steps"], maps, x,
                positions(small, small, small))
        maps = seen(maps)
        place = positions(side, side, side)[:, :, y0:y0 + h, x0:x0 + w]
        return first, refined(self.h, self.descent, self.a["h_gru"], self.a["steps"] - self.a["c_steps"], maps, image,
            place)


def refined(h, descent, gru, steps, maps, image, place):
    if h is None or not steps:
        return maps
    with torch.no_grad():
        rmse = (flash(maps, place) - image).square().mean((1, 2, 3), keepdim=True).sqrt()
    state = [torch.zeros(image.shape[0], gru, *image.shape[2:])] * 2
    for _ in range(steps):
        delta, state = h(torch.cat([maps, descent(maps, image, place, rmse)], 1), state)
        maps = maps + delta
    return maps


NAMES = ["g_width", "g_max", "g_levels", "g_first", "g_kernel", "g_size", "h_width", "h_gru", "channels", "recurrent",
    "steps", "c_steps", "c_size", "c_width", "c_gru"]


def network(words):
    torch.manual_seed(1)
    return LGD(dict(zip(NAMES, map(int, words)))), [int(w) for w in words[len(NAMES):]]


def infer(engine, words):
    best = math.inf
    for layout in engine.layouts:
        net, (side,) = network(words)
        image = torch.rand(1, 3, side, side).contiguous(memory_format=layout)
        with torch.no_grad(), engine.autocast():
            run = engine.network(net.to(memory_format=layout).eval(), gradient_of_function, side)
            best = min(best, median_time(lambda: run(image, image, 0, 0)))
    return best


def training_loss(maps, target, place, light, camera):
    """L1 of the maps and of the logarithms of nine renderings; light and camera [9, N, 3, 1, 1], the first three
    directions."""
    total = (maps - target).abs().mean()
    for i in range(9):
        a, b = rendered(maps, place, light[i], camera[i], i >= 3), rendered(target, place, light[i], camera[i], i >= 3)
        total = total + (torch.log(a + 0.01) - torch.log(b + 0.01)).abs().mean() / 9
    return total


def directions(batch):
    """Lights and cameras of nine views, above the surface."""
    light, camera = torch.randn(9, batch, 3, 1, 1), torch.randn(9, batch, 3, 1, 1)
    light[:, :, 2], camera[:, :, 2] = light[:, :, 2].abs() + 0.3, camera[:, :, 2].abs() + 0.3
    return light, camera


def stepper(engine, net, loss):
    """A step of training."""
    adam = torch.optim.Adam([p for p in net.parameters() if p.requires_grad], 1e-4, fused=True)
    forward = engine.function(loss)

    def step():
        adam.zero_grad(set_to_none=True)
        forward().backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        adam.step()

    return step


def train(engine, words):
    best = math.inf
    for layout in engine.layouts:
        net, (batch, patch, window, fixed) = network(words)
        net = net.to(memory_format=layout)
        net.g.requires_grad_(not fixed)
        if type(engine) is engines.Compiled:
            net.descent = gradient_of_function
        whole = torch.rand(batch, 3, patch, patch).contiguous(memory_format=layout)
        image, place = whole[:, :, :window, :window], positions(window, window, window)
        target = torch.rand(batch, net.a["channels"], window, window) - 0.5
        light, camera = directions(batch)

        def loss():
            with engine.autocast():
                first, last = (maps.float() for maps in net(whole, image, 0, 0))
            total = training_loss(last, target, place, light, camera)
            if net.a["steps"] and not fixed:
                total = total + training_loss(first, target, place, light, camera)
            return total

        best = min(best, median_time(stepper(engine, net, loss)))
    return best


def detailed(words, edge="replicate"):
    torch.manual_seed(1)
    return Detailed(*map(int, words), edge)


def guess(engine, words):
    """R_0 at full detail, how far it may be off, and the scene, of one photograph of which nothing is known."""
    best = math.inf
    for layout in engine.layouts:
        net, size = detailed(words), int(words[5])
        side = size * int(words[6])
        given = [torch.rand(1, 3, side, side).contiguous(memory_format=layout), torch.zeros(1, 8, size, size)]
        with torch.no_grad(), engine.autocast():
            run = engine.module(net.to(memory_format=layout).eval(), given)
            best = min(best, median_time(lambda: run(*given)))
    return best


def laplace(x, scale, target, unit):
    """-log of Laplace's density, but for a constant."""
    scale = scale.clamp(-6, 4)
    return ((x - target).abs() * torch.exp(-scale) / unit + scale).mean()


def train_guess(engine, words):
    best = math.inf
    for layout in engine.layouts:
        *shape, batch = words
        net, size = detailed(shape, engine.edge).to(memory_format=layout), int(shape[5])
        side = size * int(shape[6])
        photo, known = torch.rand(batch := int(batch), 3, side, side), torch.zeros(batch, 8, size, size)
        photo = photo.contiguous(memory_format=layout)
        target, scene, place = torch.rand(batch, 9, side, side) - 0.5, torch.rand(batch, 8), positions(side, side, side)
        light, camera = directions(batch)

        def loss():
            with engine.autocast():
                maps, spread, numbers = (v.float() for v in net(photo, known))
            each = torch.cat([spread[:, [c]] for c in (0, 0, 0, 1, 1, 2, 3, 3, 3)], 1)
            normal = (maps[:, 3:5] - target[:, 3:5]).square().mean((1, 2, 3)).add(1e-6).sqrt().mean()
            return training_loss(maps, target, place, light, camera) + 5 * normal + \
                laplace(maps.detach(), each, target, 0.1) + laplace(numbers[:, :8], numbers[:, 8:], scene, 1)

        best = min(best, median_time(stepper(engine, net, loss)))
    return best


def answer(words):
    global clock, threads
    if words[0] == "threads":
        threads = int(words[1])
        torch.set_num_threads(threads)
        return "0"
    if words[0] == "clock":
        clock = lambda: time.process_time() / threads
        return "0"
    rounded = words[1] == "bf16"
    engine = engines.ENGINES[words[0]](threads, rounded)
    work, *rest = words[1 + rounded:]
    if work == "version":
        return engine.name()
    if work in ("conv", "gradient"):
        return f"{(convolution if work == 'conv' else gradient)(engine, *map(int, rest[:7]), rest[7]):.6g}"
    torch.compiler.reset()
    work = {"infer": infer, "train": train, "guess": guess, "train_guess": train_guess}[work]
    return f"{work(engine, rest):.6g}"


def main():
    for line in sys.stdin:
        if not line.split():
            continue
        try:
            print(answer(line.split()), flush=True)
        except Exception as e:  # a library's: whatever it is, the other engines go on
            print("- " + (str(e).splitlines() or [type(e).__name__])[0], flush=True)


if __name__ == "__main__":
    main()
