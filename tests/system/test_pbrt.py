"""Scenes of pbrt: the same pixels as their translation to XML, here and in a farm, and a known radiance."""

import math
import os

import pytest
from cli_kit import digest, lightshaft, load
from local_farm import LocalFarm
from test_convert import convert, identity

ROOM = """Film "rgb" "integer xresolution" 24 "integer yresolution" 16
LookAt 0 1 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 45
Sampler "independent" "integer pixelsamples" 4
WorldBegin
MakeNamedMedium "smoke" "string type" "uniformgrid" "integer nx" 2 "integer ny" 2 "integer nz" 2
  "float density" [ 1 2 3 4 5 6 7 8 ] "point3 p0" [ -1 -1 -1 ] "point3 p1" [ 1 1 1 ]
AttributeBegin
  MediumInterface "smoke" ""
  Material "interface"
  Shape "sphere" "float radius" 0.9
AttributeEnd
AttributeBegin
  Translate 0 3 0
  AreaLightSource "diffuse" "blackbody L" 4000 "float scale" 5
  ReverseOrientation
  Shape "trianglemesh" "point3 P" [ -1 0 -1  -1 0 1  1 0 1  1 0 -1 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeEnd
Material "diffuse" "rgb reflectance" [ 0.2 0.5 0.8 ]
Translate 0 -1 0
Shape "trianglemesh" "point3 P" [ -4 0 -4  -4 0 4  4 0 4  4 0 -4 ] "integer indices" [ 0 1 2 0 2 3 ]
"""


@pytest.fixture
def room(tmp_path):
    scene = tmp_path / "room.pbrt"
    scene.write_text(ROOM)
    return scene


def rendered(scene, out, *more):
    return digest(lightshaft("render", scene, "-o", out, *more))


def test_a_scene_of_pbrt_and_its_translation_render_the_same_pixels(room, tmp_path):
    out = tmp_path / "there" / "room.xml"
    out.parent.mkdir()
    # Its meshes have no normals, so the translation has `face_normals`, which gives it a digest of its own.
    assert convert(room, out) == identity(out) == convert(room, tmp_path / "beside.xml") != identity(room)
    assert sorted(p.suffix for p in out.parent.iterdir()) == [".ply", ".ply", ".vol", ".xml"]

    of_pbrt = rendered(room, tmp_path / "a.exr")

    assert of_pbrt == rendered(out, tmp_path / "b.exr") == rendered(tmp_path / "beside.xml", tmp_path / "c.exr")


def test_submit_sends_the_meshes_of_the_text_along(room, tmp_path):
    alone = rendered(room, tmp_path / "alone.exr", "--spp", 4)
    with LocalFarm(tmp_path / "farm") as farm:
        farm.add_worker(fake=False)
        environment = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}

        lightshaft("submit", room, "--spp", 4, "--wait", "-o", tmp_path / "farm.exr", "--report", tmp_path / "farm.json",
                   env=environment)

    assert load(tmp_path / "farm.json")["pixels_sha256"] == alone


def test_a_white_ball_in_a_coloured_furnace_is_as_bright_as_the_furnace(tmp_path):
    scene = tmp_path / "furnace.pbrt"
    scene.write_text("""Film "rgb" "integer xresolution" 8 "integer yresolution" 8 "float iso" 200
LookAt 0 0 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 10
Integrator "volpath" "integer maxdepth" 100
WorldBegin
LightSource "infinite" "rgb L" [ 1 2 3 ]
Material "diffuse" "rgb reflectance" [ 1 1 1 ]
Shape "sphere"
""")

    said = lightshaft("render", scene, "--pixel", "4,4", "--sample", 0).stdout

    # A ball reflects all light in one scattering: every path has the radiance of the furnace, twice for iso 200.
    assert [float(x) for x in said.split()[-3:]] == pytest.approx([2, 4, 6], rel=1e-5), said


def test_temporary_files_go(room, tmp_path):
    kept = tmp_path / "kept"
    kept.mkdir()

    lightshaft("render", room, "-o", tmp_path / "x.exr", env={**os.environ, "TMPDIR": str(kept)})

    assert not list(kept.iterdir())


GLOW = """Film "rgb" "integer xresolution" 3 "integer yresolution" 3
LookAt 0 0 -4  0 0 0  0 1 0
Camera "perspective" "float fov" 0.1
Integrator "volpath" "integer maxdepth" 5
WorldBegin
MakeNamedMedium "glow" {medium}
MediumInterface "glow" ""
Material "interface"
Shape "sphere" "float radius" 0.25
"""
GRID = '"integer nx" 4 "integer ny" 4 "integer nz" 4 "point3 p0" [ -1 -1 -1 ] "point3 p1" [ 1 1 1 ]'
BOX = GRID + f' "float density" [ {"2 " * 64}] "rgb sigma_a" [ 1 0.5 3 ] "rgb sigma_s" [ 0 0 0 ] "float scale" 2'
LUMINANCE = (0.2126, 0.7152, 0.0722)


def radiance_of(tmp_path, medium):
    """What one path sees that passes 0.5 units of a medium without scattering, which is the same everywhere there."""
    scene = tmp_path / "glow.pbrt"
    scene.write_text(GLOW.format(medium=medium))
    said = lightshaft("render", scene, "--pixel", "1,1", "--sample", 0).stdout
    return [float(x) for x in said.split()[-3:]]


def absorbed(*sigma_a):
    return [1 - math.exp(-s * 0.5) for s in sigma_a]


# The ray is at most 2.5 pixels of 0.03 degrees off the middle, so that it passes 0.5 units less a share of 2e-6.
NEAR = 1e-4


def test_a_grid_that_absorbs_gives_off_le_times_what_it_absorbs(tmp_path):
    light = radiance_of(tmp_path, f'"string type" "uniformgrid" {BOX} "rgb Le" [ 1 2 3 ] "float Lescale" [ {"5 " * 64}]')

    assert light == pytest.approx([5 * c * a for c, a in zip((1, 2, 3), absorbed(4, 2, 12))], rel=NEAR)


def test_le_of_an_rgbgrid_has_the_integral_of_the_observer(tmp_path):
    light = radiance_of(tmp_path, f'"string type" "rgbgrid" {GRID} "rgb sigma_a" [ {"1 2 3 " * 64}] "rgb sigma_s" [ {"0 " * 192}]'
                                  f' "rgb Le" [ {"1 2 3 " * 64}] "float Lescale" 2')

    assert light == pytest.approx([2 * 106.856895 * c * a for c, a in zip((1, 2, 3), absorbed(1, 2, 3))], rel=NEAR)


# Platinum at its freezing point, 2041.4 K, was the candela's standard: 600,000 cd/m^2 within half a per cent. By 683 lm/W
# this is the integral of its spectral radiance with the observer's y. Its peak is by Wien's law and Planck's. Red and green
# have it all: blue is outside of sRGB, made 0, and less than 0.1 % of the luminance.
def test_black_bodies_have_the_peak_one(tmp_path):
    h, c, k = 6.62607015e-34, 299792458, 1.380649e-23
    m = 2.897771955e-3 / 2041.4
    peak = 2 * h * c**2 / m**5 / math.expm1(h * c / (m * k * 2041.4)) * 1e-9
    temperature = f'"float temperature" [ {"20 " * 64}] "float temperatureoffset" -0.414 "float temperaturescale" 100'

    light = radiance_of(tmp_path, f'"string type" "uniformgrid" {BOX.replace("1 0.5 3", "1 1 1")} {temperature} "float Lescale" [ {"3 " * 64}]')

    seen = sum(w * x for w, x in zip(LUMINANCE, light))
    assert seen == pytest.approx(3 * 600000 / 683.002 / peak * absorbed(4)[0], rel=0.006)


def test_a_damaged_file_of_nanovdb_is_an_error(tmp_path):
    for name, content in (("cut", b"NanoVDB0" + bytes(4)), ("other", b"VOL" * 100), ("empty", b"")):
        (tmp_path / f"{name}.nvdb").write_bytes(content)
        scene = tmp_path / f"{name}.pbrt"
        scene.write_text(GLOW.format(medium=f'"string type" "nanovdb" "string filename" "{name}.nvdb" "float Lescale" 1'))

        said = lightshaft("render", scene, "-o", tmp_path / "x.exr", code=2).stderr

        assert f"{name}.nvdb" in said and "VDB" in said, said
