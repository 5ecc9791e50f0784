"""Prims that move while the shutter of the camera is open."""

import re

import numpy as np
import pytest
from stage_kit import (
    Gf,
    Sdf,
    UsdGeom,
    UsdLux,
    UsdSkel,
    bind,
    camera,
    floor,
    image,
    moved,
    new_stage,
    path_of,
    preview,
    sky,
    turned,
)

import lightshaft
import lightshaft.usd

LONG = 1024  # frames of the exposure, so that stills have many whole frames to be of
STRATA = 12
SHOTS = 6


@pytest.fixture
def stage(tmp_path):
    """A grey floor under a white sky, and a camera whose shutter is open from frame 0 to frame LONG."""
    made = new_stage(tmp_path)
    made.SetStartTimeCode(0)
    made.SetEndTimeCode(LONG)
    sky(made)
    floor(made, 0.5)
    camera(made, (0, 4, 8), (0, 0.5, 0), 40.0).CreateShutterCloseAttr(float(LONG))
    return made


def op(prim, kind, begin, end, **options):
    """An operation of a prim whose value goes from `begin` to `end` in the exposure."""
    made = getattr(UsdGeom.Xformable(prim), f"Add{kind}Op")(**options)
    made.Set(begin, 0)
    made.Set(end, LONG)
    return made


def ball(stage, path, place=(0, 0.5, 0), radius=0.5, value=(0.8, 0.2, 0.1)):
    made = UsdGeom.Sphere.Define(stage, path)
    made.CreateRadiusAttr(radius)
    made.CreateDisplayColorAttr([Gf.Vec3f(*value)])
    UsdGeom.Xformable(made).AddTranslateOp(opSuffix="place").Set(place)
    return made


def cube(stage, path, size=1.0, value=(0.1, 0.3, 0.8)):
    made = UsdGeom.Cube.Define(stage, path)
    made.CreateSizeAttr(size)
    made.CreateDisplayColorAttr([Gf.Vec3f(*value)])
    return made


def shapes(stage):
    """A cube that turns on a stretched rail that moves, and a ball that grows while it rises."""
    rail = UsdGeom.Xform.Define(stage, "/rail")
    op(rail, "Translate", (-1.5, 0.6, 0), (0.5, 0.6, 1))
    UsdGeom.Xformable(rail).AddScaleOp().Set((1.5, 1, 1.5))
    op(cube(stage, "/rail/cube"), "RotateY", 0.0, 120.0)
    grows = ball(stage, "/ball", (1.5, 0.5, -0.5))
    op(grows, "Translate", (0, 0, 0), (0, 1, 0))
    op(grows, "Scale", (1, 1, 1), (1.4, 1.4, 1.4))


def instances(stage):
    """Instances of which one moves and one has a part that moves, and points that turn."""
    UsdGeom.Xform.Define(stage, "/_proto")
    stage.GetPrimAtPath("/_proto").SetSpecifier(Sdf.SpecifierClass)
    ball(stage, "/_proto/a", (0, 0.5, 0))
    op(cube(stage, "/_proto/b", 0.6), "Translate", (0, 1.2, 0), (0.8, 1.2, 0))
    for i, x in enumerate((-2, 2)):
        made = UsdGeom.Xform.Define(stage, f"/i{i}")
        op(made, "Translate", (x, 0, 0), (x + i, 0, i))
        made.GetPrim().GetReferences().AddInternalReference("/_proto")
        made.GetPrim().SetInstanceable(True)
    points = UsdGeom.PointInstancer.Define(stage, "/points")
    cube(stage, "/points/cube", 0.5, (0.2, 0.7, 0.2))
    points.CreatePrototypesRel().AddTarget("/points/cube")
    points.CreateProtoIndicesAttr([0, 0])
    points.CreatePositionsAttr().Set([(-0.5, 0.3, 2), (0.5, 0.3, 2)], 0)
    points.GetPositionsAttr().Set([(-0.5, 0.3, 2), (0.9, 1.0, 2)], LONG)
    op(points, "RotateY", 0.0, 40.0)


def lamps(stage):
    """Lamps of all kinds with a shape, and a cube and a ball that glow."""
    stage.RemovePrim("/sky")
    for i, kind in enumerate(("RectLight", "DiskLight", "SphereLight", "CylinderLight")):
        made = getattr(UsdLux, kind).Define(stage, f"/{kind}")
        made.CreateIntensityAttr(3.0)
        op(made, "Translate", (i - 2, 1, 0), (i - 1, 1.5, 0.5))
        op(made, "RotateX", -60.0, -100.0)
        if kind == "RectLight":
            made.CreateWidthAttr(0.5)
        if kind in ("SphereLight", "CylinderLight"):
            made.CreateRadiusAttr(0.2)
    glow = preview(stage, "/glow", emissiveColor=(1.0, 1.0, 1.0), diffuseColor=(0.0, 0.0, 0.0))
    for made in (cube(stage, "/cube", 0.5), ball(stage, "/ball", (0, 0.3, 1), 0.3)):
        op(made, "Translate", (-1, 0.3, 1), (0.5, 0.3, 1), opSuffix="way")
        bind(made, glow)


def blocks(shown):
    """Means of 8 x 8 pixels."""
    height, width, _ = shown.shape
    return shown.astype(np.float64).reshape(height // 8, 8, width // 8, 8, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("build", [shapes, instances, lamps])
def test_what_moves_is_blurred_as_the_mean_of_stills(farm, stage, build, recwarn):
    """The mean over the exposure, beside stills at two random times in each of STRATA equal parts of it.

    The mean of the stills is without bias. Its variance is the sum over the parts of (a - b)^2 / 4 / STRATA^2, which
    has the stills' noise too; that of the mean of SHOTS blurred images is their own. Both are estimated from about
    ten differences, so z = difference / error is distributed as Student's t with at least SHOTS - 1 = 5 degrees of
    freedom. The limit 12 is passed with a probability of 7e-5, 0.003 of all 36 numbers of a picture; an object that
    stands still at either end of the exposure gives 30 and more."""
    build(stage)
    size = (32, 24)
    shots = np.stack([blocks(image(farm, stage, 128, size, seed=i)) for i in range(SHOTS)])
    assert not [w for w in recwarn if issubclass(w.category, lightshaft.SceneWarning) and "motion" in str(w)]
    stage.GetPrimAtPath("/camera").GetAttribute("shutter:close").Set(0.0)
    generator, pairs = np.random.default_rng(7), []
    for part in range(STRATA):
        pair = []
        for _ in range(2):
            at = (part + generator.random()) * LONG / STRATA
            stage.SetStartTimeCode(float(at))
            pair.append(blocks(image(farm, stage, 32, size, seed=int(at))))
        pairs.append(pair)
    pairs = np.array(pairs)
    expected = pairs.mean(axis=(0, 1))
    variance = np.square(pairs[:, 0] - pairs[:, 1]).sum(axis=0) / 4 / STRATA**2
    variance += shots.var(axis=0, ddof=1) / SHOTS + (1e-3 * expected) ** 2  # of half-float images
    z = (shots.mean(axis=0) - expected) / np.sqrt(variance)
    still = (pairs[0, 0] - expected) / np.sqrt(variance)
    print(build.__name__, "z", np.abs(z).max(), np.sqrt(np.square(z).mean()), "still", np.abs(still).max())
    assert np.abs(z).max() < 12
    assert np.sqrt(np.square(z).mean()) < 1.5
    assert np.abs(still).max() > 30


def read(stage):
    return lightshaft.usd.read(path_of(stage))


def keys(text, name):
    """The times and matrices of the animation of the object whose id is `name`."""
    element = re.search(rf'<shape [^>]*id="{re.escape(name)}"[^>]*>(.*?)</shape>', text, re.DOTALL)[1]
    found = re.findall(r'<transform time="([^"]*)"><matrix value="([^"]*)"', element)
    return {float(time): np.array(list(map(float, m.split()))).reshape(4, 4) for time, m in found}


@pytest.mark.parametrize("build", [shapes, instances, lamps])
def test_a_closed_shutter_gives_the_scene_of_what_stands(tmp_path, build):
    """Byte for byte: the scene of the same stage without motion."""
    texts = []
    for moves in (True, False):
        folder = tmp_path / str(moves)
        folder.mkdir()
        made = new_stage(folder)
        made.SetStartTimeCode(0)
        made.SetEndTimeCode(LONG)
        sky(made)
        eye = camera(made, (0, 4, 8), (0, 0.5, 0), 40.0)
        if not moves:
            eye.CreateShutterCloseAttr(float(LONG))  # open, and nothing moves
        build(made)
        if not moves:
            for prim in made.TraverseAll():
                for attribute in prim.GetAuthoredAttributes():
                    if attribute.GetNumTimeSamples():
                        value = attribute.Get(0)
                        attribute.Clear()
                        attribute.Set(value)
        texts.append(read(made).main.xml)
    assert texts[0] == texts[1]
    assert "animation" not in texts[0] and "shutter" not in texts[0]


def test_as_many_transforms_as_the_motion_needs(stage):
    """Two for a straight way and for a turn at a constant rate; the sample between two for a way with a corner; more
    for a turn on a turn."""
    op(cube(stage, "/straight"), "Translate", (0, 0, 0), (1, 2, 3))
    op(cube(stage, "/turns"), "RotateY", 0.0, 170.0)
    corner = op(cube(stage, "/corner"), "Translate", (0, 0, 0), (1, 0, 0))
    corner.Set((1, 1, 0), LONG / 3)
    arm = UsdGeom.Xform.Define(stage, "/arm")
    op(arm, "RotateY", 0.0, 60.0)
    held = cube(stage, "/arm/swings")
    UsdGeom.Xformable(held).AddTranslateOp().Set((2, 0, 0))
    op(cube(stage, "/whirls"), "RotateY", 0.0, 720.0)
    found = read(stage)
    text = found.main.xml
    assert list(keys(text, "/straight")) == list(keys(text, "/turns")) == [0, LONG]
    assert list(keys(text, "/corner")) == [0, pytest.approx(LONG / 3), LONG]
    assert len(keys(text, "/arm/swings")) >= 9  # an arc
    assert len(keys(text, "/whirls")) >= 5
    assert f'<float name="shutter_close" value="{float(LONG)}"/>' in text
    assert found.warnings == ()


def test_between_matrices_it_turns(stage):
    """USD's mean of the numbers of two matrices would shrink what turns, and make a ball an ellipsoid."""
    stage.GetPrimAtPath("/camera").GetAttribute("shutter:open").Set(LONG / 4)
    made = UsdGeom.Sphere.Define(stage, "/ball")
    place = UsdGeom.Xformable(made).AddTransformOp()
    place.Set(moved(1, 0, 0), 0)
    place.Set(turned((1, 2, 3), 80) * moved(2, 0, 0), LONG)
    text = read(stage).main.xml
    assert '<shape type="sphere" id="/ball">' in text
    found = keys(text, "/ball")
    assert list(found) == [LONG / 4, LONG]
    expected = np.array(turned((1, 2, 3), 20) * moved(1.25, 0, 0)).T
    assert np.abs(found[LONG / 4] - expected).max() < 1e-12


def test_points_move_by_their_velocities(stage):
    points = UsdGeom.PointInstancer.Define(stage, "/points")
    cube(stage, "/points/cube", 0.5)
    points.CreatePrototypesRel().AddTarget("/points/cube")
    points.CreateProtoIndicesAttr([0, 0])
    points.CreatePositionsAttr().Set([(0, 1, 0), (2, 1, 0)], 0)
    points.CreateVelocitiesAttr().Set([(0, 48, 0), (0, 0, 0)], 0)
    stage.SetTimeCodesPerSecond(24.0)
    found = read(stage)
    assert found.warnings == ()
    text = found.main.xml
    assert text.count("<animation") == 1
    way = keys(text, "/points/cube instance")
    assert [m[1, 3] for m in way.values()] == pytest.approx([1, 1 + 48 / 24 * LONG])


def test_a_jointed_mesh_and_points_that_change_are_told(stage):
    root = UsdSkel.Root.Define(stage, "/rig")
    made = floor(stage, path="/rig/cloth")
    joints = UsdSkel.Skeleton.Define(stage, "/rig/bones")
    joints.CreateJointsAttr(["a"])
    joints.CreateBindTransformsAttr([Gf.Matrix4d(1)])
    joints.CreateRestTransformsAttr([Gf.Matrix4d(1)])
    animation = UsdSkel.Animation.Define(stage, "/rig/pose")
    animation.CreateJointsAttr(["a"])
    animation.CreateTranslationsAttr().Set([(0, 0, 0)], 0)
    animation.GetTranslationsAttr().Set([(0, 5, 0)], LONG)
    animation.CreateRotationsAttr([Gf.Quatf(1)])
    animation.CreateScalesAttr([Gf.Vec3h(1)])
    UsdSkel.BindingAPI.Apply(root.GetPrim()).CreateSkeletonRel().SetTargets(["/rig/bones"])
    UsdSkel.BindingAPI.Apply(joints.GetPrim()).CreateAnimationSourceRel().SetTargets(["/rig/pose"])
    skin = UsdSkel.BindingAPI.Apply(made.GetPrim())
    skin.CreateJointIndicesPrimvar(False, 1).Set([0] * 4)
    skin.CreateJointWeightsPrimvar(False, 1).Set([1.0] * 4)
    cloth = floor(stage, path="/flag").GetPointsAttr()
    points = cloth.Get()
    cloth.Set(points, 0)
    cloth.Set([p + Gf.Vec3f(0, 1, 0) for p in points], LONG)
    grows = ball(stage, "/ball").GetRadiusAttr()
    grows.Set(0.5, 0)
    grows.Set(0.8, LONG)
    stage.GetPrimAtPath("/camera").GetAttribute("shutter:close").Set(0.5)
    told = read(stage).warnings
    for name, changes in (("/flag", "points"), ("/rig/pose", "translations"), ("/ball", "radius")):
        text = f"{name}: warning: {changes} changes while the shutter is open: its value at the frame is taken"
        assert text in told, told


def test_what_cannot_move_stands_and_is_told(stage):
    rail = UsdGeom.Xform.Define(stage, "/rail")
    op(rail, "Scale", (1, 1, 1), (3, 1, 1))
    UsdGeom.Xformable(cube(stage, "/rail/sheared")).AddRotateYOp().Set(30.0)
    op(cube(stage, "/mirrored"), "Scale", (1, 1, 1), (-1, 1, 1))
    op(UsdLux.SphereLight.Define(stage, "/stretched"), "Scale", (1, 1, 1), (1, 2, 1))
    sun = UsdLux.DistantLight.Define(stage, "/sun")
    op(sun, "RotateX", 0.0, 50.0)
    point = UsdLux.SphereLight.Define(stage, "/point")
    point.CreateTreatAsPointAttr(True)
    point.CreateNormalizeAttr(True)
    op(point, "Translate", (0, 1, 0), (0, 2, 0))
    found = read(stage)
    for name, why in (
        ("/rail/sheared", "its transform shears"),
        ("/mirrored", "mirrors unlike that of the frame"),
        ("/stretched", "its transform stretches it, and it gives off light"),
        ("/sun (and 1 more)", "a light without a shape is rendered where it is at the frame"),
    ):
        assert any(w.startswith(f"{name}: warning: its motion is not blurred") and why in w for w in found.warnings), (
            name,
            found.warnings,
        )
    assert "<animation" not in found.main.xml and "shutter" not in found.main.xml


def test_a_ball_that_is_stretched_on_its_way_is_a_mesh(stage):
    op(ball(stage, "/ball"), "Scale", (1, 1, 1), (1, 2, 1))
    text = read(stage).main.xml
    assert '<shape type="ply" id="/ball">' in text and len(keys(text, "/ball")) == 2


def test_what_stands_elsewhere_while_the_shutter_is_open_is_rendered_there(stage):
    """At the frame it is at 0; from 1 on, with the shutter open from 1, it is at 5."""
    place = UsdGeom.Xformable(cube(stage, "/cube", 2.0)).AddTranslateOp()
    place.Set((0, 0, 0), 0)
    place.Set((5, 0, 0), 1)
    stage.GetPrimAtPath("/camera").GetAttribute("shutter:open").Set(1.0)
    text = read(stage).main.xml
    assert "<animation" not in text and '<matrix value="1.0 0.0 0.0 5.0 ' in text


@pytest.mark.parametrize("closes", [float("inf"), 2e9])
def test_times_that_no_scene_has_are_refused(stage, closes):
    op(cube(stage, "/cube"), "Translate", (0, 0, 0), (1, 0, 0))
    stage.GetPrimAtPath("/camera").GetAttribute("shutter:close").Set(closes)
    with pytest.raises(lightshaft.StageRejected, match="at most 1e.09 in size"):
        read(stage)
