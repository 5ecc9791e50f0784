"""Storms of Redis, of the line to it, and of coordinators that share it and take over each other's jobs.

Workers are fake: their pixels are a pure function of the unit, so any unit that is lost, doubled, swapped or folded out of order
changes the digest. What is random is drawn from the storm's seed.
"""

import contextlib

from chaos_kit import after
from cut_line import CutLine
from local_farm import SCENE, wait_until
from redis_server import RedisServer
from storm_list import storm


def redis_knows_all(farm):
    wait_until(lambda: (f := farm.figures())["lightshaft_redis_up"] == 1 and f["lightshaft_redis_jobs_behind"] == 0, "Redis is told all")


def record_is_done(redis, job):
    """A job's end is told a moment after it."""
    wait_until(lambda: '"state":"done"' in redis.ask("HGET", f"lightshaft:job:{job}", "record"), "Redis knows that the job is done")


@contextlib.contextmanager
def one_coordinator(s):
    with RedisServer(s.folder) as redis, CutLine(redis.port) as line, \
            s.farm(flags=["--store", f"redis://127.0.0.1:{line.port}/0"]) as farm:
        farm.fast_workers(3)
        farm.wait_for_workers(3)
        farm.submit_storm()
        farm.until_share(s.dice.uniform(.05, .5))
        yield farm, redis, line
        redis_knows_all(farm)
        record_is_done(redis, farm.storm_job)


# ---- one coordinator ----

@storm
def redis_frozen_for_a_while(s):
    with one_coordinator(s) as (farm, redis, _):
        redis.freeze()
        after(s.dice.uniform(2, 6))
        redis.resume()
        yield farm


@storm
def the_line_to_redis_cut_and_mended(s):
    with one_coordinator(s) as (farm, _, line):
        for loud in s.dice.sample((False, True), 2):
            line.cut(loud)
            after(s.dice.uniform(1, 4))
            line.mend()
        yield farm


@storm
def redis_comes_back_older(s):
    """As after a failover to a replica that was behind."""
    with one_coordinator(s) as (farm, redis, _):
        redis_knows_all(farm)
        redis.ask("SAVE")
        farm.until_share(s.dice.uniform(.5, .9))
        later = farm.submit(SCENE, spp=2)
        redis_knows_all(farm)
        redis.kill()
        redis.start()
        yield farm
        farm.wait_for_job(later)
        record_is_done(redis, later)


# ---- several coordinators ----

@contextlib.contextmanager
def two_coordinators(s):
    """The first one has the storm's job, and workers that go to the other one when it is dead; the other one a worker of its own."""
    with RedisServer(s.folder) as redis:
        options = dict(flags=["--shared", "--store", redis.url, "--blobs", s.folder / "blobs"], secrets=s.folder / "secrets")
        with s.farm("a", **options) as a, s.farm("b", **options) as b:
            a.submit_storm()  # first: a worker that has nothing to do looks elsewhere
            a.fast_workers(2, "--coordinator", f"127.0.0.1:{b.grpc}")
            b.fast_worker()
            a.until_share(s.dice.uniform(.05, .5))
            wait_until(lambda: redis.ask("HGET", f"lightshaft:job:{a.storm_job}", "fence") == "1", "Redis knows whose the job is")
            yield a, b, redis


def taken_over(a, b):
    wait_until(lambda: b.has(a.storm_job), "the other one has the job")
    b.goes_on_with(a)
    return b


@storm
def the_owner_of_a_shared_job_killed(s):
    with two_coordinators(s) as (a, b, redis):
        a.coordinator.kill()
        yield taken_over(a, b)
        assert redis.ask("HGET", f"lightshaft:job:{a.storm_job}", "fence") == "2"


@storm
def the_owner_of_a_shared_job_frozen_until_another_took_it(s):
    """A zombie: it wakes, and knows of nothing."""
    with two_coordinators(s) as (a, b, redis):
        a.coordinator.stop()
        heir = taken_over(a, b)
        a.coordinator.resume()
        yield heir
        wait_until(lambda: a.ask(f"/api/v1/jobs/{a.storm_job}")[0] == 307, "it has dropped the job")
        assert redis.ask("HGET", f"lightshaft:job:{a.storm_job}", "fence") == "2"
        record_is_done(redis, a.storm_job)


@storm
def redis_comes_back_with_an_older_fence(s):
    """It says that the job is still the dead owner's, who comes back, too."""
    with two_coordinators(s) as (a, b, redis):
        redis.ask("SAVE")
        a.coordinator.kill()
        heir = taken_over(a, b)
        heir.until_share(s.dice.uniform(.05, .5))
        redis.kill()
        redis.start()
        a.start_coordinator()
        yield heir
        redis_knows_all(heir)
        record_is_done(redis, a.storm_job)
        wait_until(lambda: not a.has(a.storm_job), "the first owner has not kept it")
