#!/usr/bin/env python3
"""Denoised images of Lightshaft and of Blender Cycles after the same CPU time.

usage: denoised_race.py [--scenes DIR] [--names a,b,c] [--time S] [--seeds N] [--first SEED] [--out PAGE.md]
       denoised_race.py --difference SPP [--scenes DIR] [--names a,b,c] [--first SEED]
DIR holds NAME.xml and refs/NAME.0.exr, refs/NAME.1.exr (two independent references); without, the bench scenes are made and measured.
Cycles renders each seed for S CPU seconds (over two threads), denoised by its own Open Image Denoise; Lightshaft then renders as many
samples as fit into the CPU time that Cycles took, with --denoise. What both need before the first sample and for denoising is not
counted. relMSE is (x - ref0)(x - ref1) / (ref^2 + 0.01), free of the references' noise in the mean; its standard error is that over
seeds. The references of the default scenes are Cycles' own: where the two renderers differ (a texture filter, a step through a grid),
Lightshaft pays for it. --difference tells by how much: the mean of (a - ref0)(b - ref1) / (ref^2 + 0.01) over two images of
Lightshaft with seeds and SPP samples of their own, which is the squared difference of what both renderers converge to.
Needs the packages bpy, numpy and OpenEXR, and Open Image Denoise (deploy/install-denoiser.sh).
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

import bench_scenes
from denoised import layers, publish
from efficiency import BIN, ROOT, load, relmse

ADAPTER = ROOT / "bench" / "adapters" / "blender_cycles.py"
THREADS = 2


def ours(scene, folder, spp, seed, *more):
    image, report = folder / "ours.exr", folder / "report.json"
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", image, "--float", "--report", report, "--quiet", "--threads", str(THREADS),
                    "--spp", str(spp), "--seed", str(seed), *more], check=True)
    return layers(image), json.loads(report.read_text())


def theirs(scene, folder, size, seconds, seed):
    """The longest picture: its spp, CPU seconds and pixels."""
    done = folder / f"cycles.{seed}"
    done.mkdir()
    subprocess.run([sys.executable, ADAPTER, scene, done, "--time", str(seconds / THREADS), "--clock", "cpu", "--seed", str(seed),
                    "--threads", str(THREADS), "--size", *map(str, size), "--denoise"], check=True, stdout=subprocess.DEVNULL)
    last = json.loads((done / "pictures.jsonl").read_text().splitlines()[-1])
    return last["spp"], last["cpu_seconds"], load(done / last["image"])


def spread(values):
    error = statistics.stdev(values) / len(values) ** .5 if len(values) > 1 else 0
    return f"{statistics.mean(values):.3g} ± {error:.2g}"


def row(scene, references, asked, folder):
    first, second = (load(r) for r in references)
    size = first.shape[1], first.shape[0]
    _, report = ours(scene, folder, 16, 1)
    per_sample = report["core_seconds"] / 16
    raw, denoised, told, cycles, spps = [], [], [], [], []
    for seed in range(asked.first, asked.first + asked.seeds):
        spp, seconds, image = theirs(scene, folder, size, asked.time, seed)
        cycles.append(relmse(image, first, second))
        (plain, clean), report = ours(scene, folder, max(1, round(seconds / per_sample)), seed, "--denoise")
        raw.append(relmse(plain, first, second))
        denoised.append(relmse(clean, first, second))
        told.append(report["denoised"]["relmse"])
        spps.append((report["spp"], spp))
    return (f"| {scene.stem} | {statistics.mean(s[0] for s in spps):.0f} | {spread(raw)} | {spread(denoised)} | {statistics.mean(told):.3g} "
            f"| {statistics.mean(s[1] for s in spps):.0f} | {spread(cycles)} | {statistics.mean(cycles) / statistics.mean(denoised):.1f} |")


def difference(scene, references, asked, folder):
    first, second = (load(r) for r in references)
    a, b = (ours(scene, folder, asked.difference, seed)[0][0] for seed in (asked.first, asked.first + 1))
    mean = (first + second) / 2
    products = (((a - first) * (b - second) + (a - second) * (b - first)) / 2 / (mean * mean + .01)).mean(axis=-1)
    return f"{scene.stem}: {products.mean():.2g} ± {products.std() / products.size ** .5:.1g}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=pathlib.Path)
    parser.add_argument("--names", default="shafts,fogbox,cloud,tint",
                        help="not spotfog and surface: the spot and the surfaces of Cycles differ from those of the others")
    parser.add_argument("--time", type=float, default=10, help="CPU seconds")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--difference", type=int, metavar="SPP")
    parser.add_argument("--out", type=pathlib.Path)
    asked = parser.parse_args()
    scenes = bench_scenes.scenes(asked.scenes)
    lines = ["| scene | spp | relMSE | denoised | told | Cycles' spp | denoised | Cycles / Lightshaft |", "|---|---|---|---|---|---|---|---|"]
    for name in asked.names.split(","):
        with tempfile.TemporaryDirectory() as folder:
            if asked.difference:
                print(difference(scenes / f"{name}.xml", bench_scenes.references(scenes, name), asked, pathlib.Path(folder)), flush=True)
                continue
            lines.append(row(scenes / f"{name}.xml", bench_scenes.references(scenes, name), asked, pathlib.Path(folder)))
        print(lines[-1], flush=True)
    if asked.difference:
        return
    publish("Denoised images beside Cycles", f"{{made}}: {asked.time:g} CPU seconds an image, {asked.seeds} seeds, mean and its standard "
            "error. What the columns are and what is counted: see the script.", lines, asked.out)


if __name__ == "__main__":
    main()
