import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from cli_kit import write_fog  # noqa: E402
from local_farm import SCENE, LocalFarm  # noqa: E402
from redis_server import RedisServer  # noqa: E402


@pytest.fixture
def farm(tmp_path):
    with LocalFarm(tmp_path) as farm:
        yield farm


@pytest.fixture(scope="module")
def expected(request, tmp_path_factory):
    """The pixels of the module's SPEC from an undisturbed farm: one worker with one thread."""
    with LocalFarm(tmp_path_factory.mktemp("undisturbed")) as farm:
        farm.add_worker()
        return farm.pixels(farm.submit(SCENE, **request.module.SPEC))


@pytest.fixture(scope="session")
def fog(tmp_path_factory):
    """A small scene with a grid."""
    return write_fog(tmp_path_factory.mktemp("fog"))


@pytest.fixture
def redis(tmp_path):
    with RedisServer(tmp_path) as server:
        yield server
