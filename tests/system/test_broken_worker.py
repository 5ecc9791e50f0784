"""Workers that cannot write their cache: emptied folders are made again; nobody waits for such a worker for ever; jobs say why they wait."""

import shutil

from local_farm import SCENE, LocalFarm, wait_until

JOB = dict(spp=8, size="64x64")  # 4 tiles of 3 rounds


def cache_of(farm, worker):
    return farm.folder / "cache" / worker.name


def put_in_the_way(farm, worker):
    """A file where its cache was: nothing can be written there."""
    shutil.rmtree(cache_of(farm, worker))
    cache_of(farm, worker).write_text("in the way")


def test_a_worker_whose_cache_was_removed_makes_it_again(farm):
    worker = farm.add_worker()
    farm.pixels(farm.submit(SCENE, **JOB))

    shutil.rmtree(cache_of(farm, worker))

    farm.pixels(farm.submit(SCENE, seed=2, **JOB))


def test_a_job_says_why_its_only_worker_renders_nothing_and_goes_on_when_it_can(farm):
    worker = farm.add_worker()
    farm.wait_for_workers(1)
    put_in_the_way(farm, worker)

    job = farm.submit(SCENE, **JOB)

    error = wait_until(lambda: farm.job(job)["error"], "the job says why it waits")
    assert "worker-1 was given its units" in error and "cannot get 'the scene'" in error, error
    cache_of(farm, worker).unlink()
    assert not farm.wait_for_job(job)["error"]


def test_a_job_ends_though_its_audits_could_only_go_to_such_a_worker(tmp_path):
    with LocalFarm(tmp_path, flags=["--audit-percent", "100"]) as farm:
        broken = farm.add_worker()
        farm.add_worker("--fake-delay", "100")  # slow enough for results to come while the other one is asked again
        farm.wait_for_workers(2)
        put_in_the_way(farm, broken)

        job = farm.submit(SCENE, spp=16, size="96x64")  # 6 tiles of 4 rounds

        farm.wait_for_job(job, patience=60)
        assert "not waited for" in farm.request("GET", f"/api/v1/jobs/{job}/log").decode()
