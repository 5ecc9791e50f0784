"""README's table of figures is that of the races in docs/measurements/benchmarks, and its means and intervals are right."""

import csv
import math

import pytest
from local_farm import ROOT

import measured


def share_within(t, freedom, steps=20000):
    """Of Student's law within t to either side: Simpson's rule, whose error is far below 1e-9 here."""
    scale = math.exp(math.lgamma((freedom + 1) / 2) - math.lgamma(freedom / 2)) / math.sqrt(freedom * math.pi)
    heights = [(1 + (t * k / steps) ** 2 / freedom) ** (-(freedom + 1) / 2) for k in range(steps + 1)]
    return 2 * scale * t / steps / 3 * (heights[0] + 4 * sum(heights[1:-1:2]) + 2 * sum(heights[2:-1:2]) + heights[-1])


def test_the_quantiles_hold_95_of_100():
    # Half a unit of the sixth digit, 5e-5 of 12.7 or 5e-6 of the others, at a density of at most 0.06 to either side.
    for freedom, t in enumerate(measured.T, 1):
        assert share_within(t, freedom) == pytest.approx(.95, abs=6e-7), freedom


def test_the_arithmetic_mean_shows_a_firefly_that_the_geometric_one_hides():
    seeds = [1., 1., 1., 1., 16.]

    assert measured.arithmetic(seeds)[0] == 4
    assert measured.geometric(seeds)[0] == pytest.approx(16 ** .2)


def test_an_interval_is_that_of_students_t():
    half = 4.30265 / math.sqrt(3)  # a standard deviation of 1 over three seeds

    assert measured.arithmetic([11., 12., 13.]) == pytest.approx((12, 12 - half, 12 + half))
    assert measured.geometric([math.e, math.e ** 2, math.e ** 3]) == pytest.approx([math.exp(2 + s * half) for s in (0, -1, 1)])


def test_a_ratio_of_means_is_paired_by_seed():
    ours = [1., 2., 3.]

    assert measured.ratio_of_means([2., 4., 6.], ours) == pytest.approx((2, 2, 2))
    middle, low, high = measured.ratio_of_means([6., 4., 2.], ours)
    # To first order seeds move the logarithm by 6/4 - 1/2, 0 and 2/4 - 3/2: a standard deviation of 1.
    assert (middle, low, high) == pytest.approx((2, 2 * math.exp(-4.30265 / math.sqrt(3)), 2 * math.exp(4.30265 / math.sqrt(3))))


def test_geometric_means_are_those_of_the_races_own_summary():
    ends = measured.read(measured.RACES)
    with open(measured.RACES / "summary.csv", newline="") as file:
        rows = list(csv.DictReader(file))

    assert len(rows) == sum(map(len, ends.values())) > 6
    for row in rows:
        lane = ends[row["scene"]][row["entrant"]]
        mean, low, high = measured.geometric([relmse for relmse, _, _ in lane.values()])
        # Both are written with six digits.
        assert [mean, low, high] == pytest.approx([float(row[k]) for k in ("relmse", "relmse_lo", "relmse_hi")], rel=2e-5), row


def test_the_readme_has_the_table_of_the_races():
    assert measured.between((ROOT / "README.md").read_text()) == measured.table()
