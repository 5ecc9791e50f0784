"""A thin lens focuses on what a mirror shows by the length of the light's way, not by the mirror's distance."""

import pytest
from cli_kit import lightshaft
from local_farm import ROOT
from partial_pixels import green

SCENE = ROOT / "scenes" / "mirror_focus" / "scene.xml"
SIZE = (320, 240)
FRAME, CARD = slice(13, 18), slice(62, 67)  # rows of the image within one row of checks each


def steepest(image, rows):
    """The largest step between neighbouring pixels of a strip of checks, as a share of the step between its checks.

    A sharp edge falls within one pixel: into one step or two, one of which is at least half of it. Out of focus by the 2 of
    this scene at 4 and 6 an edge is spread by a disc of .24 x 2 / 6 at distance 4, or .24 x 2 / 4 at 6: both are 12.8 pixels
    wide (320 pixels see 2 tan(14 deg) per unit of distance), so the steepest pixel has 4 / (12.8 pi) = .10 of it. Noise of 64
    samples in 5 rows adds up to 4 x .5 / sqrt(320 / 2) = .16.
    """
    line = [sum(column) for column in zip(*image[rows])][80:240]
    return max(abs(a - b) for a, b in zip(line, line[1:])) / (max(line) - min(line))


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    def picture(focus):
        folder = tmp_path_factory.mktemp(f"focus{focus}")
        lightshaft("render", SCENE, "-D", f"focus={focus}", "--spp", 64, "-o", folder / "image.exr", "--partial-dir", folder / "partials")
        return green(folder / "partials", *SIZE)
    return {focus: picture(focus) for focus in (4, 6)}


def test_the_focus_at_the_length_of_the_way_makes_the_mirror_image_sharp(pictures):
    assert steepest(pictures[6], CARD) > .45
    assert steepest(pictures[6], FRAME) < .3


def test_the_focus_at_the_mirror_makes_its_frame_sharp_and_not_the_image(pictures):
    assert steepest(pictures[4], FRAME) > .45
    assert steepest(pictures[4], CARD) < .3
