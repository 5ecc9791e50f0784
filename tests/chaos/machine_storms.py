"""Storms of machines: full disks, damaged files, clocks that jump; and scenes that bring the renderer down.

Workers are fake: their pixels are a pure function of the unit, so any unit that is lost, doubled, swapped or folded out of order
changes the digest. What is random is drawn from the storm's seed.
"""

import os

from chaos_kit import DELAY, SPEC, SmallDisk, flip_bytes
from local_farm import SCENE, wait_until
from storm_list import storm
from weather import Skip


@storm
def the_coordinators_disk_full(s):
    # A tmpfs in the place of its folder: big enough for the job, until somebody fills it.
    with SmallDisk(s.folder / "farm" / "data", 64) as disk, s.farm() as farm:
        farm.fast_workers(2)
        farm.submit_storm()
        farm.until_share(s.dice.uniform(.1, .5))
        disk.fill()
        view = wait_until(lambda: (v := farm.job(farm.storm_job))["state"] == "paused" and v, "the job waits for a person")
        assert "No space left" in (view["error"] or ""), view["error"]
        disk.free()
        farm.request("PATCH", f"/api/v1/jobs/{farm.storm_job}", b'{"state": "running"}')
        yield farm


@storm
def a_workers_disk_full(s):
    with SmallDisk(s.folder / "farm" / "cache", 2) as disk, s.farm() as farm:
        disk.fill()
        farm.fast_worker()
        farm.wait_for_workers(1)
        farm.submit_storm()
        wait_until(lambda: "trying again" in farm.workers[0].output() or "cannot" in farm.workers[0].output() or "No space" in farm.workers[0].output(),
                   "the worker says what it lacks")
        disk.free()
        farm.fast_worker("--cache", s.folder / "room")
        yield farm


@storm
def a_workers_cache_damaged(s):
    with s.farm() as farm:
        worker = farm.fast_worker()
        farm.submit_storm()
        farm.until_share(.1)
        worker.kill()
        for file in (farm.folder / "cache").rglob("*"):
            if file.is_file() and file.stat().st_size > 0:
                flip_bytes(file, s.dice)
        farm.count -= 1  # the same name and cache again
        farm.fast_worker()
        yield farm


@storm
def a_blob_of_the_coordinator_damaged(s):
    with s.farm() as farm:
        farm.submit_storm()
        for file in (farm.data / "blobs").glob("??/*"):
            flip_bytes(file, s.dice)
        farm.fast_workers(3)
        view = wait_until(lambda: (v := farm.job(farm.storm_job))["state"] == "paused" and v["error"] and v, "the job waits for its scene")
        assert "damaged" in view["error"], view["error"]
        # The same scene again brings the same blob; this job of it is not looked at.
        farm.submit(SCENE, **SPEC)
        yield farm


@storm
def partials_on_disk_damaged(s):
    with s.farm() as farm:
        farm.fast_workers(2)
        farm.submit_storm()
        farm.until_share(s.dice.uniform(.3, .7))
        farm.coordinator.kill()
        for file in (farm.data / "jobs" / farm.storm_job).rglob("*"):
            if file.is_file() and file.stat().st_size > 0:
                flip_bytes(file, s.dice)
        farm.start_coordinator()
        yield farm


@storm
def partials_on_disk_cut_short(s):
    with s.farm() as farm:
        farm.fast_workers(2)
        farm.submit_storm()
        farm.until_share(s.dice.uniform(.3, .7))
        farm.coordinator.kill()
        for file in (farm.data / "jobs" / farm.storm_job).rglob("*"):
            if file.is_file() and file.stat().st_size > 0:
                os.truncate(file, s.dice.randrange(file.stat().st_size))
        farm.start_coordinator()
        yield farm


# ---- clocks ----

FAKETIME = next((p for p in ("/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1", "/usr/lib/aarch64-linux-gnu/faketime/libfaketimeMT.so.1") if os.path.exists(p)), None)


@storm
def the_wall_clock_jumps_by_days(s):
    if not FAKETIME:
        raise Skip("clock jumps need Debian's package libfaketime")
    said = s.folder / "clock"
    said.write_text("+0")
    clock = {"LD_PRELOAD": FAKETIME, "FAKETIME_TIMESTAMP_FILE": str(said), "FAKETIME_DONT_FAKE_MONOTONIC": "1", "FAKETIME_NO_CACHE": "1",
             "DONT_FAKE_MONOTONIC": "1"}
    with s.farm() as farm:
        farm.coordinator.terminate()
        farm.environment = clock
        farm.start_coordinator()
        farm.fast_worker(environment=clock)
        farm.fast_worker()
        farm.submit_storm()
        for jump in ("+3d", "-5d"):
            farm.until_share(s.dice.uniform(0, .8))
            said.write_text(jump)
        yield farm
        days = {line[:10] for line in farm.coordinator.output().splitlines() if line[:2] == "20"}
        assert len(days) > 1, "the clock did not jump"


# ---- scenes that bring the renderer down ----

def bad_scene(fault, hang_after):
    def run(s):
        with s.farm() as farm:
            flags = ("--fake-delay", DELAY, "--fake-fault", f"{fault},seed=13,tile=2,round=1", "--hang-after", hang_after, "--memory-limit", 400_000_000)
            # A sound unit may be taken for hung on a busy machine; it fails only after three workers have failed at it.
            farm.add_workers(2, *flags, "--tags", "hasty")
            steady = farm.fast_worker()
            bad = farm.submit(SCENE, spp=24, seed=13, tags="hasty")
            farm.submit_storm()
            error = farm.wait_for_job(bad, states=("failed",))["error"]
            assert "--pixel 64,0" in error and "--sample" in error, f"no command to see it again: {error}"
            workers = {w["name"] for w in farm.get("/api/v1/workers")["workers"]} - {steady.name}
            assert len(workers) == 2 and all(f"on {w}: " in error for w in workers), error
            yield farm
            assert all(w.alive() for w in farm.workers)
    run.__name__ = f"beside a scene whose unit is a {fault}"
    storm(run)


for _fault, _hang in (("crash", 100), ("hang", 0.5), ("memory", 100)):
    bad_scene(_fault, _hang)
