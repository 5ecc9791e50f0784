import os
import pathlib

import pytest
from local_farm import LocalFarm, bin_dir


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
