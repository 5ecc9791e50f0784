"""Instances: kept once, and seen as copies are."""

import numpy as np
import pytest
from stage_kit import (
    Gf,
    Sdf,
    UsdGeom,
    bind,
    camera,
    image,
    moved,
    new_stage,
    path_of,
    place,
    preview,
    scaled,
    sky,
    turned,
)

import lightshaft
import lightshaft.usd


def ball(stage, path, value=None):
    made = UsdGeom.Sphere.Define(stage, path)
    made.CreateRadiusAttr(0.4)
    if value:
        made.CreateDisplayColorAttr([Gf.Vec3f(*value)])
    return made


def differ(one, two):
    """The largest difference of two pictures in blocks of 8 x 8 pixels. Where a group stands for shapes other
    samples are taken, so that noise is left."""
    blocks = (one - two).reshape(len(one) // 8, 8, -1, 8, 3).mean(axis=(1, 3))
    return np.abs(blocks).max()


def test_native_instances_are_kept_once_and_look_as_copies(farm, tmp_path):
    pictures, texts = [], []
    for instanceable in (True, False):
        folder = tmp_path / str(instanceable)
        folder.mkdir()
        stage = new_stage(folder)
        sky(stage)
        camera(stage, (0, 0, 10), (0, 0, 0), 35.0)
        UsdGeom.Xform.Define(stage, "/_proto")
        stage.GetPrimAtPath("/_proto").SetSpecifier(Sdf.SpecifierClass)
        ball(stage, "/_proto/a")
        place(ball(stage, "/_proto/b", (0.1, 0.3, 0.8)), moved(0.5, 0, 0))
        red = preview(stage, "/red", diffuseColor=(0.8, 0.1, 0.1), roughness=1.0)
        for i in range(6):
            made = UsdGeom.Xform.Define(stage, f"/i{i}")
            place(
                made, scaled(1, 1.5, 1) * turned((0, 0, 1), 30 * i) * moved(i % 3 * 2 - 2, i // 3 * 2 - 1, 0)
            )
            made.GetPrim().GetReferences().AddInternalReference("/_proto")
            made.GetPrim().SetInstanceable(instanceable)
            if i == 4:  # inherited from the instance, which is another look of the same prototype
                bind(made, red)
        pictures.append(image(farm, stage, 64, (32, 32)))
        texts.append(lightshaft.usd.read(path_of(stage)).main.xml)

    assert texts[0].count('type="shapegroup"') == 1 and texts[0].count('type="instance"') == 5
    assert 'type="shapegroup"' not in texts[1]
    # A diffuse ball under a white sky: of the choice of directions the noise of a block of 64 x 64 samples
    # is below 0.5 / 64; five times that.
    assert differ(*pictures) < 0.04


def test_point_instancers(farm, tmp_path):
    pictures = []
    for instanced in (True, False):
        folder = tmp_path / str(instanced)
        folder.mkdir()
        stage = new_stage(folder)
        sky(stage)
        camera(stage, (0, 0, 10), (0, 0, 0), 35.0)
        positions = [(-2, -1, 0), (0, -1, 0), (2, -1, 0), (-2, 1, 0), (0, 1, 0), (2, 1, 0)]
        sizes = [(1, 1, 1), (1.5, 1, 1), (1, 2, 1), (1, 1, 1), (2, 2, 2), (1, 1, 1)]
        angles = [0, 20, 40, 60, 80, 100]
        kinds = [0, 1, 0, 1, 0, 1]
        outer = scaled(0.9, 0.9, 0.9) * moved(0.2, 0, 0)
        own = turned((0, 0, 1), 45)
        if instanced:
            made = UsdGeom.PointInstancer.Define(stage, "/points")
            place(made, outer)
            UsdGeom.Cube.Define(stage, "/points/prototypes/cube").CreateSizeAttr(0.6)
            place(UsdGeom.Cube(stage.GetPrimAtPath("/points/prototypes/cube")), own)
            ball(stage, "/points/prototypes/ball", (0.2, 0.6, 0.2))
            made.CreatePrototypesRel().SetTargets(["/points/prototypes/cube", "/points/prototypes/ball"])
            made.CreateProtoIndicesAttr(kinds)
            made.CreatePositionsAttr([Gf.Vec3f(*p) for p in positions])
            made.CreateScalesAttr([Gf.Vec3f(*s) for s in sizes])
            made.CreateOrientationsAttr(
                [Gf.Quath(Gf.Rotation(Gf.Vec3d(0, 0, 1), a).GetQuat()) for a in angles]
            )
            made.CreateInvisibleIdsAttr([3])
        else:
            for i, (p, s, a, k) in enumerate(zip(positions, sizes, angles, kinds)):
                if i == 3:
                    continue
                item = ball(stage, f"/i{i}", (0.2, 0.6, 0.2)) if k else UsdGeom.Cube.Define(stage, f"/i{i}")
                if not k:
                    item.CreateSizeAttr(0.6)
                inner = own if not k else Gf.Matrix4d(1)
                place(item, inner * scaled(*s) * turned((0, 0, 1), a) * moved(*p) * outer)
        pictures.append(image(farm, stage, 64, (32, 32)))

    assert (
        differ(*pictures) < 0.04
    )  # as above; half floats of the orientations move edges by a thousandth of a ball


def test_instances_in_instances_and_a_light_in_a_prototype(farm, tmp_path):
    pictures = []
    for instanceable in (True, False):
        folder = tmp_path / str(instanceable)
        folder.mkdir()
        stage = new_stage(folder)
        camera(stage, (0, 0, 12), (0, 0, 0), 35.0)
        for path in ("/_leaf", "/_branch"):
            UsdGeom.Xform.Define(stage, path)
            stage.GetPrimAtPath(path).SetSpecifier(Sdf.SpecifierClass)
        ball(stage, "/_leaf/ball", (0.8, 0.6, 0.2))
        lamp = preview(stage, "/_leaf/glow", emissiveColor=(2.0, 1.0, 0.5))
        place(ball(stage, "/_leaf/lamp"), scaled(0.5, 0.5, 0.5) * moved(0, 0.7, 0.3))
        bind(stage.GetPrimAtPath("/_leaf/lamp"), lamp)
        for i in range(2):
            leaf = UsdGeom.Xform.Define(stage, f"/_branch/leaf{i}")
            place(leaf, turned((0, 0, 1), 70 * i) * moved(i * 1.2, 0, 0))
            leaf.GetPrim().GetReferences().AddInternalReference("/_leaf")
            leaf.GetPrim().SetInstanceable(instanceable)
        for i in range(3):
            branch = UsdGeom.Xform.Define(stage, f"/branch{i}")
            place(branch, moved(-1, i * 2 - 2, 0))
            branch.GetPrim().GetReferences().AddInternalReference("/_branch")
            branch.GetPrim().SetInstanceable(instanceable)
        pictures.append(image(farm, stage, 256, (32, 32)))

    assert pictures[0].max() > 1
    # The noise of a block of 8 x 8 pixels with lamps at its edges (values to 2) of 256 samples each: 2 / 2
    # / 128 at most.
    assert differ(*pictures) < 0.04


def test_an_instancer_within_itself_ends(tmp_path):
    stage = new_stage(tmp_path)
    camera(stage, (0, 0, 5), (0, 0, 0))
    points = UsdGeom.PointInstancer.Define(stage, "/world/points")
    points.CreatePrototypesRel().SetTargets(["/world"])
    points.CreateProtoIndicesAttr([0])
    points.CreatePositionsAttr([Gf.Vec3f(0)])
    with pytest.raises(lightshaft.StageRejected, match="within themselves"):
        lightshaft.usd.read(path_of(stage))


def test_more_instances_than_a_scene_can_have_end_soon(tmp_path):
    stage = new_stage(tmp_path)
    camera(stage, (0, 0, 5), (0, 0, 0))
    ball(stage, "/level0")
    for i in range(1, 12):  # 10^11 balls
        points = UsdGeom.PointInstancer.Define(stage, f"/level{i}")
        points.CreatePrototypesRel().SetTargets([f"/level{i - 1}"])
        points.CreateProtoIndicesAttr([0] * 10)
        points.CreatePositionsAttr([Gf.Vec3f(k, 0, 0) for k in range(10)])
    with pytest.raises(lightshaft.StageRejected, match="more than 120000"):
        lightshaft.usd.read(path_of(stage))
