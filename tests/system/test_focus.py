"""A part of the image that is rendered first: over HTTP and by the command line, kept, and without a trace in the pixels."""

import json
import os

import pytest
from cli_kit import lightshaft
from local_farm import SCENE, HttpError


def submit(farm, **more):
    return farm.submit(SCENE, spp=128, size="256x256", **more)


def change(farm, job, **changes):
    return json.loads(farm.request("PATCH", f"/api/v1/jobs/{job}", json.dumps(changes).encode()))


def samples(farm, job):
    """Samples by the tile's rectangle."""
    return {tuple(tile["rect"]): tile["spp"] for tile in farm.get(f"/api/v1/jobs/{job}/tiles")["tiles"]}


def test_the_pixels_are_the_same_with_and_without_it(farm):
    farm.add_workers(2, fake=False)
    plain = submit(farm)
    farm.wait_for_job(plain)
    job = submit(farm)
    assert change(farm, job, focus=[200, 200, 256, 256])["focus"] == [200, 200, 256, 256]
    change(farm, job, focus=[0, 0, 20, 20])
    farm.wait_for_job(job)
    assert farm.pixels(job) == farm.pixels(plain)


def test_its_tiles_get_the_first_samples_and_it_outlives_a_restart(farm):
    job = submit(farm)
    change(farm, job, focus=[100, 100, 101, 101])
    farm.restart_coordinator()
    assert farm.job(job)["focus"] == [100, 100, 101, 101]

    # One worker whose job is paused as soon as some units are done
    farm.add_worker()
    farm.wait_for_progress(job, 2)
    change(farm, job, state="paused")
    got = samples(farm, job)
    assert got[96, 96, 128, 128] == max(got.values()) > 0


def test_a_wrong_region_is_refused_and_changes_nothing(farm):
    job = submit(farm)
    for wrong in ([0, 0, 257, 10], [10, 10, 10, 20], [20, 0, 10, 10], [0, 0, 1], [-1, 0, 4, 4], [0, 0, 1.5, 2], "all", [0, 0, 2 ** 40, 4], {}):
        with pytest.raises(HttpError) as refused:
            change(farm, job, focus=wrong, priority=3)
        assert refused.value.status == 400, wrong
    assert farm.job(job)["focus"] is None and farm.job(job)["priority"] == 0


def test_a_sequence_has_one_for_all_its_frames(farm):
    job = json.loads(farm.request("POST", "/api/v1/jobs?spp=2&size=64x64&frames=1-3", SCENE.encode(), "application/xml"))["id"]
    assert change(farm, job, focus=[0, 0, 8, 8])["focus"] == [0, 0, 8, 8]
    assert farm.get(f"/api/v1/jobs/{job}?frame=3")["focus"] == [0, 0, 8, 8]
    change(farm, f"{job}-frame3", focus=None)
    assert farm.job(job)["focus"] is None, "the frames do not agree"


def test_the_command_line_sets_and_ends_it(farm):
    job = submit(farm)
    environment = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
    lightshaft("focus", job, "--region", "8,8,64,32", env=environment)
    assert farm.job(job)["focus"] == [8, 8, 64, 32]
    lightshaft("focus", job, "--none", env=environment)
    assert farm.job(job)["focus"] is None
    assert "X0,Y0,X1,Y1" in lightshaft("focus", job, "--region", "8,8", env=environment, code=2).stderr
