"""The world: one colour all around, an image, or what the operator Bake has made of its nodes."""

import numpy as np

from .document import element, vector
from .nodes import BAKED_ONCE, Place, constant, is_animated, output_node
from .textures import COLOR_SPACES, mapping_matrix
from .visibility import visibility_of_world

# The middle of a world image is the direction +x in Blender and +z in the scene format; the point a quarter from its
# left edge is +y in Blender and +x in the scene format.
AXES = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)


BAKED, BAKED_SUN = "lightshaft_baked", "lightshaft_baked_sun"  # properties of a world, which the operator Bake sets


class Unreadable(Exception):
    """The surface of a world is none that can be exported without baking. The message says why."""


def add_world(document, problems, textures, volumes, world, groups):
    """Adds the light of the world. Returns the id of the medium that is everywhere, or None."""
    owner, output = WorldOwner(world), output_of(world)
    if output is None:
        return None
    group = groups.of(world)
    visible = visibility_of_world(problems, owner, world)
    around = add_fog(volumes, output, owner, group)
    flags = {"visible_camera": visible.camera, **visible.receivers, "light_group": group}
    try:
        background = read(owner, output)
    except Unreadable as why:
        background = baked(world)
        if background is None:
            problems.error(f"{why}, or press Bake Procedural Textures in Render Properties > Lightshaft")
            return around
        if is_animated(world.node_tree):
            problems.warning(f"{owner}: its node tree {BAKED_ONCE}")
    if background.image is not None:
        name, _ = textures.file(background.image, owner)
        if name is not None:
            document.add(
                element(
                    "emitter",
                    "envmap",
                    None,
                    filename=name,
                    color_space=COLOR_SPACES.get(background.image.colorspace_settings.name),
                    scale=background.strength,
                    to_world=np.linalg.inv(background.turn) @ AXES,
                    **flags,
                )
            )
    elif any(background.radiance):
        document.add(element("emitter", "constant", None, radiance=background.radiance, **flags))
    if background.sun is not None:
        add_sun(document, background.sun, flags)
    return around


def add_fog(volumes, output, owner, group):
    """Defines the world's Volume, which has no end, as a medium. Returns its id, or None."""
    source, _ = output.source(output.input("Volume"))
    found = volumes.shader(source, owner, of_grid=False) if source is not None else None
    return None if found is None else volumes.homogeneous("world", found, group, None)


def add_sun(document, sun, flags):
    *towards, radius = sun[:4]
    document.add(
        element(
            "emitter",
            "directional",
            None,
            vector("direction", [-x for x in towards]),
            irradiance=list(sun[4:]),
            angular_radius=float(radius),
            **flags,
        )
    )


class Background:
    """The light of a world: one radiance, or an image with its strength and the rotation of its directions, and a sun
    (direction towards it, angular radius in degrees, irradiance) or None."""

    def __init__(self, radiance=(0, 0, 0), image=None, strength=1.0, turn=None, sun=None):
        self.radiance, self.image, self.strength, self.sun = radiance, image, strength, sun
        self.turn = np.eye(4) if turn is None else turn


def output_of(world):
    node = output_node(world.node_tree, "OUTPUT_WORLD") if world is not None and world.node_tree else None
    return None if node is None else Place(node)


def read(owner, output):
    """Returns the Background of a world that is one colour or one image. Raises Unreadable."""
    background, _ = output.source(output.input("Surface"))
    if background is None:
        return Background()
    where = f"{owner}, node '{background.title}'"
    if background.node.type != "BACKGROUND":
        raise Unreadable(f"{where}: link a Background node to Surface")
    strength = constant(background, background.input("Strength"))
    if not isinstance(strength, float):
        raise Unreadable(f"{where}: Strength varies by nodes. Set a number")
    colour = constant(background, background.input("Color"))
    if colour is not None:
        return Background([strength * c for c in colour])
    source, _ = background.source(background.input("Color"))
    where = f"{owner}, node '{source.title}'"
    if source.node.type != "TEX_ENVIRONMENT" or source.node.image is None:
        raise Unreadable(f"{where}: link an Environment Texture with an image to Color")
    if source.node.projection != "EQUIRECTANGULAR":
        raise Unreadable(f"{where}: projection {source.node.projection.title()}. Choose Equirectangular")
    return Background(image=source.node.image, strength=strength, turn=direction_mapping(source, where))


def is_readable(world):
    output = output_of(world)
    try:
        return output is None or read(WorldOwner(world), output) is not None
    except Unreadable:
        return False


def baked(world):
    """Returns the Background that the operator Bake has made of the world, or None."""
    import bpy

    image = bpy.data.images.get(world.get(BAKED, ""))
    return None if image is None else Background(image=image, sun=world.get(BAKED_SUN))


def direction_mapping(place, where):
    source, output = place.source(place.input("Vector"))
    if source is None or (source.node.type == "TEX_COORD" and output.name == "Generated"):
        return np.eye(4)
    if source.node.type == "MAPPING":
        inner, own = direction_mapping(source, where), mapping_matrix(source)
        if own is not None:
            own[:3, 3] = 0
        if own is None or not np.allclose(own @ own.T, np.eye(4), atol=1e-5):
            raise Unreadable(
                f"{where}, node '{source.title}': Lightshaft can only rotate the world. Set Scale to 1, and type Point"
            )
        return own @ inner
    raise Unreadable(
        f"{where}: coordinates from '{source.title}'. Take Texture Coordinate > Generated, or none"
    )


class WorldOwner:
    material = item = None

    def __init__(self, world):
        self.world = world

    def __str__(self):
        return f"world '{self.world.name}'"
