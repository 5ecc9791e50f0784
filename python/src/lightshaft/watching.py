"""Follows a job until it ends: progress for callables and terminals, picture and curve for notebooks."""

from __future__ import annotations

import dataclasses
import html
import sys
import time
from collections.abc import Callable
from typing import Any, TypeAlias

from . import models, snapshot
from .errors import JobCancelled, JobFailed, LightshaftError, MissingPackage, WaitTimeout
from .steps import Pause, Retry, Steps, get_job

POLL_SECONDS, LIVE_SECONDS = 0.25, 1.0

Progress: TypeAlias = Callable[[models.Job], Any] | bool | None


def wait(job: str, progress: Progress, timeout: float | None) -> Steps[models.Job]:
    """Returns the job when it is done. Polls through restarts of the coordinator."""
    report = _printer() if progress is True else progress or None

    def show(view: models.Job) -> Steps[None]:
        if report:
            report(view)
        yield from ()

    return _follow(job, show, timeout, POLL_SECONDS)


def live(job: str, interval: float) -> Steps[models.Job]:
    """Shows the job below the calling cell and updates it until the job ends."""
    try:
        from IPython.display import display
    except ImportError:
        raise MissingPackage(
            "job.live() needs IPython: run it in a notebook, or pip install 'lightshaft[notebook]'; "
            "job.wait(progress=True) does not need it"
        ) from None
    handle: Any = None
    shown: Any = None

    def show(view: models.Job) -> Steps[None]:
        nonlocal handle, shown
        state = (view["state"], view.get("units_done"), view.get("progress"))
        if state == shown:
            return
        now = yield from snapshot.of_view(view)
        shown = state
        if handle is None:
            handle = display(now, display_id=True)  # type: ignore[no-untyped-call]
        else:
            handle.update(now)

    return (yield from _follow(job, show, None, interval))


def _follow(
    job: str, show: Callable[[models.Job], Steps[None]], timeout: float | None, interval: float
) -> Steps[models.Job]:
    deadline = None if timeout is None else time.monotonic() + timeout
    retry = Retry()
    while True:
        try:
            view = yield from get_job(job)
            yield from show(view)
            retry.answered()
            pause = Pause(interval)
        except LightshaftError as error:
            pause = retry.pause(error)
        else:
            if view["state"] in snapshot.ENDED:
                return _ended(view)
        if deadline is not None and time.monotonic() >= deadline:
            raise WaitTimeout(f"job {job} has not ended within {timeout:g} s; it continues")
        yield pause


def _ended(view: models.Job) -> models.Job:
    if view["state"] == "done":
        return view
    why = f": {view['error']}" if view.get("error") else ""
    if view["state"] == "cancelled":
        raise JobCancelled(f"job {view['id']} was cancelled{why}")
    raise JobFailed(f"job {view['id']} has failed{why}")


@dataclasses.dataclass(frozen=True)
class Bar:
    """Shows the progress of a job in a notebook as a bar and a line."""

    view: models.Job

    def __repr__(self) -> str:
        return snapshot.summary(self.view)

    def _repr_html_(self) -> str:
        progress = self.view.get("progress")
        value = progress if isinstance(progress, (int, float)) else 0
        return (
            f'<progress value="{value:.3f}" max="1" style="width:240px;vertical-align:middle"></progress> '
            f"{html.escape(repr(self))}"
        )


def _in_notebook() -> bool:
    """Returns True if a notebook shows the output of this process. It shows the standard error stream as an error."""
    module = sys.modules.get("IPython")
    shell = module.get_ipython() if module is not None else None
    return shell is not None and hasattr(shell, "kernel")


def _displayed() -> Callable[[models.Job], None]:
    """Shows a bar below the cell, in one place."""
    from IPython.display import display

    handle: Any = None

    def show(view: models.Job) -> None:
        nonlocal handle
        if handle is None:
            handle = display(Bar(view), display_id=True)  # type: ignore[no-untyped-call]
        else:
            handle.update(Bar(view))

    return show


def _printer() -> Callable[[models.Job], None]:
    """Shows a bar in a notebook. Otherwise writes to the standard error stream: one line that is rewritten in a
    terminal, or one line for each change."""
    if _in_notebook():
        return _displayed()
    last = ""

    def show(view: models.Job) -> None:
        nonlocal last
        line = snapshot.summary(view)
        ended = view["state"] in snapshot.ENDED
        if sys.stderr.isatty():
            print(f"\r\x1b[K{line}", end="\n" if ended else "", file=sys.stderr, flush=True)
        elif line != last:
            print(line, file=sys.stderr, flush=True)
        last = line

    return show
