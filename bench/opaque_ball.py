#!/usr/bin/env python3
"""A third opinion on a ball of 450 mean free paths (LaJolla's volpath_test4_2): its picture's mean, in double precision.

usage: opaque_ball.py [--rays N] [--image OUT.exr ...]
A path tracer of its own, for this one scene: spheres by their quadratic, no offsets at all, direct light alone for what is scattered, no
roulette. With images (box filter, the scene's own view) their means are set beside it. Needs numpy, for images the OpenEXR package.
"""
import argparse

import numpy as np

SIGMA, ALBEDO, RADIUS, SCATTERINGS = 300.0, 1 / 3, .75, 5
LIGHTS = ((np.array([1., 1, -1]), .25, np.array([8, 46.4, 64])), (np.array([-1.5, 1.5, -1]), 1., np.array([2.4, 1, 2.4])))
EYE = np.array([0., 0, -4])


def meets(o, d, centre, radius):
    """Distances at which rays enter and leave a ball; nan where they miss it."""
    f = o - centre
    b = (f * d).sum(-1)
    # The stable form: the discriminant by the distance of the centre from the line.
    off = f - b[:, None] * d
    disc = radius ** 2 - (off ** 2).sum(-1)
    root = np.sqrt(np.where(disc > 0, disc, np.nan))
    return -b - root, -b + root


def first_light(o, d):
    """Radiance of the nearest light that a ray meets, and its distance."""
    near, value = np.full(len(o), np.inf), np.zeros((len(o), 3))
    for centre, radius, radiance in LIGHTS:
        enter, _ = meets(o, d, centre, radius)
        hit = (enter > 0) & (enter < near)
        near[hit], value[hit] = enter[hit], radiance
    return near, value


def in_cone(rng, p, centre, radius):
    """Directions evenly spread over what p sees of a ball, and that solid angle."""
    w = centre - p
    dist2 = (w ** 2).sum(-1)
    w /= np.sqrt(dist2)[:, None]
    one_less_cos = radius ** 2 / dist2 / (1 + np.sqrt(1 - radius ** 2 / dist2))
    less, phi = one_less_cos * rng.random(len(p)), 2 * np.pi * rng.random(len(p))
    u = np.cross(w, np.where(np.abs(w[:, :1]) < .9, [[1., 0, 0]], [[0, 1., 0]]))
    u /= np.linalg.norm(u, axis=-1)[:, None]
    v, sin = np.cross(w, u), np.sqrt(less * (2 - less))[:, None]
    return (1 - less)[:, None] * w + sin * (np.cos(phi)[:, None] * u + np.sin(phi)[:, None] * v), 2 * np.pi * one_less_cos


def direct(rng, p):
    """Light that comes to p inside of the ball, times the isotropic phase function."""
    sum_ = np.zeros((len(p), 3))
    for centre, radius, radiance in LIGHTS:
        d, angle = in_cone(rng, p, centre, radius)
        _, leaves = meets(p, d, np.zeros(3), RADIUS)
        _, seen = first_light(p, d)
        sees_it = (seen == radiance).all(-1)
        sum_ += np.where(sees_it[:, None], (np.exp(-SIGMA * leaves) * angle / (4 * np.pi))[:, None] * radiance, 0)
    return sum_


def radiance(rng, d):
    o = np.broadcast_to(EYE, d.shape)
    enter, leaves = meets(o, d, np.zeros(3), RADIUS)
    near, total = first_light(o, d)
    inside = np.nonzero(enter < near)[0]  # nan: no
    through = np.exp(-SIGMA * (leaves - enter))[inside]
    total[inside] *= through[:, None]
    p, w, room, alive = o[inside] + enter[inside, None] * d[inside], d[inside], (leaves - enter)[inside], inside
    for k in range(1, SCATTERINGS + 1):
        t = rng.exponential(1 / SIGMA, len(alive))
        stays = t < room
        p, alive = (p + t[:, None] * w)[stays], alive[stays]
        total[alive] += ALBEDO ** k * direct(rng, p)
        z, phi = 2 * rng.random(len(alive)) - 1, 2 * np.pi * rng.random(len(alive))
        s = np.sqrt(1 - z * z)
        w = np.stack([s * np.cos(phi), s * np.sin(phi), z], -1)
        _, room = meets(p, w, np.zeros(3), RADIUS)
    return total


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--rays", type=int, default=4_000_000)
    args.add_argument("--image", nargs="*", default=[])
    options = args.parse_args()
    rng, side, batch, means = np.random.default_rng(1), np.tan(np.radians(22.5)), 1 << 18, []
    cells = 512
    for _ in range(max(4, options.rays // batch)):
        x, y = (np.stack(np.meshgrid(np.arange(cells), np.arange(cells)), -1).reshape(-1, 2) + rng.random((cells * cells, 2))).T / cells
        d = np.stack([side * (1 - 2 * x), side * (1 - 2 * y), np.ones(cells * cells)], -1)
        means.append(radiance(rng, d / np.linalg.norm(d, axis=-1)[:, None]).mean(0))
    mean, error = np.mean(means, 0), np.std(means, 0, ddof=1) / np.sqrt(len(means))
    print("mean", *(f"{m:.5f} +- {e:.5f}" for m, e in zip(mean, error)))
    for image in options.image:
        import OpenEXR
        channels = OpenEXR.File(image).channels()
        key = next(k for k in ("RGB", "RGBA") if k in channels)
        print(image, *(f"{100 * (a / b - 1):+.3f} %" for a, b in zip(np.asarray(channels[key].pixels)[..., :3].mean((0, 1), dtype=float), mean)))


if __name__ == "__main__":
    main()
