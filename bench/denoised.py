#!/usr/bin/env python3
"""How much error denoising leaves, and whether the figures that Lightshaft tells of it are right.

usage: denoised.py SCENE.xml[@WxH]... [--seeds N] [--first SEED] [--spp N] [--reference-spp N] [--out PAGE.md] [--sharing]
Renders each scene with N seeds and --denoise. The true relMSE is (x - ref0)(x - ref1) / (ref^2 + 0.01) against two references with
seeds of their own: free of the references' noise in the mean. `told` is the mean over seeds of the report's estimate, `covered` the
share of the report's 95 % intervals that hold the true value; a true value that is not known to a quarter of the interval's half
width, because of the references' noise, has no say, nor has a seed without an interval.
--sharing prints another table: the same with `path_reuse` and without, and what the denoised error is at equal time (error times
core seconds, that without sharing over that with it; below 1 sharing loses). Needs Open Image Denoise (deploy/install-denoiser.sh), numpy, and the OpenEXR
package of PyPI.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

import numpy
import OpenEXR

from efficiency import BIN, ROOT


def layers(path):
    """The image and, if it has one, its denoised image: arrays of height x width x 3."""
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    def rgb(prefix):
        return numpy.stack([channels[prefix + c].pixels.astype(numpy.float64) for c in "RGB"], axis=-1)
    return rgb(""), rgb("denoised.") if "denoised.R" in channels else None


def render(scene, folder, size, spp, seed, *more):
    out, report = folder / "out.exr", folder / "report.json"
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--float", "--report", report, "--quiet", "--spp", str(spp), "--seed", str(seed),
                    *(["--size", size] if size else []), *more], check=True)
    return layers(out), json.loads(report.read_text())


def against(image, first, second):
    """The true relMSE and mean squared error, each with the standard error that the references' noise gives it."""
    mean = (first + second) / 2
    out = []
    for weight in (1 / (mean * mean + 0.01), numpy.ones_like(mean)):
        product = (image - first) * (image - second) * weight
        noise = (weight * (numpy.abs(image - mean) * numpy.abs(first - second))).sum(axis=-1)
        out.append((product.mean(), numpy.sqrt((noise ** 2).sum()) / product.size))
    return out


def row(name, size, asked, folder):
    scene = pathlib.Path(name)
    references = [render(scene, folder, size, asked.reference_spp, 10**6 + i)[0][0] for i in (0, 1)]
    raw, true, told, covered, true_rmse, told_rmse, covered_rmse = [], [], [], [], [], [], []
    for seed in range(asked.first, asked.first + asked.seeds):
        (image, denoised), report = render(scene, folder, size, asked.spp, seed, "--denoise")
        figures = report["denoised"]
        raw.append(against(image, *references)[0][0])
        (relmse, relmse_error), (mse, mse_error) = against(denoised, *references)
        true.append(relmse)
        told.append(figures["relmse"])
        low, high = figures["relmse_ci95"] or (0, 0)
        if relmse_error < (high - low) / 8:
            covered.append(low <= relmse <= high)
        true_rmse.append(max(0, mse))
        told_rmse.append(figures["rmse"] ** 2)
        low, high = (r * r for r in figures["rmse_ci95"] or (0, 0))
        if mse_error < (high - low) / 8:
            covered_rmse.append(low <= mse <= high)

    def share(held):
        return f"{sum(held)} of {len(held)}" if held else "not known"
    mean = statistics.mean
    return (f"| {scene.stem} | {mean(raw):.3g} | {mean(true):.3g} | {mean(raw) / mean(true):.1f} | {mean(told):.3g} | {share(covered)} "
            f"| {mean(true_rmse) ** .5:.3g} | {mean(told_rmse) ** .5:.3g} | {share(covered_rmse)} |")


def sharing_row(name, size, asked, folder):
    scene = pathlib.Path(name)
    references = [render(scene, folder, size, asked.reference_spp, 10**6 + i)[0][0] for i in (0, 1)]
    cells, costs = [], []
    for techniques in ("+path_reuse", "-path_reuse"):
        seconds, raw, true = [], [], []
        for seed in range(asked.first, asked.first + asked.seeds):
            (image, denoised), report = render(scene, folder, size, asked.spp, seed, "--denoise", f"--techniques={techniques}")
            seconds.append(report["core_seconds"])
            raw.append(against(image, *references)[0][0])
            true.append(against(denoised, *references)[0][0])
        error = statistics.stdev(true) / len(true) ** .5
        cells.append(f"{statistics.mean(seconds):.2f} | {statistics.mean(raw):.3g} | {statistics.mean(true):.3g} +- {error:.1g}")
        costs.append([statistics.mean(seconds) * x for x in (statistics.mean(raw), statistics.mean(true))])
    return f"| {scene.stem} | {cells[0]} | {cells[1]} | {costs[1][0] / costs[0][0]:.2f} | {costs[1][1] / costs[0][1]:.2f} |"


def publish(title, about, lines, out):
    """Writes the page with the table to the file `out`, or prints it. `{made}` in `about` is the command and its commit."""
    commit = subprocess.run(["git", "describe", "--always", "--dirty", "--abbrev=8"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
    command = " ".join(pathlib.Path(a).name if "/" in a else a for a in sys.argv)
    page = f"# {title}\n\n" + about.format(made=f"Made by `bench/{command}`, commit {commit}") + "\n\n" + "\n".join(lines) + "\n"
    if out:
        out.write_text(page)
    else:
        print(page)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--reference-spp", type=int, default=2048)
    parser.add_argument("--out", type=pathlib.Path)
    parser.add_argument("--sharing", action="store_true")
    asked = parser.parse_args()
    lines = ["| scene | relMSE | denoised | ratio | told | covered | RMSE, denoised | told | covered |", "|---|---|---|---|---|---|---|---|---|"]
    if asked.sharing:
        lines = ["| scene | shared: core seconds | relMSE | denoised | alone: core seconds | relMSE | denoised | efficiency of sharing | denoised |",
                 "|---|---|---|---|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as folder:
        for named in asked.scenes:
            name, _, size = named.partition("@")
            lines.append((sharing_row if asked.sharing else row)(name, size, asked, pathlib.Path(folder)))
            print(lines[-1], flush=True)
    publish("The error of denoised images", "{made}. What the columns are: see the script, and "
            "[design/denoising.md](../design/denoising.md) for the estimate.", lines, asked.out)


if __name__ == "__main__":
    main()
