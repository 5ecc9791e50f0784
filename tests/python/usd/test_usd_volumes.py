"""Volumes of OpenVDB files: how thick they are, where they stand, what they give off, and what is refused."""

import math
import sys

import numpy as np
import pytest
from local_farm import ROOT
from stage_kit import (
    Gf,
    NARROW,
    Sdf,
    UsdGeom,
    agree,
    camera,
    moved,
    new_stage,
    path_of,
    place,
    scaled,
    seen,
    sky,
    turned,
)

from pxr import UsdVol

import lightshaft
import lightshaft.usd

CELLS, VOXEL = 32, 1 / 32


@pytest.fixture(scope="module")
def write_vdb():
    sys.path.insert(0, str(ROOT / "scenes/bath"))
    try:
        import vdb
    finally:
        sys.path.remove(str(ROOT / "scenes/bath"))
    return vdb.write_vdb


@pytest.fixture
def stage(tmp_path, write_vdb):
    """A cube of fog from (0, 0, 0) to (1, 1, 1), without scattering."""
    write_vdb(tmp_path / "fog.vdb", np.full((CELLS,) * 3, 0.5, np.float32), "density", (0, 0, 0), VOXEL)
    made = new_stage(tmp_path)
    volume = UsdVol.Volume.Define(made, "/world/cloud")
    volume.CreateExtentAttr([Gf.Vec3f(0), Gf.Vec3f(1)])
    field(made, "density", "fog.vdb")
    setting(made, "albedo", [0.0])
    setting(made, "albedo", [0.0, 0.0, 0.0])
    return made


def field(stage, name, file, grid="density"):
    made = UsdVol.OpenVDBAsset.Define(stage, f"/world/cloud/{name}")
    made.CreateFilePathAttr(file)
    made.CreateFieldNameAttr(grid)
    UsdVol.Volume(stage.GetPrimAtPath("/world/cloud")).CreateFieldRelationship(name, made.GetPath())
    return made


def setting(stage, name, value):
    primvar = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/world/cloud")).CreatePrimvar(
        f"lightshaft:{name}", Sdf.ValueTypeNames.FloatArray
    )
    primvar.Set(value)


def between(measured, low, high):
    mean, error = measured
    assert np.all(mean >= low - 5 * error) and np.all(mean <= high + 5 * error), (mean, low, high)


# The outermost voxels' centres are CELLS - 1 voxels apart, and values end within half a voxel beyond.
SHORT, LONG = (CELLS - 1) / CELLS, 1.0


def test_density_and_transform(farm, stage):
    """Seen along x through a cube stretched to 3 units there: transmittance exp(-0.5 * 2 * 3)."""
    sky(stage)
    setting(stage, "densityScale", [2.0])
    matrix = scaled(1, 1, 3) * turned((0, 1, 0), 90) * moved(5, 0, 0)
    place(UsdVol.Volume(stage.GetPrimAtPath("/world/cloud")), matrix)
    middle = matrix.Transform(Gf.Vec3d(0.5, 0.5, 0.5))
    camera(stage, (20, middle[1], middle[2]), middle, NARROW)
    between(seen(farm, stage, 256), math.exp(-3 * LONG), math.exp(-3 * SHORT))


def test_a_camera_within_a_volume(farm, stage):
    sky(stage)
    camera(stage, (0.5, 0.5, 0.5), (0.5, 0.5, -5), NARROW)
    between(seen(farm, stage, 256), math.exp(-0.25 * LONG), math.exp(-0.25 * SHORT))


def test_a_temperature_makes_it_glow(farm, stage, write_vdb, tmp_path):
    """Of one temperature and optical depth t: B (1 - exp(-t)); of one twice as dense B (1 - exp(-2 t))."""
    write_vdb(tmp_path / "hot.vdb", np.ones((CELLS,) * 3, np.float32), "heat", (0, 0, 0), VOXEL)
    field(stage, "temperature", "hot.vdb", "heat")
    setting(stage, "temperatureScale", [2500.0])
    camera(stage, (0.5, 0.5, 5), (0.5, 0.5, 0), NARROW)
    means = []
    for factor in (1.0, 2.0):
        setting(stage, "densityScale", [factor])
        mean, error = seen(farm, stage, 1024)
        assert mean[0] > mean[1] > mean[2] > 0  # 2500 K is reddish
        means.append(mean[0])
    ratio = (1 - math.exp(-1)) / (1 - math.exp(-0.5))
    assert means[1] / means[0] == pytest.approx(
        ratio, rel=0.05
    )  # 1/32 of each depth by the border, and noise


def test_what_is_wrong_with_a_volume_is_told_with_its_prim(stage):
    camera(stage, (0.5, 0.5, 5), (0.5, 0.5, 0))
    field(stage, "density", "gone.vdb")
    setting(stage, "albedo", [0.5])
    stage.GetPrimAtPath("/world/cloud").RemoveProperty("extent")
    with pytest.raises(lightshaft.StageRejected) as caught:
        lightshaft.usd.read(path_of(stage))
    told = str(caught.value)
    assert "/world/cloud/density: error: the asset @gone.vdb@ is not found" in told


def test_a_volume_needs_an_extent_and_settings_of_their_kind(stage):
    camera(stage, (0.5, 0.5, 5), (0.5, 0.5, 0))
    setting(stage, "albedo", [0.5])
    stage.GetPrimAtPath("/world/cloud").RemoveProperty("extent")
    with pytest.raises(lightshaft.StageRejected, match="/world/cloud: error: it has no extent"):
        lightshaft.usd.read(path_of(stage))


def test_an_unknown_field_is_told(stage):
    camera(stage, (0.5, 0.5, 5), (0.5, 0.5, 0))
    field(stage, "velocity", "fog.vdb")
    warnings = lightshaft.usd.read(path_of(stage)).warnings
    assert any("/world/cloud: warning: the field velocity" in w for w in warnings)


def test_a_white_cube_of_fog_is_white(farm, stage):
    """With an albedo of 1 under a white sky nothing is lost."""
    sky(stage)
    setting(stage, "albedo", [1.0, 1.0, 1.0])
    setting(stage, "anisotropy", [0.5])
    camera(stage, (0.5, 0.5, 5), (0.5, 0.5, 0), NARROW)
    agree(seen(farm, stage, 64), 1.0)
