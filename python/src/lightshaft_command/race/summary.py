"""The results of a race: for each entrant its final error, its efficiency and its curve of error over time. All are means over the seeds.

Errors, times and efficiencies are positive and vary by factors, so they are averaged as logarithms: the mean is geometric, and its
95 % interval is Student's t over the seeds, which are independent renders.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from lightshaft_command.race.model import Lane, Point, Race

OUTSIDE = 0.05


class Estimate(NamedTuple):
    """A mean and its 95 % interval, which is unbounded if there is only one value."""

    value: float
    lo: float
    hi: float


def student_inside(t: float, freedom: int) -> float:
    """P(|T| < t) by the finite series for whole degrees of freedom: Abramowitz and Stegun 26.7.3 and 26.7.4."""
    angle = math.atan(t / math.sqrt(freedom))
    odd = freedom % 2
    term = math.cos(angle) if odd else 1.0
    total = term if freedom > 1 else 0.0
    for k in range(2 + odd, freedom - 1, 2):
        term *= math.cos(angle) ** 2 * (k - 1) / k
        total += term
    return 2 / math.pi * (angle + math.sin(angle) * total) if odd else math.sin(angle) * total


def student_quantile(p: float, freedom: int) -> float:
    """x with P(|T| > x) = p."""
    lo, hi = 0.0, 1.0
    while student_inside(hi, freedom) < 1 - p:
        hi *= 2
    for _ in range(100):
        middle = (lo + hi) / 2
        lo, hi = (middle, hi) if student_inside(middle, freedom) < 1 - p else (lo, middle)
    return hi


def mean(values: Sequence[float]) -> Estimate | None:
    """None: there are no values, or they have no mean."""
    n = len(values)
    middle = sum(values) / n if n else math.nan
    if not math.isfinite(middle):
        return None
    if n == 1:
        return Estimate(middle, -math.inf, math.inf)
    squares = sum((v - middle) ** 2 for v in values)
    half = student_quantile(OUTSIDE, n - 1) * math.sqrt(squares / (n - 1) / n)
    return Estimate(middle, middle - half, middle + half)


def geometric_mean(values: Sequence[float]) -> Estimate | None:
    """None: there are no values, or one of them is not a positive finite number."""
    if not all(math.isfinite(v) and v > 0 for v in values):
        return None
    logs = mean([math.log(v) for v in values])
    return logs and Estimate(*(math.exp(v) if v < math.inf else v for v in logs))


def geometric_ratio(a: Sequence[float], b: Sequence[float]) -> Estimate | None:
    """Of a[i] / b[i]: what both have in common at the same i, such as the machine's speed at that time, cancels."""
    if len(a) != len(b) or not all(math.isfinite(v) and v > 0 for v in (*a, *b)):
        return None
    return geometric_mean([x / y for x, y in zip(a, b, strict=True)])


def log_slope(points: Sequence[tuple[float, float]]) -> float | None:
    """The exponent s of error ~ seconds^-s, by least squares through the logarithms: 1 for squared errors of independent samples.

    None: fewer than three points have positive time and error, or all of them have the same time.
    """
    logs = [(math.log(t), math.log(e)) for t, e in points if math.isfinite(t) and t > 0 and math.isfinite(e) and e > 0]
    if len(logs) < 3:
        return None
    x, y = (sum(axis) / len(logs) for axis in zip(*logs, strict=True))
    xx, xy = sum((t - x) ** 2 for t, _ in logs), sum((t - x) * (e - y) for t, e in logs)
    return -xy / xx if xx > 0 else None


class Row(NamedTuple):
    """An entrant at the end of the race."""

    entrant: int
    seeds: int
    spp: float
    seconds: float
    relmse: Estimate | None  # against the reference
    efficiency: Estimate | None  # 1 / (relMSE x seconds)
    slope: Estimate | None  # s of relMSE ~ seconds^-s, fitted to points at doubling sample counts
    ratio: Estimate | None  # the first entrant's efficiency over this one's; None for the first itself
    spread: float  # the largest final relMSE of the seeds over the smallest: large if few pixels dominate the error


def lanes_of(race: Race, entrant: int) -> list[Lane]:
    return [lane for lane in race.lanes if lane.entrant == entrant and lane.points]


def _doublings(lane: Lane) -> list[tuple[float, float]]:
    """Points at doubling sample counts, the last one first: each further point has at most half the samples of the one before."""
    out, following = [], math.inf
    for p in reversed(lane.points):
        if 2 * p.spp <= following:
            following = p.spp
            out.append((p.seconds, p.relmse))
    return out


def _slope_of(lanes: Sequence[Lane]) -> Estimate | None:
    slopes = [slope for slope in map(log_slope, map(_doublings, lanes)) if slope is not None]
    return mean(slopes) if len(slopes) == len(lanes) else None


def rows_of(race: Race) -> list[Row]:
    """One row for each entrant that finished."""
    rows: list[Row] = []
    first: list[float] = []
    for entrant in range(len(race.entrants)):
        lanes = lanes_of(race, entrant)
        if not lanes:
            continue
        ends = [lane.points[-1] for lane in lanes]

        def at_end(value: Callable[[Point], float], ends: list[Point] = ends) -> list[float]:
            return [value(p) for p in ends]

        errors = at_end(lambda p: p.relmse)
        efficiencies = at_end(lambda p: 1 / (p.relmse * p.seconds) if p.relmse * p.seconds else math.inf)
        spp, seconds = (geometric_mean(values) for values in (at_end(lambda p: p.spp), at_end(lambda p: p.seconds)))
        ratio = geometric_ratio(first, efficiencies) if first else None
        spread = max(errors) / min(errors) if min(errors) > 0 else math.inf
        rows.append(Row(entrant, len(lanes), spp.value if spp else 0.0, seconds.value if seconds else 0.0, geometric_mean(errors),
                        geometric_mean(efficiencies), _slope_of(lanes), ratio, spread))  # fmt: skip
        if entrant == 0:
            first = efficiencies
    return rows


class CurveAt(NamedTuple):
    spp: float
    seconds: float
    relmse: Estimate


def curve_of(race: Race, entrant: int) -> list[CurveAt]:
    """The error of an entrant over time: one point for each sample count that at least half of the seeds have reached, and one for the ends.

    A point is omitted if the error of any of its seeds is hidden by the noise of the reference.
    """
    lanes = lanes_of(race, entrant)
    groups: dict[float, list[Point]] = {}
    for lane in lanes:
        for p in lane.points:
            groups.setdefault(math.inf if p.last else p.spp, []).append(p)  # the ends of all seeds, whatever their samples
    out = []
    for _, points in sorted(groups.items()):
        if 2 * len(points) < len(lanes):
            continue
        spp, seconds, relmse = (geometric_mean([getattr(p, what) for p in points]) for what in ("spp", "seconds", "relmse"))
        if spp and seconds and relmse:
            out.append(CurveAt(spp.value, seconds.value, relmse))
    return out
