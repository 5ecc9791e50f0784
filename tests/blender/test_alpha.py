"""Images for compositing: a transparent film, holdouts and what the camera does not see, each as Cycles has it.

The standard error of the mean of a channel follows from the differences of two renders with other seeds, pixel by pixel.
EXACT, the band of the means, is five standard errors of the difference between the renderers at least (kStandardErrors in
tests/support/significance.h), which is tested, too.
"""

import math
import sys

import numpy as np
import pytest
from test_against_cycles import EXACT, compare, differ, put_cloud


@pytest.fixture
def element(stage):
    """A stage with a transparent film, a sky and a sun."""
    stage.scene.render.film_transparent = True
    stage.sky(0.3, (0.6, 0.8, 1))
    stage.light("SUN", 2, rotation=(0.5, 0.2, 0))
    return stage


def differ_by_noise(stage, samples=64, first=0):
    """`first`: the first channel that is compared."""
    images, errors = [], []
    for engine in ("LIGHTSHAFT", "CYCLES"):
        one, other = (stage.render(engine, samples, seed=seed)[..., first:] for seed in (1, 2))
        images.append((one + other) / 2)
        errors.append(np.sqrt(((one - other) ** 2).sum(axis=(0, 1))) / 2 / one[..., 0].size)
    assert np.all(5 * np.hypot(*errors) < EXACT * images[1].mean(axis=(0, 1))), (images, errors)
    compare(*images, EXACT)


def test_fog_over_nothing(element):
    from stage import fog

    element.cube(fog(Density=0.5, Color=(0.8, 0.6, 0.4)), 3)

    differ_by_noise(element)


def test_a_cloud_of_an_openvdb_file_over_nothing(stage):
    stage.scene.render.film_transparent = True
    stage.sky(0.3, (0.6, 0.8, 1))
    cloud = put_cloud(stage, Density=4.0, Color=(0.95, 0.9, 0.85))
    cloud.location, cloud.scale = (0, 0, 0), (2.8, 2.5, 2.5)

    differ_by_noise(stage, 256)


def test_a_held_out_ball_in_fog(element):
    from stage import diffuse, fog

    element.cube(fog(Density=0.2, Color=(0.8, 0.6, 0.4)), 4)
    element.ball(diffuse(), (0, 0, 0)).is_holdout = True
    element.ball(diffuse((0.2, 0.4, 0.8), "Behind"), (-1.5, 1.5, 0))

    differ_by_noise(element)


def test_instances_are_held_out_and_hidden_one_by_one(element):
    from stage import diffuse

    element.plane(diffuse((0.5, 0.5, 0.5), "Floor"))
    first = element.ball(diffuse(), (0, 0, 0.5))
    for place, (holdout, seen) in zip(
        ((1, -2, 0.5), (-1, 1, 0.5), (2, 1, 0.5), (3, 1, 0.5)),
        ((True, True), (False, True), (False, False), (False, False)),
    ):
        other = element.put(first.copy(), place)
        other.is_holdout, other.visible_camera = holdout, seen
    first.is_holdout = True

    differ_by_noise(element)


def test_a_ball_that_the_camera_does_not_see_is_in_mirrors(stage):
    from stage import diffuse, principled

    stage.scene.render.film_transparent = True
    stage.sky(0.3, (0.6, 0.8, 1))
    stage.plane(principled(Metallic=1.0, Roughness=0.3, Base_Color=(0.9, 0.9, 0.9)), 6)
    ball = stage.ball(diffuse(), (1, 0, 1))
    ball.visible_camera = False
    differ_by_noise(stage)

    hidden = stage.render()
    ball.hide_render = True
    gone = stage.render()
    ball.hide_render = False

    assert np.array_equal(hidden[..., 3], gone[..., 3]), "the camera sees the ball"
    assert np.abs(hidden - gone)[..., :3].max() > 0.05, "the mirror does not show it"


@pytest.mark.parametrize("seen", [True, False])
@pytest.mark.parametrize("kind", ["POINT", "AREA", "SUN"])
def test_lamps_are_seen_by_the_camera_if_it_is_to_see_them(stage, kind, seen):
    from stage import diffuse

    stage.sky(0.1)
    stage.plane(diffuse())
    place = (1, -1, 1.5)
    if kind == "POINT":  # Cycles' soft falloff turns the ball into a disk
        lamp = stage.light(kind, 20, place, shadow_soft_size=0.6, use_soft_falloff=False)
    elif kind == "AREA":
        lamp = stage.light(kind, 20, place, (0, 0, 0.5), shape="RECTANGLE", size=2, size_y=1)
        stage.camera.location, stage.camera.rotation_euler = (1, -1, 0.1), (math.pi, 0, 0)
    else:
        lamp = stage.light(kind, 0.5, rotation=(-0.8, 0, 0.8), angle=0.4)
        stage.camera.rotation_euler = (math.pi - 0.8, 0, 0.8)  # towards the sun
    lamp.visible_camera = seen

    differ(stage, EXACT, 64)

    assert (stage.render(samples=1).max() > 1) == seen


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_only_lamps_that_can_be_in_the_picture_are_hidden(stage, kind):
    import bpy
    from bpy_extras.object_utils import world_to_camera_view

    random, lens, size = np.random.default_rng(1), stage.camera.data, (96, 72)
    lens.type, lens.ortho_scale, lens.shift_x = kind, 7, 0.2
    lens.dof.use_dof, lens.dof.aperture_fstop, lens.dof.focus_distance = True, 0.5, 4
    lamps = [stage.light("POINT", 1, place, shadow_soft_size=0.2) for place in random.uniform(-12, 12, (200, 3))]
    depsgraph = bpy.context.evaluated_depsgraph_get()
    may_see, seen = sys.modules["bl_ext.user_default.lightshaft.camera"].may_see, 0

    for lamp in lamps:
        centre = lamp.matrix_world.translation
        x, y, depth = world_to_camera_view(stage.scene, stage.camera, centre)
        found = may_see(stage.camera, stage.scene, size, centre, 0.2, type(lamp.matrix_world))
        if 0 < x < 1 and 0 < y < 1 and depth > 0:
            assert found, (x, y, depth)
            seen += 1
        elif depth < -1 or not (-1 < x < 2 and -1 < y < 2) and depth > 4:
            assert not found, (x, y, depth)
    assert 10 < seen < 100
    path, _, _ = sys.modules["bl_ext.user_default.lightshaft.export"].export(depsgraph, stage.folder, size)
    assert seen <= path.read_text().count("visible_camera") < 150


def test_a_world_that_the_camera_does_not_see(stage):
    from stage import diffuse

    stage.sky(0.3, (0.6, 0.8, 1))
    stage.ball(diffuse(), (0, 0, 0))
    stage.scene.world.cycles_visibility.camera = False

    differ(stage, EXACT, 16)


def test_the_combined_pass_is_the_image_with_its_alpha(element, farm):
    from stage import fog

    element.settings.where = "FARM"
    element.cube(fog(Density=0.5), 3)
    before = {job["id"] for job in farm.get("/api/v1/jobs")["jobs"]}

    element.render(samples=8)

    (job,) = {job["id"] for job in farm.get("/api/v1/jobs")["jobs"]} - before
    exr = sys.modules["bl_ext.user_default.lightshaft.exr"]
    layers = exr.read(farm.request("GET", f"/api/v1/jobs/{job}/image.exr"))
    for channel in "RGBA":
        assert np.array_equal(element.layers["Combined"][channel], layers[channel])
    alpha = element.layers["Combined"]["A"]
    assert alpha.min() == 0 and 0.5 < alpha.max() < 1


def test_what_is_not_as_in_cycles_is_refused(element):
    from stage import fog

    element.cube(fog("Mist", Density=0.5)).visible_camera = False
    element.scene.cycles.film_transparent_glass = True
    try:
        with pytest.raises(RuntimeError) as error:
            element.render(samples=1)
    finally:
        element.scene.cycles.film_transparent_glass = False

    assert "object 'Mist thing', material 'Mist': hidden from rays (camera) with a volume" in str(error.value)
    assert "Film: Transparent Glass" in str(error.value)


def test_a_holdout_without_a_transparent_film_is_black_and_warned_of(stage):
    import bpy
    from stage import diffuse

    stage.sky(0.3)
    ball = stage.ball(diffuse())
    ball.is_holdout = True
    export = sys.modules["bl_ext.user_default.lightshaft.export"].export

    ours, theirs = stage.render(samples=16), stage.render("CYCLES", 16)
    _, _, warnings = export(bpy.context.evaluated_depsgraph_get(), stage.folder, (96, 72))

    compare(ours, theirs, EXACT)
    assert any("'Diffuse thing': Holdout leaves black" in warning for warning in warnings), warnings


def test_each_row_of_a_panel_is_a_property(stage):
    import bpy

    stage.ball(None)
    for panel in sys.modules["bl_ext.user_default.lightshaft.panels"].CLASSES:
        assert panel.rows and all(hasattr(panel.owner(bpy.context), name) for name in panel.rows), panel
