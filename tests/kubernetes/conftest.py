import os
import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/support"), str(ROOT / "tests/system")]

from kubernetes_api import KubernetesApi  # noqa: E402
from local_farm import LocalFarm  # noqa: E402


@pytest.fixture(scope="session")
def api(tmp_path_factory):
    folder = os.environ.get("LIGHTSHAFT_KUBERNETES")
    assert folder, "run it by tests/kubernetes/run.sh"
    with KubernetesApi(tmp_path_factory.mktemp("kubernetes"), pathlib.Path(folder)) as api:
        yield api


@pytest.fixture
def farm(tmp_path):
    with LocalFarm(tmp_path) as farm:
        yield farm
