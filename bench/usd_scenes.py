#!/usr/bin/env python3
"""Stages of USD by others, as they are: what Lightshaft makes of them, beside Blender's import and Cycles.

usage: usd_scenes.py DIR -o FOLDER [--cycles PYTHON] [--only TEXT] [--size WxH] [--spp N]
DIR holds github.com/usd-wg/assets at commit 274fa4584dd6afe7e7d84ea30e1ec9c652858d9a. Of each scene of SCENES it
writes, with --cycles, usd-NAME.jpg: Lightshaft's picture, and right of it that of Cycles, by an interpreter that has
`bpy`, each with an exposure of its own; and prints a row of a table with the ratio of the means of all but the sky.
Needs the package lightshaft[usd]; the programs come from LIGHTSHAFT_BIN. A bench, not a test.
"""

import argparse
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build/release/bin"))
SCENES = {
    "mcusd": "full_assets/McUsd/McUsd.usda",
    "pyramids": "full_assets/SubdivisionSurfaces/Creases_SpinningPyramids.usda",
    "teapots": "full_assets/Teapot/DrawModes.usd",
    "normals": "test_assets/NormalsTextureBiasAndScale/NormalsTextureBiasAndScale.usda",
    "files": "test_assets/TextureFileFormatTests/all_files.usda",
}
BOUNCES = 64


def cycles(stage, out, size, spp):
    """Runs within Blender's Python: its own import, and no setting that leaves light out."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    import addon_utils  # which is found once bpy is there

    addon_utils.enable("cycles")
    bpy.ops.wm.usd_import(filepath=str(stage))
    scene = bpy.context.scene
    scene.render.engine, render, light = "CYCLES", scene.render, scene.cycles
    render.resolution_x, render.resolution_y, render.resolution_percentage = *size, 100
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    light.samples, light.use_denoising, light.use_adaptive_sampling = spp, False, False
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max", "volume"):
        setattr(light, f"{kind}_bounces", BOUNCES)
    light.sample_clamp_indirect = light.blur_glossy = 0
    scene.camera = next(item for item in scene.objects if item.type == "CAMERA")
    if scene.world is None:  # white, where no light is, as Lightshaft does
        scene.world = bpy.data.worlds.new("sky")
        shines = any(item.type == "LIGHT" for item in scene.objects)
        scene.world.use_nodes = True
        background = scene.world.node_tree.nodes["Background"].inputs["Color"]
        background.default_value = (0, 0, 0, 1) if shines else (1, 1, 1, 1)
    render.filepath = str(out)
    bpy.ops.render.render(write_still=True)


def load(path):
    import numpy as np
    import OpenEXR

    channels = OpenEXR.File(str(path)).channels()
    together = next((name for name in ("RGB", "RGBA") if name in channels), None)
    if together:
        return np.asarray(channels[together].pixels, float)[..., :3]
    return np.stack([np.asarray(channels[name].pixels, float) for name in "RGB"], -1)


def pair(name, stage, options):
    import lightshaft.usd
    import numpy as np
    from pairs import exposure_for, write_pair

    folder = options.output / name
    scene = lightshaft.usd.read(stage, size=options.size)
    made = scene.write(folder)
    width, height = options.size
    common = ["-o", folder / "ours.exr", "--float", "--spp", options.spp, "--size", f"{width}x{height}"]
    subprocess.run([str(x) for x in (BIN / "lightshaft", "render", made, *common, "--quiet")], check=True)
    ours, ratio = load(folder / "ours.exr"), "-"
    if options.cycles:
        theirs = folder / "cycles.exr"
        call = [options.cycles, __file__, stage, "-o", theirs, "--as-cycles", "--spp", options.spp]
        call += ["--size", f"{width}x{height}"]
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        subprocess.run([str(x) for x in call], check=True, env=environment, stdout=subprocess.DEVNULL)
        theirs = load(theirs)
        things = ours.any(axis=2) & ~np.isclose(ours, 1, atol=1e-4).all(axis=2)  # neither black nor the sky
        ratio = ", ".join(f"{a / b:.3f}" for a, b in zip(ours[things].mean(axis=0), theirs[things].mean(axis=0)))
        write_pair(options.output / f"usd-{name}.jpg", *(x * exposure_for(x) for x in (ours, theirs)))
    print(f"| {name} | {SCENES[name]} | {len(scene.warnings)} | {ratio} |", flush=True)
    for warning in scene.warnings:
        print(f"    {warning}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    parser.add_argument("--cycles", metavar="PYTHON")
    parser.add_argument("--only", default="")
    parser.add_argument("--size", default="160x120", type=lambda text: tuple(map(int, text.split("x"))))
    parser.add_argument("--spp", default=32, type=int)
    parser.add_argument("--as-cycles", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.as_cycles:
        return cycles(options.scenes, options.output, options.size, options.spp)
    print("| scene | file | warnings | ours / Cycles: red, green, blue |\n|---|---|---|---|")
    for name, path in SCENES.items():
        if options.only in name:
            pair(name, options.scenes / path, options)


if __name__ == "__main__":
    sys.exit(main())
