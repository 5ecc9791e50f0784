"""Cameras and frames: what is seen where."""

import math

import numpy as np
import pytest
from stage_kit import (
    Gf,
    UsdGeom,
    camera,
    colours,
    image,
    mesh,
    moved,
    new_stage,
    path_of,
    place,
    scaled,
    sky,
)

import lightshaft
import lightshaft.usd


@pytest.fixture
def stage(tmp_path):
    """Before a white sky, a black square from (0, 0) to (1, 1) in the plane z = 0."""
    made = new_stage(tmp_path)
    sky(made)
    square = mesh(made, "/m", [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
    colours(square, [(0, 0, 0)], "constant")
    return made


def box(shown):
    """Left, right, top and bottom of what is dark, as shares of the frame."""
    dark = shown[:, :, 0] < 0.5
    x, y = np.flatnonzero(dark.any(axis=0)), np.flatnonzero(dark.any(axis=1))
    height, width = dark.shape
    return x[0] / width, (x[-1] + 1) / width, y[0] / height, (y[-1] + 1) / height


def check(shown, left, right, top, bottom):
    assert box(shown) == pytest.approx((left, right, top, bottom), abs=1.01 / min(shown.shape[:2]))  # a pixel


def test_apertures_focal_length_and_offsets(farm, stage):
    """From 10 away through 20 x 10 tenths at a focal length of 50: 4 by 2 units, moved by 0.4 and 0.2."""
    made = camera(stage, (0, 0, 10), (0, 0, 0))
    made.GetFocalLengthAttr().Set(50.0)
    made.GetVerticalApertureAttr().Set(10.0)
    made.CreateHorizontalApertureOffsetAttr(2.0)
    made.CreateVerticalApertureOffsetAttr(1.0)
    # The window is from -1.6 to 2.4, and from -0.8 to 1.2.
    check(image(farm, stage, 4, (80, 40)), 1.6 / 4, 2.6 / 4, 0.2 / 2, 1.2 / 2)


@pytest.mark.parametrize("size", [(80, 40), (40, 80)])
def test_a_frame_of_another_shape_shows_all_of_the_aperture(farm, stage, size):
    made = camera(stage, (0, 0, 10), (0, 0, 0))
    made.GetFocalLengthAttr().Set(50.0)  # 4 by 4 units
    wide, high = (8, 4) if size[0] > size[1] else (4, 8)
    check(image(farm, stage, 4, size), 0.5, 0.5 + 1 / wide, 0.5 - 1 / high, 0.5)


def test_an_orthographic_camera(farm, stage):
    made = camera(stage, (0, 0, 10), (0, 0, 0))
    made.CreateProjectionAttr("orthographic")
    made.GetHorizontalApertureAttr().Set(40.0)
    made.GetVerticalApertureAttr().Set(40.0)
    made.CreateHorizontalApertureOffsetAttr(5.0)
    # 4 units, moved by a half to the right: from -1.5 to 2.5.
    check(image(farm, stage, 4, (40, 40)), 1.5 / 4, 2.5 / 4, 0.25, 0.5)


def test_a_camera_in_a_scaled_hierarchy_is_where_it_stands(farm, stage):
    outer = UsdGeom.Xform.Define(stage, "/rig")
    place(outer, scaled(2, 2, 2) * moved(0, 0, 4))
    made = camera(stage, (0, 0, 3), (0, 0, 0), path="/rig/camera")
    made.GetFocalLengthAttr().Set(50.0)
    check(image(farm, stage, 4, (40, 40)), 0.5, 0.75, 0.25, 0.5)  # from (0, 0, 10): 4 by 4 units


def test_what_is_out_of_focus_is_blurred_by_the_lens(farm, stage):
    """The square at 10, focused at 5: a circle of confusion with the radius of the lens, 50 / 10 / (2 *
    2.5) = 1 unit."""
    made = camera(stage, (0, 0, 10), (0, 0, 0))
    made.GetFocalLengthAttr().Set(50.0)
    made.CreateFStopAttr(2.5)
    made.CreateFocusDistanceAttr(5.0)

    shown = image(farm, stage, 1024, (41, 41))[:, :, 0]

    # At the pixel that looks at the square's corner, a point at infinity, covered where the lens sees it:
    # the lens of radius 1 is seen on the square's plane as a disk of radius 1, of which a quarter of the
    # plane holds the part within the unit square: all of the quarter disk.
    assert shown[20, 20] == pytest.approx(0.75, abs=5 * math.sqrt(0.75 * 0.25 / 1024))


def test_several_cameras_are_chosen_by_path(farm, stage):
    camera(stage, (0, 0, 10), (0, 0, 0), 20.0, path="/one")
    camera(stage, (0, 0, 20), (0, 0, 0), 20.0, path="/two")
    with pytest.raises(lightshaft.StageRejected, match="/one, /two"):
        lightshaft.usd.read(path_of(stage))
    with pytest.raises(lightshaft.StageRejected, match="no camera /three; the stage has /one, /two"):
        lightshaft.usd.read(path_of(stage), camera="/three")
    near, far = (image(farm, stage, 4, (40, 40), camera=path) for path in ("/one", "/two"))
    assert (near < 0.5).sum() > 3 * (far < 0.5).sum()


def test_render_settings_give_camera_and_size(stage):
    camera(stage, (0, 0, 10), (0, 0, 0), path="/one")
    camera(stage, (0, 0, 20), (0, 0, 0), path="/two")
    settings = stage.DefinePrim("/Render/settings", "RenderSettings")
    settings.CreateRelationship("camera").SetTargets(["/two"])
    settings.GetAttribute("resolution").Set(Gf.Vec2i(300, 200))
    stage.SetMetadata("renderSettingsPrimPath", "/Render/settings")
    text = lightshaft.usd.read(path_of(stage)).main.xml
    assert 'id="/two"' in text and 'id="/one"' not in text
    assert 'name="width" value="300"' in text and 'name="height" value="200"' in text


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_a_stage_without_camera_and_light_is_seen_from_its_front(farm, tmp_path, up):
    stage = new_stage(tmp_path, up)
    points = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)]
    if up == "Z":
        points = [(x, -z, y) for x, y, z in points]
    colours(mesh(stage, "/m", points, [(0, 1, 2, 3)]), [(0, 0, 0)], "constant")

    with pytest.warns(lightshaft.SceneWarning) as told:
        shown = image(farm, stage, 4, (40, 40))

    check(shown, 0, 1, 0.25, 0.75)  # 2 by 1, as wide as the frame
    texts = [str(w.message) for w in told]
    assert any("no camera" in t for t in texts) and any("no light" in t for t in texts)


@pytest.mark.parametrize("extent", [[(1, 1, 1), (0, 0, 0)], [(1, 1, 0), (1, 1, 0)]])
def test_a_wrong_extent_hides_nothing(farm, tmp_path, extent):
    stage = new_stage(tmp_path)
    square = mesh(stage, "/m", [(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
    colours(square, [(0, 0, 0)], "constant")
    square.CreateExtentAttr(extent)

    with pytest.warns(lightshaft.SceneWarning, match="no camera"):
        shown = image(farm, stage, 4, (40, 40))

    check(shown, 0, 1, 0.25, 0.75)


def test_a_camera_that_is_none_is_told(stage):
    made = camera(stage, (0, 0, 10), (0, 0, 0), path="/world/eye")
    made.GetFocalLengthAttr().Set(0.0)
    with pytest.raises(lightshaft.StageRejected, match="/world/eye"):
        lightshaft.usd.read(path_of(stage))


@pytest.mark.parametrize(
    "clipping, seen", [((1, 20), True), ((9.5, 10.5), True), ((10.5, 20), False), ((1, 9.5), False)]
)
def test_a_clipping_range_clips(farm, stage, clipping, seen):
    made = camera(stage, (0.5, 0.5, 10), (0.5, 0.5, 0), 4.0)
    made.CreateClippingRangeAttr(Gf.Vec2f(*clipping))
    assert (image(farm, stage, 4, (8, 8)).mean() < 0.5) == seen


def test_a_camera_that_moves_while_its_shutter_is_open_blurs(farm, stage):
    """It moves by 1 along x from frame 0 to frame 1, below a prim that moves by 1 more in that time."""
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(1)
    rail = UsdGeom.Xformable(UsdGeom.Xform.Define(stage, "/rail")).AddTranslateOp()
    made = camera(stage, (0, 0, 10), (0, 0, 0), path="/rail/camera")
    begin = UsdGeom.Xformable(made).GetOrderedXformOps()[0]
    matrix = begin.Get()
    for time in (0, 1):
        rail.Set((time, 0, 0), time)
        begin.Set(matrix * moved(time, 0, 0), time)
    sharp = 1 - image(farm, stage, 4, (80, 40))[17, :, 0]
    made.GetShutterCloseAttr().Set(1.0)

    assert lightshaft.usd.read(path_of(stage)).warnings == ()
    blurred = 1 - image(farm, stage, 64, (80, 40))[17, :, 0]

    # The square, 1 wide, passes a pixel for half of the time at most, and 3 of the frame's width, which is twice its height.
    width = 2 * 20 * math.tan(math.radians(20))
    assert sharp.max() > 0.99 and (sharp > 0.02).mean() == pytest.approx(1 / width, abs=2 / 80)
    # 64 samples that are dark or not: five standard errors of a share of a half
    assert blurred.max() == pytest.approx(0.5, abs=5 * 0.5 / 8)
    assert (blurred > 0.02).mean() == pytest.approx(3 / width, abs=2 / 80)
    assert blurred.sum() == pytest.approx(sharp.sum(), rel=0.1)
