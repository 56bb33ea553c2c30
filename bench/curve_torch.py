#!/usr/bin/env python3
"""lgd-train and PyTorch from the same weights on the same batches: curve_torch.py CONFIG.ini OUT.svg [BUILD]

Draws the training losses, lgd-train's in f32 and bf16, as means of 50 steps, and prints how far they are apart. BUILD:
where the programs are, build. The configuration has whole patches of model.g_size, descent = none and no moving
average."""
import csv
import json
import math
import os
import struct
import subprocess
import sys
import tempfile

from messages import fail, usage

try:
    import torch
except ImportError:
    fail("there is no PyTorch here: make bench-deps installs it")

import peer_torch as peer

MEAN = 50


def configuration(build, config):
    text = subprocess.run([f"{build}/bin/lgd-train", config, "--print-config"], check=True, capture_output=True,
        text=True).stdout
    section, keys = "", {}
    for line in text.splitlines():
        line = line.split("#")[0].strip()
        if line.startswith("["):
            section = line.strip("[]")
        elif "=" in line:
            key, value = (part.strip() for part in line.split("=", 1))
            keys[section + "." + key] = value
    return keys


def tensors(path):
    with open(path, "rb") as f:
        size, = struct.unpack("<Q", f.read(8))
        header = json.loads(f.read(size))
        data = f.read()
    for name, t in header.items():
        if name != "__metadata__":
            begin, end = t["data_offsets"]
            yield name, torch.frombuffer(bytearray(data[begin:end]), dtype=torch.float32).reshape(t["shape"])


def module_of(net, name):
    """Our layer's place in the peer's network: g.down2.conv1, h.gru1.ih, ..."""
    part, layer = name.split(".", 1)
    words = layer.split(".")
    if part == "h":
        h = {"conv1": net.h.conv1, "conv2": net.h.conv2, "output": net.h.out}
        return h[words[0]] if words[0] in h else getattr(getattr(net.h, "cell" + words[0][-1]), words[1])
    if words[0] == "input":
        return net.g.conv if words[1] == "conv" else net.g.glob
    if words[0] == "output":
        return {"conv1": net.g.out1, "conv2": net.g.out2, "add": net.g.add}[words[1]]
    block = (net.g.down if words[0].startswith("down") else net.g.up)[int(words[0].lstrip("downup")) - 1]
    return block.glob if words[1] == "global" else getattr(block, words[1])


def load(net, path):
    left = {name for name, _ in net.named_parameters()}
    names = {id(p): name for name, p in net.named_parameters()}
    with torch.no_grad():
        for name, value in tensors(path):
            layer, kind = name.rsplit(".", 1)
            p = getattr(module_of(net, layer), kind)
            p.copy_(value.reshape(p.shape))
            left.discard(names[id(p)])
    if left:
        fail(f"{path} has nothing for {', '.join(sorted(left))}")


def floats(stream, *shape):
    count = math.prod(shape)
    data = stream.read(4 * count)
    if len(data) < 4 * count:
        fail("the batches end early")
    return torch.frombuffer(bytearray(data), dtype=torch.float32).reshape(shape)


def rate(keys, step):
    peak, floor = float(keys["train.rate"]), float(keys["train.rate_floor"])
    steps, warmup = int(keys["train.steps"]), int(keys["train.warmup"])
    warmup = min(warmup, steps // 2)
    if step < warmup:
        return peak * (step + 1) / warmup
    at = (step - warmup) / max(steps - warmup, 1)
    return peak * (floor + (1 - floor) * 0.5 * (1 + math.cos(math.pi * at)))


def theirs(keys, build, config, weights):
    names = ["g_width", "g_width_max", "g_levels", "g_kernel_first", "g_kernel", "g_size", "h_width", "h_gru",
        "channels", "", "iterations", "coarse_steps", "coarse_size", "coarse_width",
             "coarse_gru"]
    yes = keys["model.recurrent"] == "yes"
    net, _ = peer.network([str(int(yes)) if not n else keys["model." + n] for n in names])
    load(net, weights)
    steps, batch, patch, clip = (int(float(keys[k]))
        for k in ("train.steps", "train.batch", "data.patch", "train.clip"))
    adam = torch.optim.Adam(net.parameters(), 1e-3)
    stream = subprocess.Popen([f"{build}/bin/lgd-bench", "--batches", config], stdout=subprocess.PIPE).stdout
    place, losses = peer.positions(patch, patch, patch), []
    for step in range(steps):
        image = floats(stream, batch, patch, patch, 3).permute(0, 3, 1, 2).contiguous()
        target = floats(stream, batch, patch, patch, 9).permute(0, 3, 1, 2).contiguous()
        views = floats(stream, batch, 9, 2, 3).permute(2, 1, 0, 3)[..., None, None]
        for group in adam.param_groups:
            group["lr"] = rate(keys, step)
        adam.zero_grad(set_to_none=True)
        first, last = net(image, image, 0, 0)
        loss = peer.training_loss(first, target, place, *views) + peer.training_loss(last, target, place, *views)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), clip)
        adam.step()
        losses.append(loss.item())
    return losses


def ours(build, config, folder, precision):
    settings = ["--set", "output.folder=" + folder, "--set", "train.precision=" + precision]
    subprocess.run([f"{build}/bin/lgd-train", config, *settings], check=True, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL)
    with open(folder + "/log.csv") as f:
        return [float(row["loss"]) for row in csv.DictReader(f)]


def draw(path, curves):
    width, height, left, bottom = 760, 360, 60, 40
    means = [[sum(c[i:i + MEAN]) / MEAN for i in range(0, len(c) - MEAN + 1, MEAN)] for c in curves.values()]
    low, high = min(map(min, means)), max(map(max, means))
    steps = len(means[0]) * MEAN
    across = lambda i: left + (i + 0.5) * MEAN / steps * (width - left - 20)
    down = lambda v: 20 + (high - v) / (high - low) * (height - 20 - bottom)
    with open(path, "w") as f:
        f.write(f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
                f'font-family="sans-serif" font-size="12">\n<rect width="100%" height="100%" fill="#fff"/>\n')
        for k in range(6):
            v = low + (high - low) * k / 5
            f.write(f'<line x1="{left}" x2="{width - 20}" y1="{down(v):.1f}" y2="{down(v):.1f}" stroke="#ddd"/>'
                    f'<text x="{left - 6}" y="{down(v) + 4:.1f}" text-anchor="end">{v:.2f}</text>\n')
        for k in range(0, steps + 1, steps // 4):
            f.write(f'<text x="{left + k / steps * (width - left - 20):.1f}" y="{height - 20}" '
                    f'text-anchor="middle">{k}</text>\n')
        f.write(f'<text x="{width / 2}" y="{height - 4}" '
                f'text-anchor="middle">steps; the training loss, means of {MEAN}</text>\n')
        at = 22
        for (name, _), mean, colour, dash in zip(curves.items(), means, ("#0072b2", "#d55e00", "#009e73"),
            ("", "6 4", "2 3")):
            points = " ".join(f"{across(i):.1f},{down(v):.1f}" for i, v in enumerate(mean))
            f.write(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2" '
                    f'stroke-dasharray="{dash}"/>\n')
            at += 18
            f.write(f'<line x1="{width - 200}" x2="{width - 170}" y1="{at - 4}" y2="{at - 4}" stroke="{colour}" '
                    f'stroke-width="2" stroke-dasharray="{dash}"/><text x="{width - 164}" y="{at}">{name}</text>\n')
        f.write("</svg>\n")
    return means


def main():
    if len(sys.argv) not in (3, 4):
        usage(__doc__)
    config, out, build = sys.argv[1], sys.argv[2], sys.argv[3] if len(sys.argv) == 4 else "build"
    keys = configuration(build, config)
    torch.set_num_threads(int(os.environ.get("OMP_NUM_THREADS", os.cpu_count())))
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([f"{build}/bin/lgd-train", config, "--initial", folder + "/start.safetensors"], check=True)
        curves = {"lgd-train": ours(build, config, folder + "/run", "f32"),
            f"PyTorch {torch.__version__}": theirs(keys, build, config, folder + "/start.safetensors"),
                  "lgd-train, bf16": ours(build, config, folder + "/bf16", "bf16")}
    means = draw(out, curves)
    ours_f32, *others = zip(curves, curves.values(), means)
    for name, curve, mean in others:
        apart = [abs(a - b) / b for a, b in zip(ours_f32[2], mean)]
        first = [abs(a - b) / b for a, b in zip(ours_f32[1][:20], curve)]
        print(f"{name}: first step {curve[0]:.6f}, lgd-train {ours_f32[1][0]:.6f}; "
              f"apart over the first 20 steps {100 * max(first):.3f} %, "
              f"means of {MEAN} steps {100 * max(apart):.2f} % at most, "
              f"the last {mean[-1]:.4f} and {ours_f32[2][-1]:.4f}")


if __name__ == "__main__":
    main()
