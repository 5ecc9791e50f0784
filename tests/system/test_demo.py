"""deploy/demo.sh: a denoised picture by default, and one that says why it is not where the denoiser cannot be had. What installs and
builds is replaced; the farm and its programs are real."""

import os
import shutil
import subprocess

import exr_layers
import pytest
from local_farm import PATIENCE, ROOT, bin_dir

SCENE = """<scene version="3.0.0"><integrator type="path"/><shape type="sphere"/>
<emitter type="constant"/><sensor type="perspective"><transform name="to_world"><lookat origin="0, 0, -9" target="0, 0, 0" up="0, 1, 0"/></transform></sensor></scene>"""


@pytest.fixture
def demo(tmp_path):
    """Runs the script, in a folder like a checkout; the installer of the denoiser ends with `installs`."""
    (tmp_path / "build/release").mkdir(parents=True)
    (tmp_path / "build/release/bin").symlink_to(bin_dir())
    scripts = {"deploy/install-deps.sh": "exit 0", "path/cmake": "exit 0",
               "deploy/install-denoiser.sh": 'touch asked; exit "$INSTALLS"'}
    for name, line in scripts.items():
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text(f"#!/bin/sh\n{line}\n")
        file.chmod(0o755)
    shutil.copy(ROOT / "deploy/demo.sh", tmp_path / "deploy/demo.sh")
    (tmp_path / "scenes/bath").mkdir(parents=True)
    (tmp_path / "scenes/bath/make_bath.py").write_text(
        f"import pathlib, sys\nfolder = pathlib.Path(sys.argv[1])\nfolder.mkdir()\n(folder / 'bath.xml').write_text({SCENE!r})\n")

    def run(*options, installs=0):
        environment = {**os.environ, "PATH": f"{tmp_path / 'path'}:{os.environ['PATH']}", "INSTALLS": str(installs),
                       "LIGHTSHAFT_OIDN": str(bin_dir().parent / "fake_oidn" / "blurs.so")}
        return subprocess.run([tmp_path / "deploy/demo.sh", *options], env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=PATIENCE), tmp_path

    yield run
    subprocess.run([tmp_path / "deploy/demo.sh", "--stop"], check=True, capture_output=True)


def size_and_layers(folder):
    layers = exr_layers.read(folder / "build/demo/bath.exr")[0]
    return (len(layers["R"][0]), len(layers["R"])), layers.keys()


@pytest.mark.slow
def test_the_picture_of_the_demo_is_denoised(demo):
    done, folder = demo()

    assert done.returncode == 0, done.stdout + done.stderr
    size, layers = size_and_layers(folder)
    assert size == (640, 480) and "denoised.R" in layers
    assert (folder / "build/demo/bath.png").read_bytes().startswith(b"\x89PNG")
    assert "dashboard: " in done.stdout and "could not be downloaded" not in done.stdout
    assert "without a terminal the farm stops now" in done.stdout
    assert not list((folder / "build/demo").glob("*.pid"))


@pytest.mark.slow
def test_without_the_denoiser_the_demo_says_so_and_shows_the_raw_picture(demo):
    done, folder = demo(installs=1)

    assert done.returncode == 0, done.stdout + done.stderr
    assert "Open Image Denoise could not be downloaded: the picture is not denoised" in done.stdout
    size, layers = size_and_layers(folder)
    assert size == (640, 480) and "denoised.R" not in layers
    assert (folder / "build/demo/bath.png").exists()


@pytest.mark.slow
def test_a_raw_demo_asks_for_no_denoiser(demo):
    done, folder = demo("--raw")

    assert done.returncode == 0, done.stdout + done.stderr
    assert not (folder / "asked").exists()
    assert "denoised.R" not in size_and_layers(folder)[1]


def test_a_demo_that_must_be_denoised_ends_where_it_cannot(demo):
    done, folder = demo("--denoise", installs=1)

    assert done.returncode == 1
    assert (folder / "asked").exists() and not (folder / "build/demo/bath.exr").exists()


def test_an_unknown_option_of_the_demo_is_told(demo):
    done, _ = demo("--fast")

    assert done.returncode == 2 and done.stderr.startswith("usage: deploy/demo.sh")
