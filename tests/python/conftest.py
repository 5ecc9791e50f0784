"""The package as it is installed (tests/venv.sh python), and a real farm for all tests of a module."""

import pytest
from local_farm import LocalFarm

import lightshaft


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
