"""Bakes procedural textures, volumes and worlds with Cycles, so that they can be exported."""

import math
import pathlib
import tempfile

import bpy
import mathutils
import numpy as np

from . import voxels
from .nodes import Place, constant, output_node
from .textures import bake_key, exported_as_it_is
from .volumes import VARYING
from .world import BAKED, BAKED_SUN, is_readable

INPUTS = {
    "Base Color", "Color", "Roughness", "Metallic", "Alpha", "Transmission Weight", "Emission Color", "Fac", "Factor",
}  # fmt: skip
SHADERS = {"BSDF_PRINCIPLED", "BSDF_DIFFUSE", "BSDF_GLOSSY", "EMISSION", "MIX_SHADER"}


def procedural_inputs(material):
    """The (node, input) pairs of shaders whose value cannot be exported directly. Nodes in groups cannot be baked
    separately."""
    for node in material.node_tree.nodes if material.node_tree else ():
        if node.type in SHADERS:
            place = Place(node)
            for socket in node.inputs:
                if socket.name in INPUTS and socket.is_linked and constant(place, socket) is None:
                    source, output = place.source(socket)
                    if source is not None and not exported_as_it_is(source, output):
                        yield node, socket


class LIGHTSHAFT_OT_bake(bpy.types.Operator):
    """Bakes what feeds the shaders of all materials and the world, and is no image, into images; press again after a change"""

    bl_idname = "lightshaft.bake"
    bl_label = "Bake Procedural Textures"

    size: bpy.props.IntProperty(name="Size", default=1024, min=16, max=8192)
    voxels: bpy.props.IntProperty(
        name="Voxels",
        description="Voxels across the longest side of a volume whose shader varies by nodes",
        default=96,
        min=2,
        max=voxels.MOST_ACROSS,
    )

    def execute(self, context):
        scene, baked = context.scene, 0
        engine, samples, active, selected = (
            scene.render.engine,
            scene.cycles.samples,
            context.view_layer.objects.active,
            context.selected_objects,
        )
        scene.render.engine, scene.cycles.samples = "CYCLES", 1
        done, failed = set(), {}
        try:
            for item in [o for o in context.view_layer.objects if o.type == "MESH" and not o.hide_render]:
                for material in dict.fromkeys(slot.material for slot in item.material_slots if slot.material):
                    try:
                        for node, socket in list(voxels.varying_inputs(material, VARYING)):
                            voxels.bake(context, item, material, node, socket, self.voxels)
                            baked += 1
                        if material in done:
                            continue
                        for node, socket in list(procedural_inputs(material)):
                            self.bake(context, item, material, node, socket)
                            baked += 1
                        done.add(material)
                    except RuntimeError as error:  # another object that has it may do
                        why = str(error).strip().removeprefix("Error: ")
                        failed.setdefault(material, f"object '{item.name}', material '{material.name}': {why}")
        finally:
            scene.render.engine, scene.cycles.samples = engine, samples
            select(context, active, selected)
        world = context.view_layer.world_override or scene.world
        if world is not None and not is_readable(world):
            for problem in bake_world(world, self.size):
                self.report({"WARNING"}, f"world '{world.name}': {problem}")
            baked += 1
        for material in [m for m in failed if m not in done]:
            self.report(
                {"WARNING"},
                f"{failed[material]}. What is hidden in the viewport or linked cannot be baked: show it, or make it local",
            )
        self.report({"INFO"}, f"{baked} inputs baked")
        return {"FINISHED"}

    def bake(self, context, item, material, node, socket):
        users = [
            o.name
            for o in context.view_layer.objects
            if o.type == "MESH" and material.name in o.data.materials
        ]
        if len({o.data for o in context.view_layer.objects if o.name in users}) > 1:
            self.report(
                {"WARNING"},
                f"material '{material.name}': objects {', '.join(users)} share it; it is baked as it is on '{item.name}'",
            )
        select(context, item, [item])
        if not item.data.uv_layers:
            bpy.ops.object.mode_set(mode="EDIT")
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.uv.smart_project(island_margin=0.02)
            bpy.ops.object.mode_set(mode="OBJECT")
        image = bpy.data.images.new(
            f"{material.name} {socket.name}", self.size, self.size, float_buffer=True, is_data=True
        )
        tree = material.node_tree
        output = output_node(tree, "OUTPUT_MATERIAL")
        before = output.inputs["Surface"].links[0].from_socket
        target, glow = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeEmission")
        try:
            target.image, tree.nodes.active = image, target
            tree.links.new(socket.links[0].from_socket, glow.inputs["Color"])
            tree.links.new(glow.outputs[0], output.inputs["Surface"])
            bpy.ops.object.bake(type="EMIT", margin=8)
        finally:
            tree.links.new(before, output.inputs["Surface"])
            tree.nodes.remove(target)
            tree.nodes.remove(glow)
        image.pack()
        material[bake_key(node, socket)] = image.name


SUN_SIDE, SUN_SAMPLES = 64, 64  # of the picture of the sun alone, 1.5 times as wide as its disk
WIDEST = 2.6  # angle of that picture [rad]


def bake_world(world, size):
    """Bakes the world's surface into an image of all directions, 2 * size x size pixels. The disk of a Sky Texture's sun is
    too small for such an image: it becomes a lamp of the same direction, size and irradiance. Returns problems in words."""
    problems = []
    if any(node.type == "LIGHT_PATH" for node in all_nodes(world.node_tree)):
        problems.append("it depends on Light Path; it is baked as the camera sees it")
    if BAKED_SUN in world:
        del world[BAKED_SUN]
    with tempfile.TemporaryDirectory() as folder, WorldPicture(world, pathlib.Path(folder) / "world.exr") as picture:
        suns = [n for n in all_nodes(picture.world.node_tree) if n.type == "TEX_SKY" and n.sun_disc and "SCATTERING" in n.sky_type and n.sun_size > 0]
        if len(suns) == 1 and not picture.shared_groups:
            sun, disk = suns[0], suns[0].sun_size
            towards = sun_direction(sun)
            with_disk = picture.irradiance(towards, 1.5 * disk)
            sun.sun_disc = False
            irradiance = np.maximum(with_disk - picture.irradiance(towards, 1.5 * disk), 0)
            if irradiance.max() > 0:
                world[BAKED_SUN] = [*towards, math.degrees(disk / 2), *map(float, irradiance)]
            elif sun.sun_intensity > 0 and sun.sun_elevation > 0:
                sun.sun_disc = True
                problems.append("the sun of its Sky Texture was not found in the direction of its nodes; it is baked into the image and will be blurred")
        elif suns:
            problems.append("it has several suns, or one in a group; they are baked into the image and will be blurred")
        image = picture.panorama(size)
        image.name = f"{world.name} baked"
        image.pack()
    world[BAKED] = image.name
    return problems


def all_nodes(tree):
    for node in tree.nodes:
        yield node
        if node.type == "GROUP" and node.node_tree:
            yield from all_nodes(node.node_tree)


def sun_direction(sky):
    """Returns the direction of a Sky Texture's sun: its rotation is from +y towards +x."""
    level = math.cos(sky.sun_elevation)
    return level * math.sin(sky.sun_rotation), level * math.cos(sky.sun_rotation), math.sin(sky.sun_elevation)


class WorldPicture:
    """A scene of its own in which Cycles sees nothing but a copy of a world, without its Volume."""

    def __init__(self, world, path):
        self.path, self.world = path, world.copy()
        self.shared_groups = any(n.type == "GROUP" for n in self.world.node_tree.nodes)
        output = output_node(self.world.node_tree, "OUTPUT_WORLD")
        for link in list(output.inputs["Volume"].links):
            self.world.node_tree.links.remove(link)
        self.world.cycles_visibility.camera = True
        self.scene = bpy.data.scenes.new("Lightshaft world")
        self.camera = bpy.data.objects.new("Lightshaft world", bpy.data.cameras.new("Lightshaft world"))
        self.scene.collection.objects.link(self.camera)
        self.scene.world, self.scene.camera = self.world, self.camera

    def __enter__(self):
        return self

    def __exit__(self, *_):
        data = self.camera.data
        bpy.data.scenes.remove(self.scene)
        bpy.data.objects.remove(self.camera)
        bpy.data.cameras.remove(data)
        bpy.data.worlds.remove(self.world)

    def irradiance(self, towards, angle):
        """Returns what a plane that faces this direction receives from a square of about this angle [rad], in three
        channels."""
        data = self.camera.data
        data.type, data.sensor_fit, data.angle = "PERSP", "HORIZONTAL", min(angle, WIDEST)
        self.camera.rotation_euler = mathutils.Vector(towards).to_track_quat("-Z", "Y").to_euler()
        image = self.render(SUN_SIDE, SUN_SIDE, SUN_SAMPLES)
        pixels = np.array(image.pixels[:]).reshape(SUN_SIDE, SUN_SIDE, -1)[..., :3]
        bpy.data.images.remove(image)
        # A pixel's solid angle is its area in the plane at distance 1, times cos^3; Blender limits narrow angles.
        half = math.tan(data.angle / 2)
        across = ((np.arange(SUN_SIDE) + 0.5) / SUN_SIDE * 2 - 1) * half
        cosine = 1 / np.sqrt(1 + across[:, None] ** 2 + across[None, :] ** 2)
        return (pixels * cosine[..., None] ** 4).sum((0, 1)) * (2 * half / SUN_SIDE) ** 2

    def panorama(self, size):
        """Returns an image of all directions, whose middle is the direction +x."""
        data = self.camera.data
        data.type, data.panorama_type = "PANO", "EQUIRECTANGULAR"
        self.camera.rotation_euler = (math.pi / 2, 0, -math.pi / 2)
        return self.render(2 * size, size, 16)

    def render(self, width, height, samples):
        render, cycles = self.scene.render, self.scene.cycles
        render.engine, render.resolution_x, render.resolution_y, render.resolution_percentage = "CYCLES", width, height, 100
        cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = samples, False, False
        cycles.pixel_filter_type, cycles.sample_clamp_direct = "BOX", 0
        settings = render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
        render.filepath = str(self.path)
        bpy.ops.render.render(write_still=True, scene=self.scene.name)
        return bpy.data.images.load(str(self.path), check_existing=False)


def select(context, active, selected):
    for item in context.view_layer.objects:
        item.select_set(item in selected)
    context.view_layer.objects.active = active


def register():
    bpy.utils.register_class(LIGHTSHAFT_OT_bake)


def unregister():
    bpy.utils.unregister_class(LIGHTSHAFT_OT_bake)
