"""Runs a farm-up: asks engine and coordinator, decides, acts, and keeps the report, until the user or the last job ends it."""

import contextlib
import os
import pathlib
import select
import signal
import sys
import time
from dataclasses import dataclass
from types import FrameType
from typing import Any, Protocol

from lightshaft_command.console import note
from lightshaft_command.farm_up import report
from lightshaft_command.farm_up.costs import CORE_HOUR, Budgets, Ledger, Spending
from lightshaft_command.farm_up.demand import Ours, demand_of
from lightshaft_command.farm_up.engine import Engine
from lightshaft_command.farm_up.scaler import Actions, Demand, Limits, Scaler
from lightshaft_command.files import check_file
from lightshaft_command.programs import Problem


class Asked(Protocol):
    """The coordinator."""

    def jobs(self) -> Any: ...
    def workers(self) -> Any: ...


@dataclass
class Settings:
    limits: Limits
    budgets: Budgets
    report: pathlib.Path
    until_done: bool = False  # end when every job has ended or used up its budget
    json: bool = False  # print the report as JSON at the end


class Pause:
    """The pause between two checks. A signal of the user ends it, and the farm-up; a second one ends this program at once."""

    def __init__(self) -> None:
        self._ended = False
        self._woken, self._wake = os.pipe()
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._on_signal)

    def wait(self, seconds: float) -> bool:
        """True if the user has asked for the end."""
        if self._ended:
            time.sleep(seconds)
        else:
            select.select([self._woken], [], [], seconds)
        return self._ended

    def ended(self) -> bool:
        """Whether the user has asked for the end."""
        return self._ended

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._ended:
            signal.signal(number, signal.SIG_DFL)
            os.kill(os.getpid(), number)
        self._ended = True
        os.write(self._wake, b"\0")
        with contextlib.suppress(OSError):  # not print(): this may interrupt another one
            os.write(sys.stderr.fileno(), b"lightshaft: stopping; once more ends at once\n")


class FarmUp:
    def __init__(self, coordinator: Asked, engine: Engine, settings: Settings):
        self._coordinator, self._engine, self._settings = coordinator, engine, settings
        self._scaler = Scaler(settings.limits)
        self._spending = Spending(settings.budgets)
        self._ledger = report.go_on_from(settings.report, settings.limits.farm, self._spending)
        check_file("--report", settings.report)
        self._demand: Demand | None = None
        self._last_list: float | None = None
        self._last_note = ""

    def run(self, pause: Pause) -> None:
        """Rejected: the coordinator has never answered."""
        ending = False
        while True:
            try:
                workers = self._engine.workers()
            except Problem as problem:
                self._note(f"the workers are unknown, nothing changes: {problem}")
            else:
                now = time.monotonic()
                self._ledger.observe(workers, 0.0 if self._last_list is None else now - self._last_list)
                self._last_list = now
                demand = self._ask()
                ending = ending or pause.ended() or (self._settings.until_done and demand.open_jobs == 0)
                if ending and not workers:
                    return self._finish()
                actions = self._scaler.end(workers, now) if ending else self._scaler.decide(demand, workers, self._ledger.core_seconds(), now)
                self._act(actions, pause)
                try:
                    report.write(self._settings.report, self._report())
                except Problem as problem:
                    self._note(str(problem))
            ending = pause.wait(self._settings.limits.poll_seconds) or ending

    def _ask(self) -> Demand:
        """How much work waits. While the coordinator does not answer, the number of workers does not change."""
        try:
            self._demand = demand_of(self._coordinator.jobs(), self._coordinator.workers(), Ours(self._settings.limits.farm, self._engine.version), self._spending)
        except Problem as problem:
            if self._demand is None:
                raise
            self._demand.more_helps = False
            self._demand.idle.clear()
            self._note(f"the coordinator does not answer, nothing changes: {problem}")
        return self._demand

    def _act(self, actions: Actions, pause: Pause) -> None:
        self._note(actions.why)
        if actions.drain:
            note(f"lightshaft: drains {len(actions.drain)} workers")
            try:
                self._engine.drain(actions.drain)
            except Problem as problem:
                self._scaler.drain_failed(actions.drain)
                self._note(str(problem))
        if actions.kill:
            note(f"lightshaft: ends {len(actions.kill)} workers that did not drain")
            try:
                self._engine.kill(actions.kill)
            except Problem as problem:
                self._note(str(problem))
        if actions.start and not pause.ended():
            note(f"lightshaft: starts {actions.start} workers")
            try:
                ids = self._engine.start(actions.start)
            except Problem as problem:
                self._scaler.start_failed(time.monotonic())
                self._note(str(problem))
            else:
                self._scaler.started(ids)
                self._ledger.started(ids, self._settings.limits.threads)

    def _note(self, text: str) -> None:
        """Prints a message only if it differs from the previous one."""
        if text and text != self._last_note:
            note(f"lightshaft: {text}")
        self._last_note = text

    def _hours(self) -> float:
        return self._ledger.core_seconds() / CORE_HOUR

    def _budget_hours(self) -> float | None:
        budget = self._settings.limits.budget_core_seconds
        return None if budget is None else budget / CORE_HOUR

    def _report(self) -> dict[str, Any]:
        return {
            "name": self._settings.limits.farm,
            "engine": self._engine.version,
            "spent_core_hours": self._hours(),
            "budget_core_hours": self._budget_hours(),
            "workers_started": self._ledger.started_count,
            "rendered_core_hours": self._spending.report(),
            "ledger": self._ledger.to_json(),
            "spending": self._spending.to_json(),
        }

    def _finish(self) -> None:
        last = self._report()
        report.write(self._settings.report, last)
        if self._settings.json:
            print(report.show(last), flush=True)
            return
        budget = self._budget_hours()
        of_budget = "" if budget is None else f" of {budget:.3f}"
        print(f"{self._engine.version}: {self._ledger.started_count} workers started, {self._hours():.3f} core hours spent{of_budget}")
        for user, hours in sorted(last["rendered_core_hours"]["by_user"].items()):
            print(f"{user}: {hours:.3f} core hours rendered")
        sys.stdout.flush()
