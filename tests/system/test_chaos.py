"""A short version of tests/chaos/chaos.py: every storm once."""

import sys

import pytest
from local_farm import ROOT

sys.path.insert(0, str(ROOT / "tests" / "chaos"))

from chaos import expected_pixels, try_once  # noqa: E402
from storms import STORMS  # noqa: E402
from weather import Skip  # noqa: E402


@pytest.mark.slow
@pytest.mark.parametrize("name", STORMS)
def test_the_image_is_the_same_after(name):
    try:
        pixels, _, _, asked = try_once(name, f"7 {name}")
    except Skip as why:
        pytest.skip(str(why))
    assert pixels == expected_pixels(asked)
