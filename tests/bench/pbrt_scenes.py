#!/usr/bin/env python3
"""Scenes of pbrt by others, by ours and by pbrt-v4: one picture of both, and how bright they are.

usage: pbrt_scenes.py FOLDER --pbrt PROGRAM [--out DIR] [--size N] [--spp N] [SCENE...]
FOLDER holds the scenes of docs/measurements/pbrt-scenes.md, and SCENE is a path in it, by default the five of that page with pictures. PROGRAM
is pbrt-v4, which is given the scene with another resolution in its Film, and N samples for each pixel, as ours is. The larger side has --size pixels.
For each scene: the seconds of each, our mean over pbrt's, our median over pbrt's, by channel, and OUT/pbrt-NAME.jpg, ours on the left. A bench, not a test:
needs numpy, Pillow and the OpenEXR package of PyPI.
"""
import argparse
import os
import pathlib
import re
import tempfile

import numpy as np

from agreement import BIN, load
from gltf_scenes import run
from pairs import exposure_for, write_pair

SCENES = [
    "bitterli/cornell-box/pbrt/scene-v4.pbrt",
    "bitterli/veach-mis/pbrt/scene-v4.pbrt",
    "bitterli/volumetric-caustic/pbrt/scene-v4.pbrt",
    "bitterli/coffee/pbrt/scene-v4.pbrt",
    "pbrt-minus/example/cornell-box-specular.pbrt",
]
RESOLUTION = re.compile(r'("integer ([xy])resolution"\s*)(?:\[\s*)?(\d+)(?:\s*\])?')


def name_of(scene):
    return scene.parent.parent.name if scene.stem == "scene-v4" else scene.stem


def size_of(text, largest):
    own = {axis: int(count) for _, axis, count in RESOLUTION.findall(text)}
    scale = largest / max(own.values())
    return {axis: max(1, round(count * scale)) for axis, count in own.items()}


def by_pbrt(program, scene, size, spp, out):
    """Seconds. The changed scene stands in a folder of its own, in which the files that it names are links."""
    with tempfile.TemporaryDirectory() as folder:
        for file in scene.parent.iterdir():
            os.symlink(file.resolve(), pathlib.Path(folder, file.name))
        changed = pathlib.Path(folder, "changed.pbrt")
        changed.write_text(RESOLUTION.sub(lambda m: f"{m[1]}[ {size[m[2]]} ]", scene.read_text()))
        return run(program, "--quiet", "--nthreads", 1, "--spp", spp, "--outfile", out.resolve(), changed)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--pbrt", required=True)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("pbrt-scenes"))
    parser.add_argument("--size", type=int, default=200)
    parser.add_argument("--spp", type=int, default=64)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    print("| scene | warnings | ours, s | pbrt, s | mean over pbrt's | median over pbrt's |\n|---|---:|---:|---:|---|---|")
    for path in options.scenes or SCENES:
        scene = options.folder / path
        name, size = name_of(scene), size_of(scene.read_text(), options.size)
        ours, theirs = (options.out / f"{name}-{who}.exr" for who in ("ours", "pbrt"))
        mine, done = run(BIN / "lightshaft", "render", scene, "-o", ours, "--float", "--size", f"{size['x']}x{size['y']}", "--spp",
                         options.spp, "--threads", 1, "--quiet")
        other = by_pbrt(options.pbrt, scene, size, options.spp, theirs)
        a, b = load(ours), load(theirs)
        write_pair(options.out / f"pbrt-{name}.jpg", a * exposure_for(b), b * exposure_for(b))
        means, medians = ([f"{x / y:.3f}" for x, y in zip(f(a, axis=(0, 1)), f(b, axis=(0, 1)))] for f in (np.mean, np.median))
        print(f"| {name} | {done.stderr.count('warning:')} | {mine:.0f} | {other:.0f} | {', '.join(means)} | {', '.join(medians)} |", flush=True)


if __name__ == "__main__":
    main()
