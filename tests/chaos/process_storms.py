"""Storms of processes: killed, frozen, slow, drained; at random, and at every step of a unit's life.

Workers are fake: their pixels are a pure function of the unit, so any unit that is lost, doubled, swapped or folded out of order
changes the digest. What is random is drawn from the storm's seed.
"""

import signal

from chaos_kit import after
from local_farm import wait_until
from redis_server import RedisServer
from storm_list import storm


def kill_and_replace(farm, victim):
    victim.kill()
    farm.fast_worker()


# ---- processes ----

@storm
def nothing_happens(s):
    with s.farm() as farm:
        farm.fast_workers(3)
        farm.submit_storm()
        yield farm


@storm
def workers_killed_at_random(s):
    with s.farm() as farm:
        farm.fast_workers(3)
        farm.submit_storm()
        for _ in range(6):
            farm.until_share(s.dice.uniform(0, .9))
            kill_and_replace(farm, s.dice.choice([w for w in farm.workers if w.alive()]))
        yield farm


@storm
def coordinator_killed_at_random(s):
    with s.farm() as farm:
        farm.fast_workers(3)
        farm.submit_storm()
        for share in sorted(s.dice.uniform(0, .9) for _ in range(3)):
            farm.until_share(share)
            before = farm.job(farm.storm_job)["units_done"]
            farm.restart_coordinator()
            assert farm.job(farm.storm_job)["units_done"] >= before, "what was accepted is lost"
        yield farm


@storm
def redis_killed_at_random(s):
    with RedisServer(s.folder) as redis, s.farm(flags=["--store", redis.url]) as farm:
        farm.fast_workers(3)
        farm.submit_storm()
        for share in sorted(s.dice.uniform(0, .9) for _ in range(3)):
            farm.until_share(share)
            redis.kill()
            farm.until_share(min(1, share + .1))
            redis.start()
        yield farm


@storm
def coordinator_redis_and_workers_killed_together(s):
    with RedisServer(s.folder) as redis, s.farm(flags=["--store", redis.url]) as farm:
        farm.fast_workers(3)
        farm.submit_storm()
        farm.until_share(s.dice.uniform(0, .9))
        for process in farm.workers:
            process.kill()
        redis.kill()
        farm.coordinator.kill()
        redis.start()
        farm.start_coordinator()
        farm.fast_workers(3)
        yield farm


@storm
def workers_drained_by_SIGTERM(s):
    with s.farm() as farm:
        farm.fast_workers(3, threads=2)
        farm.submit_storm()
        for _ in range(3):
            farm.until_share(s.dice.uniform(.05, .8))
            # One that has rendered something. (A worker that leaves with its first lease still under way to it never
            # sees that, and its units are told as those of a lost one.)
            known = {w["name"] for w in farm.get("/api/v1/workers")["workers"] if w["units_done"] > 0}
            leaver = s.dice.choice([w for w in farm.workers if w.alive() and w.name in known])
            farm.fast_worker(threads=2)
            assert leaver.terminate() == 0, f"{leaver.name}: {leaver.output()}"
        yield farm
        # Finished units of a drained worker are handed in: nobody rendered a unit that was not asked for again.
        freed = {k: v for k, v in farm.figures().items() if k.startswith("lightshaft_units_freed_total")}
        assert freed['lightshaft_units_freed_total{cause="worker lost"}'] == 0, freed


@storm
def a_worker_frozen_until_others_have_done_its_units(s):
    with s.farm() as farm:
        zombie = farm.fast_worker()
        farm.submit_storm()
        farm.until_share(s.dice.uniform(.02, .3))
        zombie.stop()
        farm.fast_worker()
        farm.until_share(1)
        zombie.resume()
        yield farm


@storm
def a_worker_frozen_until_its_leases_have_passed(s):
    with s.farm() as farm:
        zombie = farm.fast_worker()
        farm.submit_storm()
        farm.until_share(s.dice.uniform(.02, .3))
        zombie.stop()
        wait_until(lambda: farm.figures()['lightshaft_units_freed_total{cause="deadline passed"}'] > 0, "its leases pass")
        farm.fast_worker()
        zombie.resume()
        yield farm


@storm
def the_coordinator_frozen_for_a_while(s):
    with s.farm() as farm:
        farm.fast_workers(2)
        farm.submit_storm()
        farm.until_share(s.dice.uniform(.1, .6))
        farm.coordinator.stop()
        after(3)
        farm.coordinator.resume()
        yield farm


@storm
def one_slow_worker_among_fast_ones(s):
    with s.farm() as farm:
        farm.add_worker("--fake-delay", 2000)
        farm.fast_workers(2)
        farm.wait_for_workers(3)
        farm.submit_storm()
        yield farm


# ---- steps of a unit's life ----

COORDINATOR_STEPS = ["lease-sent", "result-arrived", "result-checked", "result-appended", "result-durable", "result-folded",
                     "result-acknowledged", "checkpoint-stored", "snapshot-written", "image-written", "job-done"]
WORKER_STEPS = ["lease-received", "unit-rendered", "result-sent", "acknowledged-seen"]
ONCE_A_JOB = {"checkpoint-stored": 4, "snapshot-written": 1, "image-written": 1, "job-done": 1}


def killed_at(step):
    return {"LIGHTSHAFT_KILL_AT": f"{step}"}


def coordinator_killed_at(step):
    def run(s):
        with s.farm(environment=killed_at(f"{step}:{s.dice.randint(1, ONCE_A_JOB.get(step, 30))}")) as farm:
            farm.submit_storm()
            farm.fast_workers(3)
            wait_until(lambda: farm.again() < 0 or not farm.coordinator.alive(), f"the coordinator comes to {step}")
            assert farm.coordinator.popen.returncode == -signal.SIGKILL
            farm.environment = {}
            farm.start_coordinator()
            yield farm
    run.__name__ = f"coordinator killed at {step}"
    storm(run)


def worker_killed_at(step):
    def run(s):
        with s.farm() as farm:
            victim = farm.fast_worker(environment=killed_at(f"{step}:{s.dice.randint(1, 5)}"))
            farm.wait_for_workers(1)
            farm.submit_storm()
            wait_until(lambda: farm.again() < 0 or not victim.alive(), f"the worker comes to {step}")
            assert victim.popen.returncode == -signal.SIGKILL
            farm.fast_workers(3)
            yield farm
    run.__name__ = f"worker killed at {step}"
    storm(run)


for _step in COORDINATOR_STEPS:
    coordinator_killed_at(_step)
for _step in WORKER_STEPS:
    worker_killed_at(_step)


# ---- lies ----

def quarantined(farm):
    return [w for w in farm.get("/api/v1/workers")["workers"] if w["activity"].startswith("quarantined")]


def a_liar(percent, spec):
    def run(s):
        with s.farm(flags=["--audit-percent", percent]) as farm:
            farm.fast_workers(2)
            liar = farm.fast_worker("--fake-fault", "wrong")
            farm.wait_for_workers(3)
            farm.submit_storm(**spec)
            yield farm
            assert [w["name"] for w in quarantined(farm)] == [liar.name], "the liar is found, and nobody else"
    run.__name__ = f"a worker that returns wrong pixels, audits of {percent} %"
    storm(run)


a_liar(10, {})
a_liar(1, {"size": "768x512"})  # 1920 units, a third of them the liar's: all of them pass 1 % unseen once in 600
