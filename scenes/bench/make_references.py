#!/usr/bin/env python3
"""Makes the reference images of the bench scenes: NAME.0.exr and NAME.1.exr, two independent renders by another program.

usage: make_references.py [FOLDER] [--scenes DIR] [--names a,b,c] [--threads N]
FOLDER is `references` beside this file; without DIR the scenes are made by make_bench.py. Each image is rendered by a process of its
own through the adapters in bench/adapters, which say what they need of a machine: here `pip install bpy mitsuba numpy OpenEXR`
for one Python. Images are half floats, compressed without loss. The header's string `reference` names program, version, integrator,
samples and seed. Printed is each image's relMSE, by the difference of both. Which program renders what, and why, is in README.md
beside this file.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time
import types
import xml.etree.ElementTree as ElementTree

import numpy as np
import OpenEXR

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
ADAPTERS = ROOT / "tests" / "bench" / "adapters"
SEEDS = 9001, 9002  # of no race
PASS = 32  # samples of one render by Mitsuba: what a small machine's memory holds
# Cycles where its picture is right; spotfog's edge and surface's plastic are others in it. So many samples that an image's noise is well
# below that of a race of some seconds, and all images take 20 minutes of CPU time.
PLAN = {"shafts": ("cycles", 96), "fogbox": ("cycles", 96), "cloud": ("cycles", 40), "tint": ("cycles", 192),
        "spotfog": ("mitsuba", 1536), "surface": ("mitsuba", 4096)}


def pixels_of(path):
    channels = OpenEXR.File(str(path)).channels()
    whole = next((channels[key].pixels[..., :3] for key in ("RGBA", "RGB") if key in channels), None)
    return np.stack([channels[c].pixels for c in "RGB"], -1) if whole is None else whole


def by_cycles(options, samples):
    import blender_cycles
    import bpy
    blender_cycles.prepare(options)
    blender_cycles.render(options, samples, "image.exr")
    return pixels_of(options.folder / "image.exr"), {"program": "Cycles", "version": bpy.app.version_string, "integrator": "path"}


def by_mitsuba(options, samples):
    import mitsuba3
    mitsuba = mitsuba3.open_mitsuba("llvm_ad_rgb", options.threads)
    scene, integrator = mitsuba3.load(mitsuba, options)
    passes = samples // PASS
    total = sum(np.asarray(mitsuba.render(scene, spp=PASS, seed=1000 * options.seed + k, integrator=integrator).numpy(), np.float64)[..., :3]
                for k in range(passes))
    return total / passes, {"program": "Mitsuba", "version": mitsuba.__version__, "integrator": integrator.class_name()}


def write(path, pixels, about):
    """Refuses what a half float cannot hold."""
    halves = np.asarray(pixels).astype(np.float16)
    if not np.isfinite(halves).all():
        raise SystemExit(f"make_references.py: {path} has values that are no finite half floats")
    header = {"compression": OpenEXR.PIZ_COMPRESSION, "type": OpenEXR.scanlineimage, "reference": json.dumps(about)}
    OpenEXR.File(header, {name: halves[..., k].copy() for k, name in enumerate("RGB")}).write(str(path))


def noise(first, second):
    """relMSE of either image about the mean of both: half of what their difference shows."""
    mean, squares = (first + second) / 2, (first - second) ** 2
    return float((squares / (mean * mean + .01)).mean()) / 2


def make_one(scene, image, seed, threads):
    sys.path.insert(0, str(ADAPTERS))
    film = ElementTree.parse(scene).getroot().find("sensor/film")
    size = [int(film.find(f"integer[@name='{side}']").get("value")) for side in ("width", "height")]
    program, samples = PLAN[scene.stem]
    with tempfile.TemporaryDirectory() as folder:
        options = types.SimpleNamespace(scene=scene, folder=pathlib.Path(folder), size=size, threads=threads, seed=seed, integrator="volpath")
        pixels, about = {"cycles": by_cycles, "mitsuba": by_mitsuba}[program](options, samples)
    write(image, pixels, {**about, "samples": samples, "seed": seed})


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("folder", type=pathlib.Path, nargs="?", default=HERE / "references")
    args.add_argument("--scenes", type=pathlib.Path)
    args.add_argument("--names", default=",".join(PLAN))
    args.add_argument("--threads", type=int, default=2)
    args.add_argument("--one", nargs=3, metavar=("SCENE", "IMAGE", "SEED"), help=argparse.SUPPRESS)
    options = args.parse_args()
    if options.one:
        scene, image, seed = options.one
        return make_one(pathlib.Path(scene), image, int(seed), options.threads)
    if options.scenes is None:
        options.scenes = ROOT / "build" / "bench"
        subprocess.run([sys.executable, HERE / "make_bench.py", options.scenes], check=True)
    options.folder.mkdir(parents=True, exist_ok=True)
    for name in options.names.split(","):
        for k, seed in enumerate(SEEDS):
            start, image = time.monotonic(), options.folder / f"{name}.{k}.exr"
            subprocess.run([sys.executable, __file__, "--threads", str(options.threads), "--one", options.scenes / f"{name}.xml", image, str(seed)],
                           check=True)
            print(f"{image}: {image.stat().st_size} bytes, {time.monotonic() - start:.0f} s", flush=True)
        pair = [pixels_of(options.folder / f"{name}.{k}.exr").astype(np.float64) for k in (0, 1)]
        print(f"{name}: relMSE of each image {noise(*pair):.2g}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
