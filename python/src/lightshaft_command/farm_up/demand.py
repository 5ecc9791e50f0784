"""Reads the coordinator's answers: what work waits, what it has cost, and which workers there are."""

from dataclasses import dataclass
from typing import Any

from lightshaft_command.farm_up import fields
from lightshaft_command.farm_up.costs import JobCost, Spending, WorkerCost
from lightshaft_command.farm_up.scaler import Demand


@dataclass
class Ours:
    """The workers of this farm-up: their names begin with "FARM-", and they run on `engine`."""

    farm: str
    engine: str

    def has(self, worker: Any) -> bool:
        return fields.text(worker, "name").startswith(self.farm + "-")


def demand_of(jobs: Any, workers: Any, ours: Ours, spending: Spending) -> Demand:
    """Adds the costs in the answers to GET /api/v1/jobs and GET /api/v1/workers to `spending`.

    Returns how much work waits, without the work of jobs whose budget is used up.
    """
    job_list, worker_list = fields.elements(jobs, "jobs"), fields.elements(workers, "workers")
    spending.observe(
        [JobCost(fields.text(job, "id"), fields.text(job, "name"), fields.text(job, "owner"), _positive(job, "core_seconds")) for job in job_list],
        [WorkerCost(fields.text(worker, "id"), ours.engine if ours.has(worker) else "others", _positive(worker, "cpu_seconds")) for worker in worker_list],
    )
    demand = Demand()
    _read_jobs(job_list, spending, demand)
    for worker in worker_list:
        if fields.text(worker, "state") != "connected":
            continue
        if not ours.has(worker):
            demand.other_threads += fields.whole(worker, "threads", 0)
            continue
        demand.joined.add(fields.text(worker, "name"))
        if not fields.text(worker, "job"):
            demand.idle.add(fields.text(worker, "name"))
    return demand


def _positive(value: Any, key: str) -> float:
    return max(0.0, fields.number(value, key) or 0.0)


def _read_jobs(jobs: list[Any], spending: Spending, demand: Demand) -> None:
    forecast = helps = False
    left_of_user: dict[str, float] = {}
    for job in jobs:
        if fields.text(job, "state") not in ("queued", "running"):
            continue
        owner = fields.text(job, "owner")
        left_of_user.setdefault(owner, spending.left_of_user(owner))
        left = min(left_of_user[owner], spending.left_of_job(fields.text(job, "id")))
        if left <= 0:
            demand.unpaid_jobs += 1
            continue
        demand.open_jobs += 1
        queued = min(left, _positive(job, "queued_core_seconds"))
        demand.queued_core_seconds += queued
        left_of_user[owner] -= queued
        if fields.number(job, "eta_seconds") is None:
            helps = True  # without a forecast, assume that more workers help
            continue
        forecast = True
        helps = helps or isinstance(fields.at(job, "eta_with_more"), dict)
    demand.more_helps = not forecast or helps
