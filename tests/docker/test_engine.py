"""`lightshaft farm up --on docker` against a real engine: tests/run.sh runs it where one answers and has the image of workers."""

import json
import subprocess

import docker_engine
import pytest
from cli_kit import lightshaft
from docker_engine import containers, docker
from engine_kit import FarmUp, calm_pixels, connected, renders_as_alone
from local_farm import SCENE, wait_until

assert not docker_engine.missing(), docker_engine.missing()

LONG = {"spp": 400}


@pytest.fixture
def start(farm):
    started = []

    def start(*flags, **options):
        started.append(FarmUp(farm, "docker", *docker_engine.of_this_build(), *flags, **options))
        return started[-1]

    yield start
    for up in started:
        up.kill()
    for container in containers("farm", "--all"):
        docker("rm", "--force", "--volumes", container)


def test_workers_render_the_pixels_of_render_and_go(farm, start, fog, tmp_path):
    up, job = renders_as_alone(farm, start, fog, tmp_path)

    assert containers("farm", "--all") == []
    report = up.report()
    assert report["engine"].startswith("docker ") and report["workers_started"] >= 1
    rendered = report["rendered_core_hours"]
    assert rendered["by_job"][job]["core_hours"] == pytest.approx(rendered["by_user"]["admin"]) and rendered["by_user"]["admin"] > 0
    assert "drain" in next(up.logs.glob("farm-*.log")).read_text().lower()


@pytest.mark.slow
def test_one_picture_while_containers_are_killed_and_stopped(farm, start):
    pixels = calm_pixels(farm, SCENE, **LONG)
    job = farm.submit(SCENE, **LONG)
    up = start("--workers", 2, "--finish-in", .001, delay=300)
    wait_until(lambda: len(connected(farm)) == 2, "two workers have joined")
    farm.wait_for_progress(job, 2)
    wait_until(lambda: up.report()["workers_started"] == 2, "farm-up has listed both")

    docker("kill", containers()[0])
    wait_until(lambda: len(connected(farm)) == 2 and up.report()["workers_started"] >= 3, "another has joined")
    lost = freed(farm, "worker lost")
    docker("stop", containers()[0])

    assert farm.pixels(job) == pixels
    assert freed(farm, "worker lost") == lost, "one that is stopped hands in what it holds"
    up.end()
    assert containers("farm", "--all") == []


def freed(farm, cause):
    line = f'lightshaft_units_freed_total{{cause="{cause}"}} '
    return next(float(text.removeprefix(line)) for text in farm.request("GET", "/metrics").decode().splitlines() if text.startswith(line))


def test_farm_up_that_was_killed_takes_its_workers_up_again(farm, start):
    job = farm.submit(SCENE, **LONG)
    first = start(delay=300)
    farm.wait_for_progress(job, 1)
    before = containers()
    first.kill()

    again = start(delay=300)
    farm.wait_for_progress(job, farm.job(job)["units_done"] + 3)

    assert len(before) == 1 and containers() == before
    again.end()
    assert again.report()["workers_started"] == 1


def test_token_is_in_no_argument_no_inspected_field_and_no_file(farm, start):
    farm.submit(SCENE, **LONG)
    up = start(delay=1000)
    wait_until(lambda: connected(farm), "a worker has joined")
    (worker,) = containers()

    facts = json.loads(docker("inspect", worker).stdout)[0]
    lines = subprocess.run(["ps", "axww", "-o", "args"], capture_output=True, text=True, check=True).stdout
    files = docker("exec", worker, "sh", "-c", f"cd /tmp && ls && grep -rsl {farm.join_token} /tmp /cache; true").stdout

    assert f"farm-{facts['Config']['Labels']['lightshaft.worker']}" in lines
    for text in (json.dumps(facts), lines, docker("logs", worker).stdout):
        assert farm.join_token not in text
    assert files.split() == ["join-token"], "the named pipe, which is empty"
    assert facts["HostConfig"]["ReadonlyRootfs"] and facts["HostConfig"]["CapDrop"] == ["ALL"]
    assert facts["Config"]["StopTimeout"] == 120
    up.end()


@pytest.mark.parametrize("flag", ["--image=lightshaft-worker:none-such", "--worker-option=--none-such"])
def test_a_worker_that_does_not_start_says_why(farm, start, flag):
    farm.submit(SCENE, spp=8)
    up = start(flag)

    wait_until(lambda: "starts of workers in a row failed" in up.output(), "farm-up sees it")

    up.end()
    assert containers("farm", "--all") == []
    assert "none-such" in up.output() + "".join(log.read_text() for log in up.logs.iterdir())


def test_job_budget_drains_the_workers(farm, start):
    job = farm.submit(SCENE, **LONG)
    up = start("--job-budget", 1e-7, delay=30)  # less than a unit costs

    wait_until(lambda: "used up" in up.output() and not containers("farm", "--all"), "all workers have gone")

    assert up.alive() and farm.job(job)["state"] != "done"
    up.end()
