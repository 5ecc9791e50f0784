"""Lights and the world. Blender's watts are for a light that emits equally in all directions."""

import math

import numpy as np

from . import exr, meshes
from .document import element, vector
from .motion import Placement
from .nodes import Place, constant, output_node

FLIP = ((1, 0, 0, 0), (0, -1, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1))  # Blender's lights look along -z
PROFILE = 512  # pixels of the image that a spot light throws


def add_light(document, problems, item, placement, matrix_class, may_see, marks, visible):
    """Adds a light object at its Placement. Its power is in W, as in the Light properties. `may_see`: a function of a centre and
    a radius, False if the camera does not see the ball. `marks`: the light group and the links of its emitter. `visible`:
    its Visibility."""
    data, name, matrix = item.data, item.name, placement.still
    colour = [c * f for c, f in zip(light_colour(data), shader_factor(problems, data))]
    if not data.normalize:
        problems.unsupported(f"light '{name}': Normalize off. Switch it on in Light properties")
    if not any(colour) or data.cycles.is_portal:
        return
    if data.cycles.max_bounces < 1024:  # Blender's default
        problems.warning(
            f"light '{name}': Max Bounces has no effect: its light is traced like that of others"
        )
    if data.type in ("SUN", "SPOT") or (data.type == "POINT" and not data.shadow_soft_size > 0):
        placement.stands(problems, "a light without a shape")
    rigid = matrix.normalized()
    if data.type == "SUN":
        direction = -rigid.col[2].xyz
        sun = element(
            "emitter",
            "directional",
            None,
            irradiance=colour,
            angular_radius=math.degrees(data.angle / 2),
            visible_camera=visible.camera,
            **marks,
            **visible.receivers,
        )
        sun.append(vector("direction", direction))
        document.add(sun)
    elif data.type == "POINT":
        radius = data.shadow_soft_size
        if radius > 0:
            ball = matrix_class.Translation(matrix.translation) @ matrix_class.Scale(radius, 4)
            radiance = [c / (4 * math.pi**2 * radius**2) for c in colour]
            if placement.poses:  # a ball of this size at each time, whatever the object's scale
                radii = matrix_class.Scale(radius, 4)
                places = {
                    time: matrix_class.Translation(pose.translation) @ radii
                    for time, pose in placement.poses.items()
                }
                ball = Placement(item, ball, places).to_world(problems, emits=True)
            document.add(lamp("sphere", ball, radiance, visible, may_see, marks))
        else:
            intensity = [c / (4 * math.pi) for c in colour]
            point = element(
                "emitter", "point", None, intensity=intensity, **marks, **visible.receivers
            )
            point.append(vector("position", matrix.translation, "point"))
            document.add(point)
    elif data.type == "SPOT":
        add_spot(document, problems, item, colour, rigid @ matrix_class(FLIP), marks, visible)
    else:
        placed = placement @ matrix_class(FLIP)
        add_area(document, problems, item, colour, placed, matrix_class, may_see, marks, visible)


def shader_factor(problems, data):
    """Returns by what the nodes of a light multiply its colour."""
    output = output_node(data.node_tree, "OUTPUT_LIGHT") if data.use_nodes and data.node_tree else None
    if output is None:
        return (1, 1, 1)
    source, _ = Place(output).source(output.inputs["Surface"])
    if source is None:
        return (0, 0, 0)
    if source.node.type == "EMISSION":
        strength, colour = (constant(source, source.input(name)) for name in ("Strength", "Color"))
        if strength is not None and colour is not None:
            return [strength * c for c in colour]
    problems.unsupported(
        f"light '{data.name}', node '{source.title}': a shader that varies. Set Color and Power in Light properties, and switch Use Nodes off"
    )
    return (1, 1, 1)


def light_colour(data):
    colour = [data.energy * 2.0**data.exposure * c for c in data.color]
    if data.use_temperature:
        colour = [c * t for c, t in zip(colour, data.temperature_color)]
    return colour


def lamp(shape, to_world, radiance, visible, may_see, marks, **values):
    """Makes a shape that emits light and lets the light of others pass, like Blender's lamps. They are hidden from the
    camera by default; a lamp that is out of sight anyway is not marked, because marked shapes cost render time."""
    hidden = visible.camera
    if not isinstance(to_world, dict):  # what moves is not looked at
        radius = to_world.col[0].xyz.length + to_world.col[1].xyz.length
        hidden = hidden if may_see(to_world.translation, radius) else None
    emitter = element("emitter", "area", None, radiance=radiance, **marks)
    return element(
        "shape",
        shape,
        None,
        element("bsdf", "null"),
        emitter,
        to_world=to_world,
        visible_camera=hidden,
        **values,
        **visible.receivers,
    )


def add_spot(document, problems, item, colour, to_world, marks, visible):
    data, name = item.data, item.name
    if data.shadow_soft_size > 0:
        problems.unsupported(f"light '{name}': a spot's Radius. Lightshaft's spots are points: set it to 0")
    half = data.spot_size / 2
    if half > math.radians(85):
        problems.error(f"light '{name}': a Spot Size above 170 degrees. Use a point light")
        return
    image = np.repeat(spot_profile(half, data.spot_blend)[:, :, None], 3, axis=2)
    # An image whose middle is the axis and whose edge is the cone: the falloff in it is Blender's to the last pixel.
    texture = element(
        "texture",
        "bitmap",
        None,
        filename=document.write(exr.write(image), ".exr"),
        raw=True,
        wrap_mode="clamp",
    )
    angle = math.degrees(half)
    intensity = [c / (4 * math.pi) for c in colour]
    document.add(
        element(
            "emitter",
            "spot",
            None,
            to_world=to_world,
            intensity=intensity,
            cutoff_angle=angle,
            beam_width=angle * 0.9999,
            texture=texture,
            **marks,
            **visible.receivers,
        )
    )


def spot_profile(half, blend):
    """Makes an image of Blender's falloff over the square around the cone: a smooth step of the cosine between the
    edge and the blend."""
    across = (np.arange(PROFILE) + 0.5) / PROFILE * 2 - 1
    tangent = np.hypot(across[None, :], across[:, None]) * math.tan(half)
    cosine = 1 / np.sqrt(1 + tangent**2)
    edge = math.cos(half)
    step = np.clip((cosine - edge) / max((1 - edge) * blend, 1e-6), 0, 1)
    return step * step * (3 - 2 * step)


def add_area(document, problems, item, colour, placement, matrix_class, may_see, marks, visible):
    data, name = item.data, item.name
    if data.spread < math.pi - 1e-4:
        problems.unsupported(
            f"light '{name}': Beam Shape > Spread. Lightshaft's area lights shine to all sides: set it to 180 degrees"
        )
    long = data.size
    short = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size
    round_one = data.shape in ("DISK", "ELLIPSE")
    placed = placement.still @ matrix_class.Diagonal((long / 2, short / 2, 1, 1))
    across, up = placed.col[0].xyz, placed.col[1].xyz
    area = across.cross(up).length * (math.pi if round_one else 4)
    if area <= 0:
        problems.error(f"light '{name}': its size is 0. Give it a size, or make it a point light")
        return
    radiance = [c / (math.pi * area) for c in colour]
    shape, values = "disk" if round_one else "rectangle", {}
    if placement.poses:  # the renderer moves no lamp that is stretched: a flat one has no size along z
        own = placement @ matrix_class.Diagonal((long / 2, short / 2, long / 2, 1))
        mirrored = placement.still.determinant() < 0
        if abs(long - short) > 1e-6 * long and not round_one and not mirrored:
            shape, own = "ply", placement
            values["filename"] = document.write(rectangle(long / 2, short / 2), ".ply")
        placed = own.to_world(problems, emits=True)
    document.add(lamp(shape, placed, radiance, visible, may_see, marks, **values))


def rectangle(x, y):
    """Makes a PLY of the rectangle of these half sizes that faces +z."""
    corners = [(-x, -y), (x, -y), (x, y), (-x, y)]
    table = np.array([(*corner, 0, 0, 0, 1) for corner in corners], "<f4")
    return meshes.ply(table, np.array([[0, 1, 2], [0, 2, 3]]))
