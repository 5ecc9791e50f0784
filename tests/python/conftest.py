"""The package as it is installed (tests/python/venv.sh), and a real farm for all tests of a module."""

import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/support"), str(ROOT / "tests/system")]

from local_farm import LocalFarm  # noqa: E402

import lightshaft  # noqa: E402


@pytest.fixture(scope="module")
def local_farm(tmp_path_factory):
    with LocalFarm(tmp_path_factory.mktemp("farm")) as farm:
        farm.add_worker(fake=False)
        farm.wait_for_workers(1)
        yield farm


@pytest.fixture
def farm(local_farm):
    with lightshaft.Farm(local_farm.url(), local_farm.token) as client:
        yield client
