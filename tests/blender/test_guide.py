"""docs/guide/blender.md, "A cube, a sun and fog, in ten steps": each step by what its menu or field calls, and the farm's picture at the end.

Steps 1 and 2 are the fixture `blender`, which packs the add-on and installs the zip.
"""

import math
import pathlib

import numpy as np
import pytest

GUIDE = pathlib.Path(__file__).resolve().parents[2] / "docs/guide/blender.md"



@pytest.fixture
def preferences(blender):
    """Those of the add-on, empty again after the test."""
    found = blender.context.preferences.addons["bl_ext.user_default.lightshaft"].preferences
    yield found
    found.url = found.token = ""


def ten_steps(bpy, farm, preferences):
    preferences.url, preferences.token = farm.url(), farm.token  # 3

    bpy.ops.wm.read_homefile(app_template="", use_factory_startup=True)  # 4
    scene = bpy.context.scene
    scene.render.engine, scene.lightshaft.where = "LIGHTSHAFT", "FARM"

    bpy.data.objects.remove(bpy.data.objects["Light"])  # 5
    bpy.ops.object.light_add(type="SUN", rotation=[math.radians(x) for x in (40, 10, 30)])
    bpy.context.object.data.energy = 3

    bpy.ops.mesh.primitive_plane_add(location=(0, 0, -1))  # 6
    bpy.context.object.scale = (10, 10, 10)

    bpy.ops.mesh.primitive_cube_add()  # 7
    room = bpy.context.object
    room.scale = (6, 6, 6)

    bpy.ops.object.material_slot_add()  # 8: what New of a slot's material does
    room.material_slots[0].material = material = bpy.data.materials.new("Material")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.remove(next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"))
    fog = tree.nodes.new("ShaderNodeVolumePrincipled")
    tree.links.new(fog.outputs[0], next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL").inputs["Volume"])
    fog.inputs["Density"].default_value = 0.05

    scene.lightshaft.samples = 64  # 9
    return scene


def pixels(bpy, scene, path):
    """What Render Image (F12) leaves in Blender, at a twentieth of the size on a side."""
    import OpenEXR

    scene.render.resolution_percentage = 5
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)  # 10
    return np.asarray(next(iter(OpenEXR.File(str(path)).channels().values())).pixels, np.float64)[..., :3]


def test_the_guide_has_ten_steps_and_says_these_values():
    section = GUIDE.read_text().split("## A cube")[1].split("\n## ")[0]

    assert [line.split(".")[0] for line in section.splitlines() if line[:1].isdigit()] == [str(n) for n in range(1, 11)]
    for value in ("*Strength* to 3", "40, 10, 30 degrees", "*Scale* 10, *Location* Z -1", "*Scale* 6", "*Density* to 0.05", "*Samples* to 64"):
        assert value in section, value


def test_ten_steps_from_a_blank_file_to_a_farms_picture_as_cycles_has_it(blender, farm, preferences, tmp_path):
    scene = ten_steps(blender, farm, preferences)

    ours = pixels(blender, scene, tmp_path / "farm.exr")
    scene.render.engine, cycles = "CYCLES", scene.cycles
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = 64, False, False
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.volume_bounces = 64
    cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    theirs = pixels(blender, scene, tmp_path / "cycles.exr")

    job = farm.get("/api/v1/jobs")["jobs"][0]
    assert (job["state"], job["size"], job["spp"]) == ("done", [96, 54], 64)
    assert ours.mean(axis=(0, 1)) == pytest.approx(theirs.mean(axis=(0, 1)), rel=0.03)
