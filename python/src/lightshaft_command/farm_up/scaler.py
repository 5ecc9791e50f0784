"""Decides how many workers `lightshaft farm up` should have on an engine.

It reads no clock and starts nothing: its inputs are demand, workers and time, its outputs are actions.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from lightshaft_command.farm_up.engine import Worker, worker_name

# A worker is started only if it can run for at least this many seconds within the budget.
WORTH_STARTING = 60.0
# Seconds until the next attempt after a failed start: FIRST_PAUSE after the first one, doubled by each further one.
FIRST_PAUSE, LONGEST_PAUSE = 5.0, 600.0


@dataclass
class Demand:
    """The coordinator's open work and its workers, as its HTTP interface reports them."""

    open_jobs: int = 0  # queued or running, with something left of their budgets
    unpaid_jobs: int = 0  # queued or running, but nothing is left of their budgets
    # Predicted cost of the work that no worker holds, as far as the budgets pay for it. The work of a job counts as 0 until workers
    # have measured its cost.
    queued_core_seconds: float = 0.0
    more_helps: bool = True  # False: by the coordinator's forecast, more workers would save no time
    other_threads: int = 0  # of connected workers that this command did not start
    joined: set[str] = field(default_factory=set)  # names of connected workers
    idle: set[str] = field(default_factory=set)  # names of the connected workers that hold no work


@dataclass
class Limits:
    farm: str
    most_workers: int = 1
    threads: int = 1  # of each worker
    finish_in: float = 600.0  # seconds in which the queued work should be rendered
    idle_seconds: float = 60.0  # a worker without work is drained after this time
    drain_seconds: float = 120.0  # a draining worker that has not ended after this time is killed
    poll_seconds: float = 5.0  # between two checks
    budget_core_seconds: float | None = None


@dataclass
class Actions:
    start: int = 0
    drain: list[Worker] = field(default_factory=list)
    kill: list[Worker] = field(default_factory=list)
    why: str = ""  # the reason, shown to the user; empty: there is nothing to report


@dataclass
class _Seen:
    joined: bool = False
    idle_since: float | None = None
    draining_since: float | None = None

    def useless(self) -> bool:
        return not self.joined and self.draining_since is None


class Scaler:
    def __init__(self, limits: Limits):
        self._limits = limits
        self._seen: dict[str, _Seen] = {}
        self._failures = 0
        self._no_start_before: float | None = None

    def decide(self, demand: Demand, workers: Sequence[Worker], spent: float, now: float) -> Actions:
        """`spent`: core seconds that our workers have cost so far. `workers`: all that the engine lists."""
        self._observe(demand, workers, now)
        budget = self._limits.budget_core_seconds
        reserved = sum(w.cores for w in workers) * self._seconds_to_end()
        if budget is not None and workers and spent + reserved >= budget:
            return self._end(workers, now, "the budget is used up, apart from what its workers need to deliver their work")
        if demand.open_jobs == 0 and demand.unpaid_jobs > 0:
            return self._end(workers, now, "the budgets of all open jobs or of their users are used up")
        out = Actions()
        want = self._wanted(demand)
        alive = sum(w.state != "stuck" and self._seen[w.id].draining_since is None for w in workers)
        if not demand.more_helps:
            want = min(want, max(alive, 0 if demand.other_threads > 0 else 1))
        for w in workers:
            seen = self._seen[w.id]
            if seen.draining_since is not None:
                continue
            surplus = w.state == "waiting" and alive > want
            idle = seen.idle_since is not None and now - seen.idle_since >= self._limits.idle_seconds
            if w.state == "stuck" or surplus or (idle and (alive > want or demand.open_jobs == 0)):
                alive -= w.state != "stuck"
                self._drain(w, out, now)
        self._kill_overdue(workers, out, now)
        if alive >= want:
            return out
        if self._no_start_before is not None and now < self._no_start_before:
            out.why = f"{self._failures} starts of workers in a row failed: the next is tried in {self._no_start_before - now:.0f} s"
            return out
        out.start = min(want - alive, self._affordable(workers, spent))
        if out.start == 0:
            out.why = "the budget allows no more workers"
        return out

    def end(self, workers: Sequence[Worker], now: float) -> Actions:
        """While the command is ending: starts no worker, drains all, and kills those that have not ended after drain_seconds."""
        return self._end(workers, now, "")

    def started(self, ids: Iterable[str]) -> None:
        """Must be called with the workers that the engine has started: one that the next list lacks has ended."""
        for id in ids:
            self._seen.setdefault(id, _Seen())

    def start_failed(self, now: float) -> None:
        """Must be called if the engine could not start workers. The next attempt is delayed, longer after each failure."""
        self._failures += 1
        self._no_start_before = now + min(LONGEST_PAUSE, FIRST_PAUSE * 2.0 ** min(self._failures - 1, 10))

    def drain_failed(self, workers: Sequence[Worker]) -> None:
        """Must be called if the engine could not ask these workers to drain. The request will be repeated."""
        for w in workers:
            self._seen[w.id].draining_since = None

    def _observe(self, demand: Demand, workers: Sequence[Worker], now: float) -> None:
        """Updates the list of workers. One that ended or got stuck before it joined the farm, without being drained, is a failed start."""
        present: dict[str, _Seen] = {}
        for w in workers:
            seen = self._seen.pop(w.id, _Seen())
            name = worker_name(self._limits.farm, w.id)
            if name in demand.joined:
                seen.joined = True
                self._failures = 0
                self._no_start_before = None
            if w.state != "running" or name not in demand.idle:
                seen.idle_since = None
            elif seen.idle_since is None:
                seen.idle_since = now
            present[w.id] = seen
        stuck = (present[w.id] for w in workers if w.state == "stuck")
        if any(seen.useless() for seen in [*self._seen.values(), *stuck]):
            self.start_failed(now)
        self._seen = present

    def _wanted(self, demand: Demand) -> int:
        if demand.open_jobs == 0:
            return 0
        threads = math.ceil(demand.queued_core_seconds / self._limits.finish_in) - demand.other_threads
        # If only this command runs workers, open jobs need at least one, even if no cost is predicted. The cost may be unknown until
        # a worker has measured it, and queued_core_seconds leaves out the work that workers hold.
        least = 0 if demand.other_threads > 0 else 1
        return max(least, min(math.ceil(threads / self._limits.threads), self._limits.most_workers))

    def _affordable(self, workers: Sequence[Worker], spent: float) -> int:
        """How many more workers the budget allows.

        What is left of it must pay every worker, existing or new, for WORTH_STARTING seconds and for the time that it takes to end.
        """
        if self._limits.budget_core_seconds is None:
            return self._limits.most_workers
        each = WORTH_STARTING + self._seconds_to_end()
        left = self._limits.budget_core_seconds - spent - each * sum(w.cores for w in workers)
        return max(0, int(min(self._limits.most_workers, left / (self._limits.threads * each))))

    def _seconds_to_end(self) -> float:
        """For how many more seconds, at most, a worker must be paid if the next check asks it to drain.

        These are the interval until that check, the time to drain, and another interval until its end is noticed.
        """
        return self._limits.drain_seconds + 2 * self._limits.poll_seconds

    def _end(self, workers: Sequence[Worker], now: float, why: str) -> Actions:
        out = Actions(why=why)
        for w in workers:
            if self._seen.setdefault(w.id, _Seen()).draining_since is None:
                self._drain(w, out, now)
        self._kill_overdue(workers, out, now)
        return out

    def _drain(self, worker: Worker, out: Actions, now: float) -> None:
        self._seen[worker.id].draining_since = now
        out.drain.append(worker)

    def _kill_overdue(self, workers: Sequence[Worker], out: Actions, now: float) -> None:
        for w in workers:
            since = self._seen[w.id].draining_since
            if since is not None and now - since >= self._limits.drain_seconds:
                out.kill.append(w)
