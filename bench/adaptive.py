#!/usr/bin/env python3
"""Adaptive sampling beside uniform sampling at equal cost, and what a target error promises beside what it gives, on real scenes.

usage: adaptive.py [--scenes DIR] [--names a,b,c] [--target E] [--seeds N] [--references DIR [--bin N] | --size WxH --reference-spp N]
DIR holds NAME.xml; without, the bench scenes are made, and measured against their references. Each scene is rendered to the target, then uniformly with as many samples, by as many seeds. The truth is two
independent references: NAME.0.exr and NAME.1.exr of --references, means of N x N of their pixels (whose size divided by N is rendered;
the scenes' films have box filters), or else two renders of --reference-spp samples by seeds of their own. The true relMSE is
(x - ref0)(x - ref1) / (ref^2 + 0.01): free of the references' noise in the mean; what chance is left of it stands behind +-.
Core seconds are CPU time of the units: only their ratio means something. Prints rows of a table.
Needs numpy and the OpenEXR package of PyPI.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

import numpy as np

import bench_scenes
from efficiency import BIN, NAMES, load, relmse


def render(scene, folder, *options):
    out, report = folder / "out.exr", folder / "report.json"
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--float", "--report", report, "--quiet", *map(str, options)], check=True)
    return load(out), json.loads(report.read_text())


def binned(image, n):
    h, w = image.shape[0] // n, image.shape[1] // n
    return image[:h * n, :w * n].reshape(h, n, w, n, 3).mean((1, 3))


def noise_of_relmse(x, r0, r1):
    """Standard deviation of relmse(x, r0, r1) by the references' noise: with r their mean and d half their difference it is the mean
    of w ((x - r)^2 - d^2), whose variance is that of 2 w (x - r) d where d is Gaussian. Channels share their noise."""
    r, d = (r0 + r1) / 2, (r0 - r1) / 2
    pixels = (2 * (x - r) * d / (r * r + .01)).sum(-1)
    return float(np.sqrt((pixels * pixels).sum()) / x.size)


def row(scene, references, target, seeds, folder, size):
    sums = {}
    for seed in range(seeds):
        image, told = render(scene, folder, *size, "--target-error", target, "--seed", seed)
        even, uniform = render(scene, folder, *size, "--spp", max(2, round(told["spp"])), "--seed", seed)
        assert told["stopped"] == "error"
        ends = told["convergence"][-1]["relmse_ci95"]
        for name, value in {"spp": told["spp"], "told": told["relmse"], "low": ends[0], "high": ends[1], "true": relmse(image, *references),
                            "chance": noise_of_relmse(image, *references) / seeds ** .5, "uniform": relmse(even, *references),
                            "core": told["core_seconds"], "even core": uniform["core_seconds"]}.items():
            sums[name] = sums.get(name, 0) + value / seeds
    gain = sums["uniform"] / sums["true"]
    return (f"| {scene.stem} | {target:g} | {sums['spp']:.0f} | {sums['told']:.3g} ({sums['low']:.3g} to {sums['high']:.3g}) "
            f"| {sums['true']:.3g} +- {sums['chance']:.1g} | {sums['uniform']:.3g} | {gain:.2f} "
            f"| {gain * sums['even core'] / sums['core']:.2f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=pathlib.Path)
    parser.add_argument("--names", default=NAMES)
    parser.add_argument("--target", type=float, default=1e-3)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--references", type=pathlib.Path)
    parser.add_argument("--bin", type=int, default=2)
    parser.add_argument("--size", default="160x96")
    parser.add_argument("--reference-spp", type=int, default=2048)
    asked = parser.parse_args()
    references_of = asked.references or (None if asked.scenes else bench_scenes.REFERENCES)
    scenes = bench_scenes.scenes(asked.scenes)
    print("| scene | target | samples a pixel | relMSE told (95 %) | true | true, uniform with as many samples | gain, per sample | gain, per core second |\n"
          "|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in asked.names.split(","):
            scene, place, size = scenes / f"{name}.xml", pathlib.Path(folder), ("--size", asked.size)
            if references_of:
                references = [binned(load(references_of / f"{name}.{i}.exr"), asked.bin) for i in (0, 1)]
                size = ("--size", f"{references[0].shape[1]}x{references[0].shape[0]}")
            else:
                references = [render(scene, place, *size, "--spp", asked.reference_spp, "--seed", 1000 + i)[0] for i in (0, 1)]
            print(row(scene, references, asked.target, asked.seeds, place, size), flush=True)


if __name__ == "__main__":
    main()
