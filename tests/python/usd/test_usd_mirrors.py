"""A stage under a mirror: prims, instances, lamps, cameras, texture coordinates."""

import math

import numpy as np
import pytest
from stage_kit import (
    Gf,
    Sdf,
    UsdGeom,
    UsdLux,
    bind,
    camera,
    coordinates,
    exr,
    image,
    mesh,
    moved,
    new_stage,
    place,
    preview,
    scaled,
    texture,
    turned,
)

X, Z, ALL = (-1, 1, 1), (1, 1, -1), (-1, -1, -1)
SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
ST = [(0, 0), (1, 0), (1, 1), (0, 1)]
LEANING = (0.9, 0.6, 0.85)  # a normal that leans to the right and up


def times(points, mirror):
    return np.multiply(np.array(points, float), mirror).tolist()


def tetrahedron(stage, path, mirror, with_normals):
    """A closed body that is no mirror image of itself; its points and normals mirrored by `mirror`."""
    points = [(1, 1, 1), (-1, -1, 0.6), (-1, 1, -1), (1, -1, -1)]
    faces = [(0, 1, 3), (0, 2, 1), (0, 3, 2), (1, 2, 3)]
    if math.prod(mirror) < 0:
        faces = [face[::-1] for face in faces]
    made = mesh(stage, path, times(points, mirror), faces)
    if with_normals:
        made.CreateNormalsAttr([Gf.Vec3f(*n).GetNormalized() for n in times(points, mirror)])
        made.SetNormalsInterpolation("vertex")
    return made


def build(stage, folder, parts, mirror=(1, 1, 1), with_normals=False, twice=False, flipped=""):
    """Lamps, or under a sun a leaning sheet or a body with a coat, in xforms that mirror back what is mirrored in
    them. Each of these `parts` by itself has no noise but by light from surface to surface.

    `flipped`: the axes of texture coordinates along which the image is mirrored on the sheet; the map is drawn for
    that. `twice`: the bodies are instances of one prototype."""
    glowing = preview(stage, "/glowing", emissiveColor=(1.0, 0.5, 0.2), diffuseColor=(0.0, 0.0, 0.0))
    coated = preview(stage, "/coated", diffuseColor=(0.2, 0.5, 0.1), roughness=0.5)
    colour = [1 - c if axis in flipped else c for c, axis in zip(LEANING, "st-")]
    file = exr(folder / "n.exr", np.broadcast_to(colour, (2, 2, 3)))
    normals = texture(
        stage,
        "/leaning/t",
        file,
        sourceColorSpace="raw",
        scale=Gf.Vec4f(2, 2, 2, 1),
        bias=Gf.Vec4f(-1, -1, -1, 0),
    )
    leaning = preview(stage, "/leaning", diffuseColor=(0.5, 0.5, 0.5), roughness=1.0, normal=normals)

    def outer(name, x, y):
        made = UsdGeom.Xform.Define(stage, f"/{name}")
        place(made, scaled(*mirror) * moved(x, y, 0))
        return f"/{name}"

    if parts == "lamps":
        bind(tetrahedron(stage, outer("lamp", -1.5, 1.5) + "/m", mirror, with_normals), glowing)
        bind(UsdGeom.Sphere.Define(stage, outer("ball", 1.5, 1.5) + "/s"), glowing)
        light = UsdLux.SphereLight.Define(stage, outer("light", 0, -1.5) + "/l")
        light.CreateRadiusAttr(0.4)
        light.CreateIntensityAttr(0.7)
    if parts == "sheet":
        front = (0, 1, 2, 3) if math.prod(mirror) > 0 else (3, 2, 1, 0)
        sheet = mesh(stage, outer("sheet", 0, 0) + "/m", times(SQUARE, mirror), [front])
        coordinates(sheet, [(1 - s if "s" in flipped else s, 1 - t if "t" in flipped else t) for s, t in ST])
        bind(sheet, leaning)
    if parts == "body":
        bind(tetrahedron(stage, outer("body", -1.5, -1.5) + "/m", mirror, with_normals), coated)
    for i in range(2 if twice and parts == "body" else 0):
        copy = UsdGeom.Xform.Define(stage, f"/copy{i}")
        place(copy, scaled(*mirror) * moved(3 * i, 1.5, 0))
        copy.GetPrim().GetReferences().AddInternalReference("/body")
        copy.GetPrim().SetInstanceable(True)
        bind(copy, coated)  # a reference brings nothing from beyond what it names
    sun = UsdLux.DistantLight.Define(stage, "/sun")
    sun.CreateAngleAttr(0.0)
    sun.CreateIntensityAttr(3.0)
    place(sun, turned((1, 0, 0), -35))
    return camera(stage, (0, 0, 8), (0, 0, 0), 45.0)


def seen(farm, folder, name, **options):
    (folder / name).mkdir(exist_ok=True)
    stage = new_stage(folder / name)
    build(stage, folder / name, **options)
    return image(farm, stage, 4, (32, 32))


def apart(one, two):
    """Pixels that differ. The geometry and the random numbers are the same but for roundings of 2^-24 and the half
    floats of images, so that a pixel does only where a path passes an edge by no more."""
    return int((np.abs(one - two).max(axis=2) > 2e-3 * (1 + one.max(axis=2))).sum())


@pytest.mark.parametrize("parts", ["lamps", "sheet", "body"])
@pytest.mark.parametrize("with_normals, twice", [(False, False), (True, True)])
def test_a_stage_looks_the_same_in_xforms_that_mirror(farm, tmp_path, parts, with_normals, twice):
    expected = seen(farm, tmp_path, "plain", parts=parts, with_normals=with_normals, twice=twice)
    assert (expected[:, :, 0] > 0.05).sum() > 20

    for name, mirror in (("x", X), ("all", ALL)):
        mirrored = seen(
            farm, tmp_path, name, parts=parts, mirror=mirror, with_normals=with_normals, twice=twice
        )
        assert apart(expected, mirrored) <= 8


@pytest.mark.parametrize("flipped", ["s", "t", "st"])
def test_a_normal_map_follows_its_image_where_that_is_mirrored(farm, tmp_path, flipped):
    expected = seen(farm, tmp_path, "plain", parts="sheet")
    assert apart(expected, seen(farm, tmp_path, "flipped", parts="sheet", flipped=flipped)) <= 8


@pytest.mark.parametrize("scale", [X, (1, -1, 1), (-1, -1, 1)])
def test_a_camera_that_mirrors_shows_the_mirrored_picture(farm, tmp_path, scale):
    """As its matrix says: the sensor is mirrored, and looks the same way."""
    stage = new_stage(tmp_path)
    made = build(stage, tmp_path, "lamps")
    expected = image(farm, stage, 16, (32, 32))
    matrix = UsdGeom.Xformable(made).GetLocalTransformation()
    place(made, scaled(*scale) * matrix)

    shown = image(farm, stage, 16, (32, 32))[:: scale[1], :: scale[0]]

    lamp = expected[:, :, 0] > 0.99  # samples fall on other places of pixels: those at edges differ
    assert (shown[:, :, 0] > 0.99)[lamp].mean() > 0.9 and lamp.sum() > 60


def test_a_camera_whose_axis_is_mirrored_looks_back(farm, tmp_path):
    stage = new_stage(tmp_path)
    made = build(stage, tmp_path, "lamps")
    place(made, scaled(*Z) * moved(0, 0, -8))

    assert (image(farm, stage, 4, (32, 32))[:, :, 0] > 0.9).sum() > 60


def test_a_spot_that_is_mirrored_shines_along_its_axis(farm, tmp_path):
    stage = new_stage(tmp_path)
    floor = mesh(stage, "/floor", [(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2, 3)])
    bind(floor, preview(stage, diffuseColor=(0.5, 0.5, 0.5), useSpecularWorkflow=1))
    light = UsdLux.SphereLight.Define(stage, "/light")
    UsdLux.ShapingAPI.Apply(light.GetPrim()).CreateShapingConeAngleAttr(20.0)
    light.GetPrim().CreateAttribute("treatAsPoint", Sdf.ValueTypeNames.Bool).Set(True)
    camera(stage, (0, 0, 20), (0, 0, 0), 20.0)
    place(light, moved(0, 0, 4))
    expected = image(farm, stage, 4, (16, 16))
    for mirror in (X, (1, -1, 1)):
        place(light, scaled(*mirror) * moved(0, 0, 4))
        assert apart(expected, image(farm, stage, 4, (16, 16))) == 0
    assert expected.max() > 0
