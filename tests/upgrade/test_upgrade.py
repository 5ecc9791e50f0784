"""Farms of the last release become farms of this build while their jobs are under way, as docs/guide/operations.md says it is
done: the coordinator first, then the workers. Jobs are finished by workers of the build that began them, to the same pixels, and
nothing that was accepted is rendered again."""

import json
import os
import re
import shutil
import signal
import subprocess

import pytest
from local_farm import SCENE, HttpError, LocalFarm, wait_until

LONG = dict(spp=512, seed=7)
SHORT = dict(spp=8, seed=7)
TARGET = dict(spp=4096, target_error=2e-4, seed=7)


def version(programs):
    """Of the last release or of this build, as its workers report it."""
    said = subprocess.run([programs / "lightshaft", "--version"], check=True, capture_output=True, text=True).stdout
    return re.match(r"lightshaft (\S+?),? ", said)[1]


def run(programs, farm, *words):
    """What the command line of these programs prints, which must succeed."""
    environment = dict(os.environ, LIGHTSHAFT_URL=farm.url(), LIGHTSHAFT_TOKEN=farm.token)
    return subprocess.run([programs / "lightshaft", *map(str, words)], env=environment, check=True, capture_output=True, text=True).stdout


def add_worker(farm, programs, *flags, **options):
    """A worker of the last release or of this build, which renders unless told otherwise."""
    own, farm.bin = farm.bin, programs
    try:
        return farm.add_worker(*flags, **{"fake": False, **options})
    finally:
        farm.bin = own


def replace_coordinator(farm, programs, by=signal.SIGTERM):
    """Ends it and starts the one of `programs` on the same folder and ports."""
    farm.coordinator.signal(by)
    farm.coordinator.wait()
    farm.bin = programs
    farm.start_coordinator()


def change(farm, job, **what):
    farm.request("PATCH", f"/api/v1/jobs/{job}", json.dumps(what).encode())


def accepted(farm):
    """Results that the coordinator has accepted since its start."""
    line = 'lightshaft_results_total{verdict="accepted"} '
    return next(int(text.removeprefix(line)) for text in farm.request("GET", "/metrics").decode().splitlines() if text.startswith(line))


def build_of(farm, job):
    return farm.report(job)["build"]


@pytest.fixture(scope="module")
def alone(tmp_path_factory, old, new):
    """The pixels of a job on an undisturbed farm of one build: alone(programs, spec)."""
    known = {}

    def pixels(programs, spec):
        key = (programs, *spec.items())
        if key not in known:
            with LocalFarm(tmp_path_factory.mktemp("undisturbed"), bin=programs) as farm:
                add_worker(farm, programs)
                known[key] = farm.pixels(farm.submit(SCENE, **spec))
        return known[key]

    assert version(old) != version(new)
    return pixels


@pytest.mark.parametrize("by", [signal.SIGTERM, signal.SIGKILL], ids=["asked to end", "killed"])
def test_jobs_in_every_state_outlive_the_upgrade(farm, alone, old, new, fog, by):
    workers = [add_worker(farm, old, name=f"old-{n}") for n in (1, 2)]
    farm.wait_for_workers(2)
    done = farm.submit(SCENE, **SHORT)
    before = farm.pixels(done)
    cancelled = farm.submit(SCENE, **LONG)
    change(farm, cancelled, state="cancelled")
    paused = farm.submit(SCENE, **LONG)
    farm.wait_for_progress(paused, 10)
    change(farm, paused, state="paused")
    running, target = farm.submit(SCENE, **LONG), farm.submit(SCENE, **TARGET)
    sequence = run(old, farm, "submit", fog, "--frames", "1-3", "--spp", 32).split()[0]
    queued = farm.submit(SCENE, **SHORT, priority=-1)
    for job in (running, target, sequence):
        farm.wait_for_progress(job, 5)
    states = {job: farm.job(job) for job in (paused, running, target, sequence, queued)}
    assert [states[job]["state"] for job in (paused, running, target, sequence, queued)] == ["paused", "running", "running", "running", "queued"]

    replace_coordinator(farm, new, by)

    assert (farm.job(done)["state"], farm.report(done)["pixels_sha256"]) == ("done", before)
    assert farm.request("GET", f"/api/v1/jobs/{done}/image.exr")[:4] == b"\x76\x2f\x31\x01"
    assert farm.job(cancelled)["state"] == "cancelled"
    assert farm.job(paused)["state"] == "paused"
    for job, view in states.items():
        assert farm.job(job)["units_done"] >= view["units_done"], "what was accepted is kept"
    # Jobs that nobody has begun wait for workers of this build.
    fresh = farm.submit(SCENE, **SHORT)
    for job in (fresh, queued):
        wait_until(lambda job=job: "old-1 is of another version than the coordinator and begins no job" in (farm.job(job)["error"] or ""),
                   "the job says what it waits for")

    change(farm, paused, state="running")
    for job, spec in ((running, LONG), (paused, LONG), (target, TARGET)):
        assert farm.pixels(job) == alone(old, spec)
        assert build_of(farm, job) == version(old)
    # A job with a target plans fewer units in the end than it had done: they count too.
    jobs = [farm.job(job) for job in (running, paused, target, sequence)]  # of the sequence, the frames that were begun
    assert accepted(farm) <= sum(max(0, view["units_done"] - states[view["id"]]["units_done"]) for view in jobs), "nothing is rendered twice"

    # The workers, one at a time.
    for n, worker in enumerate(workers, 1):
        assert worker.terminate() == 0
        add_worker(farm, new, name=f"new-{n}")
    for job in (fresh, queued):
        assert farm.pixels(job) == alone(new, SHORT)
        assert build_of(farm, job) == version(new)
    farm.wait_for_job(sequence)
    # Workers of the new build get no units of jobs that the old build began.
    change(farm, running, spp=2 * LONG["spp"])
    wait_until(lambda: "new-1 is of another numeric class" in (farm.job(running)["error"] or ""), "the job says what it waits for")


def test_a_job_whose_workers_went_too_early_waits_for_one_of_its_build(farm, alone, old, new):
    worker = add_worker(farm, old)
    job = farm.submit(SCENE, **LONG)
    farm.wait_for_progress(job, 10)
    replace_coordinator(farm, new)
    assert worker.terminate() == 0
    renewed = add_worker(farm, new)
    wait_until(lambda: f"{renewed.name} is of another numeric class" in (farm.job(job)["error"] or ""), "the job says what it waits for")
    done = farm.job(job)["units_done"]
    assert done >= 10

    add_worker(farm, old)

    assert farm.pixels(job) == alone(old, LONG)
    assert farm.job(job)["error"] is None


def test_programs_of_both_builds_understand_each_other(farm, alone, old, new, tmp_path):
    scene = tmp_path / "scene.xml"
    scene.write_text(SCENE)
    words = ("submit", scene, "--spp", SHORT["spp"], "--seed", SHORT["seed"], "--wait", "-o", tmp_path / "image.exr")
    # This build's worker and command line with the old coordinator: workers that are replaced first are no harm.
    add_worker(farm, new)
    job = run(new, farm, *words).split()[0]
    assert farm.report(job)["pixels_sha256"] == alone(new, SHORT)
    assert job in run(new, farm, "jobs")

    replace_coordinator(farm, new)

    assert job in run(old, farm, "jobs")
    later = run(old, farm, *words).split()[0]
    assert farm.report(later)["pixels_sha256"] == alone(new, SHORT)


def test_the_old_coordinator_takes_the_folder_back_without_jobs_whose_settings_it_does_not_know(farm, alone, old, new):
    worker = add_worker(farm, old)
    job = farm.submit(SCENE, **LONG)
    farm.wait_for_progress(job, 10)
    replace_coordinator(farm, new)
    worker.kill()
    unknown = farm.submit(SCENE, **SHORT, denoise="true")
    before = farm.job(job)["units_done"]

    replace_coordinator(farm, old)

    assert farm.job(job)["units_done"] >= before
    view = farm.job(unknown)
    assert view["state"] == "failed" and "denoising_albedo" in view["error"]
    add_worker(farm, old)
    assert farm.pixels(job) == alone(old, LONG)

    replace_coordinator(farm, new)
    assert farm.job(job)["state"] == "done"
    assert farm.job(unknown)["state"] == "queued"
    add_worker(farm, new)
    assert farm.pixels(unknown) == alone(new, SHORT)


# ---- several coordinators on one Redis ----

@pytest.fixture
def pair(redis, tmp_path, old):
    """Two coordinators of the last release that share a farm."""
    flags = ["--shared", "--store", redis.url, "--blobs", tmp_path / "blobs"]
    (tmp_path / "a").mkdir()
    (tmp_path / "b" / "data").mkdir(parents=True)
    with LocalFarm(tmp_path / "a", bin=old, flags=flags) as a:
        for name in ("token", "join-token"):
            shutil.copy(a.data / name, tmp_path / "b" / "data" / name)
        with LocalFarm(tmp_path / "b", bin=old, flags=flags) as b:
            yield a, b


def worker_of_both(pair, programs, **options):
    a, b = pair
    return add_worker(a, programs, "--coordinator", f"127.0.0.1:{b.grpc}", **options)


def test_coordinators_that_share_a_redis_are_replaced_one_after_the_other(pair, redis, alone, old, new):
    a, b = pair
    workers = [worker_of_both(pair, old) for _ in range(2)]
    jobs = {a.submit(SCENE, **LONG): a, b.submit(SCENE, **LONG): b}
    progress = {job: at.wait_for_progress(job, 5)["units_done"] for job, at in jobs.items()}

    for one, other in ((a, b), (b, a)):
        replace_coordinator(one, new)
        wait_until(lambda other=other: len(other.get("/api/v1/workers")["workers"]) > 0, "the other one is there")

    for job, at in jobs.items():
        assert at.has(job), "a coordinator that is back in time keeps its jobs"
        assert at.job(job)["units_done"] >= progress[job]
        assert redis.ask("HGET", f"lightshaft:job:{job}", "fence") == "1"
        assert at.pixels(job) == alone(old, LONG)
        assert build_of(at, job) == version(old)
    for worker in workers:
        assert worker.terminate() == 0
        worker_of_both(pair, new)
    fresh = b.submit(SCENE, **SHORT)
    assert b.pixels(fresh) == alone(new, SHORT)


def test_a_new_coordinator_takes_over_an_old_ones_jobs_and_the_other_way_round(pair, redis, alone, old, new):
    a, b = pair
    worker_of_both(pair, old)
    first, second = b.submit(SCENE, **LONG), a.submit(SCENE, **LONG)
    change(a, second, state="paused")  # so that it has not ended when its coordinator does
    b.wait_for_progress(first, 5)
    replace_coordinator(a, new)
    unknown = a.submit(SCENE, **SHORT, denoise="true")
    wait_until(lambda: redis.ask("HGET", f"lightshaft:job:{unknown}", "owner"), "Redis is told")

    b.coordinator.kill()
    wait_until(lambda: a.has(first), "the new one has the old one's job")
    assert a.pixels(first) == alone(old, LONG)
    assert build_of(a, first) == version(old)

    b.start_coordinator()
    wait_until(lambda: redis.ask("HGET", f"lightshaft:job:{second}", "record"), "Redis is told")
    a.coordinator.kill()
    wait_until(lambda: b.has(second), "the old one has the new one's job")
    change(b, second, state="running")
    assert b.pixels(second) == alone(old, LONG)

    # A job that the old one cannot read stays the new one's.
    assert not b.has(unknown)
    a.start_coordinator()
    wait_until(lambda: a.has(unknown), "it is there again")
    worker_of_both(pair, new)
    assert a.pixels(unknown) == alone(new, SHORT)
