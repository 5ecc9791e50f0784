#!/usr/bin/env python3
"""Error against samples and time, from 2 samples a pixel to 1024, with slopes: one row a scene, and CSV of every checkpoint.

usage: curves.py SCENE.xml... [--size WxH] [--spp N] [--reference-spp N] [--threads N] [--csv FILE]
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

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
SHOWN = (2, 8, 32, 128, 512, 1024)


def render(scene, out, options, *flags):
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--size", options.size, "--threads", str(options.threads), "--quiet",
                    *map(str, flags)], check=True)


def curve(scene, folder, options):
    reference = []
    if options.reference_spp:
        render(scene, folder / "right.exr", options, "--spp", options.reference_spp, "--seed", 77, "--float")
        reference = ["--reference", folder / "right.exr"]
    render(scene, folder / "out.exr", options, "--spp", options.spp, "--report", folder / "r.json", *reference)
    return json.loads((folder / "r.json").read_text())


def cell(point):
    if point is None:
        return ""
    estimated = f"{point['relmse']:.2g}"
    return f"{estimated} ({point['true_relmse']:.2g})" if "true_relmse" in point else estimated


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", type=pathlib.Path, nargs="+")
    parser.add_argument("--size", default="128x128")
    parser.add_argument("--spp", type=int, default=1024)
    parser.add_argument("--reference-spp", type=int, default=4096)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--csv", type=pathlib.Path)
    options = parser.parse_args()
    rows = []
    print("| scene | " + " | ".join(f"{n} spp" for n in SHOWN) + " | slope | FLIP at the end | verdict |")
    print("|---" * (len(SHOWN) + 4) + "|")
    with tempfile.TemporaryDirectory() as name:
        for scene in options.scenes:
            report = curve(scene, pathlib.Path(name), options)
            points = {p["spp"]: p for p in report["convergence"]}
            slope = report["slope"]
            told = "" if slope is None else f"{slope:.2f} ({report['slope_ci95'][0]:.2f} to {report['slope_ci95'][1]:.2f})"
            flip = report.get("true_flip")
            print(f"| {scene.stem} | " + " | ".join(cell(points.get(n)) for n in SHOWN) +
                  f" | {told} | {'' if flip is None else format(flip, '.3f')} | {report['verdict']} |", flush=True)
            rows += [[scene.stem, *(p.get(k, "") for k in ("spp", "core_seconds", "relmse", "true_relmse", "true_flip"))] for p in points.values()]
    if options.csv:
        with options.csv.open("w", newline="") as file:
            csv.writer(file).writerows([["scene", "spp", "core_seconds", "relmse", "true_relmse", "true_flip"], *rows])
    return 0


if __name__ == "__main__":
    sys.exit(main())
