"""The world: one colour all around, or an image."""

import numpy as np

from .document import element
from .nodes import Place, constant, output_node
from .textures import COLOR_SPACES, mapping_matrix
from .visibility import visibility_of_world

# The middle of a world image is the direction +x in Blender and +z in the scene format; the point a quarter from its
# left edge is +y in Blender and +x in the scene format.
AXES = np.array([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)


def add_world(document, problems, textures, world, groups):
    if world is None:
        return
    owner = WorldOwner(world)
    node = output_node(world.node_tree, "OUTPUT_WORLD") if world.node_tree else None
    if node is None:
        return
    group = groups.of(world)
    visible = visibility_of_world(problems, owner, world)
    flags = {"visible_camera": visible.camera, **visible.receivers}
    output = Place(node)
    if output.source(output.input("Volume"))[0]:
        problems.error(
            f"{owner}: an infinite Volume. Put its shader into the material of a cube around the scene"
        )
    background, _ = output.source(output.input("Surface"))
    if background is None:
        return
    if background.node.type != "BACKGROUND":
        problems.error(
            f"{owner}, node '{background.title}': the world needs a Background node. Link one to Surface"
        )
        return
    strength = constant(background, background.input("Strength"))
    if not isinstance(strength, float):
        problems.error(f"{owner}, node '{background.title}': Strength varies by nodes. Set a number")
        return
    colour = constant(background, background.input("Color"))
    if colour is not None:
        radiance = [strength * c for c in colour]
        if any(radiance):
            document.add(
                element(
                    "emitter", "constant", None, radiance=radiance, light_group=group, **flags
                )
            )
        return
    source, _ = background.source(background.input("Color"))
    where = f"{owner}, node '{source.title}'"
    if source.node.type != "TEX_ENVIRONMENT" or source.node.image is None:
        problems.error(
            f"{where}: the background needs an Environment Texture with an image. Bake the sky to an HDRI and open it there"
        )
        return
    if source.node.projection != "EQUIRECTANGULAR":
        problems.error(f"{where}: projection {source.node.projection.title()}. Choose Equirectangular")
        return
    turn = direction_mapping(problems, source, where)
    image = source.node.image
    name, _ = textures.file(image, owner)
    if turn is not None and name is not None:
        document.add(
            element(
                "emitter",
                "envmap",
                None,
                filename=name,
                color_space=COLOR_SPACES.get(image.colorspace_settings.name),
                scale=strength,
                to_world=np.linalg.inv(turn) @ AXES,
                light_group=group,
                **flags,
            )
        )


def direction_mapping(problems, place, where):
    source, output = place.source(place.input("Vector"))
    if source is None or (source.node.type == "TEX_COORD" and output.name == "Generated"):
        return np.eye(4)
    if source.node.type == "MAPPING":
        inner, own = direction_mapping(problems, source, where), mapping_matrix(source)
        if own is not None:
            own[:3, 3] = 0
        if own is None or not np.allclose(own @ own.T, np.eye(4), atol=1e-5):
            problems.error(
                f"{where}, node '{source.title}': Lightshaft can only rotate the world. Set Scale to 1, and type Point"
            )
            return None
        return None if inner is None else own @ inner
    problems.error(
        f"{where}: coordinates from '{source.title}'. Take Texture Coordinate > Generated, or none"
    )
    return None


class WorldOwner:
    material = None

    def __init__(self, world):
        self.world = world

    def __str__(self):
        return f"world '{self.world.name}'"
