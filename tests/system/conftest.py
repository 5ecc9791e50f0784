import pathlib
import sys

import pytest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))

from local_farm import LocalFarm  # noqa: E402


@pytest.fixture
def farm(tmp_path):
    with LocalFarm(tmp_path) as farm:
        yield farm
