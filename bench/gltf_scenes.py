#!/usr/bin/env python3
"""Scenes of glTF by others, by ours and by Cycles: one picture of both, and how bright they are.

usage: gltf_scenes.py FOLDER --blender PYTHON [--out DIR] [--size WxH] [--spp N] [SCENE...]
FOLDER holds the folder Models of KhronosGroup/glTF-Sample-Assets ; SCENE is a path in it, by
default the five of SCENES. PYTHON has bpy 5 (tests/venv.sh blender). For each scene: the seconds of each, our mean over Cycles' and our
median over theirs, by channel, of the pixels in which Cycles shows something else than the sky, and OUT/gltf-NAME.jpg, ours on the left. A bench, not a test: needs numpy, Pillow
and the OpenEXR package of PyPI.
"""
import argparse
import pathlib
import subprocess
import sys
import time

import numpy as np

from agreement import BIN, load
from pairs import exposure_for, write_pair

HERE = pathlib.Path(__file__).parent
SCENES = {
    "DamagedHelmet/glTF/DamagedHelmet.gltf": ["-D", "environment=1"],
    "LightsPunctualLamp/glTF/LightsPunctualLamp.gltf": [],
    "ToyCar/glTF/ToyCar.gltf": ["-D", "environment=1"],
    "CesiumMilkTruck/glTF-Binary/CesiumMilkTruck.glb": ["-D", "environment=1"],
    "AttenuationTest/glTF-Binary/AttenuationTest.glb": ["-D", "environment=1"],
}


def run(*command):
    begun = time.monotonic()
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, errors="replace")
    if done.returncode:
        sys.exit(f"{command[0]} failed:\n{done.stdout}{done.stderr}")
    return time.monotonic() - begun, done


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--blender", required=True)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("gltf-scenes"))
    parser.add_argument("--size", default="200x150")
    parser.add_argument("--spp", type=int, default=64)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    print("| scene | warnings | ours, s | Cycles, s | mean over Cycles' | median over Cycles' |\n|---|---:|---:|---:|---|---|")
    for name in options.scenes or SCENES:
        scene, stem = options.folder / name, pathlib.Path(name).stem
        choices = SCENES.get(name, ["-D", "environment=1"])
        ours, theirs, xml = (options.out / f"{stem}{end}" for end in ("-ours.exr", "-cycles.exr", ".xml"))
        run(BIN / "lightshaft", "convert", scene, xml, *choices)
        mine, done = run(BIN / "lightshaft", "render", scene, "-o", ours, "--float", "--size", options.size, "--spp", options.spp,
                         "--threads", 1, "--quiet", *choices)
        width, height = options.size.split("x")
        other, _ = run(options.blender, HERE / "gltf_cycles.py", scene, xml, theirs, width, height, options.spp)
        a, b = load(ours)[..., :3], load(theirs)[..., :3]
        write_pair(options.out / f"gltf-{stem}.jpg", a * exposure_for(b), b * exposure_for(b))
        sky = 1.0 if "environment=1" in choices else 0.0
        seen = np.abs(b - sky).max(axis=-1) > 1e-3
        means, medians = ([f"{x / y:.3f}" for x, y in zip(f(a[seen], axis=0), f(b[seen], axis=0))] for f in (np.mean, np.median))
        warnings = done.stderr.count("warning:")
        print(f"| {stem} | {warnings} | {mine:.0f} | {other:.0f} | {', '.join(means)} | {', '.join(medians)} |", flush=True)


if __name__ == "__main__":
    main()
