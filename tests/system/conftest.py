import pytest
from local_farm import SCENE, LocalFarm


@pytest.fixture(scope="module")
def expected(request, tmp_path_factory):
    """The pixels of the module's SPEC from an undisturbed farm: one worker with one thread."""
    with LocalFarm(tmp_path_factory.mktemp("undisturbed")) as farm:
        farm.add_worker()
        return farm.pixels(farm.submit(SCENE, **request.module.SPEC))
