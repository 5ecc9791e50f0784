"""The data of a race: its conditions, and what each entrant had at each moment."""

from dataclasses import dataclass, field
from typing import NamedTuple


class Conditions(NamedTuple):
    """The same for all entrants."""

    time: float  # of each lane, in seconds on the race's clock
    clock: str  # "wall", or "cpu": CPU seconds of all threads over their number, as a quiet machine's wall would show
    threads: int
    most_spp: int | None  # samples per pixel; None: no limit
    size: tuple[int, int]

    def seconds(self, wall: float, cpu: float) -> float:
        return wall if self.clock == "wall" else cpu / self.threads


class Point(NamedTuple):
    """A picture that a lane had at some point of the race. Costs are all that the lane had used by then, but for loading the scene."""

    spp: float
    wall: float
    cpu: float
    seconds: float  # on the race's clock
    last: bool
    estimate: tuple[float, float, float] | None  # relMSE and its 95 % interval, as the render itself estimates them
    # Errors against the reference. A value that is not positive: the noise of the reference hides the error.
    mse: float
    relmse: float


class Lane(NamedTuple):
    entrant: int
    seed: int  # from 0
    points: list[Point]


class Failure(NamedTuple):
    entrant: int
    why: str


@dataclass
class Race:
    scene: str
    conditions: Conditions
    entrants: list[str]
    lanes: list[Lane] = field(default_factory=list)  # of entrants that did not fail, ordered by seed, then by entrant
    failures: list[Failure] = field(default_factory=list)
    reference: str = ""  # in words
    reference_noise: float = 0.0  # relMSE of the mean of the two reference pictures; 0: there is only one
    notes: list[str] = field(default_factory=list)


@dataclass
class Results:
    machine: str  # processor and cores, in words
    others: float  # share of all cores' time that other programs had; negative: unknown
    build: str  # the Lightshaft that ran the races
    seeds: int
    first_seed: int
    races: list[Race] = field(default_factory=list)
