#!/usr/bin/env python3
"""Renders a .blend file as it is, by the add-on on this machine or by Cycles. Runs under Blender's Python (bpy).

usage: blender_file.py ADDON.zip SCENE.blend OUT.exr WIDTH HEIGHT SAMPLES LIGHTSHAFT|CYCLES [--whole]
       blender_file.py ADDON.zip --try SCENE.blend...
Scripts of the file are not run. Size, samples, engine and file format are set; so is what would make the pictures of the two engines
incomparable: Cycles clamps, denoises and adapts nothing, and neither compositor nor sequencer follow. Paths are as long as the file says,
for Cycles, and caustics are there if it says so; with --whole Cycles leaves out no light. What the add-on refuses is rendered as its words advise: Bake Procedural Textures is pressed, and
Not in Lightshaft: Leave Out chosen. With --try each file is only tried so, in 16 x 12 pixels by one sample; one without a camera gets
one that looks at all of it. A line of JSON is printed for each file: the words of a refusal, what the add-on warned of, the seconds,
and of --try the verdict.
"""
import argparse
import json
import os
import pathlib
import sys
import tempfile
import time

ADDON = "bl_ext.user_default.lightshaft"
BOUNCES = 64
BAKE = 1024  # pixels on a side of a baked texture, as the button has it


def started(addon):
    """Blender with the add-on as a user installs it; what its export warns of goes to the list that is returned."""
    resources = tempfile.TemporaryDirectory()
    os.environ["BLENDER_USER_RESOURCES"] = resources.name  # before bpy is loaded: it looks once
    import bpy

    bpy.ops.extensions.package_install_files(filepath=str(addon.resolve()), repo="user_default", enable_on_install=True)
    told, engine = [], sys.modules[f"{ADDON}.engine"]
    export = engine.export

    def listened(*arguments):
        path, document, warnings = export(*arguments)
        told.extend(warnings)
        return path, document, warnings

    engine.export = listened
    return bpy, told, resources


def opened(bpy, file):
    bpy.ops.wm.open_mainfile(filepath=str(file.resolve()), load_ui=False, use_scripts=False)
    return bpy.context.scene


def prepare(scene, engine, size, samples):
    render, light, ours = scene.render, scene.cycles, scene.lightshaft
    render.engine = engine
    render.resolution_x, render.resolution_y, render.resolution_percentage = *size, 100
    render.use_compositing = render.use_sequencer = False
    render.threads_mode, render.threads = "FIXED", 1
    render.image_settings.media_type, render.image_settings.file_format = "IMAGE", "OPEN_EXR"
    render.image_settings.color_depth, render.image_settings.color_management = "32", "FOLLOW_SCENE"
    ours.where, ours.samples = "LOCAL", samples
    light.device, light.samples, light.use_adaptive_sampling, light.use_denoising = "CPU", samples, False, False
    light.sample_clamp_direct = light.sample_clamp_indirect = light.blur_glossy = 0
    light.time_limit = 0


def leave_out_no_light(scene):
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max", "volume"):
        setattr(scene.cycles, f"{kind}_bounces", BOUNCES)
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = True
    scene.cycles.use_fast_gi = False


def rendered(bpy, out=None):
    """Seconds; RuntimeError with what Blender reports."""
    begun = time.monotonic()
    if out:
        bpy.context.scene.render.filepath = str(out.resolve())
    bpy.ops.render.render(write_still=out is not None)
    return time.monotonic() - begun


def add_camera(bpy, scene):
    from mathutils import Matrix, Vector

    places = [item.matrix_world @ Vector(corner) for item in scene.objects if item.type == "MESH" for corner in item.bound_box]
    low, high = (Vector([f((p[axis] for p in places), default=0) for axis in range(3)]) for f in (min, max))
    away = Vector((0.6, -0.7, 0.4)).normalized()
    data = bpy.data.cameras.new("Everything")
    data.clip_end = 1e4 + 10 * (high - low).length
    camera = bpy.data.objects.new("Everything", data)
    scene.collection.objects.link(camera)
    middle = (low + high) / 2
    camera.matrix_world = Matrix.Translation(middle + away * (2 * (high - low).length + 1)) @ away.to_track_quat("Z", "Y").to_matrix().to_4x4()
    scene.camera = camera


def attempt(bpy, out=None):
    """'read', 'refused' or 'failed', the words, and the seconds."""
    begun = time.monotonic()
    try:
        rendered(bpy, out)
        return "read", "", time.monotonic() - begun
    except RuntimeError as error:
        words = str(error).strip()
        failed = "add-on has a bug" in words or "lightshaft render:" in words
        return "failed" if failed else "refused", words, time.monotonic() - begun


def by_lightshaft(bpy, told, out, bake_size):
    """The first words, and what came of them: 'read', 'left out', 'baked', 'refused' or 'failed'."""
    verdict, words, seconds = attempt(bpy, out)
    answer = {"verdict": verdict, "words": words, "seconds": seconds}
    if verdict == "refused":
        bpy.context.scene.lightshaft.unsupported = "LEAVE_OUT"
        verdict, still, answer["seconds"] = attempt(bpy, out)
        answer["verdict"] = "left out" if verdict == "read" else verdict
        if verdict == "refused" and "Bake Procedural Textures" in still:
            try:
                bpy.ops.lightshaft.bake(size=bake_size)
            except RuntimeError as error:
                return answer | {"still": f"{still}\n{error}"}
            verdict, still, answer["seconds"] = attempt(bpy, out)
            answer["verdict"] = "baked" if verdict == "read" else verdict
        answer["still"] = still
    return answer | {"warnings": list(told)}


def tried(bpy, told, file):
    try:
        scene = opened(bpy, file)
    except RuntimeError as error:
        return {"verdict": "not opened", "words": str(error).strip()}
    answer = {"version": version_of(bpy), "camera": scene.camera is not None}
    if scene.camera is None:
        add_camera(bpy, scene)
    prepare(scene, "LIGHTSHAFT", (16, 12), 1)
    return answer | by_lightshaft(bpy, told, None, 64)


def version_of(bpy):
    return ".".join(map(str, bpy.data.version[:2]))


def answer_for(bpy, told, options, scene):
    opened(bpy, scene)
    out, width, height, samples, engine = options.rest
    prepare(bpy.context.scene, engine, (int(width), int(height)), int(samples))
    if options.whole:
        leave_out_no_light(bpy.context.scene)
    answer = {"version": version_of(bpy)}
    if engine == "LIGHTSHAFT":
        return answer | by_lightshaft(bpy, told, pathlib.Path(out), BAKE)
    return answer | {"seconds": rendered(bpy, pathlib.Path(out))}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("addon", type=pathlib.Path)
    parser.add_argument("rest", nargs="+")
    parser.add_argument("--whole", action="store_true")
    parser.add_argument("--try", action="store_true", dest="only_try")
    options = parser.parse_args()
    bpy, told, resources = started(options.addon)
    files = options.rest if options.only_try else [options.rest.pop(0)]
    for file in map(pathlib.Path, files):
        del told[:]
        answer = tried(bpy, told, file) if options.only_try else answer_for(bpy, told, options, file)
        print("\n" + json.dumps({"file": str(file), **answer}), flush=True)
    resources.cleanup()
    os._exit(0)  # what Blender tears down at exit is not what is tested


if __name__ == "__main__":
    main()
