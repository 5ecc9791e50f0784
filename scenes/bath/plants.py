"""Two plants: a palm in the corner by the window, and large leaves by the camera."""
import math

import numpy as np

from images import hash01
from mesh import turn_y


def build(groups):
    pot(groups["clay"], (1.72, 0, -2.62), 1.0)
    palm(groups["leaf"], np.array((1.72, .42, -2.62)), fronds=17, reach=1.15, seed=21)
    pot(groups["brass"], (1.42, 0, .85), .8)
    palm(groups["leaf"], np.array((1.42, .33, .85)), fronds=9, reach=.8, seed=47)


def pot(mesh, at, scale):
    profile = [(.001, 0), (.15, 0), (.16, .01), (.2, .2), (.215, .36), (.235, .37), (.235, .41), (.2, .412), (.19, .36), (.001, .35)]
    mesh.lathe([(max(r, 1e-3) * scale, y * scale) for r, y in profile], at, 48)


def palm(leaf, root, fronds, reach, seed):
    """Fronds that rise, arch over under their weight and carry two rows of leaflets."""
    for k in range(fronds):
        a, b, c = (float(hash01(seed, k, j)) for j in range(3))
        heading = turn_y(360 * (k * .382 + .06 * a))  # the golden angle: no two above each other
        upright = 1 - k / fronds
        rise, out = reach * (.75 + .75 * upright + .2 * b), reach * (.95 - .5 * upright + .15 * c)
        steps = 26
        t = np.arange(steps + 1) / steps
        spine = np.stack([out * t ** 1.5, rise * (1.35 * t - .62 * t ** 2.6), .04 * reach * np.sin(3 * t + 6 * a)], 1) @ heading.T + root
        leaf.tube(spine[::2], [.009 * (1 - .8 * s) * reach for s in t[::2]], sides=6)
        for s in range(7, steps + 1):
            along = spine[s] - spine[s - 1]
            along /= math.sqrt(along @ along)
            size = reach * .40 * math.sin(math.pi * (.12 + .8 * (s - 7) / (steps - 7))) ** .7
            for side in (-1, 1):
                wobble = float(hash01(seed + 5, k, 2 * s + (side > 0)))
                leaflet(leaf, spine[s], along, side, size * (.85 + .3 * wobble), .25 + .3 * wobble)


def leaflet(leaf, at, along, side, length, droop, width=.022):
    """A narrow leaf with a fold along its middle."""
    across = np.cross(along, (0, 1, 0))
    across /= max(math.sqrt(across @ across), 1e-6)
    direction = .62 * along + side * .78 * across
    edge = np.cross(direction, (0, 1, 0))
    edge /= max(math.sqrt(edge @ edge), 1e-6)
    rows = []
    for k in range(7):
        t = k / 6
        centre = at + direction * length * t + np.array((0, .06 * t - droop * t * t, 0)) * length
        half = width * math.sin(math.pi * min(.08 + .92 * t, .995)) ** .6 * (1.15 - t) * 1.2
        rows.append([centre - edge * half + (0, .35 * half, 0), centre, centre + edge * half + (0, .35 * half, 0)])
    leaf.surface(np.array(rows), uv_size=(1.0, 1.0))
