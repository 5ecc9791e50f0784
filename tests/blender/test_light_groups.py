"""Light groups: each group's pass by Lightshaft and by Cycles, and the names of groups."""

import sys

import numpy as np
import pytest
from test_against_cycles import EXACT, compare

BANDS = 5  # standard errors of the difference of two means (kStandardErrors in tests/support/significance.h)


@pytest.fixture
def grouped(stage):
    """grouped(NAME: what is in it, ...) adds the groups to the view layer."""
    import bpy

    layer = bpy.context.view_layer

    def add(**members):
        for name, member in members.items():
            group = layer.lightgroups.add(name=name)
            if member is not None:
                member.lightgroup = group.name

    yield add
    for group in list(layer.lightgroups):
        layer.lightgroups.remove(group)


def lit(stage, grouped):
    """Lamps of all kinds, the world, a glowing ball and glowing fog, in five groups; one more has no light."""
    from stage import diffuse, fog, material

    stage.plane(diffuse((0.5, 0.5, 0.5), "Floor"))
    ball = stage.ball(material("Glow", "ShaderNodeEmission", Color=(1, 0.6, 0.2), Strength=2), (1, 2, 1))
    # Clear of the floor: which of two faces in one plane a ray hits is chance
    fire = stage.cube(fog("Fire", Density=0.2, Emission_Strength=0.5, Emission_Color=(1, 0.3, 0.1)), 2, (-1, -1, 1.2))
    stage.sky(0.2, (0.5, 0.7, 1))
    key = stage.light("POINT", 200, (3, -2, 4), shadow_soft_size=0)
    fill = stage.light("AREA", 100, (-3, 2, 4), size=2)
    sun = stage.light("SUN", 0.5, rotation=(0.5, 0.2, 0), angle=0.1)
    spot = stage.light("SPOT", 300, (0, 0, 5), shadow_soft_size=0, spot_size=1.2)
    grouped(Key=key, Lamps=fill, Sky=stage.scene.world, Fire=fire, Empty=None)
    sun.lightgroup = ball.lightgroup = "Sky"
    spot.lightgroup = "Lamps"


def test_each_group_has_the_light_of_cycles(stage, grouped):
    lit(stage, grouped)
    means, errors = [], []
    for engine, samples in (("LIGHTSHAFT", 256), ("CYCLES", 256)):
        images = []
        for seed in (1, 2):
            stage.render(engine, samples, seed=seed)
            images.append({name: np.stack([stage.layers[f"Combined_{name}"][c] for c in "RGB"], 2) for name in ("Key", "Lamps", "Sky", "Fire", "Empty")})
        one, other = images
        means.append({name: (one[name] + other[name]) / 2 for name in one})
        errors.append({name: np.sqrt(((one[name] - other[name]) ** 2).sum((0, 1))) / 2 / one[name][..., 0].size for name in one})

    ours, theirs = means
    assert not ours.pop("Empty").any() and not theirs.pop("Empty").any()
    for name in ours:
        # The band is that of noise at least.
        noise = np.hypot(errors[0][name], errors[1][name])
        assert np.all(BANDS * noise < EXACT * theirs[name].mean((0, 1))), (name, noise / theirs[name].mean((0, 1)))
        compare(ours[name], theirs[name], EXACT)


def test_the_groups_are_all_of_the_light_where_each_light_has_one(stage, grouped):
    """Each of the five is rounded to floats twice, by the worker and in the image, each time by at most 2^-24 of the whole."""
    lit(stage, grouped)

    stage.render(samples=4)

    total = sum(stage.layers[f"Combined_{name}"]["R"] for name in ("Key", "Lamps", "Sky", "Fire"))
    combined = stage.layers["Combined"]["R"]
    assert combined.mean() > 0.01 and np.abs(total - combined).max() <= 10 * 2**-24 * combined.max()


def exported(stage):
    import bpy

    export = sys.modules["bl_ext.user_default.lightshaft.export"].export
    path, _, warnings = export(bpy.context.evaluated_depsgraph_get(), stage.folder, (96, 72))
    return path.read_text(), warnings


def test_names_that_lightshaft_does_not_take_are_changed_and_told(stage, grouped):
    grouped(**{"Key lämp": stage.light("POINT", 10), "other": stage.light("SUN", 1)})

    scene, warnings = exported(stage)

    assert 'name="light_group" value="Key_l_mp"' in scene and 'name="light_group" value="other_"' in scene
    assert "light group 'Key lämp' is called 'Key_l_mp' in Lightshaft" in warnings
    assert "light group 'other' is called 'other_' in Lightshaft" in warnings
    stage.render(samples=4)
    assert stage.layers["Combined_Key lämp"]["R"].max() >= 0
    assert stage.layers["Combined_other"]["R"].max() >= 0


def test_names_that_become_the_same_are_refused(stage, grouped):
    grouped(**{"Key 1": stage.light("POINT", 10), "Key+1": stage.light("SUN", 1)})

    with pytest.raises(RuntimeError, match="light groups 'Key 1' and 'Key[+]1': both are called 'Key_1' in Lightshaft"):
        stage.render(samples=1)


def test_a_scene_without_groups_asks_for_none(stage, farm):
    stage.settings.where = "FARM"
    stage.sky(1)
    before = {job["id"] for job in farm.get("/api/v1/jobs")["jobs"]}

    stage.render(samples=1)

    (job,) = {job["id"] for job in farm.get("/api/v1/jobs")["jobs"]} - before
    assert "light_group" not in exported(stage)[0]
    assert not [row for row in farm.get(f"/api/v1/jobs/{job}/layers")["layers"] if row["name"].startswith("RGB_")]
