"""Stage: an empty Blender scene with a camera, what tests put on it, and its render as an array of linear pixels."""

import bpy
import numpy as np
import OpenEXR

ADDON = "bl_ext.user_default.lightshaft"


class Stage:
    def __init__(self, folder, size=(96, 72)):
        self.folder, self.count = folder, 0
        for item in list(bpy.data.objects):
            bpy.data.objects.remove(item)
        bpy.data.orphans_purge(do_recursive=True)
        self.scene = bpy.context.scene
        for name in ("use_pass_z", "use_pass_normal"):
            setattr(bpy.context.view_layer, name, False)
        for name in self.settings.bl_rna.properties.keys():
            self.settings.property_unset(name)
        self.settings.where = "LOCAL"
        self.scene.frame_set(1)
        self.scene.render.resolution_x, self.scene.render.resolution_y = size
        self.scene.render.resolution_percentage = 100
        self.scene.render.film_transparent = False
        data = bpy.data.cameras.new("Camera")
        self.camera = self.put(bpy.data.objects.new("Camera", data), (7.36, -6.93, 4.96), (1.109, 0, 0.815))
        self.scene.camera = self.camera
        self.scene.world = bpy.data.worlds.new("World")
        self.sky(0)

    @property
    def settings(self):
        return self.scene.lightshaft

    def put(self, item, location=(0, 0, 0), rotation=(0, 0, 0)):
        self.scene.collection.objects.link(item)
        item.location, item.rotation_euler = location, rotation
        return item

    def sky(self, strength, colour=(1, 1, 1)):
        background = self.scene.world.node_tree.nodes["Background"]
        background.inputs["Color"].default_value = (*colour, 1)
        background.inputs["Strength"].default_value = strength

    def light(self, kind, energy, location=(0, 0, 3), rotation=(0, 0, 0), **values):
        data = bpy.data.lights.new(kind.title(), kind)
        data.energy = energy
        for name, value in values.items():
            setattr(data, name, value)
        return self.put(bpy.data.objects.new(kind.title(), data), location, rotation)

    def plane(self, material, size=8):
        bpy.ops.mesh.primitive_plane_add(size=size)
        return self.named(material)

    def ball(self, material, location=(0, 0, 1)):
        bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32, location=location)
        bpy.ops.object.shade_smooth()
        return self.named(material)

    def cube(self, material, size=2, location=(0, 0, 0)):
        bpy.ops.mesh.primitive_cube_add(size=size, location=location)
        return self.named(material)

    def named(self, material):
        item = bpy.context.object
        if material:
            item.data.materials.append(material)
            item.name = material.name + " thing"
        return item

    def render(self, engine="LIGHTSHAFT", samples=64, layer=None, seed=0):
        """Linear pixels, height x width x channels, with alpha if the film is transparent; of a `layer` those of a pass. RuntimeError with Blender's report."""
        scene, image = self.scene, self.scene.render.image_settings
        scene.render.engine, self.settings.samples = engine, samples
        cycles = scene.cycles
        self.settings.seed = cycles.seed = seed
        cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = samples, False, False
        for name in ("", "diffuse_", "glossy_", "transmission_", "volume_"):
            setattr(cycles, f"{name}max_bounces" if not name else f"{name}bounces", 64)
        cycles.max_bounces = 64
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
        image.media_type = "MULTI_LAYER_IMAGE"
        image.file_format, image.color_depth = "OPEN_EXR_MULTILAYER", "32"
        self.count += 1
        path = self.folder / f"{self.count}.exr"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        found = {}
        for part in OpenEXR.File(str(path), separate_channels=True).parts:
            for name, channel in part.channels.items():
                found.setdefault(name.split(".")[-2], {})[name.split(".")[-1]] = np.asarray(
                    channel.pixels, np.float64
                )
        self.layers = found
        planes = found[layer or "Combined"]
        order = [c for c in "RGBXYZVA" if c in planes and (c != "A" or scene.render.film_transparent)]
        return np.stack([planes[c] for c in order], axis=2)


def material(name, shader, output="Surface", **values):
    """A material of one shader node, such as ShaderNodeBsdfPrincipled; names of inputs with _ for blanks."""
    made = bpy.data.materials.new(name)
    tree = made.node_tree or enabled(made)
    tree.nodes.clear()
    node = tree.nodes.new(shader)
    target = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], target.inputs[output])
    for key, value in values.items():
        socket = node.inputs[key.replace("_", " ")]
        socket.default_value = (
            (*value, 1) if hasattr(value, "__len__") and len(socket.default_value) == 4 else value
        )
    return made


def enabled(made):
    made.use_nodes = True
    return made.node_tree


def principled(name="Principled", **values):
    return material(name, "ShaderNodeBsdfPrincipled", **values)


def diffuse(colour=(0.8, 0.5, 0.3), name="Diffuse"):
    return material(name, "ShaderNodeBsdfDiffuse", Color=colour)


def fog(name="Fog", **values):
    return material(name, "ShaderNodeVolumePrincipled", "Volume", **values)


def feed(made, socket, node, output=0, **values):
    """A new node whose output feeds an input of the material's shader."""
    tree = made.node_tree
    source = tree.nodes.new(node)
    for key, value in values.items():
        setattr(source, key, value)
    shader = next(
        n for n in tree.nodes if socket in n.inputs and n.type not in ("OUTPUT_MATERIAL", source.type)
    )
    tree.links.new(source.outputs[output], shader.inputs[socket])
    return source


def image(name, pixels, space="sRGB"):
    """An image of Blender's from height x width x 4, rows from the bottom."""
    made = bpy.data.images.new(name, pixels.shape[1], pixels.shape[0], float_buffer=space != "sRGB")
    made.colorspace_settings.name = space
    made.pixels.foreach_set(pixels.astype(np.float32).ravel())
    made.update()
    return made
