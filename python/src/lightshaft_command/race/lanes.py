"""Lets integrators render in turns: each lane is a process, `lightshaft race-lane`, that renders for about a second at each request."""

import pathlib
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from lightshaft_command.programs import Problem, Rejected
from lightshaft_command.race.model import Conditions, Failure
from lightshaft_command.race.tool import Conversation


class Turn(NamedTuple):
    """The state of a racer before its next turn. Times are in seconds on the race's clock."""

    done: bool
    used: float
    expected: float  # duration of the next turn; 0: unknown


class Made(NamedTuple):
    """A picture of a lane, not yet measured."""

    spp: float
    wall: float
    cpu: float
    last: bool
    estimate: tuple[float, float, float]
    picture: str  # its file


@dataclass
class Ran:
    """A lane at its end."""

    entrant: int
    seed: int
    pictures: list[Made]
    halves: list[str]  # files of the means of the even and of the odd samples of the last picture
    notes: list[str]


class Racer(Protocol):
    """What renders one lane. Each method raises Problem if it fails; the racer then gets no more turns."""

    def next(self) -> Turn: ...
    def take_turn(self) -> None: ...
    def end(self) -> tuple[list[Made], list[str], list[str]]:
        """Pictures, halves and notes; the racer has ended."""

    def close(self) -> None: ...


class LaneProcess:
    """Begins to read the scene; ready() waits until it is loaded. Problem: the process was killed."""

    def __init__(self, program: str, scene: str, options: Sequence[str], name: str, folder: pathlib.Path):
        self._errors = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115
        self._talk = Conversation([program, "race-lane", *options, f"--folder={folder}", f"--name={name}", "--", scene], self._errors)
        self._turn: Turn | None = None

    def ready(self) -> Any:
        """What the scene and its integrator are. Rejected: the scene cannot be rendered."""
        return self._answer()

    def _answer(self) -> Any:
        answer = self._talk.answer()
        if answer is None:
            code = self._talk.process.wait()
            if code < 0:
                raise Problem(f"its process was killed by signal {-code}")
            self._errors.seek(0)
            shown = self._errors.read().decode(errors="replace")
            raise Rejected(code if code in (1, 2) else 1, shown or f"lightshaft: error: the render ended with exit code {code}\n")
        return answer

    def _ask(self, request: str) -> Any:
        self._talk.tell(request)
        return self._answer()

    def next(self) -> Turn:
        if self._turn is None:
            self._turn = Turn(**self._ask("begin"))
        return self._turn

    def take_turn(self) -> None:
        self._turn = Turn(**self._ask("turn"))

    def end(self) -> tuple[list[Made], list[str], list[str]]:
        answer = self._ask("end")
        self.close()
        pictures = []
        for p in answer["points"]:
            relmse, lo, hi = (float("nan") if v is None else v for v in p.pop("estimate"))
            pictures.append(Made(**p, estimate=(relmse, lo, hi)))
        return pictures, answer["halves"], answer["notes"]

    def close(self) -> None:
        self._talk.close()
        self._errors.close()


def next_turn(turns: Sequence[Turn], lap: int) -> int | None:
    """The index of the racer that runs next: the one with the smallest used + expected / 2, the middle of its next turn on its own clock.

    So racers take turns and use equal times. Among equals the first from index `lap` on, cyclically, runs, so that no racer always goes
    first. None: all are done.
    """
    waiting = [i for k in range(len(turns)) if not turns[i := (k + lap) % len(turns)].done]
    return min(waiting, key=lambda i: turns[i].used + turns[i].expected / 2, default=None)


def run_heat(racers: dict[int, Racer], seed: int, failures: list[Failure]) -> list[Ran]:
    """Lets the racers of one seed, by their entrants, render in turns to the end. Those that fail are closed and added to `failures`."""
    turns: dict[int, Turn] = {}

    def tried(entrant: int, action: Callable[[], None]) -> None:
        try:
            action()
            turns[entrant] = racers[entrant].next()
        except Problem as problem:
            failures.append(Failure(entrant, str(problem)))
            racers.pop(entrant).close()
            turns.pop(entrant, None)

    for entrant in list(racers):
        tried(entrant, lambda: None)
    lap = seed
    while (at := next_turn(list(turns.values()), lap)) is not None:
        entrant = list(turns)[at]
        tried(entrant, racers[entrant].take_turn)
        lap += 1
    ran = []
    for entrant, racer in racers.items():
        try:
            ran.append(Ran(entrant, seed, *racer.end()))
        except Problem as problem:
            failures.append(Failure(entrant, str(problem)))
    return ran


def run_lanes(entrants: int, seeds: int, make: Callable[[int, int], Racer], begins: Callable[[int], None], failures: list[Failure]) -> list[Ran]:
    """Runs all lanes, seed after seed. `make` makes the racer of an entrant and a seed; `begins` is called with each seed.

    If a racer fails, its entrant leaves the race and all its lanes are removed; the others continue.
    """
    lanes: list[Ran] = []
    for seed in range(seeds):
        if len({f.entrant for f in failures}) == entrants:
            break
        racers: dict[int, Racer] = {}
        try:
            for entrant in range(entrants):
                if entrant in [f.entrant for f in failures]:
                    continue
                try:
                    racers[entrant] = make(entrant, seed)
                except Problem as problem:
                    failures.append(Failure(entrant, str(problem)))
            begins(seed)
            lanes += run_heat(racers, seed, failures)
        finally:
            for racer in racers.values():
                racer.close()
    failed = {f.entrant for f in failures}
    return [lane for lane in lanes if lane.entrant not in failed]


def options_of(conditions: Conditions, integrator: str, seed: int, others: Sequence[str]) -> list[str]:
    """The options of `race-lane`. `others`: -D and --strict as the user gave them."""
    own = [f"--time={conditions.time!r}", f"--clock={conditions.clock}", f"--threads={conditions.threads}", f"--seed={seed}", *others]
    if conditions.most_spp is not None:
        own.append(f"--spp={conditions.most_spp}")
    if conditions.size != (0, 0):
        own.append(f"--size={conditions.size[0]}x{conditions.size[1]}")
    return [*own, f"--integrator={integrator}"] if integrator else own


