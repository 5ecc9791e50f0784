"""Fake workers make pixels up, for tests of a farm. They join only where that is allowed, and whatever they touch says so."""

import os

import pytest
from cli_kit import lightshaft
from exr_layers import read
from local_farm import SCENE, LocalFarm, wait_until


@pytest.fixture
def command(farm):
    """Runs the command as a client of the farm; its output."""
    def run(*arguments):
        return lightshaft(*arguments, env={**os.environ, "LIGHTSHAFT_URL": farm.url(), "LIGHTSHAFT_TOKEN": farm.token}).stdout
    return run


def workers(farm):
    return {w["name"]: w for w in farm.get("/api/v1/workers")["workers"]}


def header(farm, job, path):
    path.write_bytes(farm.request("GET", f"/api/v1/jobs/{job}/image.exr"))
    return read(path)[1]


def test_a_fake_worker_is_refused_and_told_what_to_do(tmp_path):
    with LocalFarm(tmp_path, allow_fake=False) as farm:
        stranger = farm.add_worker()

        assert stranger.wait() == 1
        assert "--allow-fake" in stranger.output() and "without --fake" in stranger.output()
        assert workers(farm) == {}
        farm.add_worker(fake=False)
        farm.wait_for_workers(1)


def test_what_fake_workers_make_says_so_wherever_it_is_shown(farm, command, tmp_path):
    fake = farm.add_worker()
    job = farm.submit(SCENE, spp=4)
    farm.wait_for_job(job)

    assert workers(farm)[fake.name]["fake"] is True
    assert farm.job(job)["fake"] is True
    assert farm.report(job)["fake"] is True
    assert "fake workers" in header(farm, job, tmp_path / "fake.exr")["lightshaft:fake"]
    assert "connected (fake)" in command("workers")
    assert "(fake pixels)" in command("jobs")
    assert "fake workers" in command("show", job)
    assert "fake workers" in farm.request("GET", f"/api/v1/jobs/{job}/report.html").decode()
    assert "\nlightshaft_workers_fake 1\n" in farm.request("GET", "/metrics").decode()
    farm.restart_coordinator()
    assert farm.job(job)["fake"] is True


def test_a_job_that_is_rendered_says_nothing_of_fakes_and_gets_no_unit_of_one(farm, command, tmp_path):
    real = farm.add_worker(fake=False)
    job = farm.submit(SCENE, spp=64)
    farm.wait_for_progress(job, 1)
    fake = farm.add_worker()
    farm.wait_for_workers(2)
    farm.wait_for_job(job)

    assert workers(farm)[real.name]["fake"] is False
    assert workers(farm)[fake.name]["units_done"] == 0
    assert farm.job(job)["fake"] is False and farm.report(job)["fake"] is False
    assert "lightshaft:fake" not in header(farm, job, tmp_path / "real.exr")
    assert "fake" not in command("show", job)


def test_a_job_that_a_fake_worker_came_first_to_shows_it_and_real_ones_leave_it_alone(farm):
    farm.add_worker("--fake-delay", 10)
    job = farm.submit(SCENE, spp=64)
    farm.wait_for_progress(job, 1)
    real = farm.add_worker(fake=False)

    assert wait_until(lambda: farm.job(job)["fake"], "the job says that it is fake while it goes on")
    farm.wait_for_workers(2)
    farm.wait_for_job(job)
    assert workers(farm)[real.name]["units_done"] == 0
