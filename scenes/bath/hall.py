"""The hall itself: floor, tiled and plastered walls, beams, and the window wall with its two arched, slatted bays.

x runs from the left wall to the window wall, y up, z from the back wall towards the camera. Metres.
"""
import math

import numpy as np

LEFT, RIGHT, BACK, FRONT, HEIGHT = -2.3, 2.3, -3.2, 3.8, 3.7
WALL = 0.3
BAYS = ((-2.8, -1.8), (-1.35, -0.35))  # the window bays' extent along z
SILL, SPRING = 0.95, 2.85  # where the openings begin, and where their arches do
TOP = SPRING + 0.5 * (BAYS[0][1] - BAYS[0][0])
WAINSCOT = 1.5
SLAT_PITCH, SLAT_DEPTH, SLAT_THICK, SLAT_TILT = 0.30, 0.16, 0.04, -12.0


def build(groups):
    shell(groups)
    window_wall(groups["plaster"], groups["tiles"])
    for bay in BAYS:
        arch(groups["plaster"], *bay)
        shutter(groups["wood"], *bay)
    trim(groups["wood"], groups["brass"])


def shell(groups):
    width, depth = RIGHT - LEFT, FRONT - BACK
    groups["floor"].quad((LEFT, 0, FRONT), (width, 0, 0), (0, 0, -depth), uv=[(0, 1), (1, 1), (1, 0), (0, 0)])
    plaster, tiles = groups["plaster"], groups["tiles"]
    plaster.quad((LEFT, HEIGHT, BACK), (width, 0, 0), (0, 0, depth))
    for mesh, lo, hi in ((tiles, 0, WAINSCOT), (plaster, WAINSCOT, HEIGHT)):
        mesh.quad((LEFT, lo, BACK), (width, 0, 0), (0, hi - lo, 0))
        mesh.quad((LEFT, lo, FRONT), (0, 0, -depth), (0, hi - lo, 0))
    plaster.quad((RIGHT, 0, FRONT), (-width, 0, 0), (0, HEIGHT, 0))
    # Behind the ceiling and the walls nothing may let the sun in.
    plaster.box((LEFT - WALL, HEIGHT + .01, BACK - WALL), (RIGHT + WALL, HEIGHT + .2, FRONT + WALL))
    plaster.box((LEFT - WALL, 0, BACK - .2), (RIGHT + WALL, HEIGHT, BACK - .01))


def window_wall(plaster, tiles):
    tiles.quad((RIGHT, 0, BACK), (0, 0, FRONT - BACK), (0, SILL - .03, 0))
    plaster.box((RIGHT + .005, 0, BACK), (RIGHT + WALL, SILL - .03, FRONT))
    plaster.box((RIGHT, TOP, BACK), (RIGHT + WALL, HEIGHT, FRONT))
    edges = (BACK, *BAYS[0], *BAYS[1], FRONT)
    for a, b in zip(edges[::2], edges[1::2]):
        plaster.box((RIGHT, SILL - .03, a), (RIGHT + WALL, TOP, b))


def arch(plaster, z0, z1, segments=24):
    """The wall between a round arch and the straight top of its opening, and the arch's inner face."""
    centre, radius = (z0 + z1) / 2, (z1 - z0) / 2
    angles = [math.pi * k / segments for k in range(segments + 1)]
    rim = [(SPRING + radius * math.sin(a), centre - radius * math.cos(a)) for a in angles]
    for x, outward in ((RIGHT, -1), (RIGHT + WALL, 1)):
        for (ya, za), (yb, zb) in zip(rim, rim[1:]):
            corners = np.array([(x, ya, za), (x, yb, zb), (x, TOP, zb), (x, TOP, za)])
            order = [(0, 1, 2), (0, 2, 3)] if outward < 0 else [(2, 1, 0), (3, 2, 0)]
            plaster.add(corners, np.tile((float(outward), 0.0, 0.0), (4, 1)), corners[:, [2, 1]], order)
    across = np.array([[(x, y, z) for x in (RIGHT, RIGHT + WALL / 2, RIGHT + WALL)] for y, z in rim])
    plaster.surface(across, uv_size=(math.pi * radius, WALL), flip=True)


def shutter(wood, z0, z1):
    """A frame with slats; their outer edges are the lower ones, against the rain."""
    x, frame = RIGHT + .15, .05
    wood.box((RIGHT - .07, SILL - .04, z0 - .06), (RIGHT + WALL, SILL, z1 + .06), grain=2, offset=(z0, .3))
    for a in (z0, z1 - frame, (z0 + z1 - frame) / 2):
        wood.box((x - .04, SILL, a), (x + .04, TOP, a + frame), grain=1, offset=(3 * a, .1))
    slope = math.radians(SLAT_TILT)
    tilt = np.array([(math.cos(slope), -math.sin(slope), 0), (math.sin(slope), math.cos(slope), 0), (0, 0, 1)])
    y, k = SILL + SLAT_PITCH / 2, 0
    while y < TOP - .05:
        lo = np.array((x - SLAT_DEPTH / 2, y - SLAT_THICK / 2, z0))
        hi = np.array((x + SLAT_DEPTH / 2, y + SLAT_THICK / 2, z1))
        wood.box(lo, hi, grain=2, offset=(.37 * k, .61 * k), turn=(tilt, (lo + hi) / 2))
        y, k = y + SLAT_PITCH, k + 1


def trim(wood, brass):
    """A rail above the tiles, skirting, beams under the ceiling, and a brass rail for towels on the back wall."""
    wood.box((LEFT, WAINSCOT - .01, BACK), (RIGHT, WAINSCOT + .035, BACK + .035), grain=0, offset=(.2, .4))
    wood.box((LEFT, WAINSCOT - .01, BACK), (LEFT + .035, WAINSCOT + .035, FRONT), grain=2, offset=(.7, .1))
    for k, z in enumerate((-2.35, -.75, .85, 2.45)):
        wood.box((LEFT, HEIGHT - .2, z - .08), (RIGHT, HEIGHT, z + .08), grain=0, offset=(.31 * k, .17 * k))
    y, z = 1.22, BACK + .09
    brass.tube([(.35, y, z), (1.25, y, z)], .013)
    for x in (.4, 1.2):
        brass.tube([(x, y, BACK), (x, y, z)], .009)
        brass.ball((x, y, BACK), .028)
