#!/usr/bin/env python3
"""Scenes of pbrt by others, by ours and by Mitsuba 3: one picture of both, and how bright they are.

usage: pbrt_scenes.py FOLDER --mitsuba PYTHON [--out DIR] [--size N] [--spp N] [SCENE...]
FOLDER holds the scenes of docs/measurements/pbrt-scenes.md, and SCENE is a path in it, by default those with pictures there. PYTHON has
mitsuba 3, which is given what `lightshaft convert` writes: it checks light and surfaces, not how the file is read. The larger side of a picture has --size pixels.
For each scene: the seconds of each, our mean over Mitsuba's, our median over Mitsuba's, by channel, and OUT/pbrt-NAME.jpg, ours on the left. A bench, not a
test: needs numpy, Pillow and the OpenEXR package of PyPI.
"""
import argparse
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
]
RESOLUTION = re.compile(r'"integer ([xy])resolution"\s*(?:\[\s*)?(\d+)')
# Parameters that only ours knows, as `convert` writes them.
OURS = re.compile(r'\s*<boolean name="(?:multiple_scattering|flat_without_normals)"[^>]*/>')
RENDER = """
import sys, mitsuba as mi
mi.set_variant("scalar_rgb")
scene = mi.load_file(sys.argv[1])
mi.Bitmap(mi.render(scene, spp=int(sys.argv[3]))).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False).write(sys.argv[2])
"""


def name_of(scene):
    return scene.parent.parent.name if scene.stem == "scene-v4" else scene.stem


def size_of(scene, largest):
    own = {axis: int(count) for axis, count in RESOLUTION.findall(scene.read_text())}
    return [max(1, round(own[axis] * largest / max(own.values()))) for axis in "xy"]


def by_mitsuba(python, scene, size, spp, out):
    """Seconds."""
    with tempfile.TemporaryDirectory() as folder:
        xml = pathlib.Path(folder, "scene.xml")
        run(BIN / "lightshaft", "convert", scene, xml)
        text = OURS.sub("", xml.read_text())
        for axis, count in zip(("width", "height"), size):
            text = re.sub(rf'(<integer name="{axis}" value=")\d+', rf"\g<1>{count}", text)
        xml.write_text(text)
        return run(python, "-c", RENDER, xml, out.resolve(), spp)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--mitsuba", required=True)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("pbrt-scenes"))
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--spp", type=int, default=64)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    print("| scene | warnings | ours, s | Mitsuba, s | mean over Mitsuba's | median over Mitsuba's |\n|---|---:|---:|---:|---|---|")
    for path in options.scenes or SCENES:
        scene = options.folder / path
        name, size = name_of(scene), size_of(scene, options.size)
        ours, theirs = (options.out / f"{name}-{who}.exr" for who in ("ours", "mitsuba"))
        mine, done = run(BIN / "lightshaft", "render", scene, "-o", ours, "--float", "--size", "{}x{}".format(*size), "--spp", options.spp,
                         "--threads", 1, "--quiet")
        other = by_mitsuba(options.mitsuba, scene, size, options.spp, theirs)
        a, b = load(ours), load(theirs)
        write_pair(options.out / f"pbrt-{name}.jpg", a * exposure_for(b), b * exposure_for(b))
        means, medians = ([f"{x / y:.3f}" for x, y in zip(f(a, axis=(0, 1)), f(b, axis=(0, 1)))] for f in (np.mean, np.median))
        print(f"| {name} | {done.stderr.count('warning:')} | {mine:.0f} | {other:.0f} | {', '.join(means)} | {', '.join(medians)} |", flush=True)


if __name__ == "__main__":
    main()
