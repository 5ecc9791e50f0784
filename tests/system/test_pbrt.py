"""Scenes of pbrt: the same pixels as their translation to XML, here and in a farm, and a known radiance."""

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
    assert convert(room, out) == identity(room) == convert(room, tmp_path / "beside.xml")
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
