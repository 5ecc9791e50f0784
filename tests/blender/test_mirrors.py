"""Mirrored objects, cameras and texture coordinates: as they are without the mirror, and as in Cycles."""

import numpy as np
import pytest


def leaning(red=0.9, green=0.6):
    """A material whose image leans its normals to the right and up."""
    import bpy
    from stage import material

    made = material("Leaning", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5))
    picture = bpy.data.images.new("normals", 2, 2, float_buffer=True, is_data=True)
    picture.pixels.foreach_set(np.tile(np.array([red, green, 0.85, 1], np.float32), 4))
    tree = made.node_tree
    image, normal = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    image.image = picture
    tree.links.new(image.outputs["Color"], normal.inputs["Color"])
    shader = next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    tree.links.new(normal.outputs[0], shader.inputs["Normal"])
    return made


def turn_over(item, axis):
    layer = item.data.uv_layers.active.uv
    for entry in layer:
        entry.vector[axis] = 1 - entry.vector[axis]


@pytest.mark.parametrize("flipped", ["", "u", "v", "uv", "object"])
def test_a_normal_map_leans_as_its_image_lies(stage, flipped):
    """Drawn for where it is mirrored, it gives the light of one that is not; so it does in Cycles."""
    stage.light("SUN", 3, rotation=(0.6, 0.5, 0))
    sheet = stage.plane(leaning(), 40)
    expected = stage.render(samples=2).mean()
    if flipped == "object":  # whose image is seen mirrored in x
        sheet.scale.x = -1
        sheet.data.materials[0] = leaning(red=0.1)
    else:
        sheet.data.materials[0] = leaning(0.1 if "u" in flipped else 0.9, 0.4 if "v" in flipped else 0.6)
        for axis in flipped:
            turn_over(sheet, "uv".index(axis))

    ours, theirs = stage.render(samples=2).mean(), stage.render("CYCLES", 2).mean()

    # Where all is lit alike by a sun without size, no sample has noise; Cycles computes in single precision.
    assert ours == pytest.approx(expected, rel=1e-4) and ours == pytest.approx(theirs, rel=2e-3)


@pytest.mark.parametrize("scale", [(-1, 1, 1), (1, -1, 1), (1, 1, -1), (-1, -1, -1), (2, 1, 3)])
def test_a_camera_that_mirrors_sees_what_it_does_in_cycles(stage, scale):
    from stage import material

    stage.sky(0.2)
    for x, colour in ((-2, (1, 0.2, 0.1)), (2, (0.1, 0.3, 1))):
        stage.cube(material("Lamp", "ShaderNodeEmission", Color=colour), 1.5, (x, 0, 1))
    stage.ball(material("Green", "ShaderNodeEmission", Color=(0, 1, 0)), (12, -12, 8.5))  # behind the camera
    stage.camera.rotation_euler = (1.109, 0, 0.815)
    stage.camera.scale = scale

    ours, theirs = (stage.render(engine, 4)[:, :, :3] for engine in ("LIGHTSHAFT", "CYCLES"))

    # Colours are constant, so that pixels differ where they have an edge alone.
    assert (np.abs(ours - theirs).max(axis=2) < 0.01).mean() > 0.93
    assert len(np.unique(np.round(ours.reshape(-1, 3), 2), axis=0)) >= 2


@pytest.mark.parametrize("scale", [(-1, 1, 1), (-1, -1, -1)])
def test_mirrored_bodies_look_as_in_cycles(stage, scale):
    """A glowing sheet, and dyed glass, once and as instances."""
    from stage import material

    stage.sky(0.5)
    glass = material("Glass", "ShaderNodeBsdfGlass", Color=(0.5, 0.8, 0.3), Roughness=0.0, IOR=1.5)
    one = stage.ball(glass, (1, 1, 1))
    two = one.copy()
    stage.put(two, (-1, -1, 1))
    lamp = stage.cube(material("Lamp", "ShaderNodeEmission", Color=(1, 0.5, 0.2), Strength=2.0), 1, (0, 3, 0.5))
    plain = stage.render(samples=16).mean(axis=(0, 1))
    for item in (one, two, lamp):
        item.scale = scale

    # Balls and cubes are their own mirror images.
    assert stage.render(samples=16).mean(axis=(0, 1)) == pytest.approx(plain, rel=0.02)


@pytest.mark.parametrize("distance", [1.05, 1.0])
def test_fog_whose_face_lies_before_the_clip_start_is_seen(stage, distance):
    from stage import fog

    stage.sky(1)
    stage.cube(fog(Density=0.5, Color=(0, 0, 0)), 2)
    stage.camera.location, stage.camera.rotation_euler = (0, -distance, 0), (np.pi / 2, 0, 0)
    stage.camera.data.clip_start, stage.camera.data.angle = 0.1, 0.02

    # The extinction is 0.5; of the way of 2 what lies before the clip start may be missing.
    assert np.exp(-1.0) * 0.999 < stage.render(samples=2).mean() < np.exp(-0.95) * 1.001
