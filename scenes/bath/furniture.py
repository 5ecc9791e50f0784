"""What stands in the hall: the tub with its water and tap, the mirror, a stool, a shelf with vessels."""
import math

import numpy as np

from images import noise
from mesh import spline, turn_y, turn_z

TUB, TUB_A, TUB_B = np.array((-0.15, 0.0, -0.75)), 0.92, 0.43  # centre and half axes of its rim
WATER = 0.50  # height of the surface

# The tub's section as (offset from the rim's ellipse, height): up the outside, over the rim, down the inside.
SECTION = [(-.34, .125), (-.25, .13), (-.15, .19), (-.085, .3), (-.045, .44), (-.02, .56), (.012, .595), (.036, .613), (.034, .635),
           (.01, .648), (-.022, .642), (-.042, .62), (-.057, .55), (-.08, .42), (-.12, .28), (-.2, .19), (-.3, .165), (-.42, .16)]


def build(groups):
    tub(groups["enamel"])
    water(groups["water"])
    feet(groups["brass"])
    tap(groups["brass"], groups["enamel"])
    mirror(groups["mirror"], groups["brass"])
    stool(groups["wood"], groups["towel"], groups["brass"])
    shelf(groups)
    tray(groups["wood"], groups["towel"], groups["clay"])


def tub(enamel, sides=96):
    section = spline(SECTION, 4)
    rows = []
    for k in range(sides):
        a = 2 * math.pi * k / sides
        row = []
        for offset, y in section:
            x, z = (TUB_A + offset) * math.cos(a), (TUB_B + offset) * -math.sin(a)
            lift = .15 * (abs(x) / TUB_A) ** 3 * max(0, (y - .3) / .35) ** 2  # both ends are drawn up
            row.append((x, y + lift, z))
        rows.append(row)
    enamel.surface(np.array(rows) + TUB, closed=True)


def water(mesh, rings=40, sides=120):
    """A surface with small waves; it ends within the tub's wall."""
    a, b = TUB_A - .058, TUB_B - .058
    r, k = np.meshgrid((np.arange(rings) + .02) / (rings - 1), np.arange(sides), indexing="ij")
    angle = np.array([2 * math.pi * s / sides for s in range(sides)])[k]
    x, z = a * r * np.cos(angle), -b * r * np.sin(angle)
    height = .006 * (noise(5, 7 * x + 50, 9 * z + 50) - .5) + .003 * (noise(6, 19 * x + 50, 23 * z + 50) - .5)
    points = np.stack([x + TUB[0], WATER + height, z + TUB[2]], -1)
    mesh.surface(points.transpose(1, 0, 2), closed=True, flip=True)


def feet(brass):
    for sx in (-1, 1):
        for sz in (-1, 1):
            foot = TUB + ((TUB_A - .27) * sx, 0, (TUB_B - .13) * sz)
            brass.ball(foot + (.03 * sx, .045, .03 * sz), .045, squash=.95)
            brass.tube(spline([foot + (.03 * sx, .05, .03 * sz), foot + (.06 * sx, .11, .05 * sz), foot + (-.01 * sx, .17, .0 * sz),
                               foot + (-.08 * sx, .2, -.06 * sz)], 6), [.026 + .014 * math.sin(math.pi * k / 18) for k in range(19)])


def tap(brass, enamel):
    """A tap on two risers from the floor behind the tub, a spout that bends over its rim, and a hand shower on a cradle."""
    x, z = TUB[0] + .2, TUB[2] - TUB_B - .1
    for s in (-.09, .09):
        brass.tube([(x + s, 0, z), (x + s, .93, z)], .014)
        brass.lathe([(.001, 0), (.04, 0), (.04, .008), (.018, .03), (.014, .04)], (x + s, 0, z), 24)
        brass.ball((x + s, .94, z), .03)
        for turn in (0, 90):
            d = turn_y(turn + 30) @ np.array((.045, 0, 0))
            brass.tube([np.array((x + 1.9 * s, .94, z)) - d, np.array((x + 1.9 * s, .94, z)) + d], .007)
        brass.tube([(x + s, .94, z), (x + 1.9 * s, .94, z)], .012)
        enamel.ball((x + 1.96 * s, .94, z), .014)
    brass.tube([(x - .09, .94, z), (x + .09, .94, z)], .02)
    brass.tube(spline([(x, .95, z), (x, 1.12, z), (x, 1.2, z + .07), (x, 1.17, z + .17), (x, 1.07, z + .2), (x, 1.03, z + .2)], 6), .015)
    brass.tube([(x, 1.19, z + .05), (x, 1.36, z + .03)], .008)
    brass.tube([(x - .06, 1.36, z + .03), (x + .06, 1.36, z + .03)], .008)
    head = np.array((x + .16, 1.34, z + .05))
    brass.tube([(x - .1, 1.39, z + .02), head], [.011, .014])
    brass.tube([head, head + (.03, -.05, .04)], [.016, .045])
    brass.tube(spline([(x - .1, 1.39, z + .02), (x - .19, 1.2, z + .02), (x - .22, .8, z - .01), (x - .2, .5, z - .02), (x - .12, .62, z),
                       (x - .05, .9, z)], 8), .006)


def mirror(glass, brass):
    """A tall arched mirror on the floor that leans back a little and faces between window and camera."""
    at, matrix = np.array((-1.55, 0.0, -1.75)), turn_y(-41) @ turn_z(2.2)
    half, foot, spring = .46, .06, 1.62  # half the width; where the straight sides begin and end

    def place(across, up, forwards=0.0):
        return matrix @ np.array((forwards, up, across)) + at
    side = [(half, foot + (spring - foot) * k / 8) for k in range(8)]
    bow = [(half * math.cos(a), spring + half * math.sin(a)) for a in (math.pi * k / 32 for k in range(33))]
    outline = side + bow + [(-across, up) for across, up in reversed(side)]
    n = len(outline)
    points = np.array([place(0, 1)] + [place(*p) for p in outline])
    normal = matrix @ np.array((1.0, 0, 0))
    glass.add(points, np.tile(normal, (n + 1, 1)), points[:, :2], [(0, (k + 1) % n + 1, k + 1) for k in range(n)])
    brass.tube([place(*p, .005) for p in outline], .026, closed_path=True)
    for across in (-.3, .3):  # the legs behind it
        heel = place(across, 0, -.4)
        brass.tube([place(across, 1.3, -.02), (heel[0], 0, heel[2])], .012)


def stool(wood, towel, brass):
    """By the camera: a round stool with folded towels and a brass pitcher."""
    at = np.array((-0.98, 0.0, 1.15))
    wood.lathe([(.001, .44), (.17, .44), (.195, .452), (.2, .468), (.195, .485), (.17, .49), (.001, .49)], at, 48, uv_size=(.4, .2))
    for k in range(4):
        d = turn_y(45 + 90 * k) @ np.array((1.0, 0, 0))
        wood.tube([at + .2 * d, at + .13 * d + (0, .45, 0)], [.014, .02], sides=12)
        e = turn_y(135 + 90 * k) @ np.array((1.0, 0, 0))
        wood.tube([at + .178 * d + (0, .15, 0), at + .178 * e + (0, .15, 0)], .009, sides=10)
    for k, (size, turn) in enumerate(((.135, 8), (.125, 14), (.128, 4))):
        folded(towel, at + (-.035, .49 + .05 * k, .0), size, .05, turn)
    pitcher(brass, at + (.115, .49, .07))


def folded(towel, at, half, thick, turn):
    """A folded towel: a cushion-like block with round edges, narrower along z."""
    rows = []
    for k in range(40):
        a = 2 * math.pi * k / 40
        c, s = math.cos(a), math.sin(a)
        power = .35
        x, z = math.copysign(abs(c) ** power, c) * half, math.copysign(abs(s) ** power, -s) * half * .72
        rows.append([(x * r, thick * h, z * r) for r, h in ((.02, 0), (.9, .0), (.98, .12), (1, .5), (.98, .86), (.9, .98), (.5, 1.03), (.02, 1.04))])
    points = np.array(rows) @ turn_y(turn).T + at
    towel.surface(points, closed=True, uv_size=(1.0, .3))


def pitcher(brass, at, scale=1.0):
    profile = spline([(.001, 0), (.05, 0), (.062, .03), (.066, .07), (.05, .13), (.032, .17), (.034, .2), (.046, .225), (.044, .226), (.03, .2)], 5)
    brass.lathe([(max(r, 1e-3) * scale, y * scale) for r, y in profile], at, 40)
    brass.tube(spline([at + scale * np.array(p) for p in ((.036, .205, 0), (.085, .2, 0), (.105, .14, 0), (.06, .07, 0))], 7), .0065 * scale)


def shelf(groups):
    """On the back wall: a board on brass brackets, with vessels."""
    y, z = 1.78, -3.2
    groups["wood"].box((-1.15, y, z), (.1, y + .035, z + .2), grain=0, offset=(.5, .9))
    for x in (-1.0, -.05):
        groups["brass"].tube(spline([(x, y - .13, z), (x, y - .11, z + .06), (x, y - .02, z + .17)], 6), .008)
    y += .035
    vase = spline([(.001, 0), (.05, 0), (.085, .06), (.09, .13), (.06, .21), (.03, .26), (.042, .3), (.036, .3), (.024, .26)], 5)
    groups["clay"].lathe([(max(r, 1e-3), h) for r, h in vase], (-.95, y, z + .1), 36)
    bottle = [(.001, 0), (.04, 0), (.042, .01), (.042, .13), (.03, .155), (.012, .17), (.012, .2), (.015, .205), (.001, .205)]
    for x, group in ((-.7, "enamel"), (-.58, "amber")):
        groups[group].lathe(bottle, (x, y, z + .09), 32)
    pitcher(groups["brass"], np.array((-.32, y, z + .1)), 1.1)
    for k in range(2):
        folded(groups["towel"], np.array((-.06, y + .05 * k, z + .1)), .1, .05, 3 * k)


def tray(wood, towel, clay):
    """A board across the tub with a folded cloth and a cup, and a slatted mat before it."""
    x = TUB[0] - .38
    wood.box((x - .1, .672, TUB[2] - TUB_B - .07), (x + .1, .692, TUB[2] + TUB_B + .07), grain=2, offset=(.1, .2))
    clay.lathe([(.001, 0), (.03, 0), (.038, .03), (.04, .08), (.037, .08), (.034, .03), (.001, .012)], (x + .02, .692, TUB[2] + .16), 32)
    folded(towel, np.array((x, .692, TUB[2] - .12)), .085, .04, 92)
    for k in range(9):
        wood.box((-.6, .022, -.1 + .068 * k), (.42, .04, -.05 + .068 * k), grain=0, offset=(.3 * k, .13 * k))
    for x in (-.5, .3):
        wood.box((x, 0, -.1), (x + .04, .022, .5), grain=2)
