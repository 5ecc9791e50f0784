"""The part of Mitsuba's scene language that the bench scenes are written in, as a scene of Blender's.

Cubes, rectangles and spheres; diffuse (with a checkerboard), rough conductors and plastic, null; homogeneous media and grids
(of NAME.vol the NAME.vdb beside it, with a grid named density); area lights, constant light, directional light; pinhole and
thin lens. What else a scene has is refused: a picture of something else is worse than none. Of a spot light the edge falls off
otherwise, so it is refused, too.
"""
import math
import re
import xml.etree.ElementTree as ElementTree

import bmesh
import bpy
from mathutils import Matrix, Vector


class Unknown(SystemExit):
    def __init__(self, what):
        super().__init__(f"cycles_scene: {what} is not known")


def numbers(text):
    return [float(v) for v in re.split(r"[,\s]+", text.strip())]


def value(element, name, default=None):
    """Of the child with this name: three numbers of colours and vectors, one of floats, else text."""
    for child in element if element is not None else ():
        if child.get("name") != name:
            continue
        if child.tag == "rgb":
            given = numbers(child.get("value"))
            return given if len(given) == 3 else given * 3
        if child.tag in ("point", "vector"):
            return [float(child.get(axis, 0)) for axis in "xyz"]
        return float(child.get("value")) if child.tag in ("float", "integer") else child.get("value")
    return default


def three(given):
    return given if isinstance(given, list) else [given] * 3


def look_at(step):
    origin, target, up = (Vector(numbers(step.get(key))) for key in ("origin", "target", "up"))
    forward = (target - origin).normalized()
    right = forward.cross(up).normalized()
    up = right.cross(forward)
    return Matrix(((right.x, up.x, -forward.x, origin.x), (right.y, up.y, -forward.y, origin.y), (right.z, up.z, -forward.z, origin.z), (0, 0, 0, 1)))


def transform(element):
    matrix, steps = Matrix.Identity(4), element.find("transform[@name='to_world']")
    for step in steps if steps is not None else ():
        if step.tag == "scale":
            by = numbers(step.get("value")) * 3 if step.get("value") else [float(step.get(axis, 1)) for axis in "xyz"]
            matrix = Matrix.Diagonal(Vector((*by[:3], 1))) @ matrix
        elif step.tag == "translate":
            matrix = Matrix.Translation([float(step.get(axis, 0)) for axis in "xyz"]) @ matrix
        elif step.tag == "rotate":
            matrix = Matrix.Rotation(math.radians(float(step.get("angle"))), 4, Vector([float(step.get(axis, 0)) for axis in "xyz"])) @ matrix
        elif step.tag == "lookat":
            matrix = look_at(step) @ matrix
        else:
            raise Unknown(f"transform {step.tag}")
    return matrix


def nodes_of(name):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.node_tree.nodes.clear()
    return material, material.node_tree, material.node_tree.nodes.new("ShaderNodeOutputMaterial")


def diffuse(tree, bsdf):
    node = tree.nodes.new("ShaderNodeBsdfDiffuse")
    texture = bsdf.find("texture")
    if texture is None:
        node.inputs["Color"].default_value = (*three(value(bsdf, "reflectance", .5)), 1)
        return node
    if texture.get("type") != "checkerboard":
        raise Unknown(f"texture {texture.get('type')}")
    squares = tree.nodes.new("ShaderNodeTexChecker")
    for k in (0, 1):
        squares.inputs[f"Color{k + 1}"].default_value = (*value(texture, f"color{k}"), 1)
    scale = next((numbers(s.get("value") or s.get("x"))[0] for s in texture.iter("scale")), 1)
    squares.inputs["Scale"].default_value = 2 * scale  # squares a unit of uv; Mitsuba counts pairs
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    tree.links.new(coordinates.outputs["UV"], squares.inputs["Vector"])
    tree.links.new(squares.outputs["Color"], node.inputs["Color"])
    return node


def rough_conductor(tree, bsdf):
    node = tree.nodes.new("ShaderNodeBsdfMetallic")
    node.fresnel_type = "PHYSICAL_CONDUCTOR"
    node.distribution = "BECKMANN" if value(bsdf, "distribution", "beckmann") == "beckmann" else "GGX"
    node.inputs["Roughness"].default_value = math.sqrt(value(bsdf, "alpha", .1))
    node.inputs["IOR"].default_value, node.inputs["Extinction"].default_value = value(bsdf, "eta"), value(bsdf, "k")
    return node


def rough_plastic(tree, bsdf):
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.inputs["Base Color"].default_value = (*three(value(bsdf, "diffuse_reflectance", .5)), 1)
    node.inputs["Roughness"].default_value, node.inputs["IOR"].default_value = math.sqrt(value(bsdf, "alpha", .1)), 1.5
    return node


SURFACES = {"diffuse": diffuse, "roughconductor": rough_conductor, "roughplastic": rough_plastic}


def surface(bsdf):
    if bsdf is None:
        return bpy.data.materials.new("default")
    if bsdf.get("type") == "twosided":
        bsdf = bsdf.find("bsdf")
    if bsdf.get("type") not in SURFACES:
        raise Unknown(f"bsdf {bsdf.get('type')}")
    material, tree, out = nodes_of("surface")
    tree.links.new(SURFACES[bsdf.get("type")](tree, bsdf).outputs[0], out.inputs["Surface"])
    return material


def light_of_area(emitter):
    """Shines to the front only, as in Mitsuba."""
    material, tree, out = nodes_of("light")
    emission, geometry, mix = (tree.nodes.new(kind) for kind in ("ShaderNodeEmission", "ShaderNodeNewGeometry", "ShaderNodeMixShader"))
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (*value(emitter, "radiance"), 1), 1
    tree.links.new(geometry.outputs["Backfacing"], mix.inputs[0])
    tree.links.new(emission.outputs[0], mix.inputs[1])
    tree.links.new(mix.outputs[0], out.inputs["Surface"])
    return material


def volume(medium):
    material, tree, out = nodes_of("volume")
    node = tree.nodes.new("ShaderNodeVolumeCoefficients")
    phase = medium.find("phase")
    if phase is not None and phase.get("type") not in ("hg", "isotropic"):
        raise Unknown(f"phase function {phase.get('type')}")
    node.inputs["Anisotropy"].default_value = value(phase, "g", 0.)
    grid = medium.get("type") == "heterogeneous"
    extinction = [s * value(medium, "scale", 1.) for s in ([1.] * 3 if grid else three(value(medium, "sigma_t", 1.)))]
    scattering = [a * s for a, s in zip(three(value(medium, "albedo", .75)), extinction)]
    absorption = [s - a for s, a in zip(extinction, scattering)]
    density = tree.nodes.new("ShaderNodeAttribute") if grid else None
    for name, coefficient in (("Absorption Coefficients", absorption), ("Scatter Coefficients", scattering)):
        if density is None:
            node.inputs[name].default_value = coefficient
            continue
        density.attribute_name = "density"
        scaled = tree.nodes.new("ShaderNodeVectorMath")
        scaled.operation, scaled.inputs[0].default_value = "SCALE", coefficient
        tree.links.new(density.outputs["Fac"], scaled.inputs["Scale"])
        tree.links.new(scaled.outputs[0], node.inputs[name])
    tree.links.new(node.outputs[0], out.inputs["Volume"])
    return material


def mesh(kind):
    made = bmesh.new()
    if kind == "cube":
        bmesh.ops.create_cube(made, size=2)
    elif kind == "rectangle":
        bmesh.ops.create_grid(made, x_segments=1, y_segments=1, size=1, calc_uvs=True)
        made.loops.layers.uv.new()
    elif kind == "sphere":
        bmesh.ops.create_uvsphere(made, u_segments=128, v_segments=64, radius=1)
    else:
        raise Unknown(f"shape {kind}")
    data = bpy.data.meshes.new(kind)
    made.to_mesh(data)
    made.free()
    if kind == "rectangle":
        for loop in data.loops:
            at = data.vertices[loop.vertex_index].co
            data.uv_layers[0].data[loop.index].uv = ((at.x + 1) / 2, (at.y + 1) / 2)
    for face in data.polygons if kind == "sphere" else ():
        face.use_smooth = True
    return data


def place(data, matrix=None):
    thing = bpy.data.objects.new("thing", data)
    bpy.context.scene.collection.objects.link(thing)
    if matrix is not None:
        thing.matrix_world = matrix
    return thing


def add_shape(shape, named, folder):
    kind, matrix = shape.get("type"), transform(shape)
    if kind == "sphere":
        matrix = matrix @ Matrix.Translation(value(shape, "center", [0, 0, 0])) @ Matrix.Scale(value(shape, "radius", 1.), 4)
    inside = shape.find("*[@name='interior']")
    if inside is not None:
        medium = named[inside.get("id")] if inside.tag == "ref" else inside
        if medium.get("type") == "heterogeneous":
            data, matrix = bpy.data.volumes.new("grid"), None
            data.filepath = str((folder / value(medium.find("volume"), "filename")).with_suffix(".vdb"))
        else:
            data = mesh(kind)
        data.materials.append(volume(medium))
        place(data, matrix)
        return
    data, emitter, bsdf = mesh(kind), shape.find("emitter"), shape.find("bsdf")
    if bsdf is None:
        bsdf = next((named[r.get("id")] for r in shape.findall("ref") if r.get("name") != "interior"), None)
    data.materials.append(light_of_area(emitter) if emitter is not None else surface(bsdf))
    place(data, matrix)


def add_light(emitter, sky):
    if emitter.get("type") == "constant":
        sky.inputs["Color"].default_value, sky.inputs["Strength"].default_value = (*three(value(emitter, "radiance")), 1), 1
    elif emitter.get("type") == "directional":
        sun = bpy.data.lights.new("sun", "SUN")
        sun.angle, sun.energy, sun.color = 0, 1, three(value(emitter, "irradiance"))
        place(sun, Vector(value(emitter, "direction")).normalized().to_track_quat("-Z", "Y").to_matrix().to_4x4())
    else:
        raise Unknown(f"emitter {emitter.get('type')}")


def add_camera(sensor):
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle, camera.clip_start = "HORIZONTAL", math.radians(value(sensor, "fov")), 1e-3
    if sensor.get("type") == "thinlens":
        camera.dof.use_dof, camera.dof.focus_distance = True, value(sensor, "focus_distance")
        camera.dof.aperture_fstop = camera.lens * 1e-3 / (2 * value(sensor, "aperture_radius"))
    elif sensor.get("type") != "perspective":
        raise Unknown(f"sensor {sensor.get('type')}")
    bpy.context.scene.camera = place(camera, transform(sensor))


def open_sky():
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    tree = world.node_tree
    sky = tree.nodes.get("Background") or tree.nodes.new("ShaderNodeBackground")
    out = tree.nodes.get("World Output") or tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(sky.outputs[0], out.inputs["Surface"])
    sky.inputs["Color"].default_value = (0, 0, 0, 1)
    return sky


def build(path):
    """Makes it the scene of this process; the scene's max_depth."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    root = ElementTree.parse(path).getroot()
    named = {e.get("id"): e for e in root.iter() if e.get("id") and e.tag != "ref"}
    sky, depth = open_sky(), 16
    for element in root:
        if element.tag == "shape":
            add_shape(element, named, path.resolve().parent)
        elif element.tag == "emitter":
            add_light(element, sky)
        elif element.tag == "sensor":
            add_camera(element)
        elif element.tag == "integrator":
            depth = int(value(element, "max_depth", depth))
        elif element.tag not in ("bsdf", "medium", "default"):
            raise Unknown(element.tag)
    return depth
