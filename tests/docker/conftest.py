import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/support"), str(ROOT / "tests/system")]

from local_farm import LocalFarm  # noqa: E402


@pytest.fixture
def farm(tmp_path):
    with LocalFarm(tmp_path) as farm:
        yield farm
