import os
import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/support"), str(ROOT / "tests/system")]

from cli_kit import write_fog  # noqa: E402
from local_farm import LocalFarm, bin_dir  # noqa: E402
from redis_server import RedisServer  # noqa: E402


@pytest.fixture(scope="session")
def old():
    """The folder of the last release's programs."""
    folder = os.environ.get("LIGHTSHAFT_OLD_BIN")
    assert folder, "run it by tests/upgrade/run.sh"
    return pathlib.Path(folder)


@pytest.fixture(scope="session")
def new():
    return bin_dir()


@pytest.fixture
def farm(tmp_path, old):
    """A farm of the last release. No results are audited, so that those that come can be counted."""
    with LocalFarm(tmp_path, bin=old, flags=["--audit-percent", "0"]) as farm:
        yield farm


@pytest.fixture(scope="session")
def fog(tmp_path_factory):
    return write_fog(tmp_path_factory.mktemp("fog"))


@pytest.fixture
def redis(tmp_path):
    with RedisServer(tmp_path) as server:
        yield server
