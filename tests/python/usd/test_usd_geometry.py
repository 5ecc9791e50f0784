"""Meshes, basic shapes, transforms and instances: what is read, and what is seen."""

import math

import numpy as np
import pytest
from stage_kit import (
    Gf,
    Usd,
    UsdGeom,
    UsdLux,
    UsdSkel,
    UsdShade,
    agree,
    bind,
    camera,
    colours,
    image,
    mesh,
    moved,
    new_stage,
    path_of,
    png,
    place,
    preview,
    scaled,
    seen,
    sky,
    texture,
    turned,
)

import lightshaft
import lightshaft.usd
from lightshaft.usd.meshes import Polygons


def polygons(points, faces):
    return Polygons(
        np.array(points, float), np.array([len(f) for f in faces]), np.array([i for f in faces for i in f])
    )


def area(points, corners):
    a, b, c = (points[corners[:, k]] for k in range(3))
    return np.cross(b - a, c - a).sum(axis=0) / 2


def test_polygons_are_cut_into_triangles_that_cover_them():
    arrow = [(0, 0, 0), (2, 2, 0), (0, 1, 0), (-2, 2, 0)]  # the third corner is inward
    comb = [(0, 0, 5), (5, 0, 5), (5, 3, 5), (4, 3, 5), (4, 1, 5), (3, 1, 5), (3, 3, 5), (0, 3, 5)]
    ring = [(math.cos(a), 0, math.sin(a)) for a in np.linspace(0, 6, 7)]
    points = [*arrow, *comb, *ring]
    faces = [tuple(range(4)), tuple(range(4, 12)), tuple(range(12, 19)), (0, 1, 2)]

    corners, face = polygons(points, faces).triangles()

    assert np.bincount(face).tolist() == [2, 6, 5, 1]
    array = np.array(points)
    indices = np.array([i for f in faces for i in f])
    for f, own in enumerate(faces):
        cut = indices[corners[face == f]]
        whole = (
            sum(
                (np.cross(array[own[k]], array[own[(k + 1) % len(own)]]) for k in range(len(own))),
                np.zeros(3),
            )
            / 2
        )
        total = area(array, cut)
        assert np.allclose(total, whole), f
        single = [np.linalg.norm(area(array, cut[i : i + 1])) for i in range(len(cut))]
        assert sum(single) == pytest.approx(np.linalg.norm(whole)), f"triangles of face {f} overlap"


def test_a_mesh_whose_faces_have_different_numbers_of_corners_is_seen_whole(farm, tmp_path):
    stage = new_stage(tmp_path)
    sky(stage)
    points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (0, 0.2, 0), (-1, 1, 0), (0, 3, 0)]
    made = mesh(stage, "/m", points, [(0, 1, 2, 3, 4), (4, 3, 2), (4, 2, 5)])
    colours(made, [(0.6, 0.4, 0.2)], "constant")
    camera(stage, (0, 0.4, 10), (0, 0.4, 0), 4.0)
    # Diffuse under a white sky: its own albedo everywhere, without noise but that of the choice of
    # directions.
    agree(seen(farm, stage, 4), (0.6, 0.4, 0.2))


def quad(stage, path="/m", **attributes):
    points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    return mesh(stage, path, points, [(0, 1, 2, 3)], **attributes)


@pytest.mark.parametrize(
    "kind, corner", [("constant", 0.5), ("uniform", 0.5), ("vertex", 0.0), ("faceVarying", 0.0)]
)
def test_colours_by_interpolation(farm, tmp_path, kind, corner):
    stage = new_stage(tmp_path)
    sky(stage)
    values = [(0.5,) * 3] if kind in ("constant", "uniform") else [(0, 0, 0), (1, 1, 1), (1, 1, 1), (0, 0, 0)]
    colours(quad(stage), values, kind)
    camera(stage, (0, 0, 10), (0, 0, 0), math.degrees(2 * math.atan(0.1)))

    shown = image(farm, stage, 16, (16, 16))

    # From left to right: a half everywhere, or from 0 to 1 by pixel centres.
    expected = np.full(16, 0.5) if corner else (np.arange(16) + 0.5) / 16
    assert shown[4:12, 2:14].mean(axis=(0, 2)) == pytest.approx(
        expected[2:14], abs=0.02
    )  # 1/16 of a pixel's ramp, and noise


def test_a_subset_has_its_own_material_and_a_hole_is_none(farm, tmp_path):
    stage = new_stage(tmp_path)
    sky(stage)
    points = [(x, y, 0) for y in (-1, 1) for x in (-2, -1, 0, 1, 2)]
    made = mesh(stage, "/m", points, [(i, i + 1, i + 6, i + 5) for i in range(4)], holeIndices=[3])
    bind(made, preview(stage, "/red", diffuseColor=(0.8, 0.0, 0.0), roughness=1.0, useSpecularWorkflow=1))
    green = preview(stage, "/green", diffuseColor=(0.0, 0.8, 0.0), roughness=1.0, useSpecularWorkflow=1)
    subset = UsdGeom.Subset.CreateGeomSubset(
        UsdGeom.Imageable(made), "part", UsdGeom.Tokens.face, [1, 2], UsdShade.Tokens.materialBind
    )
    bind(subset, green)
    camera(stage, (0, 0, 10), (0, 0, 0), math.degrees(2 * math.atan(0.2)))

    row = image(farm, stage, 16, (16, 16))[6:10].mean(axis=0)

    for pixels, expected in (
        (slice(1, 3), (0.8, 0, 0)),
        (slice(5, 11), (0, 0.8, 0)),
        (slice(13, 15), (1, 1, 1)),
    ):
        assert row[pixels].mean(axis=0) == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("handed", ["rightHanded", "leftHanded"])
def test_the_outside_of_a_mesh_is_by_its_orientation(tmp_path, handed):
    stage = new_stage(tmp_path)
    camera(stage, (0, 0, 5), (0, 0, 0))
    quad(stage, orientation=handed)
    scene = lightshaft.usd.read(path_of(stage))
    ((vertices, faces),) = [ply(source) for name, source in scene.files.items() if name.endswith(".ply")]
    a, b, c = (vertices[faces[:, k], :3] for k in range(3))
    facing = np.cross(b - a, c - a)[:, 2]
    assert np.all(facing > 0) if handed == "rightHanded" else np.all(facing < 0)


def ply(source):
    """(rows of vertices, faces) of one that the package writes."""
    head, body = source.read(0, source.size).split(b"end_header\n", 1)
    lines = head.decode().splitlines()
    count, faces = (int(line.split()[2]) for line in lines if line.startswith("element"))
    width = sum(line.startswith("property float") for line in lines)
    rows = np.frombuffer(body, "<f4", count * width).reshape(count, width)
    kind = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
    return rows, np.frombuffer(body, kind, faces, offset=4 * count * width)["corners"]


def test_normals_are_smooth_flat_or_given(farm, tmp_path):
    """A wedge under light from the left: its ridge is sharp where faces are flat, and smooth with normals."""
    stage = new_stage(tmp_path)
    camera(stage, (0, 0, 5), (0, 0, 0))
    points = [(-1, -1, 0), (0, -1, 1), (1, -1, 0), (-1, 1, 0), (0, 1, 1), (1, 1, 0)]
    faces = [(0, 1, 4, 3), (1, 2, 5, 4)]
    mesh(stage, "/flat", points, faces)
    mesh(stage, "/subdivided", points, faces, subdivisionScheme="catmullClark")
    given = mesh(stage, "/given", points, faces)
    given.CreateNormalsAttr([Gf.Vec3f(0, 0, 1)] * 2)
    given.SetNormalsInterpolation("uniform")

    scene = lightshaft.usd.read(path_of(stage))

    tables = [ply(source)[0] for name, source in scene.files.items() if name.endswith(".ply")]
    flat, smooth, uniform = tables
    assert flat.shape == (6, 3) and scene.main.xml.count('name="face_normals"') == 1
    # The ridge: the sum of both faces' normals is +z. The edge: the one face's own, (-1, 0, 1).
    ridge = smooth[smooth[:, 0] == 0][:, 3:6]
    edge = smooth[smooth[:, 0] == -1][:, 3:6]
    assert np.allclose(ridge / np.linalg.norm(ridge, axis=1, keepdims=True), (0, 0, 1))
    assert np.allclose(
        edge / np.linalg.norm(edge, axis=1, keepdims=True), (-math.sqrt(0.5), 0, math.sqrt(0.5))
    )
    assert np.allclose(uniform[:, 3:6], (0, 0, 1))
    assert any("/subdivided" in w and "base mesh" in w for w in scene.warnings)


SHAPES = {
    "sphere": ("Sphere", {"radius": 0.8}, moved(0.1, 0.2, 0)),
    "ellipsoid": ("Sphere", {"radius": 0.8}, scaled(1, 0.5, 1)),
    "cube": ("Cube", {"size": 1.2}, turned((1, 1, 0), 30)),
    "cylinder": ("Cylinder", {"radius": 0.5, "height": 1.2, "axis": "X"}, turned((0, 1, 1), 20)),
    "cone": ("Cone", {"radius": 0.6, "height": 1.4, "axis": "Y"}, turned((0, 0, 1), 20)),
    "capsule": ("Capsule", {"radius": 0.3, "height": 0.8, "axis": "X"}, moved(0, 0.2, 0)),
    "plane": ("Plane", {"width": 1.6, "length": 0.8, "axis": "Z"}, moved(0, 0.2, 0)),
}


def shadow(name, points):
    """Whether rays along -z through (x, y) meet the shape: by its equation in its own space."""
    kind, values, matrix = SHAPES[name]
    inverse = np.array(matrix.GetInverse())
    depth = np.linspace(-3, 3, 1201)
    x, y = (np.repeat(points[:, k : k + 1], len(depth), 1) for k in range(2))
    place = np.stack([x, y, np.broadcast_to(depth, x.shape), np.ones_like(x)], axis=-1) @ inverse
    a, b, c = (place[..., k] for k in range(3))
    if kind == "Sphere":
        inside = a**2 + b**2 + c**2 < values["radius"] ** 2
    elif kind == "Cube":
        inside = np.maximum(np.maximum(abs(a), abs(b)), abs(c)) < values["size"] / 2
    elif kind == "Cylinder":
        inside = (b**2 + c**2 < values["radius"] ** 2) & (abs(a) < values["height"] / 2)
    elif kind == "Cone":
        radius = values["radius"] * (0.5 - b / values["height"])
        inside = (a**2 + c**2 < radius**2) & (abs(b) < values["height"] / 2)
    elif kind == "Capsule":
        along = np.clip(a, -values["height"] / 2, values["height"] / 2)
        inside = (a - along) ** 2 + b**2 + c**2 < values["radius"] ** 2
    else:
        inside = (abs(a) < values["width"] / 2) & (abs(b) < values["length"] / 2)
    return inside.any(axis=1)


@pytest.mark.parametrize("name", SHAPES)
def test_basic_shapes(farm, tmp_path, name):
    """Black before a white sky, seen by parallel rays: each pixel's share of the sky, by the shape's
    equation."""
    kind, values, matrix = SHAPES[name]
    stage = new_stage(tmp_path)
    sky(stage)
    made = getattr(UsdGeom, kind).Define(stage, "/shape")
    for key, value in values.items():
        made.GetPrim().GetAttribute(key).Set(value)
    place(made, matrix)
    made.CreateDisplayColorAttr([Gf.Vec3f(0)])
    lens = camera(stage, (0, 0, 5), (0, 0, 0))
    lens.CreateProjectionAttr("orthographic")  # apertures of 20 tenths: from -1 to 1

    shown = image(farm, stage, 64, (32, 32))[:, :, 0]

    grid = (np.arange(256) + 0.5) / 128 - 1
    x, y = np.meshgrid(grid, -grid)
    covered = np.concatenate(
        [shadow(name, p) for p in np.array_split(np.stack([x.ravel(), y.ravel()], 1), 64)]
    ).reshape(32, 8, 32, 8)
    expected = 1 - covered.mean(axis=(1, 3))
    clear = (covered.mean(axis=(1, 3)) % 1 == 0) & (shown_border(expected))
    # Where neither a pixel nor its neighbours have an edge: all or nothing. In all: the noise of 64 samples
    # at the edges, of which the filter makes one pixel's width; 1 % is five standard errors of 100 such
    # pixels.
    assert np.abs(shown - expected)[clear].max() < 1e-3
    assert shown.mean() == pytest.approx(expected.mean(), abs=0.01)


def shown_border(values):
    """Pixels whose neighbours up to two away have the same value."""
    padded = np.pad(values, 2, mode="edge")
    near = np.stack([padded[i : i + 32, k : k + 32] for i in range(5) for k in range(5)])
    return np.ptp(near, axis=0) == 0


def test_a_perspective_is_no_placement(tmp_path):
    stage = new_stage(tmp_path)
    square = mesh(stage, "/m", [(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)])
    square.AddTransformOp().Set(Gf.Matrix4d(1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1))

    with pytest.raises(lightshaft.StageRejected, match="/m: error: its transform is a perspective"):
        lightshaft.usd.read(path_of(stage))


def test_a_mesh_without_faces_is_told(tmp_path):
    stage = new_stage(tmp_path)
    mesh(stage, "/m", [(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 1, 2)])
    mesh(stage, "/none", [], [])

    assert "/none: warning: it has no faces: nothing of it is seen" in lightshaft.usd.read(path_of(stage)).warnings


def test_transforms_visibility_purpose_and_variants(farm, tmp_path):
    stage = new_stage(tmp_path)
    sky(stage)
    camera(stage, (0, 0, 10), (0, 0, 0), math.degrees(2 * math.atan(0.2)))
    UsdGeom.Xform.Define(stage, "/group").AddTranslateOp().Set(Gf.Vec3d(-1, 0, 0))
    inner = UsdGeom.Xform.Define(stage, "/group/inner")
    inner.AddTranslateOp().Set(Gf.Vec3d(0, -1, 0))
    inner.AddScaleOp().Set(Gf.Vec3f(0.5))
    colours(quad(stage, "/group/inner/shown"), [(0.5, 0, 0)], "constant")
    reset = UsdGeom.Xform.Define(stage, "/group/reset")
    reset.AddTranslateOp().Set(Gf.Vec3d(1, -1, 0))
    reset.AddScaleOp().Set(Gf.Vec3f(0.5))
    reset.SetResetXformStack(True)
    colours(quad(stage, "/group/reset/shown"), [(0, 0.5, 0)], "constant")
    hidden = UsdGeom.Xform.Define(stage, "/hidden")
    hidden.CreateVisibilityAttr("invisible")
    quad(stage, "/hidden/m")
    proxy = UsdGeom.Xform.Define(stage, "/proxy")
    proxy.CreatePurposeAttr("proxy")
    quad(stage, "/proxy/m")
    quad(stage, "/inactive").GetPrim().SetActive(False)
    choice = UsdGeom.Xform.Define(stage, "/choice")
    choice.AddTranslateOp().Set(Gf.Vec3d(1, 1, 0))
    choice.AddScaleOp().Set(Gf.Vec3f(0.5))
    variants = choice.GetPrim().GetVariantSets().AddVariantSet("colour")
    for name, value in (("blue", (0, 0, 0.5)), ("yellow", (0.5, 0.5, 0))):
        variants.AddVariant(name)
        variants.SetVariantSelection(name)
        with variants.GetVariantEditContext():
            colours(quad(stage, "/choice/m"), [value], "constant")
    variants.SetVariantSelection("yellow")

    shown = image(farm, stage, 16, (16, 16))

    middle = {"up left": (4, 4), "up right": (4, 12), "down left": (12, 4), "down right": (12, 12)}
    expected = {
        "up left": (1, 1, 1),
        "up right": (0.5, 0.5, 0),
        "down left": (0.5, 0, 0),
        "down right": (0, 0.5, 0),
    }
    for name, (y, x) in middle.items():
        assert shown[y - 1 : y + 1, x - 1 : x + 1].mean(axis=(0, 1)) == pytest.approx(
            expected[name], abs=0.03
        ), name


@pytest.mark.parametrize("fault, told", [
    ("indices", "faceVertexIndices name points"),
    ("counts", "sum of faceVertexCounts"),
    ("points", "not three finite numbers"),
    ("subset", "indices name faces"),
    ("instances", "protoIndices name prototypes"),
])  # fmt: skip
def test_damaged_geometry_is_told_with_its_prim(tmp_path, fault, told):
    stage = new_stage(tmp_path)
    camera(stage, (0, 0, 5), (0, 0, 0))
    made = quad(stage, "/world/m")
    if fault == "indices":
        made.GetFaceVertexIndicesAttr().Set([0, 1, 2, 9])
    elif fault == "counts":
        made.GetFaceVertexCountsAttr().Set([5])
    elif fault == "points":
        made.GetPointsAttr().Set([Gf.Vec3f(float("nan"))] * 4)
    elif fault == "subset":
        subset = UsdGeom.Subset.CreateGeomSubset(
            UsdGeom.Imageable(made), "part", UsdGeom.Tokens.face, [7], UsdShade.Tokens.materialBind
        )
        assert subset
    else:
        points = UsdGeom.PointInstancer.Define(stage, "/world/points")
        points.CreateProtoIndicesAttr([3])
        points.CreatePositionsAttr([Gf.Vec3f(0)])

    with pytest.raises(lightshaft.StageRejected, match=told) as caught:
        lightshaft.usd.read(path_of(stage))

    assert caught.value.path.startswith("/world/")


def test_what_is_not_read_is_told_with_its_prim(tmp_path):
    stage = new_stage(tmp_path)
    camera(stage, (0, 0, 5), (0, 0, 0))
    quad(stage)
    UsdGeom.BasisCurves.Define(stage, "/world/hair")
    UsdGeom.Points.Define(stage, "/world/dust")
    UsdGeom.Points.Define(stage, "/world/more")
    stage.DefinePrim("/world/lamp", "PortalLight")
    UsdLux.MeshLightAPI.Apply(quad(stage, "/world/shining").GetPrim())
    warnings = lightshaft.usd.read(path_of(stage)).warnings
    assert any(w.startswith("/world/hair: ") and "BasisCurves" in w for w in warnings)
    assert any(w.startswith("/world/dust (and 1 more): ") for w in warnings)
    assert any(w.startswith("/world/lamp: ") and "PortalLight" in w for w in warnings)
    assert any(w.startswith("/world/shining: ") and "light of a mesh" in w for w in warnings)


def test_a_basic_shape_with_a_material_of_primvars_has_its_own_colour(tmp_path):
    stage = new_stage(tmp_path)
    camera(stage, (0, 0, 5), (0, 0, 0))
    file = png(tmp_path / "a.png", np.zeros((2, 2, 3)))
    made = UsdGeom.Sphere.Define(stage, "/world/ball")
    colours(made, [(0.25, 0.5, 0.75)], "constant")
    bind(made, preview(stage, diffuseColor=texture(stage, "/look/t", file)))
    scene = lightshaft.usd.read(path_of(stage))
    assert any(w.startswith("/world/ball: ") and "no primvars" in w for w in scene.warnings)
    assert 'value="0.25 0.5 0.75"' in scene.main.xml


def test_the_time_of_a_stage_without_frames_is_its_start(tmp_path):
    stage = new_stage(tmp_path)
    camera(stage, (0, 0, 5), (0, 0, 0))
    made = quad(stage)
    made.GetPointsAttr().Clear()
    for time, size in ((1, 1.0), (5, 2.0)):
        made.GetPointsAttr().Set(
            [Gf.Vec3f(x * size, y * size, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], time
        )
    stage.SetStartTimeCode(5)
    stage.SetEndTimeCode(9)
    scene = lightshaft.usd.read(path_of(stage))
    (rows,) = [ply(s)[0] for name, s in scene.files.items() if name.endswith(".ply")]
    assert rows[:, :2].max() == 2
    assert Usd.TimeCode(5) == Usd.TimeCode(stage.GetStartTimeCode())


def test_skinned_meshes_stand_as_their_joints_say(tmp_path):
    """One joint, moved by 3 in the second of two frames."""
    stage = new_stage(tmp_path)
    camera(stage, (0, 0, 5), (0, 0, 0))
    root = UsdSkel.Root.Define(stage, "/rig")
    skeleton = UsdSkel.Skeleton.Define(stage, "/rig/skeleton")
    skeleton.CreateJointsAttr(["bone"])
    skeleton.CreateBindTransformsAttr([Gf.Matrix4d(1)])
    skeleton.CreateRestTransformsAttr([Gf.Matrix4d(1)])
    animation = UsdSkel.Animation.Define(stage, "/rig/animation")
    animation.CreateJointsAttr(["bone"])
    animation.CreateRotationsAttr([Gf.Quatf(1)])
    animation.CreateScalesAttr([Gf.Vec3h(1)])
    for time, place_of_bone in ((1, 0), (2, 3)):
        animation.CreateTranslationsAttr().Set([Gf.Vec3f(place_of_bone, 0, 0)], time)
    api = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    api.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    skin = UsdSkel.BindingAPI.Apply(quad(stage, "/rig/m").GetPrim())
    skin.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    skin.CreateJointIndicesPrimvar(False, 1).Set([0, 0, 0, 0])
    skin.CreateJointWeightsPrimvar(False, 1).Set([1.0] * 4)

    scene = lightshaft.usd.read(path_of(stage), frames="1-2")

    assert root and not any("skin" in warning for warning in scene.warnings)
    tables = [ply(source)[0] for name, source in scene.files.items() if name.endswith(".ply")]
    assert sorted(table[:, 0].max() for table in tables) == [1, 4]
