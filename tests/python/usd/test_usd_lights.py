"""Lights of UsdLux against the definitions of its specification: the irradiance on a white floor in closed
form.

The camera sees one point of the floor, at the origin; its radiance is irradiance / pi.
"""

import math

import numpy as np
import pytest
from PIL import Image
from stage_kit import (
    Gf,
    NARROW,
    Sdf,
    UsdGeom,
    UsdLux,
    agree,
    camera,
    exr,
    floor,
    image,
    moved,
    new_stage,
    place,
    scaled,
    seen,
    sky,
    turned,
)

DOWN = turned((1, 0, 0), -90)  # lights shine along -z; this turns it to -y


@pytest.fixture
def stage(tmp_path):
    made = new_stage(tmp_path)
    floor(made)
    camera(made, (0, 4, 3), (0, 0, 0), NARROW)  # past the lights
    return made


def irradiance(farm, stage, spp=64):
    mean, error = seen(farm, stage, spp)
    return mean * math.pi, error * math.pi


def light(stage, kind, matrix, **inputs):
    made = getattr(UsdLux, kind).Define(stage, "/light")
    for name, value in inputs.items():
        made.GetPrim().GetAttribute(f"inputs:{name}").Set(value)
    place(made, matrix)
    return made


def shaped(made, **inputs):
    api = UsdLux.ShapingAPI.Apply(made.GetPrim())
    for name, value in inputs.items():
        api.GetPrim().GetAttribute(f"inputs:shaping:{name.replace('_', ':')}").Set(value)


@pytest.mark.parametrize("angle", [0.0, 0.53, 30.0])
@pytest.mark.parametrize("normalize", [False, True])
def test_a_distant_light(farm, stage, angle, normalize):
    tilt = 40.0
    light(
        stage, "DistantLight", DOWN * turned((0, 0, 1), tilt),
        angle=angle, intensity=3.0, exposure=1.0, normalize=normalize, color=Gf.Vec3f(1, 0.5, 0.25),
    )  # fmt: skip

    size = math.pi * math.sin(math.radians(angle / 2)) ** 2
    facing = 6 * (1 if normalize or angle == 0 else size)
    expected = facing * math.cos(math.radians(tilt)) * np.array([1, 0.5, 0.25])
    agree(irradiance(farm, stage), expected)


@pytest.mark.parametrize("normalize", [False, True])
def test_a_sphere_light_that_is_scaled(farm, stage, normalize):
    light(
        stage,
        "SphereLight",
        scaled(2, 2, 2) * moved(2, 3, 0),
        radius=0.25,
        intensity=5.0,
        normalize=normalize,
    )

    radius, distance = 0.5, math.sqrt(13)
    luminance = 5 / (4 * math.pi * radius**2 if normalize else 1)
    agree(irradiance(farm, stage), luminance * math.pi * (radius / distance) ** 2 * 3 / distance)


def test_a_sphere_light_that_is_stretched(farm, stage):
    """An ellipsoid right above: seen from below it is the ellipse of a sphere's picture, stretched across."""
    light(stage, "SphereLight", scaled(2, 1, 1) * moved(0, 3, 0), radius=0.5, intensity=5.0)

    # The cone of tangents to x^2/a^2 + (y-h)^2/b^2 + z^2/c^2 = 1 meets the plane y = 1 in the ellipse
    # x^2/p^2 + z^2/q^2 = 1 with p = a / sqrt(h^2 - b^2), q = c / sqrt(h^2 - b^2); its irradiance is
    # pi p q / sqrt((1 + p^2) (1 + q^2)) (projected on the unit sphere and then on the floor).
    p, q = 1 / math.sqrt(9 - 0.25), 0.5 / math.sqrt(9 - 0.25)
    expected = 5 * math.pi * p * q / math.sqrt((1 + p**2) * (1 + q**2))
    agree(irradiance(farm, stage, 256), expected)


def test_a_sphere_light_as_a_point(farm, stage):
    made = light(stage, "SphereLight", moved(2, 3, 0), radius=0.5, intensity=5.0)
    made.CreateTreatAsPointAttr(True)
    agree(irradiance(farm, stage), 5 * math.pi * 0.25 / 13 * 3 / math.sqrt(13))


def rectangle_above(width, height, distance):
    """Of luminance 1, parallel to the floor and centred above the point: the sum of four corners' form
    factors."""
    a, b = width / 2 / distance, height / 2 / distance
    corner = a / math.sqrt(1 + a * a) * math.atan(b / math.sqrt(1 + a * a))
    corner += b / math.sqrt(1 + b * b) * math.atan(a / math.sqrt(1 + b * b))
    return 2 * corner  # 4 corners, each corner / (2 pi) of pi


@pytest.mark.parametrize("normalize", [False, True])
def test_a_rect_light_that_is_scaled(farm, stage, normalize):
    light(
        stage, "RectLight", scaled(2, 1, 1) * DOWN * moved(0, 2, 0),
        width=1.5, height=1.0, intensity=4.0, normalize=normalize,
    )  # fmt: skip
    luminance = 4 / (3 * 1 if normalize else 1)
    agree(irradiance(farm, stage, 256), luminance * rectangle_above(3, 1, 2))


def test_a_rect_light_is_dark_behind(farm, stage):
    light(stage, "RectLight", turned((1, 0, 0), 90) * moved(0, 2, 0), intensity=4.0)
    agree(irradiance(farm, stage), 0)


@pytest.mark.parametrize("normalize", [False, True])
def test_a_disk_light(farm, stage, normalize):
    light(stage, "DiskLight", DOWN * moved(0, 2, 0), radius=0.7, intensity=4.0, normalize=normalize)
    luminance = 4 / (math.pi * 0.49 if normalize else 1)
    agree(irradiance(farm, stage, 256), luminance * math.pi * 0.49 / (0.49 + 4))


@pytest.mark.parametrize("stretch", [1.0, 2.0], ids=["along", "squeezed"])
@pytest.mark.parametrize("normalize", [False, True])
def test_a_cylinder_light(farm, stage, stretch, normalize):
    """Long and thin: radius r at height h, over -l to l, gives L 2 r / h (integral of cos^3 over the
    axis)."""
    radius, height, length = 0.02, 2.0, 3.0
    light(
        stage, "CylinderLight", scaled(2, stretch, 1) * moved(0, height, 0),
        radius=radius, length=length / 2, intensity=100.0, normalize=normalize,
    )  # fmt: skip
    reach = math.atan(length / 2 / height)
    # A point of the axis at angle a sends L 2 r cos a per length into the plane of the axis, over distance
    # h / cos a, and meets the floor at cosine cos a: the integral of L 2 r / h cos^2 a da. Only its width
    # across counts: stretching it along the view changes nothing that is seen but the area.
    value = 100 * 2 * radius / height * (reach + math.sin(reach) * math.cos(reach)) / 1
    a, b = radius * stretch, radius
    ring = math.pi * (3 * (a + b) - math.sqrt((3 * a + b) * (a + 3 * b)))  # of an ellipse, by Ramanujan
    area = ring * length
    # 1 %: the radius is a hundredth of the height, and a polygon of 128 corners stands for the ellipse.
    agree(irradiance(farm, stage, 256), value / (area if normalize else 1), 0.01)


def test_a_colour_temperature(farm, stage):
    light(
        stage, "DistantLight", DOWN, angle=0.0, intensity=2.0,
        enableColorTemperature=True, colorTemperature=3000.0,
    )  # fmt: skip
    agree(irradiance(farm, stage), 2 * np.array(UsdLux.BlackbodyTemperatureAsRgb(3000)))


def test_two_domes_of_one_colour_each(farm, stage):
    sky(stage, 0.75)
    other = sky(stage, 0.5, "/other")
    other.CreateColorAttr(Gf.Vec3f(1, 0, 0))
    agree(irradiance(farm, stage), math.pi * np.array([1.25, 0.75, 0.75]))


@pytest.mark.parametrize("cone, soft", [(20.0, 0.0), (60.0, 0.0), (60.0, 0.5), (30.0, 1.0)])
def test_the_cone_of_a_disk_light(farm, stage, cone, soft):
    """Right below the middle the angle from the axis is that from the floor's normal: 2 pi L times the
    integral of f(a) sin a cos a over what the disk covers."""
    made = light(stage, "DiskLight", DOWN * moved(0, 1, 0), radius=1.0, intensity=4.0)
    shaped(made, cone_angle=cone, cone_softness=soft)

    angle = np.linspace(0, math.pi / 4, 20001)
    cutoff = math.radians(cone)
    begin = cutoff * (1 - soft)
    t = np.clip((angle - begin) / max(cutoff - begin, 1e-9), 0, 1)
    factor = np.where(angle > cutoff, 0, 1 - t * t * (3 - 2 * t))
    expected = 4 * 2 * math.pi * (factor * np.sin(angle) * np.cos(angle)).mean() * math.pi / 4
    # The soft edge is followed by a power of cosines that meets it in the middle: within a tenth of the
    # luminance at each angle (test_the_soft_edge), and of both signs, so that 3 % are left of the integral.
    agree(irradiance(farm, stage, 256), expected, 2e-3 if soft == 0 else 0.03)


def test_the_focus_of_a_disk_light(farm, stage):
    made = light(stage, "DiskLight", DOWN * moved(0, 1, 0), radius=1.0, intensity=4.0)
    shaped(made, focus=3.0)
    # The integral of 2 pi cos^3 a sin a cos a from 0 to 45 degrees.
    agree(irradiance(farm, stage, 256), 4 * 2 * math.pi * (1 - math.sqrt(0.5) ** 5) / 5)


@pytest.mark.parametrize("tilt, expected", [(0, 1), (12.5, 0.5), (24, None), (26, 0)])
def test_the_soft_cone_of_a_sphere_light(farm, stage, tilt, expected):
    """Far away: intensity L pi r^2 times the smooth step of the angle. Its middle, at 12.5 of 25 degrees,
    is 1/2."""
    made = light(
        stage, "SphereLight", DOWN * turned((0, 0, 1), tilt) * moved(0, 10, 0), radius=0.5, intensity=50.0
    )
    shaped(made, cone_angle=25.0, cone_softness=1.0)
    t = min(tilt / 25, 1)
    factor = 1 - t * t * (3 - 2 * t)
    assert expected is None or factor == pytest.approx(expected, abs=1e-12)
    # Half a percent of the full intensity: the image of the cone has 512 pixels across.
    mean, error = irradiance(farm, stage)
    full = 50 * math.pi * 0.25 / 100
    assert np.all(np.abs(mean - full * factor) <= 5 * error + 0.005 * full)


@pytest.mark.parametrize(
    "up, axis, old", [("Y", None, True), ("Z", None, True), ("Z", "scene", False), ("Y", "Z", False)]
)
def test_a_dome_stands_as_openexr_says(farm, tmp_path, up, axis, old):
    """Middle: +z, a quarter from the left: +x, top: +y; with its pole on z: middle -y, top +z."""
    stage = new_stage(tmp_path, up)
    values = np.zeros((64, 128, 3))
    values[:, 48:80] = (1, 0, 0)  # around the middle
    values[:, 16:48] = (0, 1, 0)  # around a quarter from the left
    values[:12] = (0, 0, 1)  # the top
    dome = (UsdLux.DomeLight if old else UsdLux.DomeLight_1).Define(stage, "/dome")
    dome.CreateTextureFileAttr(str(exr(tmp_path / "sky.exr", values)))
    dome.CreateIntensityAttr(2.0)
    if axis:
        dome.CreatePoleAxisAttr(axis)
    stands = axis == "Z" or (axis == "scene" and up == "Z")
    ways = [(0, 0, 1), (1, 0, 0), (0, 1, 0)]
    for i, (x, y, z) in enumerate(ways):
        way = (x, -z, y) if stands else (x, y, z)
        camera(stage, (0, 0, 0), way, 5.0, up=(0.3, 0.4, 0.5), path=f"/camera{i}")

    for i in range(3):
        expected = np.zeros(3)
        expected[i] = 2
        agree(seen(farm, stage, 4, (8, 8), camera=f"/camera{i}"), expected)


def test_a_dome_may_have_an_image_of_one_pixel(farm, tmp_path):
    """A map of the scene format has three rows and two columns at least."""
    stage = new_stage(tmp_path)
    Image.new("RGB", (1, 1), (255, 0, 255)).save(tmp_path / "sky.png")
    dome = UsdLux.DomeLight.Define(stage, "/dome")
    dome.CreateTextureFileAttr(str(tmp_path / "sky.png"))
    dome.CreateIntensityAttr(2.0)
    camera(stage, (0, 0, 0), (0, 0, 1), 5.0)

    agree(seen(farm, stage, 4, (8, 8)), np.array([2.0, 0, 2.0]))


def test_the_image_of_a_rect_light_is_upright(farm, tmp_path):
    stage = new_stage(tmp_path)
    values = np.zeros((2, 2, 3))
    values[0, 0], values[0, 1], values[1, 0] = (1, 0, 0), (0, 1, 0), (0, 0, 1)
    made = UsdLux.RectLight.Define(stage, "/light")
    made.CreateTextureFileAttr(str(exr(tmp_path / "image.exr", np.repeat(np.repeat(values, 32, 0), 32, 1))))
    camera(stage, (0, 0, -3), (0, 0, 0), 15.0)  # before the lit side

    shown = image(farm, stage, 4, (8, 8))

    corner = lambda y, x: np.round(shown[y, x], 2).tolist()  # noqa: E731
    assert [corner(1, 1), corner(1, 6), corner(6, 1), corner(6, 6)] == [
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
        [0, 0, 0],
    ]


def test_lights_of_files_of_before_2021(farm, stage):
    prim = stage.DefinePrim("/light", "DistantLight")
    prim.CreateAttribute("intensity", Sdf.ValueTypeNames.Float).Set(2.0)
    prim.CreateAttribute("angle", Sdf.ValueTypeNames.Float).Set(0.0)
    place(UsdGeom.Xformable(prim), DOWN)
    agree(irradiance(farm, stage), 2.0)
