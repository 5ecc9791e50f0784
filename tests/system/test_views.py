"""Views of OpenColorIO: PNGs, videos and tables beside what OpenImageIO makes of the same image and configuration."""

import json
import os
import shutil
import struct
import subprocess
import urllib.parse

import pytest
from cli_kit import PATIENCE, lightshaft, write_fog
from local_farm import SCENE, HttpError, LocalFarm, bin_dir, wait_until

VIEW = "Screen/Warm"
ACES = "sRGB - Display/ACES 1.0 - SDR Video"
PLAIN = {name: value for name, value in os.environ.items() if name != "OCIO"}


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    """Colours are mixed, get a shoulder from a file, and are encoded by a power: what people's views consist of."""
    folder = tmp_path_factory.mktemp("ocio")
    # y = x / (x + 0.5) up to x = 4
    rows = "\n".join(f"{x / (x + 0.5):.8f}" for x in (4 * i / 4095 for i in range(4096)))
    (folder / "shoulder.spi1d").write_text(f"Version 1\nFrom 0.0 4.0\nLength 4096\nComponents 1\n{{\n{rows}\n}}\n")
    (folder / "config.ocio").write_text("""ocio_profile_version: 2
search_path: .
roles:
  default: Linear Rec.709
file_rules:
  - !<Rule> {name: Default, colorspace: default}
displays:
  Screen:
    - !<View> {name: Warm, colorspace: warm}
    - !<View> {name: Broken, colorspace: broken}
colorspaces:
  - !<ColorSpace>
    name: Linear Rec.709
  - !<ColorSpace>
    name: warm
    from_scene_reference: !<GroupTransform>
      children:
        - !<MatrixTransform> {matrix: [0.9, 0.2, 0, 0, 0.1, 0.8, 0.1, 0, 0, 0.1, 0.6, 0, 0, 0, 0, 1]}
        - !<FileTransform> {src: shoulder.spi1d, interpolation: linear}
        - !<ExponentTransform> {value: [2.2, 2.2, 2.2, 1], direction: inverse}
  - !<ColorSpace>
    name: broken
    from_scene_reference: !<FileTransform> {src: nowhere.cube}
""")
    return folder / "config.ocio"


@pytest.fixture(scope="module")
def fog(tmp_path_factory):
    return write_fog(tmp_path_factory.mktemp("fog"))


def oiiotool(*arguments):
    done = subprocess.run(["oiiotool", *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def assert_like(ours, image, config, folder, view=VIEW):
    """The PNG differs by at most one code from what OpenImageIO makes of the EXR. Both compute in float32; a value near the middle of two codes may round otherwise."""
    theirs = folder / "theirs.png"
    display, name = view.split("/")
    oiiotool("--colorconfig", config, image, "--ch", "R,G,B", "--iscolorspace", "Linear Rec.709", f"--ociodisplay:from=Linear Rec.709", display, name, "-d", "uint8", "-o", theirs)
    # --fail: the largest difference that is none; a code is 1/255
    done = subprocess.run(["idiff", "-fail", "0.0041", "-hardfail", "0.0041", str(ours), str(theirs)], capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_png_shows_the_view_that_opencolorio_makes(fog, config, tmp_path):
    environment = {**PLAIN, "OCIO": str(config)}
    common = ("--spp", 8, "--float")
    lightshaft("render", fog, "-o", tmp_path / "linear.exr", *common, env=environment)
    lightshaft("render", fog, "-o", tmp_path / "plain.png", *common, env=environment)
    lightshaft("render", fog, "-o", tmp_path / "warm.png", "--view", VIEW, *common, env=environment)

    assert_like(tmp_path / "warm.png", tmp_path / "linear.exr", config, tmp_path)
    assert (tmp_path / "warm.png").read_bytes() != (tmp_path / "plain.png").read_bytes()

    lightshaft("render", fog, "-o", tmp_path / "out.exr", "--partial-dir", tmp_path / "partials", *common, env=environment)
    lightshaft("merge", tmp_path / "partials", "-o", tmp_path / "merged.png", "--view", VIEW, env=environment)
    assert (tmp_path / "merged.png").read_bytes() == (tmp_path / "warm.png").read_bytes()


def test_a_view_that_cannot_be_shown_is_refused_before_anything_is_rendered(fog, config, tmp_path):
    environment = {**PLAIN, "OCIO": str(config)}
    for arguments, words in (((tmp_path / "a.exr", "--view", VIEW), "PNG"), ((tmp_path / "a.png", "--view", "Screen/Wram"), f"did you mean '{VIEW}'?"),
                             ((tmp_path / "a.png", "--view", "Screen/Broken"), "nowhere.cube")):
        done = lightshaft("render", fog, "-o", *arguments, env=environment, code=2)
        assert words in done.stderr, done.stderr
    done = lightshaft("render", fog, "-o", tmp_path / "a.png", "--view", VIEW, env={**PLAIN, "OCIO": "/nowhere.ocio"}, code=2)
    assert "/nowhere.ocio" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_farm_shows_the_views_of_its_configuration(fog, config, tmp_path):
    with LocalFarm(environment={"OCIO": str(config)}) as farm:
        to = {**PLAIN, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}", "LIGHTSHAFT_TOKEN": farm.token}
        farm.add_worker(fake=False)
        job = lightshaft("submit", fog, "--spp", 8, "--float", "--wait", "-o", tmp_path / "warm.png", "--view", VIEW, env=to).stdout.split()[0]

        assert farm.get("/api/v1/views") == {"default": VIEW, "views": ["sRGB", VIEW]}
        assert lightshaft("views", env=to).stdout.splitlines() == ["sRGB", VIEW]
        lightshaft("fetch", job, "-o", tmp_path / "linear.exr", env=to)
        assert_like(tmp_path / "warm.png", tmp_path / "linear.exr", config, tmp_path)
        lightshaft("fetch", job, "-o", tmp_path / "fetched.png", "--view", VIEW, env=to)
        assert (tmp_path / "fetched.png").read_bytes() == (tmp_path / "warm.png").read_bytes()
        assert farm.request("GET", f"/api/v1/jobs/{job}/image.png?view={VIEW}") == (tmp_path / "warm.png").read_bytes()

        cube = farm.request("GET", f"/api/v1/views/cube?view={VIEW}")
        values = struct.unpack(f"<{3 * 65 ** 3}e", cube)
        # Grey at place 28, the light (2^7 - 1) / 256: each row of the matrix times it, the shoulder, the power
        at, light = 3 * 28 * (1 + 65 + 65 * 65), 127 / 256
        for value, row in zip(values[at:at + 3], (1.1, 1.0, 0.7)):
            # float16 has 11 bits; the shoulder's table has steps of 1/1024, whose straight lines miss it by less
            assert value == pytest.approx((light * row / (light * row + 0.5)) ** (1 / 2.2), rel=2 ** -11)

        done = lightshaft("submit", fog, "--wait", "-o", tmp_path / "late.png", "--view", "Screen/Wram", env=to, code=2)
        assert f"did you mean '{VIEW}'?" in done.stderr and farm.get("/api/v1/jobs")["total"] == 1, "before anything is sent"

        for path, status in ((f"jobs/{job}/image.png?view=Screen/Wram", 400), (f"jobs/{job}/image.png?view=Screen/Broken", 400), ("views/cube?view=x", 404), ("views/cube?view=Screen/Broken", 404), ("views/cube", 400)):
            with pytest.raises(HttpError) as refused:
                farm.request("GET", f"/api/v1/{path}")
            assert refused.value.status == status, path
            assert str(config.parent) not in str(refused.value), "a matter of the operator, in the log"
        lines = [line for line in (farm.folder / "coordinator.log").read_text().splitlines() if "Screen/Broken" in line]
        assert len(lines) == 1 and "nowhere.cube" in lines[0], "once, however often it is asked for"


@pytest.mark.skipif(not shutil.which("ffmpeg"), reason="ffmpeg is not installed (apt-get install ffmpeg)")
def test_a_video_is_made_in_a_view_and_at_the_rate_of_its_job(tmp_path):
    with LocalFarm(environment={"OCIO": ""}) as farm:
        farm.add_worker()
        job = json.loads(farm.request("POST", "/api/v1/jobs?spp=2&size=64x32&frames=1-2&fps=12", SCENE.encode(), "application/xml"))["id"]
        farm.wait_for_job(job)
        means = []
        for view in (ACES, "sRGB"):
            farm.request("POST", f"/api/v1/jobs/{job}/video", json.dumps({"view": view}).encode())
            video = wait_until(lambda: (v := farm.get(f"/api/v1/jobs/{job}/video"))["state"] in ("ready", "failed") and v, "the video")
            assert (video["state"], video["view"], video["fps"]) == ("ready", view, 12), video
            file = tmp_path / "video.mp4"
            file.write_bytes(farm.request("GET", f"/api/v1/jobs/{job}/video.mp4"))
            raw = subprocess.run(["ffmpeg", "-v", "error", "-i", file, "-vf", "scale=1:1", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True).stdout
            means.append(raw[:3])
        assert means[0] != means[1]
        with pytest.raises(HttpError) as refused:
            farm.request("POST", f"/api/v1/jobs/{job}/video", b'{"view": "nothing"}')
        assert refused.value.status == 400


def test_a_configuration_of_the_environment_that_cannot_be_used_leaves_the_built_in_views(tmp_path):
    with LocalFarm(environment={"OCIO": "/nowhere.ocio"}) as farm:
        assert "/nowhere.ocio" in (farm.folder / "coordinator.log").read_text()
        views = farm.get("/api/v1/views")
        assert views["default"] == "sRGB" and ACES in views["views"]
        assert len(farm.request("GET", f"/api/v1/views/cube?view={urllib.parse.quote(ACES)}")) == 2 * 3 * 65 ** 3


def test_a_configuration_that_the_operator_names_must_be_usable(config, tmp_path):
    def start(file):
        return subprocess.run([bin_dir() / "lightshaft-coordinator", "--data", tmp_path / "data", "--http", "127.0.0.1:0", "--grpc", "127.0.0.1:0", "--ocio", file], capture_output=True, text=True, timeout=PATIENCE, env=PLAIN)
    for file in (tmp_path / "missing.ocio", tmp_path, __file__):
        done = start(file)
        assert done.returncode != 0 and str(file) in done.stderr + done.stdout, done
    first_broken = tmp_path / "first.ocio"
    first_broken.write_text(config.read_text().replace("name: Warm, colorspace: warm", "name: Warm, colorspace: broken"))
    done = start(first_broken)
    assert done.returncode != 0 and "nowhere.cube" in done.stderr + done.stdout, done
    with LocalFarm(flags=["--ocio", config], environment={"OCIO": "/nowhere.ocio"}) as farm:
        assert farm.get("/api/v1/views")["default"] == VIEW
