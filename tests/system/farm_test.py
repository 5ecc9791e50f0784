"""One image, whatever happens to the farm: the same pixels_sha256 from any number of workers and threads, through kills of
workers and coordinator. With fake workers: their pixels are a pure function of the unit, so any unit that is lost, doubled,
swapped or folded out of order changes the digest."""

import random

import pytest
from local_farm import SCENE, wait_until

SPEC = dict(spp=24, seed=5)
DELAY = ("--fake-delay", 15)  # milliseconds a unit: slow enough to be hit in flight


@pytest.mark.parametrize("workers, threads", [(1, 2), (2, 1), (5, 1)])
def test_the_pixels_do_not_depend_on_workers_or_threads(farm, expected, workers, threads):
    farm.add_workers(workers, threads=threads)

    assert farm.pixels(farm.submit(SCENE, **SPEC)) == expected


def test_another_seed_gives_other_pixels(farm, expected):
    farm.add_worker()

    assert farm.pixels(farm.submit(SCENE, **dict(SPEC, seed=6))) != expected


def test_workers_killed_at_random_change_nothing(farm, expected):
    dice = random.Random(20240601)
    farm.add_workers(3, *DELAY)
    job = farm.submit(SCENE, **SPEC)
    total = farm.job(job)["units_total"]
    for kill in range(6):
        farm.wait_for_progress(job, total * kill // 8)
        victim = dice.choice([w for w in farm.workers if w.alive()])
        victim.kill()
        farm.add_worker(*DELAY)

    assert farm.pixels(job) == expected


def test_the_coordinator_killed_twice_changes_nothing(farm, expected):
    farm.add_workers(2, *DELAY)
    job = farm.submit(SCENE, **SPEC)
    total = farm.job(job)["units_total"]
    for part in (4, 2):
        before = farm.wait_for_progress(job, total // part)["units_done"]
        farm.restart_coordinator()
        assert farm.job(job)["units_done"] >= before, "what was accepted is lost"

    assert farm.pixels(job) == expected


def test_a_worker_that_is_frozen_holds_nothing_up_and_its_late_results_change_nothing(farm, expected):
    sleeper = farm.add_worker(*DELAY)
    farm.wait_for_workers(1)
    job = farm.submit(SCENE, **SPEC)
    farm.wait_for_progress(job, 3)
    sleeper.stop()
    farm.add_worker(*DELAY)
    total = farm.job(job)["units_total"]
    farm.wait_for_progress(job, total // 2)
    sleeper.resume()

    assert farm.pixels(job) == expected


def test_a_drained_worker_ends_cleanly_and_what_it_finished_counts(farm, expected):
    leaver = farm.add_worker(*DELAY, threads=2)
    job = farm.submit(SCENE, **SPEC)
    farm.wait_for_progress(job, 5)

    assert leaver.terminate() == 0
    done = farm.job(job)["units_done"]
    assert done >= 5
    worker = next(w for w in farm.get("/api/v1/workers")["workers"] if w["name"] == leaver.name)
    assert worker["units_done"] == done
    farm.add_worker()
    assert farm.pixels(job) == expected


def test_workers_may_start_before_the_coordinator_and_wait_for_it(farm, expected):
    farm.coordinator.kill()
    farm.add_worker()
    wait_until(lambda: "trying again" in farm.workers[0].output(), "the worker says that nobody answers")
    farm.start_coordinator()

    assert farm.pixels(farm.submit(SCENE, **SPEC)) == expected
