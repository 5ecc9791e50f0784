"""Stages as they are handed in: frames, packages, missing and foreign files, the command, and missing
packages."""

import subprocess
import sys
import zipfile

import numpy as np
import pytest
from local_farm import ROOT, bin_dir
from stage_kit import (
    Gf,
    Sdf,
    UsdGeom,
    UsdUtils,
    bind,
    camera,
    colours,
    new_stage,
    path_of,
    png,
    preview,
    square,
    stage_from_front,
    texture,
)

import lightshaft
import lightshaft.usd



@pytest.fixture
def stage(tmp_path):
    return stage_from_front(tmp_path)


def test_time_samples_are_frames(farm, stage):
    colours(square(stage), [(0, 0, 0)], "constant")
    move = UsdGeom.Xform.Define(stage, "/world").AddTranslateOp()
    move.Set(Gf.Vec3d(-0.25, 0, 0), 3)
    move.Set(Gf.Vec3d(0.25, 0, 0), 7)

    job = farm.submit(path_of(stage), spp=4, size=(32, 32), frames="3-7x2").wait()

    frames = job.frames()
    places = []
    for frame in frames:
        dark = frame.image()[:, :, 0] < 0.5
        places.append(np.argwhere(dark)[:, 1].mean() / 32 - 0.5 + 0.5 / 32)
    assert len(frames) == 3 and places == sorted(places)
    step = 0.25 / (20 * np.tan(np.radians(7.5)))  # of the frame's width at 10 units
    assert places == pytest.approx([-step, 0, step], abs=0.5 / 32)  # half a pixel


def test_an_error_in_a_frame_names_the_prim(farm, stage):
    """What only the farm refuses, here a field of view of 180 degrees, is told by the prim, too."""
    square(stage)
    stage.GetPrimAtPath("/camera").GetAttribute("focalLength").Set(1e-30)
    for frames in (None, "1-2"):
        with pytest.raises(lightshaft.SceneRejected) as caught:
            farm.submit(path_of(stage), spp=4, size=(8, 8), frames=frames)
        assert caught.value.path == "/camera.fov"


def test_a_package_is_read_as_it_is(farm, tmp_path, stage):
    png(tmp_path / "a.png", np.full((8, 8, 3), 0.5))
    made = square(stage)
    bind(made, preview(stage, emissiveColor=texture(stage, "/look/t", "a.png", sourceColorSpace="raw")))
    package = tmp_path / "packed" / "scene.usdz"
    package.parent.mkdir()
    assert UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(path_of(stage))), str(package))
    (tmp_path / "a.png").unlink()

    shown = farm.submit(package, spp=4, size=(8, 8)).wait().image()

    assert shown[4, 4].min() > 128 / 255


def test_a_missing_image_is_told_with_prim_and_path_and_nothing_is_sent(farm, stage):
    bind(square(stage), preview(stage, diffuseColor=texture(stage, "/look/t", "textures/gone.png")))
    before = len(farm.jobs())
    with pytest.raises(lightshaft.StageRejected) as caught:
        farm.submit(path_of(stage), spp=4)
    assert caught.value.path == "/look/t" and "@textures/gone.png@" in str(caught.value)
    assert len(farm.jobs()) == before


def test_a_missing_layer_is_told_with_its_prim(stage):
    stage.DefinePrim("/world/chair").GetReferences().AddReference("gone/chair.usd")
    with pytest.raises(lightshaft.StageRejected) as caught:
        lightshaft.usd.read(path_of(stage))
    assert "/world/chair" in str(caught.value) and "gone/chair.usd" in str(caught.value)


@pytest.mark.parametrize("way", ["absolute", "above", "link"])
def test_images_outside_the_stages_folder_are_not_sent(tmp_path, way):
    secret = png(tmp_path / "secret.png", np.zeros((4, 4, 3)))
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / "link.png").symlink_to(secret)
    stage = new_stage(folder)
    camera(stage, (0, 0, 10), (0, 0, 0))
    name = {"absolute": str(secret), "above": "../secret.png", "link": "link.png"}[way]
    bind(square(stage), preview(stage, diffuseColor=texture(stage, "/look/t", name)))

    with pytest.raises(lightshaft.FileRefused, match=r"/look/t names .*secret.png.*allow="):
        lightshaft.usd.read(path_of(stage))

    files = lightshaft.usd.read(path_of(stage), allow=[tmp_path]).files
    assert any(name.endswith(".png") for name in files)
    assert lightshaft.usd.read(path_of(stage), folder=tmp_path).files


def test_layers_outside_the_stages_folder_are_not_sent(tmp_path):
    other = new_stage(tmp_path, name="private.usda")
    square(other, "/private")
    other.Save()
    folder = tmp_path / "scene"
    folder.mkdir()
    stage = new_stage(folder)
    camera(stage, (0, 0, 10), (0, 0, 0))
    stage.DefinePrim("/world/m").GetReferences().AddReference("../private.usda", "/private")
    with pytest.raises(lightshaft.FileRefused, match="private.usda.*allow="):
        lightshaft.usd.read(path_of(stage))
    assert lightshaft.usd.read(path_of(stage), allow=[tmp_path]).files


@pytest.mark.parametrize(
    "content", [b"", b"#usda 1.0\ndef Mesh", b"PXR-USDC" + b"\xff" * 200, b"\0" * 100, b"<scene/>"]
)
@pytest.mark.parametrize("suffix", ["usd", "usda", "usdc", "usdz"])
def test_what_is_no_stage_is_told(tmp_path, content, suffix):
    path = tmp_path / f"scene.{suffix}"
    path.write_bytes(content)
    with pytest.raises(lightshaft.LightshaftError, match="scene"):
        lightshaft.usd.read(path)


@pytest.mark.parametrize(
    "place", ["/world/m.points", "/camera.focalLength", "/sky.inputs:intensity", "/look/surface.inputs:ior"]
)
def test_values_of_a_wrong_type_are_told_with_their_prim(stage, place):
    bind(square(stage), preview(stage, ior=1.5))
    path = Sdf.Path(place)
    layer = stage.GetRootLayer()
    prim = layer.GetPrimAtPath(path.GetPrimPath())
    del prim.properties[path.name]
    Sdf.AttributeSpec(prim, path.name, Sdf.ValueTypeNames.String).default = "many"
    with pytest.raises(lightshaft.StageRejected, match="another type than|three finite numbers") as caught:
        lightshaft.usd.read(path_of(stage))
    assert str(path.GetPrimPath()).startswith(caught.value.path)


def test_a_file_that_is_not_there_is_told(tmp_path):
    with pytest.raises(lightshaft.FileRefused, match="there is no file"):
        lightshaft.usd.read(tmp_path / "gone.usda")


def test_a_package_with_compressed_members_is_refused(tmp_path, stage):
    """A small file could grow without bound."""
    png(tmp_path / "a.png", np.zeros((8, 8, 3)))
    bind(square(stage), preview(stage, diffuseColor=texture(stage, "/look/t", "a.png")))
    layer = path_of(stage)
    package = tmp_path / "scene.usdz"
    with zipfile.ZipFile(package, "w") as file:
        file.write(layer, "scene.usda", zipfile.ZIP_STORED)
        file.write(tmp_path / "a.png", "a.png", zipfile.ZIP_DEFLATED)
    with pytest.raises(lightshaft.LightshaftError):
        lightshaft.usd.read(package)


def test_settings_that_do_not_go_with_a_stage_are_refused(farm, stage):
    with pytest.raises(lightshaft.RequestRejected, match="assets="):
        farm.submit(path_of(stage), assets={"a": b"x"})
    with pytest.raises(lightshaft.RequestRejected, match="camera="):
        farm.submit('<scene version="3.0.0"/>', camera="/camera")
    with pytest.raises(lightshaft.StageRejected, match="frames"):
        farm.submit(path_of(stage), frames="one")


def test_the_command_writes_what_lightshaft_renders(tmp_path, stage):
    colours(square(stage), [(0.2, 0.4, 0.6)], "constant")
    run = [sys.executable, "-m", "lightshaft.usd", str(path_of(stage)), "-o", str(tmp_path / "out")]
    done = subprocess.run(run, capture_output=True, text=True)
    assert done.returncode == 0 and not done.stderr, done.stderr
    rendered = subprocess.run(
        [bin_dir() / "lightshaft", "render", tmp_path / "out/scene.xml", "-o", tmp_path / "a.exr",
         "--spp", "4", "--size", "16x16", "--strict"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert rendered.returncode == 0, rendered.stderr
    framed = subprocess.run([*run, "--frames", "1-2"], capture_output=True, text=True)
    assert framed.returncode == 0 and (tmp_path / "out/frame.0002.xml").exists(), framed.stderr
    wrong = subprocess.run([*run, "--camera", "/gone"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "no camera /gone" in wrong.stderr


def test_without_usd_core_it_says_what_to_install(tmp_path):
    """A process to which the packages are not there."""
    program = (
        "import importlib.util as u, lightshaft\n"
        "find = u.find_spec\n"
        "u.find_spec = lambda name, package=None: None if name == 'pxr' else find(name, package)\n"
        "try:\n"
        "    lightshaft.Farm('http://localhost:1').submit('scene.usda')\n"
        "except lightshaft.MissingPackage as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert "usd-core" in done.stdout and "pip install 'lightshaft[usd]'" in done.stdout, done.stderr


def test_the_package_loads_without_usd():
    done = subprocess.run(
        [sys.executable, "-c", "import sys, lightshaft; print('pxr' in sys.modules)"],
        capture_output=True,
        text=True,
    )
    assert done.stdout == "False\n"


def test_the_guide_tells_of_every_type_that_is_read():
    page = (ROOT / "docs/guide/usd.md").read_text()
    from lightshaft.usd.geometry import SHAPES
    from lightshaft.usd.lights import BUILD
    from lightshaft.usd.volumes import SETTINGS

    for name in (*SHAPES, *BUILD, *SETTINGS):
        assert f"`{name}`" in page or name.endswith("_1"), name
