"""The costs of `lightshaft farm up`, in core seconds.

The sums are kept in a file, so that the next run with the same --name continues them. The classes are pure state machines: they
read no clock and send no requests.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Self

from lightshaft_command.farm_up import fields
from lightshaft_command.farm_up.engine import Unreadable, Worker

CORE_HOUR = 3600.0  # in core seconds


@dataclass
class _Line:
    seconds: float
    cores: int


class Ledger:
    """Adds up the core seconds that workers have reserved at the engine."""

    def __init__(self) -> None:
        self._running: dict[str, _Line] = {}
        self._unlisted: dict[str, int] = {}  # cores of workers that were started since the last list
        self._ended = 0.0  # core seconds of workers that have ended
        self.started_count = 0  # workers that have started to run; one that the engine requeued and ran again counts again

    def observe(self, workers: Sequence[Worker], elapsed: float) -> None:
        """Adds the cost since the previous call, `elapsed` seconds ago. `workers` is the engine's present list.

        A worker that is no longer in it is charged for all of `elapsed`, since the time of its end is unknown.
        """
        now: dict[str, _Line] = {}
        for w in workers:
            self._unlisted.pop(w.id, None)
            if w.state != "running":
                continue
            before = self._running.get(w.id)
            # If the worker has run for a shorter time than at the previous call, its earlier run has ended, and the engine has
            # started it again.
            if before and w.seconds >= before.seconds:
                del self._running[w.id]
            else:
                self.started_count += 1
            now[w.id] = _Line(w.seconds, w.cores)
        self._ended += sum((line.seconds + elapsed) * line.cores for line in self._running.values())
        self._running = now
        self._ended += elapsed * sum(self._unlisted.values())
        self.started_count += len(self._unlisted)
        self._unlisted.clear()

    def started(self, ids: Iterable[str], cores: int) -> None:
        """Adds workers that the engine has just started. One that the next list lacks has run and ended in between."""
        for id in ids:
            self._unlisted.setdefault(id, cores)

    def core_seconds(self) -> float:
        return self._ended + sum(line.seconds * line.cores for line in self._running.values())

    def to_json(self) -> dict[str, Any]:
        return {"ended_core_seconds": self._ended, "started": self.started_count, "running": {id: asdict(line) for id, line in self._running.items()}}

    @classmethod
    def from_json(cls, value: Any) -> Self:
        ended, running = fields.number(value, "ended_core_seconds"), fields.at(value, "running")
        if ended is None or not isinstance(running, dict):
            raise Unreadable("it has no sum of core seconds")
        ledger = cls()
        ledger._ended = ended
        ledger.started_count = fields.whole(value, "started", 0)
        for id, line in running.items():
            seconds = fields.number(line, "seconds")
            if seconds is None:
                raise Unreadable(f"the worker {id} has no seconds")
            ledger._running[id] = _Line(seconds, fields.whole(line, "cores", 1))
        return ledger


@dataclass
class Budgets:
    """Upper limits in core seconds; None: no limit."""

    job: float | None = None  # of each job
    user: float | None = None  # of each user that is not in `users`
    users: dict[str, float] = field(default_factory=dict)  # by user name; "": the administrator


@dataclass
class JobCost:
    id: str
    name: str
    owner: str  # "": the administrator
    core_seconds: float  # spent on rendering since the job was submitted


@dataclass
class WorkerCost:
    id: str
    engine: str
    core_seconds: float  # spent on rendering since the worker was started


@dataclass
class _Job:
    name: str = ""
    owner: str = ""
    before: float = 0.0  # core seconds before the first observe(), which are not counted
    now: float = 0.0

    def spent(self) -> float:
        return self.now - self.before


@dataclass
class _Process:
    engine: str = ""
    earlier: float = 0.0  # core seconds of earlier processes with the same id
    before: float = 0.0  # as in _Job, but only of the process that runs now
    now: float = 0.0


class Spending:
    """Adds up the core seconds that each job and each user has cost, from the coordinator's reports, and compares them with the budgets.

    Costs before the first report are not counted. A job or worker that the coordinator has forgotten keeps its most recent sum.
    """

    def __init__(self, budgets: Budgets | None = None):
        self._budgets = budgets or Budgets()
        self._begun = False
        self._jobs: dict[str, _Job] = {}
        self._workers: dict[str, _Process] = {}

    def observe(self, jobs: Iterable[JobCost], workers: Iterable[WorkerCost]) -> None:
        for cost in jobs:
            job = self._jobs.setdefault(cost.id, _Job(before=0.0 if self._begun else cost.core_seconds))
            job.name, job.owner = cost.name, cost.owner
            # A coordinator that was killed may have lost the latest results, and then reports less. The core seconds were still
            # spent, so a sum never falls.
            job.now = max(job.now, cost.core_seconds)
        for spent in workers:
            worker = self._workers.setdefault(spent.id, _Process(before=0.0 if self._begun else spent.core_seconds))
            worker.engine = spent.engine
            # A worker that reports less than before was restarted. What its earlier process has cost is kept.
            if spent.core_seconds < worker.now:
                worker.earlier += worker.now - worker.before
                worker.before = 0.0
            worker.now = spent.core_seconds
        self._begun = True

    def of_job(self, id: str) -> float:
        return self._jobs[id].spent() if id in self._jobs else 0.0

    def of_user(self, owner: str) -> float:
        return sum(job.spent() for job in self._jobs.values() if job.owner == owner)

    def left_of_job(self, id: str) -> float:
        """The core seconds that remain: infinity without a budget; 0 or less if the budget is used up."""
        return math.inf if self._budgets.job is None else self._budgets.job - self.of_job(id)

    def left_of_user(self, owner: str) -> float:
        budget = self._budgets.users.get(owner, self._budgets.user)
        return math.inf if budget is None else budget - self.of_user(owner)

    def report(self) -> dict[str, Any]:
        """Core hours by job, by user and by engine."""
        by_job: dict[str, Any] = {}
        by_user: dict[str, float] = defaultdict(float)
        by_engine: dict[str, float] = defaultdict(float)
        for id, job in self._jobs.items():
            if job.now <= job.before:
                continue
            user = job.owner or "admin"
            by_job[id] = {"name": job.name, "user": user, "core_hours": job.spent() / CORE_HOUR}
            by_user[user] += job.spent() / CORE_HOUR
        for w in self._workers.values():
            by_engine[w.engine] += (w.earlier + w.now - w.before) / CORE_HOUR
        return {"by_job": by_job, "by_user": by_user, "by_engine": by_engine}

    def to_json(self) -> dict[str, Any]:
        return {"jobs": {id: asdict(job) for id, job in self._jobs.items()}, "workers": {id: asdict(w) for id, w in self._workers.items()}, "begun": self._begun}

    def go_on_from(self, value: Any) -> None:
        """Continues the sums of an earlier run, from its to_json()."""
        jobs, workers = fields.at(value, "jobs"), fields.at(value, "workers")
        if not isinstance(jobs, dict) or not isinstance(workers, dict):
            raise Unreadable("it has no sums of jobs and workers")
        for id, line in jobs.items():
            self._jobs[id] = _Job(fields.text(line, "name"), fields.text(line, "owner"), *_before_and_now(line, f"the job {id}"))
        for id, line in workers.items():
            earlier = fields.number(line, "earlier") or 0.0
            self._workers[id] = _Process(fields.text(line, "engine"), earlier, *_before_and_now(line, f"the worker {id}"))
        self._begun = fields.at(value, "begun") is True


def _before_and_now(line: Any, whose: str) -> tuple[float, float]:
    before, now = fields.number(line, "before"), fields.number(line, "now")
    if before is None or now is None:
        raise Unreadable(f"{whose} has no core seconds")
    return before, now
