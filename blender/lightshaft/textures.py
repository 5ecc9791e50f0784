"""Exports image textures, checkers and baked procedural textures."""

import hashlib
import pathlib

import numpy as np

from . import exr
from .document import element
from .nodes import BAKED_ONCE, constant, is_animated

# Blender's colour spaces, and `color_space` of the textures that have them. Files with these are read as they are.
COLOR_SPACES = {
    "ACEScg": "acescg",
    "ACES2065-1": "aces2065-1",
    "Linear Rec.2020": "rec2020",
    "Linear DCI-P3 D65": "p3-d65",
    "Linear CIE-XYZ D65": "xyz",
    "Rec.1886": "g24_rec709",
    "Display P3": "srgb_p3d65",
}
READ_AS_THEY_ARE = {".png", ".jpg", ".jpeg", ".bmp", ".exr", ".hdr"}
UPSIDE_DOWN = np.array([[1, 0, 0, 0], [0, -1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]], float)
WRAP = {"REPEAT": "repeat", "EXTEND": "clamp", "MIRROR": "mirror"}
SHARES = {  # inputs of shaders that are shares of light or of a mix
    "BSDF_PRINCIPLED": {"Base Color", "Metallic", "Roughness", "Transmission Weight", "Alpha"},
    "BSDF_DIFFUSE": {"Color"},
    "BSDF_GLOSSY": {"Color", "Roughness"},
    "BSDF_GLASS": {"Color", "Roughness"},
    "MIX_SHADER": {"Fac", "Factor"},
}
CHECKER_OUTPUTS = ("Color", "Fac", "Factor")


class Textures:
    """Converts textures. `baked`: images by (material, node, input) that the operator Bake for Lightshaft has
    made."""

    def __init__(self, document, problems):
        self.document, self.problems, self.images = document, problems, {}

    def value(self, place, name, owner):
        """Returns an input as a number, a colour or a texture element. Returns None and reports an error if that
        is impossible."""
        socket = place.input(name)
        share = place.node.type in SHARES and name in SHARES[place.node.type]
        fixed = constant(place, socket)
        if fixed is not None:
            return self.within_one(fixed, place, name, owner) if share else fixed
        source, output = place.source(socket)
        node = source.node if source else None
        baked = baked_image(owner.material, place.node, socket)
        if baked is not None and not exported_as_it_is(source, output):
            if is_animated(owner.material.node_tree):
                self.problems.warning(f"{owner}, node '{place.title}': {name} {BAKED_ONCE}")
            return self.bitmap(baked, owner)
        if node and node.type == "TEX_IMAGE":
            return self.image_node(source, output, owner)
        if node and node.type == "TEX_CHECKER" and output.name in CHECKER_OUTPUTS:
            return self.checker(source, output, owner, number=socket.type == "VALUE", share=share)
        title = source.title if source else socket.name
        self.problems.error(
            f"{owner}, node '{title}': '{place.title}' > {name} is procedural. "
            "Press Bake Procedural Textures in Render Properties > Lightshaft"
        )
        return None

    def within_one(self, value, place, name, owner):
        """Clamps a share of light to 1, since nothing reflects more than it receives; Blender's fields allow more."""
        values = value if isinstance(value, list) else [value]
        if max(values) > 1.001 or min(values) < -0.001:
            self.problems.warning(f"{owner}, node '{place.title}': {name} is clamped to the range 0 to 1")
        values = [min(max(v, 0.0), 1.0) for v in values]
        return values if isinstance(value, list) else values[0]

    def image_node(self, place, output, owner, raw=None):
        node = place.node
        where = f"{owner}, node '{place.title}'"
        if node.image is None:
            self.problems.error(f"{where}: no image. Open one in the node")
            return None
        if node.projection != "FLAT":
            self.problems.error(f"{where}: projection {node.projection.title()}. Choose Flat, or bake it")
            return None
        if node.extension not in WRAP:
            self.problems.unsupported(f"{where}: extension Clip. Choose Repeat, Extend or Mirror")
        if node.interpolation in ("Cubic", "Smart"):
            self.problems.warning(f"{where}: interpolation {node.interpolation} is rendered as Linear")
        filter_type = "nearest" if node.interpolation == "Closest" else "bilinear"
        mapping = self.mapping(place, where)
        if mapping is None:
            return None
        return self.bitmap(
            node.image,
            owner,
            alpha=output.name == "Alpha",
            wrap=WRAP.get(node.extension, "clamp"),
            filter_type=filter_type,
            mapping=mapping,
        )

    def bitmap(self, image, owner, alpha=False, wrap="repeat", filter_type="bilinear", mapping=None):
        name, raw = self.file(image, owner, alpha)
        if name is None:
            return None
        color_space = None if alpha else COLOR_SPACES.get(image.colorspace_settings.name)
        to_uv = (
            None
            if mapping is None or np.allclose(mapping, np.eye(4))
            else UPSIDE_DOWN @ mapping @ UPSIDE_DOWN
        )
        return element(
            "texture",
            "bitmap",
            None,
            filename=name,
            raw=raw if color_space is None else False,
            color_space=color_space,
            wrap_mode=wrap,
            filter_type=filter_type,
            to_uv=to_uv,
        )

    def file(self, image, owner, alpha=False):
        """Returns (name, raw) of an image's file. If Lightshaft cannot read the file's format, the image is
        written to a new file."""
        key = (image.name_full, alpha)
        if key not in self.images:
            self.images[key] = self.write(image, owner, alpha)
        return self.images[key]

    def write(self, image, owner, alpha):
        space = image.colorspace_settings
        if not (space.is_data or space.name in ("sRGB", "Linear Rec.709", "Non-Color", *COLOR_SPACES)):
            self.problems.error(
                f"{owner}, image '{image.name}': colour space {space.name}. "
                f"Choose sRGB, Linear Rec.709, Non-Color, {', '.join(COLOR_SPACES)}"
            )
            return None, None
        if image.source not in ("FILE", "GENERATED"):
            self.problems.error(
                f"{owner}, image '{image.name}': source {image.source.title()}. Choose Single Image"
            )
            return None, None
        raw = space.name != "sRGB"
        path = pathlib.Path(absolute(image))
        if (
            not alpha
            and image.source == "FILE"
            and not image.is_dirty
            and path.suffix.lower() in READ_AS_THEY_ARE
        ):
            float_file = path.suffix.lower() in (".exr", ".hdr")
            if space.name in COLOR_SPACES or float_file != (
                space.name == "sRGB"
            ):  # what an ending says of the coding of colours is what Blender takes it for
                if image.packed_file:
                    return self.document.write(bytes(image.packed_file.data), path.suffix.lower()), raw
                return self.document.take(path, f"{owner}, image '{image.name}'"), raw
        if space.name in COLOR_SPACES and not alpha:
            self.problems.error(
                f"{owner}, image '{image.name}': colour space {space.name} of an image that is not a PNG, JPEG, BMP, "
                "EXR or HDR file. Save it as one of these, or choose sRGB, Linear Rec.709 or Non-Color"
            )
            return None, None
        if not image.has_data and not image.pixels:
            self.problems.error(
                f"{owner}, image '{image.name}': Blender cannot load {image.filepath}. Find or replace the file"
            )
            return None, None
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        pixels = pixels.reshape(height, width, image.channels)[::-1]
        if alpha:
            chosen = pixels[:, :, 3:4] if image.channels == 4 else np.ones((height, width, 1), np.float32)
            return (
                self.document.write(exr.write_png(np.rint(chosen.clip(0, 1) * 255).astype(np.uint8)), ".png"),
                True,
            )
        pixels = pixels[:, :, :3] if image.channels >= 3 else np.repeat(pixels[:, :, :1], 3, axis=2)
        if image.is_float:
            return self.document.write(exr.write(pixels), ".exr"), True
        return (
            self.document.write(exr.write_png(np.rint(pixels.clip(0, 1) * 255).astype(np.uint8)), ".png"),
            raw,
        )

    def mapping(self, place, where):
        """Returns the 4 x 4 matrix that maps texture coordinates of the mesh to those of the lookup. Returns None
        and reports an error if there is none."""
        source, output = place.source(place.input("Vector"))
        if source is None:
            return np.eye(4)
        node = source.node
        if node.type == "MAPPING":
            inner = self.mapping(source, where)
            own = mapping_matrix(source)
            if own is None:
                self.problems.error(
                    f"{where}, node '{source.title}': a mapping that varies, or of type {node.vector_type.title()}. Set numbers, and type Point"
                )
            return None if inner is None or own is None else own @ inner
        if node.type == "UVMAP" or (node.type == "TEX_COORD" and output.name == "UV"):
            if node.type == "UVMAP" and node.uv_map:
                self.problems.warning(
                    f"{where}: the mesh's map for rendering is used instead of the UV map named in node '{source.title}': {node.uv_map}"
                )
            return np.eye(4)
        self.problems.error(
            f"{where}: coordinates from '{source.title}' > {output.name}. Take UV, or press Bake Procedural Textures"
        )
        return None

    def checker(self, place, output, owner, number, share):
        where = f"{owner}, node '{place.title}'"
        source, _ = place.source(place.input("Vector"))
        scale = constant(place, place.input("Scale"))
        colours = (
            [[1.0] * 3, [0.0] * 3]
            if output.name != "Color"
            else [self.value(place, name, owner) for name in ("Color1", "Color2")]
        )
        if source is None or not isinstance(scale, float):
            self.problems.error(
                f"{where}: a checker needs UV coordinates and one scale. "
                "Link Texture Coordinate > UV to its Vector, or press Bake Procedural Textures in Render Properties > Lightshaft"
            )
            return None
        mapping = self.mapping(place, where)
        if mapping is None or any(colour is None for colour in colours):
            return None
        if share:
            colours = [
                self.within_one(colour, place, f"Color{i}", owner) if isinstance(colour, list) else colour
                for i, colour in enumerate(colours, 1)
            ]
        # A checkerboard's period is two of Blender's squares.
        to_uv = np.diag([scale / 2, scale / 2, 1, 1]) @ mapping @ UPSIDE_DOWN
        # Blender's first square has Color2. Where a number is wanted, Lightshaft's colours change places.
        first, second = colours if number else colours[::-1]
        return element("texture", "checkerboard", None, color0=first, color1=second, to_uv=to_uv)


def exported_as_it_is(place, output):
    """Returns True if a texture node needs no baking: an image, or a checker with one scale and constant colours,
    looked up by UV."""
    if place is None:
        return False
    node = place.node
    if node.type == "TEX_IMAGE":
        return node.projection == "FLAT" and by_uv(place)
    if node.type == "TEX_CHECKER":
        fixed = all(constant(place, place.input(name)) is not None for name in ("Scale", "Color1", "Color2"))
        linked = place.source(place.input("Vector"))[0] is not None
        return output.name in CHECKER_OUTPUTS and fixed and linked and by_uv(place)
    return False


def by_uv(place):
    """Returns True if the coordinates of a texture come from UV through constant mappings. Unlinked coordinates
    are UV."""
    source, output = place.source(place.input("Vector"))
    if source is None:
        return True
    if source.node.type == "MAPPING":
        return mapping_matrix(source) is not None and by_uv(source)
    return source.node.type == "UVMAP" or (source.node.type == "TEX_COORD" and output.name == "UV")


def mapping_matrix(place):
    """Returns the matrix of a Mapping node for points, or for textures. None: it is not constant."""
    values = [
        constant(place, place.input(name)) if place.input(name) else None
        for name in ("Location", "Rotation", "Scale")
    ]
    kind = place.node.vector_type
    if kind not in ("POINT", "TEXTURE") or values[1] is None or values[2] is None or values[0] is None:
        return None
    location, rotation, scale = values
    cx, cy, cz = np.cos(rotation)
    sx, sy, sz = np.sin(rotation)
    turn = (
        np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
        @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
        @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    )
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn @ np.diag(scale), location
    if kind == "TEXTURE":
        return np.linalg.inv(matrix) if all(scale) else None
    return matrix


def absolute(image):
    import bpy

    return bpy.path.abspath(image.filepath, library=image.library)


def bake_key(node, socket, *more):
    """Returns the name of the property of a material that holds the name of the baked image. Names of properties are
    short, and those of nodes and objects may be long."""
    names = "\0".join([node.id_data.name, node.name, socket.identifier, *more])
    return f"lightshaft {hashlib.sha256(names.encode()).hexdigest()[:40]}"


def baked_image(material, node, socket):
    """Returns the image that was baked for an input of this material, or None."""
    import bpy

    return bpy.data.images.get(material.get(bake_key(node, socket), "")) if material else None
