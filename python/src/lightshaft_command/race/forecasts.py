"""Checks forecasts of render times. They are made again from the measurements of a race, and compared with the actual times."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from lightshaft_command.race.model import Point, Race
from lightshaft_command.race.tool import Tool

SHARES = (0.5, 0.25, 0.125)
FIRST_SPP = 8


class Prediction(NamedTuple):
    entrant: int
    seed: int
    spp: float  # samples per pixel when the prediction was made
    spent: float  # core seconds
    target: float  # relMSE to be reached, as the render itself estimates it
    predicted: float  # remaining core seconds; lo and hi bound the 95 % interval
    lo: float
    hi: float
    actual: float | None  # that were needed; None: the render ended, later than `hi`, without reaching the target

    def within(self) -> bool:
        return self.actual is not None and self.lo <= self.actual <= self.hi


def predictions_of(race: Race, tool: Tool) -> list[Prediction]:
    """The forecasts of all renders, made at 8 samples per pixel and at each doubling after that.

    A forecast is included only if its interval ends before the render does. This condition does not depend on later measurements of the
    error, so it does not favour correct forecasts.
    """
    return [
        Prediction(lane.entrant, lane.seed, *prediction) for lane in race.lanes for prediction in _of_points([p for p in lane.points if p.estimate], tool)
    ]


def _of_points(points: Sequence[Point], tool: Tool) -> Iterator[tuple[float, float, float, float, float, float, float | None]]:
    wanted: float = FIRST_SPP
    for i, now in enumerate(points[:-1]):
        if now.spp < wanted or not now.estimate:
            continue
        wanted = 2 * now.spp
        for share in SHARES:
            target = share * now.estimate[0]
            forecast = tool.forecast(points[: i + 1], target)
            if forecast is None or forecast[2] > points[-1].cpu - now.cpu:
                continue
            reached = (p.cpu - now.cpu for p in points[i + 1 :] if p.estimate and p.estimate[0] <= target)
            yield now.spp, now.cpu, target, *forecast, next(reached, None)
