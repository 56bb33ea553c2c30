"""Our networks in PyTorch, for bench/peer_torch.py: g, h, and g at full detail (nn/unet.c, nn/refiner.c, nn/detail.c).
"""
import torch
import torch.nn.functional as F
from torch import nn


def padded(x, k, dilation, pad):
    reach = dilation * (k // 2)
    return F.pad(x, (reach,) * 4, mode="replicate") if pad == "replicate" else x


class Block(nn.Module):
    def __init__(self, ins, middle, out, glob, k, norm):
        super().__init__()
        self.conv1 = nn.Conv2d(ins, middle, k, padding=k // 2)
        self.conv2 = nn.Conv2d(middle, out, k, padding=k // 2, bias=False)
        self.add, self.glob, self.norm = nn.Linear(glob, out), nn.Linear(out + glob, out), norm

    def forward(self, x, g):
        y = self.conv2(self.conv1(x))
        mean = y.mean((2, 3))
        if self.norm:
            y = F.instance_norm(y, eps=1e-5)
        x = F.leaky_relu(y + self.add(g)[:, :, None, None], 0.2)
        return x, F.selu(self.glob(torch.cat([mean, g], 1)))


class UNet(nn.Module):
    def __init__(self, width, width_max, levels, first, kernel, channels, reads=3):
        super().__init__()
        self.wide = wide = [min(width << i, width_max) for i in range(levels + 1)]
        self.conv, self.glob = nn.Conv2d(reads, wide[0], 3, padding=1), nn.Linear(reads, wide[0])
        self.down = nn.ModuleList(Block(wide[i], wide[i + 1], wide[i + 1], wide[i], kernel if i else first,
            i < levels - 1) for i in range(levels))
        up, deep = [], wide[levels]
        for i in range(1, levels + 1):
            skip, out = wide[levels - i], wide[levels - i - 1] if i < levels else wide[0]
            up.append(Block(skip + deep, (skip + deep) // 2, out, deep, kernel, True))
            deep = out
        self.up = nn.ModuleList(up)
        self.out1, self.out2 = nn.Conv2d(wide[0], channels, 3, padding=1), nn.Conv2d(channels, channels, 3, padding=1)
        self.add = nn.Linear(wide[0], channels)

    def forward(self, x):
        return torch.tanh(self.parts(x)[0])

    def parts(self, x):
        """The maps before the tanh, the last features, and the global track where the features are smallest."""
        g = F.selu(self.glob(x.mean((2, 3))))
        x, skips = F.leaky_relu(self.conv(x), 0.2), []
        for block in self.down:
            skips.append(x)
            x, g = block(F.max_pool2d(x, 2), g)
        deep = g
        for block in self.up:
            x, g = block(torch.cat([skips.pop(), F.interpolate(x, scale_factor=2, mode="bilinear", align_corners=True)],
                1), g)
        return self.out2(self.out1(x)) + self.add(g)[:, :, None, None], x, deep


class Cell(nn.Module):
    def __init__(self, ins, c):
        super().__init__()
        self.ih, self.hh, self.c = nn.Conv2d(ins, 3 * c, 1), nn.Conv2d(c, 3 * c, 1), c

    def forward(self, x, old):
        iz, ir, im = self.ih(x).chunk(3, 1)
        hz, hr, hm = (self.hh(old) if old is not None else self.hh.bias[None, :, None, None]).chunk(3, 1)
        z, r = torch.sigmoid(iz + hz), torch.sigmoid(ir + hr)
        m = torch.tanh(im + r * hm)
        return z * m if old is None else (1 - z) * old + z * m


class Refiner(nn.Module):
    def __init__(self, width, gru, channels, recurrent):
        super().__init__()
        self.conv1, self.cell1 = nn.Conv2d(2 * channels, width, 5), Cell(width, gru)
        self.conv2, self.cell2 = nn.Conv2d(gru, width, 3, dilation=2), Cell(width, gru)
        self.out, self.recurrent = nn.Conv2d(gru, channels, 3, bias=False), recurrent

    def forward(self, x, state):
        a = self.cell1(F.leaky_relu(self.conv1(padded(x, 5, 1, "replicate")), 0.01),
            state[0] if self.recurrent else None)
        b = self.cell2(F.leaky_relu(self.conv2(padded(a, 3, 2, "replicate")), 0.01),
            state[1] if self.recurrent else None)
        return torch.tanh(self.out(padded(b, 3, 1, "replicate"))), (a, b)


def places(side):
    """Of every pixel, across and down, in -1 .. 1."""
    at = (2 * torch.arange(side) + 1) / side - 1
    return torch.stack([at.expand(side, side), at[:, None].expand(side, side)])[None]


def leaky(x):
    return F.leaky_relu(x, 0.2)


class Change(nn.Module):
    """x and what two convolutions add to it; edge: how F.pad goes on beyond it."""
    def __init__(self, width, dilation, edge):
        super().__init__()
        self.conv1, self.conv2 = nn.Conv2d(width, width, 3, dilation=dilation), nn.Conv2d(width, width, 3, bias=False)
        self.dilation, self.edge = dilation, edge

    def forward(self, x):
        y = leaky(self.conv1(F.pad(x, (self.dilation,) * 4, self.edge)))
        return x + self.conv2(F.pad(y, (1,) * 4, self.edge))


class Detailed(nn.Module):
    """g at full detail: photographs [N, 3, S, S] and what is known [N, 8, S / unshuffle, S / unshuffle] to maps
    [N, 9, S, S], the logarithms of their errors [N, 4, S, S], and the scene's 8 numbers with those of theirs. edge: as
    F.pad has it, where ours repeats the border's pixels."""
    FINE, FINER, KNOWN, MAPS, SPREADS, SCENE = 12, 16, 8, 9, 4, 8

    def __init__(self, width, width_max, levels, first, kernel, size, unshuffle, detail, trunk, half, edge="replicate"):
        super().__init__()
        r, side = unshuffle, size * unshuffle
        reads = 3 * r * r + 2 + self.KNOWN
        self.g = UNet(width, width_max, levels, first, kernel, self.MAPS, reads)
        self.hidden, self.numbers = nn.Linear(self.g.wide[-1], 64), nn.Linear(64, 2 * self.SCENE)
        self.conv1 = nn.Conv2d(reads, detail, 3, padding=1)
        self.conv2 = nn.Conv2d(detail + self.g.wide[0], detail, 3, padding=1)
        self.trunk = nn.Sequential(*(Change(detail, 2, "constant") for _ in range(trunk)))
        self.conv3 = nn.Conv2d(detail, self.FINE * r * r, 1)
        self.two = None
        if half:
            self.two = nn.ModuleList([nn.Conv2d(detail, half * (r // 2) ** 2, 1), nn.Conv2d(half + 12, half, 3),
                Change(half, 1, edge), nn.Conv2d(half, 4 * self.FINE, 1, bias=False)])
        self.conv4 = nn.Conv2d(self.FINE + 3 + 2, self.FINER, 3)
        self.conv5 = nn.Conv2d(self.FINER, self.MAPS + 2 + self.SPREADS, 3)
        self.r, self.edge = r, edge
        self.register_buffer("coarse_places", places(size))
        self.register_buffer("places", places(side))
        p = self.places * torch.tensor([1.0, -1.0])[None, :, None, None]
        self.register_buffer("frame", p / (p.square().sum(1, keepdim=True) + 0.05))

    def bordered(self, x):
        return F.pad(x, (1,) * 4, self.edge)

    def forward(self, photo, known):
        n = photo.shape[0]
        seen = torch.cat([F.pixel_unshuffle(photo, self.r), self.coarse_places.expand(n, -1, -1, -1), known], 1)
        coarse, features, deep = self.g.parts(seen)
        y = self.trunk(leaky(self.conv2(torch.cat([leaky(self.conv1(seen)), features], 1))))
        fine = F.pixel_shuffle(leaky(self.conv3(y)), self.r)
        if self.two is not None:
            expand, read, change, write = self.two
            z = torch.cat([F.pixel_shuffle(leaky(expand(y)), self.r // 2), F.pixel_unshuffle(photo, 2)], 1)
            z = change(leaky(read(self.bordered(z))))
            fine = fine + F.pixel_shuffle(write(z), 2)
        y = torch.cat([fine, photo, self.places.expand(n, -1, -1, -1)], 1)
        y = self.conv5(self.bordered(leaky(self.conv4(self.bordered(y)))))
        s, t = y[:, 9:10], y[:, 10:11]
        fx, fy = self.frame[:, 0:1], self.frame[:, 1:2]
        moved = torch.cat([y[:, 0:3], y[:, 3:4] + s * fx - t * fy, y[:, 4:5] + s * fy + t * fx, y[:, 5:9]], 1)
        coarse = F.interpolate(coarse, size=photo.shape[2:], mode="bilinear")
        return torch.tanh(coarse + moved), y[:, 11:], self.numbers(F.selu(self.hidden(deep)))
