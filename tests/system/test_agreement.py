"""Agreement with other renderers: three verdicts, and docs/measurements/agreement.md has those of the figures that it prints."""

import re

import pytest
from local_farm import ROOT

from verdicts import AGREES, DIFFERS, TOO_FEW, verdict

FIGURE = re.compile(r"([+-]\d+\.\d+) ± (\d+\.\d+) %")


@pytest.mark.parametrize("channels, said", [
    ([(0, .001), (.002, .001), (-.003, .001)], AGREES),  # 0.3 % and twice 0.1 % end at the edge of 0.5 %
    ([(0, .001), (0, .001), (.0031, .001)], TOO_FEW),    # one channel reaches beyond
    ([(-.0196, .0237), (.0053, .0033), (0, .0006)], TOO_FEW),  # an interval of 5 % to either side holds everything
    ([(0, .001), (0, .001), (-.0069, .0007)], DIFFERS),  # 0.69 % less 0.14 %: no part of the interval is in the band
    ([(.01, .001), (0, .1), (0, .001)], DIFFERS),        # a noisy channel does not hide one that differs
    ([(0, float("inf"))], TOO_FEW),
])
def test_an_interval_within_the_band_agrees_one_outside_differs_and_one_across_its_edge_says_nothing(channels, said):
    assert verdict(channels) == said


def test_more_samples_decide_and_never_turn_a_verdict_round():
    for off, said in ((.002, AGREES), (.008, DIFFERS)):
        assert [verdict([(off, error)]) for error in (.01, .0001)] == [TOO_FEW, said]


def rows():
    for line in (ROOT / "docs" / "measurements" / "agreement.md").read_text().splitlines():
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)]
        figures = cells[-2].split(";")[0] if len(cells) > 4 else ""
        if "±" in figures:
            yield cells[1], cells[-3], [(float(off) / 100, float(error) / 100) for off, error in FIGURE.findall(figures)]


def test_the_page_has_the_verdicts_of_its_figures():
    found = list(rows())

    assert len(found) > 30 and all(channels for _, _, channels in found)
    assert [(scene, said) for scene, said, channels in found if said != verdict(channels)] == []
