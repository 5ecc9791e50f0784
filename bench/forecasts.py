#!/usr/bin/env python3
"""Predicted against actual time to a target error: every job says at its checkpoints when it will be there; was it?

usage: forecasts.py [--scenes DIR] [--names a,b,c] [--size WxH] [--seeds N] [--samples N] [--threads N] [--keep DIR]
DIR holds NAME.xml; without, the bench scenes are made. Of each scene a first job of --samples samples a pixel (seed 1000) finds an error to aim for: what it ends
with. Then each seed renders to that target, and its report holds what was predicted at every checkpoint (`forecast`: core
seconds still to spend, with a 95 % interval) to be held against the core seconds that it took. Prints a line per scene and the
share within; exits with 1 if it is below 90 % or there are fewer than 70 predictions. Core seconds are CPU time: other load on the machine
changes them by caches alone.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import bench_scenes

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
NAMES = "shafts,fogbox,cloud,spotfog,tint,surface"
LEAST, SHARE = 70, .9


def render(scene, folder, options, *flags):
    report = folder / "report.json"
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", folder / "out.exr", "--size", options.size, "--threads", str(options.threads),
                    "--quiet", "--report", report, *map(str, flags)], check=True)
    return json.loads(report.read_text())


def predictions(report):
    """[(predicted, low, high, actual)] core seconds from each checkpoint that made a prediction to the end."""
    end = report["convergence"][-1]["core_seconds"]
    out = []
    for point in report["convergence"][:-1]:
        forecast = point.get("forecast")
        if forecast:
            low, high = forecast["core_seconds_ci95"]
            out.append((forecast["core_seconds"], low, high, end - point["core_seconds"], point["spp"]))
    return out


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--scenes", type=pathlib.Path)
    parser.add_argument("--names", default=NAMES)
    parser.add_argument("--size", default="64x64")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for every report")
    options = parser.parse_args()
    scenes = bench_scenes.scenes(options.scenes)
    every = []
    print("| scene | target relMSE | predictions | within | median actual / predicted |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for scene in options.names.split(","):
            path = scenes / f"{scene}.xml"
            target = render(path, folder, options, "--spp", options.samples, "--seed", 1000)["relmse"]
            found = []
            for seed in range(options.seeds):
                report = render(path, folder, options, "--target-error", target, "--spp", 64 * options.samples, "--seed", seed)
                if options.keep:
                    options.keep.mkdir(exist_ok=True)
                    (options.keep / f"{scene}.{seed}.json").write_text(json.dumps(report))
                found += predictions(report)
            every += found
            within = sum(low <= actual <= high * (1 + 1e-9) for _, low, high, actual, _ in found)
            ratios = sorted(actual / predicted for predicted, _, _, actual, _ in found if predicted > 0)
            print(f"| {scene} | {target:.3g} | {len(found)} | {within} | {ratios[len(ratios) // 2]:.2f} |", flush=True)
    within = sum(low <= actual <= high * (1 + 1e-9) for _, low, high, actual, _ in every)
    print(f"\n{within} of {len(every)} predictions held, {100 * within / max(1, len(every)):.1f} %")
    return 0 if len(every) >= LEAST and within >= SHARE * len(every) else 1


if __name__ == "__main__":
    sys.exit(main())
