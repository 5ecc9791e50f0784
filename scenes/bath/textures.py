"""The images of the bath: floor boards with their puddles, glazed tiles, plaster, wood, cloth, and what lies outside the window.

Every colour is given in linear light and coded as sRGB when it is written.
"""
import numpy as np

from furniture import TUB, TUB_A, TUB_B
from hall import BACK, FRONT, LEFT, RIGHT
from images import fractal, hash01, mix, noise, smoothstep, write_hdr, write_png


def write_all(folder, detail):
    """detail: 1 for the full setting, 0.5 for the small one."""
    floor(folder, int(1536 * detail))
    tiles(folder, int(1024 * detail))
    plaster(folder, int(768 * detail))
    wood(folder, int(512 * detail))
    towel(folder, int(256 * detail))
    outside(folder)


def srgb(linear):
    """sRGB's curve by its nearest rational power: squares and square roots only, so the same on every machine."""
    x = np.clip(linear, 0, 1)
    s1 = np.sqrt(x)
    s2 = np.sqrt(s1)
    s3 = np.sqrt(s2)
    return np.clip(np.where(x < .0031308, 12.92 * x, .662002687 * s1 + .684122060 * s2 - .323583601 * s3 - .0225411470 * x), 0, 1)


def normals(height, texel):
    """A normal map of a height field; texel: a texel's edge in the unit of the heights. Repeats at its edges."""
    du = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) / (2 * texel)
    dv = (np.roll(height, -1, 0) - np.roll(height, 1, 0)) / (2 * texel)
    length = np.sqrt(du * du + dv * dv + 1)
    return np.stack([-du / length, -dv / length, 1 / length], -1) * .5 + .5


def grid(rows, columns):
    """(across, down): texel centres from 0 to 1."""
    return np.meshgrid((np.arange(columns) + .5) / columns, (np.arange(rows) + .5) / rows)


def grain(seed, across, along):
    """The pattern of wood: rings cut lengthwise, pores, and streaks; lengths in metres. In [0, 1]."""
    warp = .05 * fractal(seed, 7 * across + 9, .9 * along + 9, octaves=3)
    rings = 60 * (across + warp) + 2.5 * fractal(seed + 1, 5 * across + 3, .6 * along + 3, octaves=2)
    saw = rings - np.floor(rings)
    ring = saw * saw * (1 - smoothstep(.86, 1, saw))  # slow to late wood, sharp back to early wood
    pores = smoothstep(.62, .8, noise(seed + 2, 480 * across + 5, 11 * along + 5))
    streaks = fractal(seed + 3, 110 * across + 7, 1.6 * along + 7, octaves=3)
    return np.clip(.20 + .42 * ring + .55 * (streaks - .5) + .3 * pores, 0, 1)


OAK_LIGHT, OAK_DARK = (.40, .225, .105), (.115, .05, .02)


def floor(folder, columns):
    """Boards of 14 cm that run towards the window wall's corner, with dark joints; puddles around the tub."""
    width, depth = RIGHT - LEFT, FRONT - BACK
    rows = int(columns * depth / width)
    u, v = grid(rows, columns)
    x, z = u * width, v * depth
    board = np.floor(x / .14)
    lengths = z / 2.1 + hash01(71, board)
    piece = np.floor(lengths)
    own = hash01(72, board, piece)
    g = grain(40, x + 3.7 * own, z + 11 * hash01(73, board, piece))
    colour = mix(OAK_LIGHT, OAK_DARK, g[..., None]) * (.72 + .5 * own)[..., None]
    colour *= mix((1.06, .97, .90), (.96, 1.0, 1.06), hash01(74, board, piece)[..., None])
    across, along = x / .14 - board, (lengths - piece) * 2.1
    joint = np.minimum(np.minimum(across, 1 - across) * .14, np.minimum(along, 2.1 - along))
    open_joint = 1 - smoothstep(.0006, .0026, joint)
    colour *= (1 - .85 * open_joint)[..., None]

    wx, wz = x + LEFT, z + BACK
    tub = np.sqrt(((wx - TUB[0]) / (TUB_A + .55)) ** 2 + ((wz - TUB[2] - .25) / (TUB_B + .95)) ** 2)
    patches = fractal(90, 1.7 * wx + 20, 1.4 * wz + 20, octaves=4)
    level = patches + .42 * (1 - smoothstep(.55, 1.55, tub)) - .10
    wet = smoothstep(.52, .60, level)
    damp = smoothstep(.40, .56, level)
    colour *= (1 - .42 * damp)[..., None]
    write_png(folder / "floor.png", srgb(colour))
    write_png(folder / "puddles.png", wet)
    cup = .0007 * (1 - (2 * across - 1) ** 2) - .0012 * open_joint - .00022 * g  # boards arch a little
    cup = cup * (1 - .85 * wet) + .0006 * fractal(95, 9 * wx + 30, 9 * wz + 30, octaves=2)
    write_png(folder / "floor_normal.png", normals(cup, width / columns))


def tiles(folder, size):
    """Eight by eight hand-made tiles of 12.5 cm: glaze that pools at the edges, no two alike in tone or tilt."""
    n = 8
    u, v = grid(size, size)
    i, j = np.floor(u * n), np.floor(v * n)
    x, y = u * n - i, v * n - j
    edge = np.minimum(np.minimum(x, 1 - x), np.minimum(y, 1 - y)) + .012 * (noise(11, 40 * u, 40 * v, period=(40, 40)) - .5)
    face = smoothstep(.022, .045, edge)
    tone = hash01(12, i, j)
    cloud = fractal(13, 16 * u, 16 * v, octaves=3, period=(16, 16))
    deep, pale = np.array((.012, .085, .083)), np.array((.055, .235, .205))
    glaze = mix(deep, pale, np.clip(.15 + .6 * tone + .7 * (cloud - .5), 0, 1)[..., None])
    glaze *= (.62 + .38 * smoothstep(.02, .16, edge))[..., None]
    grout = np.array((.28, .27, .24)) * (.7 + .5 * noise(14, 128 * u, 128 * v, period=(128, 128)))[..., None]
    write_png(folder / "tiles.png", srgb(mix(grout, glaze, face[..., None])))
    texel = 1.0 / size  # the image is a metre wide
    tilt = (.0026 * (hash01(15, i, j) - .5) * (x - .5) + .0026 * (hash01(16, i, j) - .5) * (y - .5))
    waves = .0009 * (fractal(17, 12 * u, 12 * v, octaves=2, period=(12, 12)) - .5)
    height = (tilt + waves + .0022 * smoothstep(.02, .11, edge)) * face
    write_png(folder / "tiles_normal.png", normals(height, texel))


def plaster(folder, size):
    """Limewash: soft clouds, brushed two ways."""
    u, v = grid(size, size)
    clouds = fractal(31, 6 * u, 6 * v, octaves=5, gain=.55, period=(6, 6))
    strokes = .5 * (fractal(32, 60 * u, 8 * v, octaves=2, period=(60, 8)) + fractal(33, 8 * u, 60 * v, octaves=2, period=(8, 60)))
    t = np.clip(.5 + 1.2 * (clouds - .5) + .5 * (strokes - .5), 0, 1)
    write_png(folder / "plaster.png", srgb(mix((.40, .355, .29), (.60, .55, .465), t[..., None])))


def wood(folder, size):
    """Dark oak for trim and furniture; half a metre wide, two long, mirrored at its edges by the scene."""
    u, v = grid(size * 2, size)
    g = grain(50, .5 * u, 2 * v)
    write_png(folder / "wood.png", srgb(mix((.235, .118, .052), (.06, .026, .011), g[..., None])))


def towel(folder, size):
    """Woven cotton with two stripes along the hem."""
    u, v = grid(size, size)
    weave = .8 + .2 * noise(61, 64 * u, 64 * v, period=(64, 64))
    stripe = smoothstep(.10, .11, v) * (1 - smoothstep(.16, .17, v)) + smoothstep(.20, .205, v) * (1 - smoothstep(.22, .225, v))
    write_png(folder / "towel.png", srgb(mix((.72, .66, .56), (.09, .22, .22), stripe[..., None]) * weave[..., None]))


def outside(folder, size=192):
    """What the window shows, as radiance: a bright sky, pale above far hills, out-of-focus trees below. (0, 0) is its top left."""
    u, v = grid(size, size)
    sky = mix((1.15, 1.75, 2.75), (2.7, 2.75, 2.7), smoothstep(.0, .75, v)[..., None])
    cloud = smoothstep(.45, .8, fractal(81, 3 * u + 1, 7 * v + 1, octaves=4)) * .55
    sky = mix(sky, (3.0, 2.9, 2.8), cloud[..., None])
    far = smoothstep(-.02, .02, v - .66 + .10 * (fractal(82, 4 * u + 2, np.full_like(u, .5), octaves=3) - .5))
    near = smoothstep(-.05, .05, v - .80 + .5 * (fractal(83, 6 * u + 2, 4 * v + 2, octaves=3) - .5))
    leaves = mix((.10, .17, .05), (.75, .85, .28), (fractal(84, 16 * u, 16 * v, octaves=3) ** 2)[..., None])
    colour = mix(sky, (.75, .95, 1.05), far[..., None])
    write_hdr(folder / "outside.hdr", mix(colour, leaves, near[..., None]))
