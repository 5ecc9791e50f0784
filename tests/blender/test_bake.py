"""Worlds and volumes that vary by nodes: Cycles bakes them, and Lightshaft's image is that of Cycles."""

import math

import pytest
from test_against_cycles import EXACT, differ


def shaded(stage):
    from stage import material

    stage.plane(material("Floor", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5)))
    stage.ball(material("Ball", "ShaderNodeBsdfDiffuse", Color=(0.5, 0.5, 0.5)))


def background(stage):
    tree = stage.scene.world.node_tree
    return tree, next(node for node in tree.nodes if node.type == "BACKGROUND")


def sky(stage, kind, **values):
    tree, node = background(stage)
    node.inputs["Strength"].default_value = 0.1
    made = tree.nodes.new("ShaderNodeTexSky")
    made.sky_type = kind
    for name, value in values.items():
        setattr(made, name, value)
    tree.links.new(made.outputs[0], node.inputs["Color"])
    return made


def baked_sun(stage):
    return list(stage.scene.world.get("lightshaft_baked_sun", []))


def bake(**sizes):
    import bpy

    assert bpy.ops.lightshaft.bake(**{"size": 256, **sizes}) == {"FINISHED"}


# The edges of shadows and of the sun are sampled by few pixels, so blocks may differ by more than elsewhere.
@pytest.mark.parametrize("kind", ["SINGLE_SCATTERING", "MULTIPLE_SCATTERING", "PREETHAM", "HOSEK_WILKIE"])
def test_sky_textures_are_baked_with_a_sun_of_their_own(stage, kind):
    made = sky(stage, kind)
    if "SCATTERING" in kind:
        made.sun_elevation, made.sun_rotation, made.sun_size = 0.6, 2.2, 0.02
    shaded(stage)
    with pytest.raises(RuntimeError, match="world 'World.*Sky Texture.*Bake Procedural Textures"):
        stage.render(samples=1)

    bake()

    differ(stage, 2 * EXACT, 64)
    sun = baked_sun(stage)
    if "SCATTERING" not in kind:
        assert not sun
        return
    # From its nodes: elevation 0.6, and a rotation of 2.2 from +y towards +x
    assert sun[:3] == pytest.approx(
        [math.cos(0.6) * math.sin(2.2), math.cos(0.6) * math.cos(2.2), math.sin(0.6)], abs=1e-6
    )
    assert sun[3] == pytest.approx(math.degrees(0.01), rel=1e-5)


# Narrower than Blender's cameras see, and so wide that it is not flat
@pytest.mark.parametrize("size", [0.002, 0.6])
def test_suns_of_all_sizes_have_their_power(stage, size):
    sky(stage, "SINGLE_SCATTERING", sun_elevation=0.9, sun_rotation=1, sun_size=size)
    shaded(stage)
    bake()
    differ(stage, 2 * EXACT, 64)


def test_a_volume_in_a_group_is_refused_with_a_way_out(stage):
    from stage import bpy, material

    made = material("Fog", "ShaderNodeVolumeScatter", output="Volume")
    tree = made.node_tree
    group = bpy.data.node_groups.new("Cloud", "ShaderNodeTree")
    group.interface.new_socket("Volume", in_out="OUTPUT", socket_type="NodeSocketShader")
    fog, noise, end = (group.nodes.new(kind) for kind in ("ShaderNodeVolumeScatter", "ShaderNodeTexNoise", "NodeGroupOutput"))
    group.links.new(noise.outputs[0], fog.inputs["Density"])
    group.links.new(fog.outputs[0], end.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    tree.links.new(node.outputs[0], output.inputs["Volume"])
    stage.cube(made)
    with pytest.raises(RuntimeError, match="Density is procedural. Ungroup the node"):
        stage.render(samples=1)


def test_a_sky_that_is_baked_again_without_its_sun_has_none(stage):
    made = sky(stage, "SINGLE_SCATTERING", sun_elevation=0.6)
    shaded(stage)
    bake()
    assert baked_sun(stage)

    made.sun_disc = False
    bake()

    assert not baked_sun(stage)
    differ(stage, 2 * EXACT, 64)


def test_worlds_of_several_backgrounds_are_baked(stage):
    tree, first = background(stage)
    second, mix, where = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("Background", "MixShader", "TexCoord")
    )
    parts = tree.nodes.new("ShaderNodeSeparateXYZ")
    first.inputs["Color"].default_value, first.inputs["Strength"].default_value = (1, 0.5, 0.2, 1), 0.5
    second.inputs["Color"].default_value, second.inputs["Strength"].default_value = (0.1, 0.3, 1, 1), 2
    tree.links.new(where.outputs["Generated"], parts.inputs[0])
    tree.links.new(parts.outputs["X"], mix.inputs[0])
    tree.links.new(first.outputs[0], mix.inputs[1])
    tree.links.new(second.outputs[0], mix.inputs[2])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    shaded(stage)
    with pytest.raises(RuntimeError, match="world 'World.*', node 'Mix Shader'.*Bake Procedural Textures"):
        stage.render(samples=1)

    bake()

    differ(stage, EXACT, 64)


def test_baking_leaves_the_file_as_it_was(stage):
    import bpy

    sky(stage, "SINGLE_SCATTERING")
    shaded(stage)

    def counts():
        return {kind: len(getattr(bpy.data, kind)) for kind in ("scenes", "worlds", "objects", "cameras", "meshes", "materials")}

    before = counts()
    bake()

    assert counts() == before
    assert next(n for n in stage.scene.world.node_tree.nodes if n.type == "TEX_SKY").sun_disc


@pytest.mark.parametrize("emission", [0.0, 0.2])
def test_the_volume_of_the_world_has_no_end(stage, emission):
    tree, _ = background(stage)
    fog = tree.nodes.new("ShaderNodeVolumePrincipled")
    for name, value in {"Density": 0.05, "Anisotropy": 0.3, "Emission Strength": emission}.items():
        fog.inputs[name].default_value = value
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(fog.outputs[0], output.inputs["Volume"])
    stage.sky(1)  # which no ray reaches
    stage.light("POINT", 300, (2, -2, 4), shadow_soft_size=0)
    shaded(stage)

    differ(stage, 2 * EXACT, 128)


def test_a_camera_in_two_volumes_is_refused(stage):
    from stage import material

    tree, _ = background(stage)
    fog = tree.nodes.new("ShaderNodeVolumeScatter")
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    tree.links.new(fog.outputs[0], output.inputs["Volume"])
    stage.cube(material("Fog", "ShaderNodeVolumeScatter", output="Volume"), 40)

    with pytest.raises(RuntimeError, match="camera 'Camera': it stands in the volume of an object and in that of the world"):
        stage.render(samples=1)


def clouded(stage, emission=0.0):
    """A cube of noise whose colour is a ramp along x, turned and stretched."""
    from stage import feed, material

    made = material("Fog", "ShaderNodeVolumePrincipled", output="Volume", Anisotropy=0.3)
    tree = made.node_tree
    shader = next(node for node in tree.nodes if node.type == "PRINCIPLED_VOLUME")
    noise = feed(made, "Density", "ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 2
    more = tree.nodes.new("ShaderNodeMath")
    more.operation = "MULTIPLY_ADD"
    more.inputs[1].default_value, more.inputs[2].default_value = 6, -2.4  # below 0 in places
    tree.links.new(noise.outputs[0], more.inputs[0])
    tree.links.new(more.outputs[0], shader.inputs["Density"])
    where, along, ramp = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexCoord", "TexGradient", "ValToRGB"))
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (1, 0.2, 0.1, 1), (0.1, 0.4, 1, 1)
    tree.links.new(where.outputs["Generated"], along.inputs[0])
    tree.links.new(along.outputs[0], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], shader.inputs["Color"])
    if emission:
        tree.links.new(ramp.outputs[0], shader.inputs["Emission Color"])
        shader.inputs["Emission Strength"].default_value = emission
    cube = stage.cube(made, 2.5, (0, 0, 0.4))
    cube.rotation_euler, cube.scale = (0.2, 0.3, 0.4), (1.3, 1, 0.8)
    return made, cube


# A grid of 96 voxels has the noise's second derivative left: of octaves down to 1/16 of a unit, far below 1 %.
@pytest.mark.parametrize("emission", [0.0, 0.2])
def test_volumes_that_vary_by_nodes_are_baked(stage, emission):
    stage.sky(0.3)
    stage.light("POINT", 200, (3, -2, 4), shadow_soft_size=0)
    clouded(stage, emission)
    with pytest.raises(RuntimeError, match="'Fog', node 'Principled Volume': Color is procedural.*Bake"):
        stage.render(samples=1)

    bake(voxels=96)

    differ(stage, 2 * EXACT, 64)


def test_each_object_bakes_the_volume_of_its_own_box(stage):
    stage.sky(0.5)
    made, first = clouded(stage)
    second = stage.cube(made, 1.2, (2.5, 1, 0.5))
    second.scale = (0.5, 1.5, 1)

    bake(voxels=48)

    differ(stage, 2 * EXACT, 64)


@pytest.mark.parametrize("factors", [(3, 1, 1), (2, 2, 2)])
def test_a_volume_whose_voxels_were_baked_in_another_box_is_refused(stage, factors):
    stage.sky(0.3)
    _, cube = clouded(stage)
    bake(voxels=8)

    for vertex in cube.data.vertices:
        vertex.co = [x * factor for x, factor in zip(vertex.co, factors)]

    with pytest.raises(RuntimeError, match="is procedural.*Bake Procedural Textures"):
        stage.render(samples=1)


def test_objects_of_one_mesh_have_voxels_of_their_own(stage):
    import bpy
    from stage import material

    made = material("Fog", "ShaderNodeVolumeScatter", output="Volume")
    tree = made.node_tree
    place, parts = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("NewGeometry", "SeparateXYZ"))
    shader = next(node for node in tree.nodes if node.type == "VOLUME_SCATTER")
    tree.links.new(place.outputs["Position"], parts.inputs[0])
    tree.links.new(parts.outputs["X"], shader.inputs["Density"])  # so it is 0 in the left half of the world
    stage.sky(0.5)
    left = stage.cube(made, 1.5, (-1.5, 0, 0.5))
    right = bpy.data.objects.new("Right", left.data)
    stage.put(right, (1.5, 0, 0.5))

    bake(voxels=24)

    differ(stage, 2 * EXACT, 32)


def test_baked_volumes_that_are_animated_are_a_warning(stage, capfd):
    stage.sky(0.3)
    made, _ = clouded(stage)
    noise = next(node for node in made.node_tree.nodes if node.type == "TEX_NOISE")
    for frame, scale in ((1, 2), (10, 4)):
        noise.inputs["Scale"].default_value = scale
        noise.inputs["Scale"].keyframe_insert("default_value", frame=frame)
    bake(voxels=8)

    stage.render(samples=1)

    assert "Density is animated; all frames have what was baked at one" in "".join(capfd.readouterr())
