#!/usr/bin/env python3
"""Error against samples and time, from 2 samples a pixel to 1024, with slopes: one row a scene, and CSV of every checkpoint.

usage: curves.py SCENE.xml... [--size WxH] [--spp N | --to-error E] [--reference-spp N] [--threads N] [--seed N] [--csv FILE]
With --to-error the steps are errors, not samples: the job renders until its relMSE is down to E, where it needs it most, and what it
took to 16, 8, 4, 2 times E and to E is told: samples a pixel, core seconds and, behind the error that it said, the true one. Each is
the first checkpoint there (of those 15 % of samples apart), which a job with that target would have ended at or a level before.
A reference of --reference-spp samples and another seed is rendered first, and its own noise subtracted; 0: none, then only the
estimated error is shown. Slopes are of log relMSE over log core seconds, with their 95 % interval; -1 is what independent samples
give. Prints a table in Markdown.
"""
import argparse
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
SHOWN = (2, 8, 32, 128, 512, 1024)
STEPS = (16, 8, 4, 2, 1)
MOST_SPP = 1 << 20  # with a target: more than it should need


def render(scene, out, options, *flags):
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--size", options.size, "--threads", str(options.threads), "--quiet",
                    *map(str, flags)], check=True)


def curve(scene, folder, options):
    reference = []
    if options.reference_spp:
        render(scene, folder / "right.exr", options, "--spp", options.reference_spp, "--seed", 77, "--float")
        reference = ["--reference", folder / "right.exr"]
    limits = ["--spp", options.spp] if options.to_error is None else ["--spp", MOST_SPP, "--target-error", options.to_error]
    render(scene, folder / "out.exr", options, *limits, "--seed", options.seed, "--report", folder / "r.json", *reference)
    return json.loads((folder / "r.json").read_text())


def cell(point):
    if point is None:
        return ""
    estimated = f"{point['relmse']:.2g}"
    return f"{estimated} ({point['true_relmse']:.2g})" if "true_relmse" in point else estimated


def at_samples(report):
    points = {p["spp"]: p for p in report["convergence"]}
    return [cell(points.get(n)) for n in SHOWN]


def at_errors(report, least):
    cells = []
    for step in STEPS:
        point = next((p for p in report["convergence"] if p["relmse"] <= step * least), None)
        cells.append("" if point is None else f"{point['spp']:.0f} spp, {point['core_seconds']:.3g} s: {cell(point)}")
    return cells


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", type=pathlib.Path, nargs="+")
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--spp", type=int, default=1024)
    parser.add_argument("--to-error", type=float)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--reference-spp", type=int, default=4096)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--csv", type=pathlib.Path)
    options = parser.parse_args()
    rows = []
    columns = [f"{n} spp" for n in SHOWN] if options.to_error is None else [f"to {n * options.to_error:.2g}" for n in STEPS]
    print("| scene | " + " | ".join(columns) + " | slope | FLIP at the end | verdict |")
    print("|---" * (len(columns) + 4) + "|")
    with tempfile.TemporaryDirectory() as name:
        for scene in options.scenes:
            report = curve(scene, pathlib.Path(name), options)
            shown = at_samples(report) if options.to_error is None else at_errors(report, options.to_error)
            slope = report["slope"]
            told = "" if slope is None else f"{slope:.2f} ({report['slope_ci95'][0]:.2f} to {report['slope_ci95'][1]:.2f})"
            flip = report.get("true_flip")
            print(f"| {scene.stem} | " + " | ".join(shown) +
                  f" | {told} | {'' if flip is None else format(flip, '.3f')} | {report['verdict']} |", flush=True)
            rows += [[scene.stem, *(p.get(k, "") for k in ("spp", "core_seconds", "relmse", "true_relmse", "true_flip"))] for p in report["convergence"]]
    if options.csv:
        with options.csv.open("w", newline="") as file:
            csv.writer(file).writerows([["scene", "spp", "core_seconds", "relmse", "true_relmse", "true_flip"], *rows])
    return 0


if __name__ == "__main__":
    sys.exit(main())
