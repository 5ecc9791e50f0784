"""Which rays meet a prim, by the primvars of Arnold, RenderMan and Karma."""

import math
import xml.etree.ElementTree as ElementTree

import lightshaft.usd
import pytest
from stage_kit import Sdf, UsdGeom, UsdLux, camera, floor, new_stage, path_of, sky

ALL = {"camera", "shadow", "reflection", "volume"}


@pytest.fixture
def stage(tmp_path):
    made = new_stage(tmp_path)
    camera(made, (0, 5, 0), (0, 0, 0), up=(0, 0, 1))
    sky(made)
    UsdGeom.Sphere.Define(made, "/ball")
    return made


def say(prim, name, value):
    kind = {bool: "Bool", int: "Int", float: "Float", str: "String"}[type(value)]
    made = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(name, getattr(Sdf.ValueTypeNames, kind), "constant")
    made.Set(value)


def flags(stage, kind="sphere"):
    """The rays from which the first shape or emitter of a type is hidden, whether it is held out, and the warnings."""
    scene = lightshaft.usd.read(path_of(stage))
    (found,) = (e for e in ElementTree.fromstring(scene.main.xml).iter() if e.get("type") == kind)
    given = {e.get("name"): e.get("value") for e in found.iter("boolean")}
    hidden = {name[8:] for name, value in given.items() if name.startswith("visible_") and value == "false"}
    return hidden, given.get("holdout") == "true", "\n".join(scene.warnings)


@pytest.mark.parametrize(
    ("name", "value", "hidden"),
    [
        ("arnold:visibility:camera", False, {"camera"}),
        ("arnold:visibility:shadow", 0, {"shadow"}),
        ("arnold:visibility:shadow", True, set()),
        ("arnold:visibility:volume", False, {"volume"}),
        ("arnold:visibility", 255 - 1, {"camera"}),
        ("arnold:visibility", 1, ALL - {"camera"}),
        ("arnold:visibility", 255 - 4 - 8 - 32 - 64, {"reflection"}),
        ("ri:attributes:visibility:camera", 0, {"camera"}),
        ("ri:attributes:visibility:indirect", 0, {"reflection", "volume"}),
        ("ri:attributes:visibility:transmission", 0, {"shadow"}),
        ("karma:object:rendervisibility", "*", set()),
        ("karma:object:rendervisibility", "", ALL),
        ("karma:object:rendervisibility", "-primary", {"camera"}),
        ("karma:object:rendervisibility", "-shadow", {"shadow"}),
        ("karma:object:rendervisibility", "* ^shadow", {"shadow"}),
        ("karma:object:rendervisibility", "-volume", {"volume"}),
        ("karma:object:rendervisibility", "primary|shadow", {"reflection"}),
        ("karma:object:rendervisibility", "-diffuse & -reflect & -refract", {"reflection"}),
    ],
)
def test_primvars_of_other_renderers_hide_a_prim_from_rays(stage, name, value, hidden):
    say(stage.GetPrimAtPath("/ball"), name, value)

    assert flags(stage) == (hidden, False, "")


def test_a_flag_of_a_ray_goes_before_the_mask_of_all(stage):
    ball = stage.GetPrimAtPath("/ball")
    say(ball, "arnold:visibility", 0)
    say(ball, "arnold:visibility:shadow", True)

    assert flags(stage)[0] == ALL - {"shadow"}


def test_flags_are_inherited_and_instances_keep_those_that_they_inherit(stage):
    around = UsdGeom.Xform.Define(stage, "/around")
    UsdGeom.Sphere.Define(stage, "/around/inner")
    stage.RemovePrim("/ball")
    say(around.GetPrim(), "arnold:visibility:shadow", False)

    assert flags(stage)[0] == {"shadow"}

    around.GetPrim().SetActive(False)
    model = stage.CreateClassPrim("/model")
    UsdGeom.Sphere.Define(stage, "/model/ball")
    for path, visible in (("/one", True), ("/two", False)):
        placed = UsdGeom.Xform.Define(stage, path).GetPrim()
        placed.GetReferences().AddInternalReference(model.GetPath())
        placed.SetInstanceable(True)
        say(placed, "ri:attributes:visibility:camera", int(visible))
    text = lightshaft.usd.read(path_of(stage)).main.xml
    assert text.count('type="sphere"') == 2 and text.count("visible_camera") == 1


def test_a_matte_is_held_out(stage):
    say(stage.GetPrimAtPath("/ball"), "arnold:matte", True)

    assert flags(stage) == (set(), True, "")


def test_lights_follow_the_flags_that_they_have(stage):
    for light in (stage.GetPrimAtPath("/sky"), UsdLux.SphereLight.Define(stage, "/lamp").GetPrim()):
        say(light, "ri:attributes:visibility:camera", 0)
        say(light, "ri:attributes:visibility:indirect", 0)
    stage.GetPrimAtPath("/lamp").GetAttribute("inputs:radius").Set(0.0)
    UsdLux.SphereLight(stage.GetPrimAtPath("/lamp")).CreateNormalizeAttr(True)

    assert flags(stage, "constant")[0] == {"camera", "reflection", "volume"}
    assert flags(stage, "point")[0] == {"reflection", "volume"}


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("arnold:visibility:diffuse_reflect", False, "hidden from some of the rays"),
        ("karma:object:rendervisibility", "-caustic", "it names 'caustic'"),
        ("arnold:visibility:camera", "no", "it is not a number"),
        ("arnold:visibility:camera", math.nan, "arnold:visibility:camera has no effect: it is not a number"),
        ("arnold:visibility", math.inf, "arnold:visibility has no effect: it is not a number"),
    ],
)
def test_what_has_no_effect_is_told_with_its_prim(stage, name, value, told):
    say(stage.GetPrimAtPath("/ball"), name, value)

    hidden, _, warnings = flags(stage)

    assert not hidden
    assert warnings.startswith("/ball: warning:") and told in warnings, warnings


def test_a_prim_without_a_shadow_casts_none(farm, stage):
    floor(stage)
    ball = stage.GetPrimAtPath("/ball")
    UsdGeom.Xformable(ball).AddTranslateOp().Set((0, 2, 0))
    say(ball, "arnold:visibility:camera", False)
    say(ball, "arnold:visibility:shadow", False)
    sun = UsdLux.DistantLight.Define(stage, "/sun")
    sun.CreateIntensityAttr(3.14159265)
    sun.CreateAngleAttr(0.0)
    UsdGeom.Xformable(sun).AddRotateXOp().Set(-90.0)
    stage.GetPrimAtPath("/sky").SetActive(False)

    pixels = farm.submit(path_of(stage), spp=64, size=(16, 16)).wait().image()

    # A white floor under an irradiance of pi; the ball reflects light from floor to floor, too.
    assert pixels.min() > 0.99
