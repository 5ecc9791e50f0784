"""A farm whose jobs are kept in Redis: whatever of Redis, coordinator and its database goes, the image has the same bits."""

import shutil

import pytest
from local_farm import SCENE, LocalFarm, refused_coordinator, wait_until

SPEC = dict(spp=64, seed=3)


@pytest.fixture
def redis_farm(redis, tmp_path):
    with LocalFarm(tmp_path, flags=["--store", redis.url]) as farm:
        yield farm


def metric(farm, name):
    for line in farm.request("GET", "/metrics").decode().splitlines():
        if line.startswith(name + " "):
            return float(line.split()[1])
    return None


def told(farm):
    wait_until(lambda: metric(farm, "lightshaft_redis_up") == 1 and metric(farm, "lightshaft_redis_jobs_behind") == 0, "Redis knows all")


def forget_database(farm):
    for file in farm.data.glob("jobs.sqlite*"):
        file.unlink()


def test_a_job_survives_redis_and_coordinator_killed_together(redis, redis_farm, expected):
    redis_farm.add_worker("--fake-delay", 10)
    job = redis_farm.submit(SCENE, **SPEC)
    redis_farm.wait_for_progress(job, 5)

    redis_farm.coordinator.kill()
    redis.kill()
    redis.start()
    redis_farm.start_coordinator()

    assert redis_farm.pixels(job) == expected
    told(redis_farm)
    assert redis.ask("HGET", f"lightshaft:job:{job}", "record").find('"state":"done"') > 0


def test_a_job_goes_on_while_redis_is_away(redis, redis_farm, expected):
    redis.kill()
    redis_farm.add_worker()

    job = redis_farm.submit(SCENE, **SPEC)

    assert redis_farm.pixels(job) == expected
    wait_until(lambda: metric(redis_farm, "lightshaft_redis_up") == 0, "it is noticed")
    assert metric(redis_farm, "lightshaft_redis_jobs_behind") >= 1
    redis.start()
    told(redis_farm)


def test_a_lost_database_comes_back_from_redis_and_goes_on_with_the_partials(redis, redis_farm, expected):
    redis_farm.add_worker("--fake-delay", 10)
    job = redis_farm.submit(SCENE, **SPEC)
    redis_farm.wait_for_progress(job, 5)
    told(redis_farm)

    redis_farm.coordinator.kill()
    forget_database(redis_farm)
    redis_farm.start_coordinator()

    assert redis_farm.job(job)["units_done"] >= 5, "what was accepted is not rendered again"
    assert redis_farm.pixels(job) == expected


def test_a_lost_image_is_rendered_again_to_the_same_bits(redis, redis_farm, expected):
    redis_farm.add_worker()
    job = redis_farm.submit(SCENE, **SPEC)
    assert redis_farm.pixels(job) == expected
    told(redis_farm)

    redis_farm.coordinator.kill()
    forget_database(redis_farm)
    shutil.rmtree(redis_farm.data / "jobs")
    redis_farm.start_coordinator()

    wait_until(lambda: redis_farm.job(job)["state"] == "done" and (redis_farm.data / "jobs" / job / "image.exr").exists(), "it is rendered again")
    assert redis_farm.pixels(job) == expected


def test_a_job_whose_files_are_lost_says_which_and_goes_on_when_they_are_sent_again(redis, redis_farm, expected):
    job = redis_farm.submit(SCENE, **SPEC)
    told(redis_farm)

    redis_farm.coordinator.kill()
    shutil.rmtree(redis_farm.data / "blobs")
    redis_farm.start_coordinator()

    view = redis_farm.job(job)
    assert view["state"] == "paused"
    assert "it waits for its" in view["error"] and "scene.xml" in view["error"]
    redis_farm.submit(SCENE, spp=2)
    redis_farm.add_worker()
    assert redis_farm.pixels(job) == expected


def test_a_removed_job_stays_removed(redis, redis_farm):
    redis_farm.add_worker()
    job = redis_farm.submit(SCENE, spp=4)
    redis_farm.wait_for_job(job)
    told(redis_farm)
    kept = redis.ask("HGET", f"lightshaft:job:{job}", "record")

    redis_farm.request("DELETE", f"/api/v1/jobs/{job}")
    wait_until(lambda: redis.ask("SISMEMBER", "lightshaft:jobs", job) == "0", "Redis is told")
    redis_farm.coordinator.kill()
    redis.ask("SADD", "lightshaft:jobs", job)
    redis.ask("HSET", f"lightshaft:job:{job}", "revision", "1", "record", kept)
    redis_farm.start_coordinator()

    assert redis_farm.get("/api/v1/jobs")["jobs"] == []


@pytest.mark.parametrize("store, said", [
    ("redis://127.0.0.1:1", "no answer from redis://127.0.0.1:1/0"),
    ("redis://127.0.0.1:x", "port cannot be read"),
    ("rediss://127.0.0.1", "TLS"),
    ("postgres://db", "unknown"),
])
def test_a_store_that_cannot_be_used_is_refused_with_a_reason(tmp_path, store, said):
    assert said in refused_coordinator(tmp_path, "--store", store)
