#!/usr/bin/env python3
"""The model of docs/scaling.md: what a step waits for the sums of N ranks.

  scaling.py link N GBIT MICROSECONDS [tree]   LATENCY SPEED, as bench/mpi/link.c wants them, of a ring (or a tree) of N
                                               ranks over links of so many Gbit/s and such a latency
  scaling.py wait LOG LATENCY SPEED            milliseconds that a step waits: LOG is LGD_LINK_LOG's file
  scaling.py table LOG [FACTOR]                efficiency for 2 .. 1,024 ranks by LOG's processor time; FACTOR: of ranks
                                               that compute so many times as fast
  scaling.py buckets LOG FACTOR N              efficiency of N ranks for several sizes of buckets, LOG made with
                                               train.bucket = 0
"""
import math
import sys

LINKS = ((10, 20.0), (25, 10.0), (100, 5.0))  # Gbit/s, microseconds of latency: TCP, TCP, RDMA


def link(ranks, gbit, alpha, tree=False):
    """An all-reduce of n bytes takes LATENCY + n / SPEED microseconds: every rank sends and receives 2 (N - 1) / N of
    the bytes, in 2 (N - 1) messages along a ring, in 2 log2 N by halving and doubling (Thakur et al. 2005)."""
    messages = 2 * math.ceil(math.log2(ranks)) if tree else 2 * (ranks - 1)
    return messages * alpha, gbit * 125 * ranks / (2 * (ranks - 1))


def read(path, column):
    """(bytes, microseconds) of each bucket, and a step's microseconds of processor time."""
    rows = [line.split() for line in open(path, encoding="ascii")]
    return [(float(r[0]), float(r[column])) for r in rows[:-1]], float(rows[-1][1])


def wait(buckets, latency, speed, factor=1.0, size=1.0):
    """The link takes one bucket after the other; backward ends when the last one is sent."""
    end = 0.0
    for count, at in buckets:
        end = max(end, at / factor) + latency + size * count / speed
    return (end - buckets[-1][1] / factor) / 1000


def table(buckets, step, factor):
    print("| ranks | " + " | ".join(f"{g} Gbit/s | bf16" for g, _ in LINKS) + " |")
    print("|" + "---:|" * (1 + 2 * len(LINKS)))
    for k in range(1, 11):
        cells = []
        for gbit, alpha in LINKS:
            for size in (1, 0.5):
                lost = min(wait(buckets, *link(2**k, gbit, alpha, t), factor, size) for t in (False, True))
                cells.append(f"{step / factor / (step / factor + lost):.3f}")
        print(f"| {2**k:,} | " + " | ".join(cells) + " |")


def merge(buckets, size):
    """Neighbours together as train/reduce.c puts them together: sent when the last of them is complete."""
    merged, count = [], 0.0
    for number, (more, at) in enumerate(buckets):
        count += more
        if count >= size or number == len(buckets) - 1:
            merged.append((count, at))
            count = 0.0
    return merged


def sizes(buckets, step, factor, ranks):
    print("| MiB | buckets | " + " | ".join(f"{g} Gbit/s" for g, _ in LINKS) + " |")
    print("|" + "---:|" * (2 + len(LINKS)))
    for mib in (0, 0.25, 0.5, 1, 2, 4, 16):
        now = merge(buckets, mib * 2**20)
        lost = [min(wait(now, *link(ranks, g, a, t), factor) for t in (False, True)) for g, a in LINKS]
        cells = [f"{step / factor / (step / factor + x):.3f}" for x in lost]
        print(f"| {mib:g} | {len(now)} | " + " | ".join(cells) + " |")


def main(words):
    if len(words) in (4, 5) and words[0] == "link":
        print("%.1f %.3f" % link(int(words[1]), float(words[2]), float(words[3]), words[4:] == ["tree"]))
    elif len(words) == 4 and words[0] == "wait":
        print(f"{wait(read(words[1], 1)[0], float(words[2]), float(words[3])):.2f}")
    elif len(words) in (2, 3) and words[0] == "table":
        buckets, step = read(words[1], 2)
        table(buckets, step / 1000, float(words[2]) if len(words) == 3 else 1.0)
    elif len(words) == 4 and words[0] == "buckets":
        buckets, step = read(words[1], 2)
        sizes(buckets, step / 1000, float(words[2]), int(words[3]))
    else:
        sys.exit(__doc__)


main(sys.argv[1:])
