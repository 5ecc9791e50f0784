"""Many jobs open at once, with workers that render: each must come to its end. Short rows of bench/open_jobs.py."""

import pytest
from local_farm import SCENE, wait_until
from open_jobs import measure

SMALL = dict(size="32x32", spp=16)  # four units a job


def all_done(farm, jobs, patience=60):
    """Waits until all of the farm's jobs are done, and says how far it came if they are not."""
    def listed():
        return farm.get(f"/api/v1/jobs?limit={jobs}")["jobs"]
    try:
        wait_until(lambda: all(job["state"] == "done" for job in listed()), f"{jobs} jobs are done", patience)
    except AssertionError:
        left = [job for job in listed() if job["state"] != "done"]
        raise AssertionError(f"{len(left)} of {jobs} jobs are not done; the first: {left[0]}") from None


def test_one_worker_renders_eighty_jobs_that_were_open_before_it_came(farm):
    for seed in range(80):
        farm.submit(SCENE, seed=seed, **SMALL)

    farm.add_worker(fake=False)

    all_done(farm, 80)
    returned = [line for line in farm.request("GET", "/metrics").decode().splitlines() if line.startswith('lightshaft_units_freed_total{cause="returned"}')]
    assert float(returned[0].rsplit(" ", 1)[1]) == 0, "the worker knew each job"


@pytest.mark.slow
@pytest.mark.parametrize("row", [dict(users=5), dict(restless=True), dict(big=True)], ids=["of five users", "with restless workers", "with big worlds"])
def test_many_jobs_come_to_their_end(row):
    jobs = 5 if "big" in row else 70

    assert measure("short", jobs, **row).ended == jobs
