#!/usr/bin/env python3
"""Adaptive sampling beside uniform sampling at equal cost, and what a target error promises beside what it gives, on real scenes.

usage: adaptive.py --scenes DIR [--names a,b,c] [--target E] [--seeds N] [--size WxH] [--reference-spp N]
DIR holds NAME.xml. Each scene is rendered to the target, then uniformly with as many samples, by as many seeds. Two references of
--reference-spp samples are rendered by seeds of their own; the true relMSE is (x - ref0)(x - ref1) / (ref^2 + 0.01): free of the
references' noise. Core seconds are CPU time of the units: only their ratio means something. Prints rows of docs/stopping.md.
Needs numpy and the OpenEXR package of PyPI.
"""
import argparse
import json
import pathlib
import subprocess
import tempfile

from efficiency import BIN, NAMES, load, relmse


def render(scene, folder, *options):
    out, report = folder / "out.exr", folder / "report.json"
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--float", "--report", report, "--quiet", *map(str, options)], check=True)
    return load(out), json.loads(report.read_text())


def row(scene, references, target, seeds, folder, size):
    sums = {}
    for seed in range(seeds):
        image, told = render(scene, folder, *size, "--target-error", target, "--seed", seed)
        even, uniform = render(scene, folder, *size, "--spp", max(2, round(told["spp"])), "--seed", seed)
        assert told["stopped"] == "error"
        ends = told["convergence"][-1]["relmse_ci95"]
        for name, value in {"spp": told["spp"], "told": told["relmse"], "low": ends[0], "high": ends[1], "true": relmse(image, *references),
                            "uniform": relmse(even, *references), "core": told["core_seconds"], "even core": uniform["core_seconds"]}.items():
            sums[name] = sums.get(name, 0) + value / seeds
    gain = sums["uniform"] * uniform["spp"] / (sums["true"] * sums["spp"])
    return (f"| {scene.stem} | {target:g} | {sums['spp']:.0f} | {sums['told']:.3g} ({sums['low']:.3g} to {sums['high']:.3g}) | {sums['true']:.3g} "
            f"| {sums['uniform']:.3g} | {gain:.2f} | {sums['uniform'] * sums['even core'] / (sums['true'] * sums['core']):.2f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=pathlib.Path, required=True)
    parser.add_argument("--names", default=NAMES)
    parser.add_argument("--target", type=float, default=1e-3)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--size", default="160x96")
    parser.add_argument("--reference-spp", type=int, default=2048)
    asked = parser.parse_args()
    print("| scene | target | samples a pixel | relMSE told (95 %) | true | true, uniform with as many samples | gain, per sample | gain, per core second |\n"
          "|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in asked.names.split(","):
            scene, place, size = asked.scenes / f"{name}.xml", pathlib.Path(folder), ("--size", asked.size)
            references = [render(scene, place, *size, "--spp", asked.reference_spp, "--seed", 1000 + i)[0] for i in (0, 1)]
            print(row(scene, references, asked.target, asked.seeds, place, size), flush=True)


if __name__ == "__main__":
    main()
