#!/usr/bin/env python3
"""Scenes of pbrt by others, by ours and by another renderer: one picture of both, and how bright they are.

usage: pbrt_scenes.py FOLDER [SCENE...] (--pbrt PROGRAM | --mitsuba PYTHON) [--out DIR] [--size N] [--spp N] [--threads N]
FOLDER holds scenes of pbrt, and SCENE is a path in it, by default those of SCENES (github.com/gonsolo/bitterli in the folder bitterli). The larger side of a picture has --size pixels.
PROGRAM is pbrt-v4. It is given a copy of the scene's main file in the scene's own folder, which must be writable: with another size, as pbrt has no option
for that, and without `maxcomponentvalue`, by which pbrt clamps samples and we do not. The copy is removed afterwards.
PYTHON has mitsuba 3, which is given what `lightshaft convert` writes: it checks light and surfaces, not how the file is read.
For each scene: the seconds of each, our mean over theirs, our median over theirs, by channel, and OUT/pbrt-NAME.jpg (OUT/pbrt-NAME-pbrt.jpg beside pbrt), ours
on the left. A bench, not a test: needs numpy, Pillow and the OpenEXR package of PyPI.
"""
import argparse
import pathlib
import re
import tempfile

import numpy as np

from agreement import BIN, load
from gltf_scenes import run
from pairs import exposure_for, write_pair

SCENES = [f"bitterli/{name}/pbrt/scene-v4.pbrt" for name in ("cornell-box", "veach-mis")]
BESIDE_PBRT = [f"bitterli/{name}/pbrt/scene-v4.pbrt" for name in ("cornell-box", "veach-mis", "veach-bidir", "coffee", "volumetric-caustic")]
RESOLUTION = re.compile(r'"integer ([xy])resolution"\s*(?:\[\s*(\d+)\s*\]|(\d+))')
COMMENT = re.compile(r"#.*")
CLAMP = re.compile(r'"float maxcomponentvalue"\s*(?:\[[^\]]*\]|\S+)')
FILM = re.compile(r'(\bFilm\s+"\w+")')
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
    own = {"x": 1280, "y": 720} | {axis: int(a or b) for axis, a, b in RESOLUTION.findall(COMMENT.sub("", scene.read_text()))}
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


def sized(text, size):
    """The scene's main file with this size, and without a clamp. What the film says itself comes after the name of its kind."""
    plain = CLAMP.sub("", RESOLUTION.sub("", COMMENT.sub("", text)))
    return FILM.sub(r'\1 "integer xresolution" {} "integer yresolution" {}'.format(*size), plain, count=1)


def by_pbrt(program, scene, size, spp, threads, out):
    """Seconds."""
    copy = scene.with_name(f"{scene.stem}-sized.pbrt")
    copy.write_text(sized(scene.read_text(), size))
    try:
        return run(program, "--quiet", "--nthreads", threads, "--spp", spp, "--outfile", out.resolve(), copy)[0]
    finally:
        copy.unlink()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*")
    other = parser.add_mutually_exclusive_group(required=True)
    other.add_argument("--pbrt", type=pathlib.Path)
    other.add_argument("--mitsuba")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("pbrt-scenes"))
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    who = "pbrt" if options.pbrt else "Mitsuba"
    print(f"| scene | warnings | ours, s | {who}, s | mean over {who}'s | median over {who}'s |\n|---|---:|---:|---:|---|---|")
    for path in options.scenes or (BESIDE_PBRT if options.pbrt else SCENES):
        scene = options.folder / path
        name, size = name_of(scene), size_of(scene, options.size)
        ours, theirs = (options.out / f"{name}-{of}.exr" for of in ("ours", who.lower()))
        mine, done = run(BIN / "lightshaft", "render", scene, "-o", ours, "--float", "--size", "{}x{}".format(*size), "--spp", options.spp,
                         "--threads", options.threads, "--quiet")
        if options.pbrt:
            seconds = by_pbrt(options.pbrt.resolve(), scene, size, options.spp, options.threads, theirs)
        else:
            seconds = by_mitsuba(options.mitsuba, scene, size, options.spp, theirs)
        a, b = load(ours), load(theirs)
        picture = options.out / f"pbrt-{name}{'-pbrt' if options.pbrt else ''}.jpg"
        write_pair(picture, a * exposure_for(b), b * exposure_for(b))
        means, medians = ([f"{x / y:.3f}" for x, y in zip(f(a, axis=(0, 1)), f(b, axis=(0, 1)))] for f in (np.mean, np.median))
        print(f"| {name} | {done.stderr.count('warning:')} | {mine:.0f} | {seconds:.0f} | {', '.join(means)} | {', '.join(medians)} |", flush=True)


if __name__ == "__main__":
    main()
