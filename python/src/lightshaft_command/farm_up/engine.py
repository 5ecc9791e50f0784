"""The interface between `lightshaft farm up` and an engine, which runs its workers: Slurm, ssh, Docker or Kubernetes.

Whatever can list, start and end instances of one program can be an engine.
"""

import contextlib
import pathlib
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

from lightshaft_command.programs import Problem

# waiting: the engine has accepted the worker and will start it, or start it again; stuck: it will not, or not soon
State = Literal["waiting", "running", "stuck"]


@dataclass
class Worker:
    """A worker from the engine's point of view. A worker that has ended is not listed."""

    id: str  # the engine's; unique among the workers that the engine lists
    state: State = "waiting"
    seconds: float = 0.0  # since its last start
    cores: int = 1  # that the engine has reserved for it


class Engine(Protocol):
    """Each method raises Problem if the engine does not do it."""

    version: str  # of the engine, "slurm-wlm 22.05.8" say

    def workers(self) -> list[Worker]:
        """The workers that this farm-up started, now or in an earlier run. A Problem means that they are unknown, not that there are none."""

    def start(self, count: int) -> Sequence[str]:
        """Starts up to `count` workers; their ids, since one may end before it is ever listed. After a Problem, some may have been started."""

    def drain(self, workers: Sequence[Worker]) -> None:
        """Asks workers to deliver their results and end. Those that have not started yet are withdrawn."""

    def kill(self, workers: Sequence[Worker]) -> None: ...


@dataclass
class Command:
    """How a worker is started, by any engine."""

    farm: str  # name of this farm-up
    program: str  # path of lightshaft-worker on the workers' machines
    coordinator: str  # HOST:PORT under which these machines reach the coordinator
    token_file: str  # file that contains the join token
    threads: int = 1
    options: list[str] = field(default_factory=list)  # more of the worker, one word each


def worker_name(farm: str, id: str) -> str:
    """The name under which the coordinator shows the worker."""
    return f"{farm}-{id}"


def new_id() -> str:
    """The id of a new worker in a container."""
    return secrets.token_hex(4)


def ids_of(workers: Sequence[Worker], running: bool) -> list[str]:
    """The ids of the workers that run, or of those that do not."""
    return [w.id for w in workers if (w.state == "running") == running]


def keep_log(folder: str, name: str, text: str) -> None:
    """Writes the log of a worker that has ended. If that fails, the log is lost: the worker is removed in any case."""
    with contextlib.suppress(OSError):
        pathlib.Path(folder, f"{name}.log").write_text(text, errors="surrogateescape")


def first_line(text: str) -> str:
    """Of a command's output: its version, or the reason why it failed."""
    return text.partition("\n")[0]


class Unreadable(Problem):
    """A program answered with something that this one does not understand."""
