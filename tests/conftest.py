"""What tests of several folders start: a farm, a Redis server, a scene. Helpers are found by pytest.ini."""

import pytest
from cli_kit import write_fog
from local_farm import LocalFarm
from redis_server import RedisServer


@pytest.fixture
def farm(tmp_path):
    with LocalFarm(tmp_path) as farm:
        yield farm


@pytest.fixture(scope="session")
def fog(tmp_path_factory):
    """A small scene with a grid."""
    return write_fog(tmp_path_factory.mktemp("fog"))


@pytest.fixture
def redis(tmp_path):
    with RedisServer(tmp_path) as server:
        yield server
