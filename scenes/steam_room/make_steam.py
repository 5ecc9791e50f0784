#!/usr/bin/env python3
"""Writes steam.vol: steam that rises from a tub, rolls under a ceiling and thins out towards the walls.

usage: make_steam.py OUT.vol [--voxel METRES]

A mean shape (a plume that leans and widens, a layer under the ceiling) is looked up at points carried backwards through a
divergence-free flow: curl noise, the curl of a smooth random vector potential (Bridson, Hourihan, Nordenstam 2007), so that
the steam is drawn out into sheets and curls instead of blobs. Deterministic. Needs numpy only.
File: Mitsuba's .vol version 3, float32, x fastest; values in [0, 1], at cell centres of the box below.
"""
import argparse
import struct

import numpy as np

BOX_MIN, BOX_MAX = np.array([-2.0, 0.0, -3.0]), np.array([2.0, 3.0, 3.0])
TUB = np.array([-0.75, 0.55, -0.6])


class Potential:
    """Vector potential: a sum of plane waves over a few octaves; its curl is known in closed form."""

    def __init__(self, seed, wavelength, octaves, waves=10):
        rng = np.random.default_rng(seed)
        self.waves = []
        for octave in range(octaves):
            for _ in range(waves):
                direction = rng.normal(size=3)
                k = direction / np.linalg.norm(direction) * 2 * np.pi / wavelength * 1.9 ** octave
                amplitude = rng.normal(size=3) * 2.3 ** -octave / waves ** 0.5
                self.waves.append((k, amplitude, rng.uniform(0, 2 * np.pi)))

    def curl(self, p):
        v = np.zeros_like(p)
        for k, a, phase in self.waves:
            v -= np.cross(k, a) * np.sin(p @ k + phase)[..., None]
        return v


def mean_shape(p):
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    rise = np.clip(y - TUB[1], 0, None)
    cx, cz = TUB[0] + 0.28 * rise, TUB[2] + 0.12 * rise
    spread = 0.10 + 0.26 * rise
    plume = np.exp(-((x - cx) ** 2 / spread + (z - cz) ** 2 / (spread * 1.5))) * np.exp(-0.32 * rise) * (y > TUB[1] - 0.05)
    layer = 0.5 * np.exp(-((y - 2.75) / 0.38) ** 2) * np.exp(-((x - 0.2) ** 2 / 6 + (z + 0.3) ** 2 / 8))
    haze = 0.075 * np.exp(-0.25 * y)
    return plume + layer + haze


def steam(p):
    flow, detail = Potential(3, 1.7, 3), Potential(11, 0.55, 3)
    q = p.copy()
    for _ in range(6):  # backwards through the flow: drawn out further with every step
        q -= 0.030 * flow.curl(q) + 0.0036 * detail.curl(q)
    stretched = np.linalg.norm(q - p, axis=-1)
    curls = 0.5 + 0.5 * np.sin(9.0 * q[..., 1] + 5.0 * stretched + 3.0 * np.sin(2.1 * q[..., 0] + 1.3 * q[..., 2]))
    return mean_shape(q) * (0.18 + 0.82 * curls ** 2)


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("out")
    args.add_argument("--voxel", type=float, default=0.04, help="edge of a voxel in metres (default 0.04: 4 MB)")
    options = args.parse_args()
    n = np.round((BOX_MAX - BOX_MIN) / options.voxel).astype(int)
    axes = [BOX_MIN[k] + (np.arange(n[k]) + 0.5) / n[k] * (BOX_MAX[k] - BOX_MIN[k]) for k in range(3)]
    density = np.empty((n[2], n[1], n[0]), dtype=np.float32)
    for k, z in enumerate(axes[2]):  # slice by slice: bounded memory at any resolution
        y, x = np.meshgrid(axes[1], axes[0], indexing="ij")
        density[k] = steam(np.stack([x, y, np.full_like(x, z)], axis=-1))
    density /= density.max()
    density[density < 0.004] = 0
    with open(options.out, "wb") as f:
        f.write(b"VOL" + bytes([3]) + struct.pack("<5i6f", 1, *n, 1, *BOX_MIN, *BOX_MAX))
        f.write(density.astype("<f4").tobytes())
    print(f"{options.out}: {n[0]} x {n[1]} x {n[2]} voxels, mean {density.mean():.4f}")


if __name__ == "__main__":
    main()
