#!/usr/bin/env python3
"""curves.py OUT.svg NAME=FOLDER...: the losses of runs of lgd-train, one line each, and below them how far each is from
the first, relatively (docs/scaling.md)."""
import math
import sys

W, TOP, LOW, X0, X1 = 760, 240, 200, 70, 740
COLOURS = ("#000", "#1f77b4", "#d62728", "#2ca02c")
DASHES = ("", "6 4", "2 4", "8 3 2 3")


def losses(folder):
    rows = open(f"{folder}/log.csv", encoding="ascii").read().split("\n")[1:]
    return [float(r.split(",")[2]) for r in rows if r]


def main(out, runs):
    names = [r.split("=", 1)[0] for r in runs]
    data = [losses(r.split("=", 1)[1]) for r in runs]
    steps = len(data[0])
    hi = max(max(d) for d in data)
    x = lambda i: X0 + (X1 - X0) * i / (steps - 1)
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{W}" height="{TOP + LOW + 60}" '
           'font-family="sans-serif" font-size="12">', '<rect width="100%" height="100%" fill="#fff"/>']
    text = lambda a, b, t, anchor="end": svg.append(f'<text x="{a:.0f}" y="{b:.0f}" text-anchor="{anchor}">{t}</text>')
    line = lambda a, b, c, d: svg.append(f'<line x1="{a:.0f}" x2="{b:.0f}" y1="{c:.0f}" y2="{d:.0f}" stroke="#ddd"/>')
    for k in range(5):
        y = TOP - (TOP - 20) * k / 4
        line(X0, X1, y, y)
        text(X0 - 6, y + 4, f"{hi * k / 4:.2f}")
    floor = TOP + 30
    for e in range(-8, 0, 1):
        y = floor + LOW * (-1 - e) / 7
        line(X0, X1, y, y)
        text(X0 - 6, y + 4, f"1e{e}")
    for k, (name, d) in enumerate(zip(names, data)):
        style = f'fill="none" stroke="{COLOURS[k]}" stroke-dasharray="{DASHES[k]}"'
        points = " ".join(f"{x(i):.1f},{TOP - (TOP - 20) * v / hi:.1f}" for i, v in enumerate(d))
        svg.append(f'<polyline points="{points}" {style}/>')
        text(X1, 20 + 16 * k, name)
        svg.append(f'<line x1="{X1 - 110}" x2="{X1 - 80}" y1="{16 + 16 * k}" y2="{16 + 16 * k}" {style}/>')
        if k:
            off = [max(abs(v / w - 1), 1e-8) for v, w in zip(d, data[0])]
            points = " ".join(f"{x(i):.1f},{floor + LOW * (-1 - math.log10(v)) / 7:.1f}" for i, v in enumerate(off))
            svg.append(f'<polyline points="{points}" {style}/>')
            print(f"{name}: {max(off[:20]):.1e} in the first 20 steps, {max(off):.1e} in all")
    for k in range(5):
        text(x((steps - 1) * k / 4), floor + LOW + 16, str(round((steps - 1) * k / 4) + 1), "middle")
    text((X0 + X1) / 2, floor + LOW + 29, "steps; above the loss, below its relative difference from the first run's",
        "middle")
    open(out, "w", encoding="ascii").write("\n".join(svg) + "\n</svg>\n")


if len(sys.argv) < 3:
    sys.exit(__doc__)
main(sys.argv[1], sys.argv[2:])
