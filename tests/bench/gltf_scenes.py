#!/usr/bin/env python3
"""Scenes of glTF by others, by ours and by Cycles: one picture of both, and how bright they are.

usage: gltf_scenes.py FOLDER --blender PYTHON [--out DIR] [--size WxH] [--spp N] [SCENE...]
FOLDER holds the folder Models of KhronosGroup/glTF-Sample-Assets (see docs/measurements/gltf-scenes.md); SCENE is a path in it, by
default the five of that page. PYTHON has bpy 5 (tests/venv.sh blender). For each scene: the seconds of each, our mean over Cycles' and our
median over theirs, by channel, of the pixels in which Cycles shows something else than the sky, and OUT/NAME.png, ours on the left. A bench, not a test: needs numpy and the OpenEXR package of PyPI.
"""
import argparse
import pathlib
import subprocess
import sys
import time
import zlib

import numpy as np

from agreement import BIN, load

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


def write_png(path, image, exposure):
    coded = np.clip(image * exposure, 0, None)
    coded = np.where(coded <= 0.0031308, 12.92 * coded, 1.055 * np.maximum(coded, 1e-9) ** (1 / 2.4) - 0.055)
    pixels = np.rint(np.clip(coded, 0, 1) * 255).astype(np.uint8)
    height, width, _ = pixels.shape

    def chunk(kind, data):
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")

    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    head = width.to_bytes(4, "big") + height.to_bytes(4, "big") + bytes([8, 2, 0, 0, 0])
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


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
        exposure = 0.8 / max(np.quantile(b, 0.98), 1e-6)
        write_png(options.out / f"{stem}.png", np.concatenate([a, b], axis=1), exposure)
        sky = 1.0 if "environment=1" in choices else 0.0
        seen = np.abs(b - sky).max(axis=-1) > 1e-3
        means, medians = ([f"{x / y:.3f}" for x, y in zip(f(a[seen], axis=0), f(b[seen], axis=0))] for f in (np.mean, np.median))
        warnings = done.stderr.count("warning:")
        print(f"| {stem} | {warnings} | {mine:.0f} | {other:.0f} | {', '.join(means)} | {', '.join(medians)} |", flush=True)


if __name__ == "__main__":
    main()
