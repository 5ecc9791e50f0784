#!/usr/bin/env python3
"""Renders a glTF scene by Blender's Cycles, seen by the camera of our translation. Runs under Blender's Python (bpy).

usage: gltf_cycles.py SCENE.glb TRANSLATION.xml OUT.exr WIDTH HEIGHT SAMPLES
Lights are imported in glTF's own units ("COMPAT": a sun's strength is its lux, a lamp's watts are 4 pi candela). The white sky of
-D environment is the world's. Blender turns +y of glTF to +z.
"""
import math
import sys
import xml.etree.ElementTree as ElementTree

import bpy
from mathutils import Matrix

UPRIGHT = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
TURNED = Matrix(((-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1)))


def numbers(element):
    return [float(x) for x in element.get("value").split()]


def main():
    scene_file, translation, out, width, height, samples = sys.argv[1:]
    root = ElementTree.parse(translation).getroot()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=scene_file, export_import_convert_lighting_mode="COMPAT")
    scene = bpy.context.scene
    sensor = root.find("sensor")
    values = {e.get("name"): e.get("value") for e in sensor if e.get("name")}
    data = bpy.data.cameras.new("ours")
    camera = bpy.data.objects.new("ours", data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    m = numbers(sensor.find("transform/matrix"))
    camera.matrix_world = UPRIGHT @ Matrix([m[i : i + 4] for i in range(0, 16, 4)]) @ TURNED
    data.sensor_fit = "VERTICAL"
    data.angle = math.radians(float(values["fov"]))
    data.clip_start, data.clip_end = float(values["near_clip"]), float(values["far_clip"])
    sky = [e for e in root.findall("emitter") if e.get("type") == "constant"]
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    radiance = numbers(sky[0].find("*[@name='radiance']"))[0] if sky else 0
    background.inputs["Strength"].default_value = radiance
    scene.render.engine = "CYCLES"
    scene.cycles.samples = int(samples)
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = scene.cycles.glossy_bounces = 64
    scene.cycles.transmission_bounces = scene.cycles.volume_bounces = scene.cycles.transparent_max_bounces = 64
    scene.cycles.sample_clamp_indirect = scene.cycles.sample_clamp_direct = 0
    scene.cycles.blur_glossy = 0
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = int(width), int(height), 100
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = out
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
