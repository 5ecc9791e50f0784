#!/usr/bin/env python3
"""Adapter of race.py for Blender Cycles: one process per seed, pictures of four times the samples each, from nothing.

usage: blender_cycles.py SCENE FOLDER --time S [--clock wall|cpu] --seed N --threads N --size W H [--denoise]
Averaging renders would spoil what its low-discrepancy samples gain, so each picture is rendered anew. What a render costs
whatever its samples (synchronising the scene, writing the file) is measured with few samples and taken off: in its favour.
No clamping, no adaptive sampling, a box filter, the scene's max_depth. With --denoise the pictures are denoised by Open Image
Denoise with albedo and normals, prefiltered, at its high quality; the time of that is part of what a render costs in any case. The scene is translated by
cycles_scene.py, which refuses what it does not know. Needs the package bpy (Blender as a Python module, for the Python version
that it is made for) and Debian's libxi6 libxxf86vm1 libxfixes3 libxrender1 libgl1 libegl1 libxkbcommon0 libsm6 libice6.
"""
import bpy

import cycles_scene
import stopwatch

GROWTH = 4


def prepare(options):
    depth = cycles_scene.build(options.scene)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = options.size
    scene.render.resolution_percentage = 100
    scene.render.threads_mode, scene.render.threads = "FIXED", options.threads
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.use_persistent_data = True
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_guiding = False
    cycles.use_denoising = options.denoise
    if options.denoise:
        cycles.denoiser, cycles.denoising_quality = "OPENIMAGEDENOISE", "HIGH"
        cycles.denoising_input_passes, cycles.denoising_prefilter = "RGB_ALBEDO_NORMAL", "ACCURATE"
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = cycles.volume_bounces = depth
    cycles.transparent_max_bounces = 64
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0


def render(options, spp, name):
    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.seed = spp, options.seed
    scene.render.filepath = str(options.folder / name)
    start = stopwatch.Cost.now()
    bpy.ops.render.render(write_still=True)
    return stopwatch.Cost.now() - start


def main():
    arguments = stopwatch.arguments(__doc__)
    arguments.add_argument("--denoise", action="store_true")
    options = arguments.parse_args()
    prepare(options)
    render(options, 1, "warm.exr")
    one, five = render(options, 1, "warm.exr"), render(options, 5, "warm.exr")
    a_sample = (five - one) * .25
    start = one - a_sample
    start = stopwatch.Cost(max(0., start.wall), max(0., start.cpu))
    per_sample = max(a_sample.seconds(options), 1e-4)
    spp = 4
    while True:
        cost = render(options, spp, f"{spp}.exr") - start
        stopwatch.note(options.folder, f"{spp}.exr", spp, cost)
        spent = cost.seconds(options)
        per_sample = max(per_sample / 4, spent / spp)
        if spent > .7 * options.time:
            return
        most = int(options.time / per_sample)
        if most <= spp:
            return
        spp = GROWTH * spp if 2 * GROWTH * spp <= most else most


if __name__ == "__main__":
    main()
