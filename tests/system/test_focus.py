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


def stated_error(farm, job):
    """What the report says of the error at the end and at each checkpoint, without what tells of time."""
    report = farm.report(job)
    end = {key: report[key] for key in ("spp", "rmse", "rmse_ci95", "relmse", "relmse_ci95", "relmse_16", "relmse_16_ci95", "mean", "mean_ci95",
                                        "trusted", "few_hits_pixels")}
    return end, [{key: value for key, value in point.items() if "seconds" not in key} for point in report["convergence"]]


def test_the_error_estimate_is_the_same_with_it_and_in_jobs_that_were_extended(farm):
    farm.add_workers(2, fake=False)
    plain, first, after_16, after_24 = (farm.submit(SCENE, spp=spp, size="64x64", seed=7) for spp in (64, 64, 16, 24))
    change(farm, first, focus=[0, 0, 20, 20])
    for job in (after_16, after_24):
        farm.wait_for_job(job)
        change(farm, job, spp=64)
    for job in (plain, first, after_16, after_24):
        farm.wait_for_job(job)
    end, checkpoints = stated_error(farm, plain)
    assert end["relmse_ci95"] and len(checkpoints) == 6
    assert stated_error(farm, first) == (end, checkpoints)
    assert stated_error(farm, after_16) == (end, checkpoints)
    # Its checkpoint of 32 samples is that of the 24 with which it had ended
    assert stated_error(farm, after_24)[0] == end


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
