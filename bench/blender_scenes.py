#!/usr/bin/env python3
"""Files of Blender by others, as they are, by the add-on and by Cycles: one picture of both, and how bright they are.

usage: blender_scenes.py DIR --blender PYTHON [--out DIR] [--size WxH] [--spp N] [SCENE...]
       blender_scenes.py DIR --blender PYTHON --every
DIR holds repositories, each checked out into a folder OWNER+NAME (docs/measurements/blender-scenes.md lists them); SCENE is a name of
SCENES or a path in DIR, by default the scenes of that page. PYTHON has bpy 5 (tests/venv.sh blender); the programs come from LIGHTSHAFT_BIN.
For each scene: how it was read, what the add-on left out and warned of, the seconds of each, our mean over Cycles' and our median over theirs, by channel,
of all pixels, our mean over that of Cycles without limits to its paths and with caustics, and OUT/blend-NAME.jpg, ours on the left. With --every each .blend below DIR is rendered by the add-on in 16 x 12 pixels: whether it is
read, read with Leave Out, read with baked textures besides, refused, or fails. A bench, not a test: needs numpy, Pillow and the OpenEXR package of PyPI.
"""
import argparse
import collections
import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

from agreement import BIN, ROOT, load
from pairs import exposure_for, write_pair

HERE = pathlib.Path(__file__).parent
SCENES = {
    "chess": "ebabel-eu+blender-models/chess/chess-scene.blend",
    "pyramid": "ebabel-eu+blender-models/mayan-temple/mayan-temple-with-stairs.blend",
    "lamp": "ebabel-eu+blender-models/lamp/lamp.blend",
    "axes": "PearCoding+Ignis/scenes/showcase/camera/base.blend",
    "technique": "PearCoding+Ignis/scenes/showcase/technique/scene.blend",
    "lights": "PearCoding+Ignis/scenes/evaluation/blender/lights.blend",
    "sun": "PearCoding+Ignis/scenes/evaluation/blender/sun.blend",
    "normals": "PearCoding+Ignis/scenes/evaluation/blender/normalmap.blend",
    "bumps": "PearCoding+Ignis/scenes/evaluation/blender/bumpmap.blend",
    "fog": "remywu18+CS-148-Final-Project/fog.blend",
    "cornell": "remywu18+CS-148-Final-Project/cornell_box.blend",
    "hydrogen": "tomhepz+scivis-openvdb-blender/Blender/rendering.blend",
}
BATCH = 10  # files that one process opens, one after another
LIMIT = 600  # seconds for these


def blender(options, *rest, limit=None):
    """The answers of blender_file.py, and how it ended if it did not answer for all."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"} | {"LIGHTSHAFT_PROGRAM": str(BIN / "lightshaft")}
    command = [str(c) for c in (options.blender, HERE / "blender_file.py", options.addon, *rest)]
    with tempfile.TemporaryFile("w+", errors="replace") as out:
        try:
            code = subprocess.run(command, stdout=out, stderr=subprocess.STDOUT, env=environment, timeout=limit).returncode
            end = f"ended with {code}"
        except subprocess.TimeoutExpired:
            end = f"no answer within {limit} s"
        out.seek(0)
        text = out.read()
    return [json.loads(line) for line in text.splitlines() if line.startswith('{"file"')], f"{end}: {text[-1000:]}"


def pair(name, file, options):
    frame = [*options.size.split("x"), options.spp]
    images, answers = [], []
    for who, *how in (("ours", "LIGHTSHAFT"), ("cycles", "CYCLES"), ("whole", "CYCLES", "--whole")):
        out = options.out / f"{name}-{who}.exr"
        answer, end = blender(options, file, out, *frame, *how)
        if not answer:
            sys.exit(f"{file}, {who}: {end}")
        answers += answer
        if answer[0].get("verdict") in ("refused", "failed"):
            print(f"| {name} | {answer[0]['version']} | {answer[0]['verdict']}: {answer[0]['still']} |", flush=True)
            return
        images.append(load(out))
    ours, theirs, whole = images
    mine, other, _ = answers
    write_pair(options.out / f"blend-{name}.jpg", ours * exposure_for(theirs), theirs * exposure_for(theirs))
    warnings = mine["warnings"]
    left_out = sum(message.endswith("(left out)") for message in warnings)
    cells = [name, mine["version"], mine["verdict"], left_out, len(warnings) - left_out, f"{mine['seconds']:.0f}", f"{other['seconds']:.0f}",
             over(ours, theirs, np.mean), over(ours, theirs, np.median), over(ours, whole, np.mean)]
    print("|", " | ".join(map(str, cells)), "|", flush=True)
    for warning in warnings:
        print(f"    {warning}", flush=True)


def over(ours, theirs, of):
    return ", ".join(f"{a / b:.3f}" if b else "black" for a, b in zip(of(ours, axis=(0, 1)), of(theirs, axis=(0, 1))))


def every(options):
    tally = collections.Counter()
    files = sorted(file for file in options.folder.rglob("*.blend") if file.is_file())
    while files:
        answers, end = blender(options, "--try", *files[:BATCH], limit=LIMIT)
        if len(answers) < len(files[:BATCH]):  # it ended at the file after these
            answers.append({"file": str(files[len(answers)]), "verdict": "failed", "words": end})
        del files[: len(answers)]
        for answer in answers:
            tally[answer["verdict"]] += 1
            print(json.dumps(answer | {"file": os.path.relpath(answer["file"], options.folder)}), flush=True)
    print(dict(tally))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*")
    parser.add_argument("--blender", required=True)
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("blender-scenes"))
    parser.add_argument("--size", default="160x120")
    parser.add_argument("--spp", type=int, default=128)
    parser.add_argument("--every", action="store_true")
    options = parser.parse_intermixed_args()
    packed = subprocess.run([sys.executable, ROOT / "blender/package.py"], check=True, capture_output=True, text=True)
    options.addon = pathlib.Path(packed.stdout.strip())
    if options.every:
        return every(options)
    options.out.mkdir(parents=True, exist_ok=True)
    print("| scene | version | how | left out | warnings | ours, s | Cycles, s | mean over Cycles' | median over Cycles' | mean over Cycles' without limits |"
          "\n|---|---|---|---:|---:|---:|---:|---|---|---|")
    for scene in options.scenes or SCENES:
        path = options.folder / SCENES.get(scene, scene)
        pair(scene if scene in SCENES else path.stem, path, options)


if __name__ == "__main__":
    main()
