"""A short version of tests/chaos/chaos.py: every storm once."""

import pytest
from chaos import expected_pixels, try_once
from storms import STORMS
from weather import Skip


@pytest.mark.slow
@pytest.mark.parametrize("name", STORMS)
def test_the_image_is_the_same_after(name):
    try:
        pixels, _, _, asked = try_once(name, f"7 {name}")
    except Skip as why:
        pytest.skip(str(why))
    assert pixels == expected_pixels(asked)
