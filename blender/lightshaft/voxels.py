"""Volume shaders whose inputs vary by nodes: Cycles evaluates each input at the voxels of the object's box, and the
values travel with the object until they are exported as grids."""

import math
import struct

import numpy as np

from .nodes import Place, constant, output_node
from .textures import bake_key

MOST_ACROSS = 512


class Grid:
    """The voxels of an object's box (in its own space), of equal width, along x, y and z."""

    def __init__(self, item, across):
        """item: an evaluated object."""
        corners = np.array([tuple(corner) for corner in item.bound_box])
        self.low, self.size = corners.min(0), np.maximum(np.ptp(corners, axis=0), 1e-6)
        self.counts = np.clip(np.ceil(across * self.size / self.size.max()).astype(int), 1, MOST_ACROSS)
        self.columns = math.ceil(math.sqrt(self.counts[2]))  # of layers in the image

    @property
    def image_size(self):
        rows = math.ceil(self.counts[2] / self.columns)
        return int(self.columns * self.counts[0]), int(rows * self.counts[1])

    def layers(self):
        """Returns a mesh of a rectangle through the middles of each layer of voxels, which lies in the image beside the
        others."""
        import bpy

        nx, ny, nz = (int(n) for n in self.counts)
        width, height = self.image_size
        corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
        places, uvs = [], []
        for k in range(nz):
            z = np.full((4, 1), (k + 0.5) / nz)
            places.append(self.low + np.hstack([corners, z]) * self.size)
            at = np.array([k % self.columns * nx, k // self.columns * ny])
            uvs.append((at + corners * (nx, ny)) / (width, height))
        mesh = bpy.data.meshes.new("Lightshaft layers")
        mesh.from_pydata(
            [tuple(p) for p in np.concatenate(places)], [], [tuple(range(4 * k, 4 * k + 4)) for k in range(nz)]
        )
        mesh.uv_layers.new().data.foreach_set("uv", np.concatenate(uvs).ravel())
        return mesh

    def values(self, image):
        """Returns the values of an image of the layers, z x y x x x channels."""
        nx, ny, nz = (int(n) for n in self.counts)
        width, height = self.image_size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        tiles = pixels.reshape(height // ny, ny, self.columns, nx, 4)[..., :3].transpose(0, 2, 1, 3, 4)
        return tiles.reshape(-1, ny, nx, 3)[:nz]


def varying_inputs(material, names_of):
    """The (node, input) pairs of volume shaders that vary by nodes. names_of: the inputs by the type of the shader."""
    tree = material.node_tree
    output = output_node(tree, "OUTPUT_MATERIAL") if tree else None
    if output is None or not output.inputs["Volume"].is_linked:
        return
    for node in tree.nodes:
        place = Place(node)
        for name in names_of.get(node.type, ()):
            socket = place.input(name)
            if socket is not None and socket.is_linked and constant(place, socket) is None:
                yield node, socket


def bake(context, item, material, node, socket, across):
    """Bakes one input of the material's volume for this object, with this many voxels across the longest side."""
    import bpy

    grid, own = Grid(item.evaluated_get(context.evaluated_depsgraph_get()), across), material.copy()
    mesh = grid.layers()
    if item.type == "MESH":  # for Generated coordinates
        mesh.use_auto_texspace = False
        mesh.texspace_location, mesh.texspace_size = item.data.texspace_location, item.data.texspace_size
    layers = bpy.data.objects.new("Lightshaft layers", mesh)
    context.scene.collection.objects.link(layers)
    try:
        layers.matrix_world = item.matrix_world
        layers.color, layers.pass_index = item.color, item.pass_index
        mesh.materials.append(own)
        image = bpy.data.images.new(
            f"{item.name} {material.name} {socket.name}", *grid.image_size, float_buffer=True, is_data=True
        )
        tree = own.node_tree
        target, glow = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeEmission")
        target.image, tree.nodes.active = image, target
        value = next(s for s in tree.nodes[node.name].inputs if s.identifier == socket.identifier)
        tree.links.new(value.links[0].from_socket, glow.inputs["Color"])
        output = output_node(tree, "OUTPUT_MATERIAL")
        tree.links.new(glow.outputs[0], output.inputs["Surface"])
        for link in list(output.inputs["Volume"].links):
            tree.links.remove(link)
        for other in context.view_layer.objects:
            other.select_set(other == layers)
        context.view_layer.objects.active = layers
        bpy.ops.object.bake(type="EMIT", margin=0)
        image.pack()
    finally:
        bpy.data.objects.remove(layers)
        bpy.data.meshes.remove(mesh)
        bpy.data.materials.remove(own)
    material[bake_key(node, socket, item.name_full)] = {
        "image": image.name,
        "across": across,
        "box": [*grid.low, *grid.size],
    }


def baked_values(item, material, place, socket):
    """Returns (values z x y x x x 3, Grid) of an input that was baked for this object, or None."""
    import bpy

    made = material.get(bake_key(place.node, socket, item.name_full))
    image = bpy.data.images.get(made["image"]) if made else None
    if image is None:
        return None
    grid = Grid(item, made["across"])
    same = np.allclose([*grid.low, *grid.size], list(made["box"]), rtol=0, atol=1e-4 * grid.size.max())
    return (grid.values(image), grid) if same and tuple(image.size) == grid.image_size else None


def is_baked(item):
    """Returns whether a material of the object has voxels that were baked for it alone."""
    made = (one for slot in item.material_slots if slot.material for one in slot.material.items())
    return any(name.startswith("lightshaft ") and not isinstance(value, str) for name, value in made)


def vol(values):
    """Encodes z x y x x x channels as a Mitsuba volume that fills [0, 1]^3."""
    nz, ny, nx, channels = values.shape
    head = b"VOL\x03" + struct.pack("<5i6f", 1, nx, ny, nz, channels, 0, 0, 0, 1, 1, 1)
    return head + np.ascontiguousarray(values, "<f4").tobytes()
