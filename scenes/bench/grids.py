"""The densities of the bench scenes: steam that rises from a tub, and a cumulus cloud."""
import dataclasses
import math

import numpy as np


@dataclasses.dataclass
class Grid:
    values: np.ndarray  # [z, y, x], float32, the largest 1 or below
    corner: tuple       # of the box, where its coordinates are least, in scene units
    voxel: float        # an edge's length

    def box(self):
        return self.corner, tuple(c + n * self.voxel for c, n in zip(self.corner, reversed(self.values.shape)))


def centres(counts, extents):
    """Voxel centres along x, y and z, counted from the box's corner, as arrays that broadcast to [z, y, x]."""
    along = [(np.arange(n) + .5) / n * extent for n, extent in zip(counts, extents)]
    return along[0][None, None, :], along[1][None, :, None], along[2][:, None, None]


def turbulence(x, y, z, seed, octaves, lowest):
    """Octaves of eight plane waves each, of random directions and phases; the k-th has lowest * 2^k / 6 waves a unit of length."""
    random = np.random.default_rng(seed)
    total = np.zeros(np.broadcast_shapes(x.shape, y.shape, z.shape))
    for octave in range(octaves):
        for _ in range(8):
            wave = random.normal(size=3)
            # By hand, since a library's norm may round otherwise on another processor.
            wave *= lowest * 2 ** octave * 2 * np.pi / 6 / math.sqrt(wave[0] * wave[0] + wave[1] * wave[1] + wave[2] * wave[2])
            phase = random.uniform(0, 2 * np.pi)
            total += np.sin(wave[0] * x + wave[1] * y + wave[2] * z + phase) / 2 ** (.8 * octave) / 3
    return total


def steam():
    """A plume above the tub (x = -0.6, z = 0.4) that leans and widens as it rises, and a layer below the ceiling."""
    corner, voxel, counts = (-1.98, .02, -2.98), .04, (99, 74, 149)
    x, y, z = centres(counts, [n * voxel for n in counts])
    noise = turbulence(x, y, z, seed=7, octaves=6, lowest=1.5)
    x, y, z = (at + c for at, c in zip((x, y, z), corner))
    plume = np.exp(-((x + .6 - .25 * y) ** 2 + (z - .4) ** 2) / (.18 + .35 * y)) * np.clip(1.25 - y / 3.2, 0, 1)
    layer = .35 * np.exp(-((y - 2.7) / .45) ** 2)
    density = (plume + layer) * np.clip(.55 + .55 * noise, 0, None) + .015
    density[density < .02] = 0
    return Grid((density / density.max()).astype("<f4"), corner, voxel)


def cloud():
    """An ellipsoid with a flat base whose edge the turbulence tears."""
    corner, counts, stretch = (-1., 0., -1.), (112, 84, 112), 1.5
    x, y, z = centres(counts, (3., 2.25, 3.))
    noise = turbulence(x, y, z, seed=21, octaves=7, lowest=2.5)
    x, y, z = (at / stretch + c for at, c in zip((x, y, z), corner))
    depth = 1 - np.sqrt((x / .85) ** 2 + ((y - .65) / .55) ** 2 + (z / .85) ** 2)
    density = np.clip(depth * 2.2 + .55 * noise, 0, 1) * (depth > -.12) * np.clip((y - .12) / .08, 0, 1)
    return Grid(density.astype("<f4"), corner, 2 / 112)


ALL = {"steam": steam, "cloud": cloud}
