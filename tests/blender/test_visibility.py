"""Which rays meet objects, lights and the world: each image as Cycles has it.

Where a shape is hidden from shadow rays alone, and a lamp has an extent, Cycles mixes what shadow rays and what other rays
see; such lamps are tiny here, or suns.
"""

import sys

import pytest
from test_alpha import differ_by_noise
from test_against_cycles import EXACT, differ

ALPHA = 3  # its channel
SURFACE_RAYS = ("diffuse", "glossy", "transmission")


def hide(item, *rays):
    for ray in rays:
        setattr(item, f"visible_{ray}", False)


def exported(stage):
    import bpy

    export = sys.modules["bl_ext.user_default.lightshaft.export"].export
    path, _, warnings = export(bpy.context.evaluated_depsgraph_get(), stage.folder, (96, 72))
    return path.read_text(), warnings


@pytest.fixture
def lit(stage):
    """A stage with a floor and a sun."""
    from stage import diffuse

    stage.plane(diffuse((0.6, 0.5, 0.4), "Floor"))
    stage.light("SUN", 2, rotation=(0.5, 0.2, 0))
    return stage


def test_a_ball_without_a_shadow(lit):
    from stage import diffuse

    hide(lit.ball(diffuse((0.2, 0.4, 0.8)), (0, 0, 1.2)), "shadow")

    differ_by_noise(lit)


def test_a_ball_that_only_casts_a_shadow(lit):
    from stage import diffuse

    hide(lit.ball(diffuse(), (0, 0, 1.2)), "camera", *SURFACE_RAYS)

    differ_by_noise(lit)


def test_a_ball_that_mirrors_do_not_show(stage):
    from stage import diffuse, principled

    stage.sky(0.4, (0.6, 0.8, 1))
    stage.plane(principled(Metallic=1.0, Roughness=0.0, Base_Color=(0.9, 0.9, 0.9)), 6)
    hide(stage.ball(diffuse(), (0.5, 0, 1)), *SURFACE_RAYS)

    differ_by_noise(stage)


def test_fog_without_the_shadow_of_a_ball(stage):
    from stage import diffuse, fog

    stage.cube(fog(Density=0.3, Color=(0.9, 0.8, 0.7)), 4)
    stage.light("SUN", 3, rotation=(0.5, 0.2, 0))
    hide(stage.ball(diffuse(), (0, 0, 0.8)), "shadow", "camera", "volume_scatter")

    differ_by_noise(stage, 128)


@pytest.mark.parametrize("rays", [SURFACE_RAYS, ("volume_scatter",)])
@pytest.mark.parametrize("kind", ["SUN", "POINT", "AREA", "SPOT"])
def test_lamps_light_surfaces_or_media_alone(stage, kind, rays):
    from stage import diffuse, fog

    stage.cube(fog(Density=0.15, Color=(0.9, 0.8, 0.7)), 5, (0, 0, 2.6))
    stage.plane(diffuse((0.5, 0.5, 0.5), "Floor"))
    stage.light("SUN", 0.3, rotation=(-0.5, 0.2, 0))
    values = {"shadow_soft_size": 0.0} if kind in ("POINT", "SPOT") else {}
    hide(stage.light(kind, 3 if kind == "SUN" else 300, (0.5, 0.5, 3.5), (0.2, 0.1, 0), **values), *rays)

    differ(stage, 2 * EXACT, 128)


@pytest.mark.parametrize("rays", [SURFACE_RAYS, ("scatter",)])
def test_a_world_lights_surfaces_or_media_alone(stage, rays):
    from stage import diffuse, fog

    stage.sky(0.5, (0.6, 0.8, 1))
    stage.light("SUN", 0.5, rotation=(0.5, 0.2, 0))
    stage.cube(fog(Density=0.3), 2, (-1, 0, 1.1))
    stage.plane(diffuse((0.5, 0.5, 0.5), "Floor"))
    for ray in rays:
        setattr(stage.scene.world.cycles_visibility, ray, False)
    try:
        differ(stage, 2 * EXACT, 128)
    finally:
        for ray in rays:
            setattr(stage.scene.world.cycles_visibility, ray, True)


@pytest.mark.parametrize("setting", ["indirect_only", "holdout"])
def test_collections_pass_their_switches_on(stage, setting):
    import bpy
    from stage import diffuse

    stage.scene.render.film_transparent = True
    stage.sky(0.5)
    stage.plane(diffuse((0.5, 0.5, 0.5), "Floor"))
    ball = stage.ball(diffuse(), (0, 0, 1))
    collection = bpy.data.collections.new("Inside")
    stage.scene.collection.children.link(collection)
    for other in list(ball.users_collection):
        other.objects.unlink(ball)
    collection.objects.link(ball)
    setattr(bpy.context.view_layer.layer_collection.children["Inside"], setting, True)
    try:
        differ_by_noise(stage)
        text, _ = exported(stage)
    finally:
        bpy.data.collections.remove(collection)

    assert ("visible_camera" if setting == "indirect_only" else "holdout") in text


def test_instances_are_hidden_from_what_their_parent_is_hidden_from(lit):
    import bpy
    from stage import diffuse

    ball = lit.ball(diffuse(), (0, 0, 1.2))
    model = bpy.data.collections.new("Model")
    for other in list(ball.users_collection):
        other.objects.unlink(ball)
    model.objects.link(ball)
    for x, rays in ((-1.2, ("shadow",)), (1.2, ())):
        empty = lit.put(bpy.data.objects.new("Instancer", None), (x, 0, 0))
        empty.instance_type, empty.instance_collection = "COLLECTION", model
        hide(empty, *rays)
    try:
        differ_by_noise(lit)
    finally:
        bpy.data.collections.remove(model)


@pytest.mark.parametrize("instanced", [False, True])
@pytest.mark.parametrize(
    "switches", [("indirect_only",), ("holdout",), ("holdout", "indirect_only"), ("is_holdout",), ("inner",)]
)
def test_holdout_and_indirect_only_are_those_of_cycles(stage, instanced, switches):
    """Of a collection, of what instances a ball, or of the ball, alone and together."""
    import bpy
    from stage import diffuse

    stage.scene.render.film_transparent = True
    stage.sky(0.5)
    stage.plane(diffuse((0.5, 0.5, 0.5), "Floor"))
    ball = stage.ball(diffuse(), (0, 0, 1))
    made = [bpy.data.collections.new(name) for name in ("Inside", "Model")]
    stage.scene.collection.children.link(made[0])
    for other in list(ball.users_collection):
        other.objects.unlink(ball)
    made[instanced].objects.link(ball)
    owner = ball
    if instanced:
        owner = bpy.data.objects.new("Instancer", None)
        made[0].objects.link(owner)
        owner.instance_type, owner.instance_collection = "COLLECTION", made[1]
    layer = bpy.context.view_layer.layer_collection.children["Inside"]
    for switch in switches:
        on = {"is_holdout": (owner, switch), "inner": (ball, "is_holdout")}.get(switch, (layer, switch))
        setattr(*on, True)
    try:
        differ_by_noise(stage)
    finally:
        for collection in made:
            bpy.data.collections.remove(collection)


def test_lights_in_a_collection_with_holdout_are_not_held_out(stage):
    import bpy
    from stage import diffuse

    stage.scene.render.film_transparent = True
    stage.plane(diffuse((0.5, 0.5, 0.5), "Floor"))
    lamp = stage.light("AREA", 300, size=1)
    inside = bpy.data.collections.new("Inside")
    stage.scene.collection.children.link(inside)
    stage.scene.collection.objects.unlink(lamp)
    inside.objects.link(lamp)
    bpy.context.view_layer.layer_collection.children["Inside"].holdout = True
    try:
        differ_by_noise(stage)
    finally:
        bpy.data.collections.remove(inside)


def test_some_surface_rays_alone_are_refused(stage):
    from stage import diffuse

    hide(stage.ball(diffuse()), "diffuse")
    with pytest.raises(RuntimeError) as error:
        stage.render(samples=1)

    assert "object 'Diffuse thing': hidden from rays (diffuse) alone" in str(error.value)


@pytest.mark.parametrize("angle", [0.0, 0.6])
def test_a_floor_that_catches_the_shadow_of_a_ball(stage, angle):
    from stage import diffuse

    stage.scene.render.film_transparent = True
    stage.light("SUN", 2, rotation=(0.5, 0.2, 0), angle=angle)
    stage.plane(diffuse((0.6, 0.6, 0.6), "Floor")).is_shadow_catcher = True
    stage.ball(diffuse((0.0, 0.0, 0.0)), (0, 0, 1.2))  # a bright one would light the floor, in Cycles

    differ_by_noise(stage, first=ALPHA)


def test_a_floor_that_catches_shadows_under_the_sky_and_a_lamp(stage):
    from stage import diffuse

    stage.scene.render.film_transparent = True
    stage.sky(0.5)
    stage.light("POINT", 300, (1, -1, 4), shadow_soft_size=0.5)
    stage.plane(diffuse((0.6, 0.6, 0.6), "Floor"), 6).is_shadow_catcher = True
    stage.ball(diffuse((0.0, 0.0, 0.0)), (0, 0, 1.2))

    differ_by_noise(stage, 256, ALPHA)


def test_a_shadow_catcher_without_a_transparent_film_is_warned_of(stage):
    from stage import diffuse

    stage.plane(diffuse()).is_shadow_catcher = True

    text, warnings = exported(stage)

    assert "shadow_catcher" in text
    assert any("'Diffuse thing': Shadow Catcher has no effect" in warning for warning in warnings), warnings


def test_lights_that_do_not_light_shadow_catchers_are_refused_beside_one(lit):
    from stage import diffuse

    lit.light("POINT", 10).is_shadow_catcher = False
    exported(lit)

    lit.cube(diffuse()).is_shadow_catcher = True
    exported(lit)  # nothing is caught

    lit.scene.render.film_transparent = True
    with pytest.raises(Exception) as error:
        exported(lit)

    assert "light 'Point': Shadow Catcher off" in str(error.value)
