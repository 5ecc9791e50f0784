"""Light and shadow linking: each image as Cycles has it.

What Cycles has of a lamp with an extent behind what is no blocker depends on its weights: shadow rays pass, and the scattered
rays that would find the lamp do not. So such lamps are tiny here, and highlights are those of lamps without an extent.
"""

import re

import pytest
from test_alpha import differ_by_noise
from test_visibility import exported

LAMPS = {
    "SUN": {"energy": 2, "rotation": (0.5, 0.2, 0)},
    "soft SUN": {"energy": 2, "rotation": (0.5, 0.2, 0), "angle": 0.5},
    "POINT": {"energy": 300, "location": (1, -1, 3.5), "shadow_soft_size": 0.0},
    "soft POINT": {"energy": 300, "location": (1, -1, 3.5), "shadow_soft_size": 0.05},
    "SPOT": {"energy": 900, "location": (0.5, -0.5, 4), "shadow_soft_size": 0.0, "spot_size": 1.5},
    "AREA": {"energy": 300, "location": (0.5, -0.5, 3.5), "size": 0.1},
}


@pytest.fixture
def collections(stage):
    """Returns a function that makes a collection of objects and of other collections, each with its state."""
    import bpy

    made = []

    def make(*members):
        collection = bpy.data.collections.new("Linked")
        made.append(collection)
        for member, state in members:
            inner = isinstance(member, bpy.types.Collection)
            (collection.children if inner else collection.objects).link(member)
            links = collection.collection_children if inner else collection.collection_objects
            links[-1].light_linking.link_state = state
        return collection

    yield make
    for collection in made:
        bpy.data.collections.remove(collection)


@pytest.fixture
def scene(stage):
    """A floor, two balls and a sky that is not linked. Returns (stage, floor, balls)."""
    from stage import diffuse

    stage.sky(0.1, (0.6, 0.8, 1))
    floor = stage.plane(diffuse((0.6, 0.5, 0.4), "Floor"))
    balls = [stage.ball(diffuse((0.2, 0.4, 0.8), f"Ball {x}"), (x, 0, 1)) for x in (-1.1, 1.1)]
    return stage, floor, balls


def lamp(stage, kind):
    values = dict(LAMPS[kind])
    return stage.light(kind.split()[-1], values.pop("energy"), **values)


@pytest.mark.parametrize("kind", LAMPS)
def test_a_lamp_lights_a_ball_and_the_floor_alone(scene, collections, kind):
    stage, floor, balls = scene
    lamp(stage, kind).light_linking.receiver_collection = collections((floor, "INCLUDE"), (balls[0], "INCLUDE"))

    differ_by_noise(stage, 128)


@pytest.mark.parametrize("kind", LAMPS)
def test_a_lamp_is_shaded_by_a_ball_alone(scene, collections, kind):
    stage, _, balls = scene
    lamp(stage, kind).light_linking.blocker_collection = collections((balls[0], "INCLUDE"))

    differ_by_noise(stage, 128)


@pytest.mark.parametrize("roughness", [0.25, 0.4])
def test_highlights_pass_what_is_no_blocker(stage, collections, roughness):
    from stage import diffuse, principled

    stage.sky(0.1)
    floor = stage.plane(principled(Metallic=1.0, Roughness=roughness, Base_Color=(0.9, 0.9, 0.9)), 8)
    ball = stage.ball(diffuse((0.1, 0.2, 0.4)), (0.2, 1.0, 1.0))
    lamp(stage, "POINT").light_linking.blocker_collection = collections((ball, "EXCLUDE"))

    differ_by_noise(stage, 256)


def test_a_mirror_shows_what_is_no_blocker(stage, collections):
    from stage import diffuse, principled

    stage.sky(0.1)
    stage.plane(principled(Metallic=1.0, Roughness=0.0, Base_Color=(0.9, 0.9, 0.9)), 8)
    ball = stage.ball(diffuse((0.1, 0.2, 0.4)), (0.2, 1.0, 1.0))
    shine = stage.light("AREA", 300, (0.3, 2.5, 3.5), size=2.0)
    shine.visible_camera = False
    shine.light_linking.blocker_collection = collections((ball, "EXCLUDE"))

    differ_by_noise(stage, 256)


def test_receivers_and_blockers_that_are_left_out(scene, collections):
    stage, floor, balls = scene
    one, other = lamp(stage, "AREA"), lamp(stage, "SUN")
    one.light_linking.receiver_collection = collections((balls[1], "EXCLUDE"))
    one.light_linking.blocker_collection = collections((balls[0], "EXCLUDE"))
    other.light_linking.blocker_collection = collections((balls[1], "EXCLUDE"), (floor, "INCLUDE"))

    differ_by_noise(stage, 256)


def test_a_ball_that_emits_is_linked(scene, collections):
    from stage import material

    stage, floor, balls = scene
    glowing = stage.ball(material("Glow", "ShaderNodeEmission", Strength=20.0), (0, -2, 1.5))
    glowing.scale = (0.3, 0.3, 0.3)
    glowing.light_linking.receiver_collection = collections((balls[0], "EXCLUDE"))
    glowing.light_linking.blocker_collection = collections((balls[1], "EXCLUDE"))

    differ_by_noise(stage, 256)


def test_fog_receives_light_or_none(stage, collections):
    from stage import diffuse, fog

    cube = stage.cube(fog(Density=0.15, Color=(0.9, 0.8, 0.7)), 5, (0, 0, 2.6))
    floor = stage.plane(diffuse((0.5, 0.5, 0.5), "Floor"))
    stage.light("SUN", 0.3, rotation=(-0.5, 0.2, 0))
    dark, light = lamp(stage, "POINT"), stage.light("SUN", 1, rotation=(0.2, 0.5, 0))
    dark.light_linking.receiver_collection = collections((cube, "EXCLUDE"))
    light.light_linking.receiver_collection = collections((floor, "EXCLUDE"))

    differ_by_noise(stage, 256)


@pytest.mark.parametrize("excluded", [True, False])
def test_instances_have_the_links_of_what_instances_them_or_their_own(scene, collections, excluded):
    import bpy
    from stage import diffuse

    stage, floor, balls = scene
    model = collections()
    for other in list(balls[0].users_collection):
        other.objects.unlink(balls[0])
    model.objects.link(balls[0])
    empties = []
    for place in ((0, 0, 0), (1.1, -1.8, 0), (1.1, 1.8, 0)):
        empty = stage.put(bpy.data.objects.new("Instancer", None), place)
        empty.instance_type, empty.instance_collection = "COLLECTION", model
        empties.append(empty)
    state = "EXCLUDE" if excluded else "INCLUDE"
    lamp(stage, "SUN").light_linking.receiver_collection = collections((empties[1], state), (balls[0], "EXCLUDE"))
    model_lamp = stage.light("POINT", 100, (0, 0, 3), shadow_soft_size=0.0)
    stage.scene.collection.objects.unlink(model_lamp)
    model.objects.link(model_lamp)
    model_lamp.light_linking.receiver_collection = collections((floor, "EXCLUDE"))

    differ_by_noise(stage)


def test_nested_collections_have_the_state_of_the_outermost(scene, collections):
    stage, floor, balls = scene
    inner = collections((balls[0], "INCLUDE"))
    lamp(stage, "SUN").light_linking.receiver_collection = collections((inner, "EXCLUDE"))

    differ_by_noise(stage)
    text, _ = exported(stage)

    assert 'name="receivers" value="-' in text


@pytest.mark.parametrize(("state", "lists"), [("INCLUDE", ["none"]), ("EXCLUDE", [])])
def test_a_collection_of_what_is_not_in_the_scene(scene, collections, state, lists):
    import bpy

    stage, floor, _ = scene
    elsewhere = bpy.data.objects.new("Elsewhere", floor.data)
    lamp(stage, "SUN").light_linking.receiver_collection = collections((elsewhere, state))

    differ_by_noise(stage)
    text, _ = exported(stage)

    assert re.findall('name="receivers" value="(.*?)"', text) == lists


def test_an_empty_collection_leaves_nothing_out(scene, collections):
    stage, _, _ = scene
    lamp(stage, "SUN").light_linking.receiver_collection = collections()

    differ_by_noise(stage)


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
def test_a_light_without_shadows(scene, kind):
    stage, _, _ = scene
    lamp(stage, kind).data.use_shadow = False

    differ_by_noise(stage)


def test_a_volume_that_is_no_blocker_is_warned_of(scene, collections):
    from stage import fog

    stage, floor, _ = scene
    stage.cube(fog(Density=0.1), 1, (0, -2, 1)).name = "Haze"
    lamp(stage, "SUN").light_linking.blocker_collection = collections((floor, "INCLUDE"))

    _, warnings = exported(stage)

    assert any("'Haze': the volume in it shades light 'Sun'" in warning for warning in warnings), warnings
