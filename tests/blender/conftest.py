"""Blender as a module with the add-on as a user installs it: the packed zip. Without `bpy` only what needs none is tested."""

import importlib.util
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "blender"))

from local_farm import LocalFarm, bin_dir  # noqa: E402


@pytest.fixture(scope="session")
def blender(tmp_path_factory):
    """The module bpy, in which the add-on is installed and on."""
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("Blender is not installed as a module (tests/venv.sh blender)")
    # Before bpy is loaded: it looks once.
    os.environ["BLENDER_USER_RESOURCES"] = str(tmp_path_factory.mktemp("blender"))
    os.environ["LIGHTSHAFT_PROGRAM"] = str(bin_dir() / "lightshaft")
    import bpy

    packed = subprocess.run(
        [sys.executable, ROOT / "blender/package.py"], check=True, capture_output=True, text=True
    )
    bpy.ops.extensions.package_install_files(
        filepath=packed.stdout.strip(), repo="user_default", enable_on_install=True
    )
    return bpy


@pytest.fixture
def stage(blender, tmp_path):
    from stage import Stage

    return Stage(tmp_path)


@pytest.fixture(scope="module")
def farm(blender, tmp_path_factory):
    # Open Image Denoise, or what stands in for it.
    denoiser = os.environ.get("LIGHTSHAFT_OIDN") or str(bin_dir().parent / "fake_oidn" / "blurs.so")
    with LocalFarm(tmp_path_factory.mktemp("farm"), environment={"LIGHTSHAFT_OIDN": denoiser}) as local:
        local.add_worker(fake=False)
        local.wait_for_workers(1)
        os.environ["LIGHTSHAFT_URL"], os.environ["LIGHTSHAFT_TOKEN"] = local.url(), local.token
        yield local
