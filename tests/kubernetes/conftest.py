import os
import pathlib

import pytest
from kubernetes_api import KubernetesApi


@pytest.fixture(scope="session")
def api(tmp_path_factory):
    folder = os.environ.get("LIGHTSHAFT_KUBERNETES")
    assert folder, "run it by tests/kubernetes/run.sh"
    with KubernetesApi(tmp_path_factory.mktemp("kubernetes"), pathlib.Path(folder)) as api:
        yield api
