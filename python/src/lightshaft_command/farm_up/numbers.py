"""Reads numbers in text strictly: without blanks, signs of plus, underscores, and words such as "inf"."""

import math
import re

from lightshaft_command.programs import Usage


def read_whole(text: str) -> int | None:
    """A whole number of 0 or more."""
    return int(text) if re.fullmatch("[0-9]{1,18}", text) else None


def read_number(text: str) -> float | None:
    if not re.fullmatch(r"-?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?", text):
        return None
    value = float(text)
    return value if math.isfinite(value) else None


def whole_option(option: str, text: str, least: int, most: int) -> int:
    value = read_whole(text)
    if value is None or not least <= value <= most:
        raise Usage(f"{option} '{text}': it must be a whole number from {least} to {most}")
    return value


def positive_option(option: str, text: str, most: float) -> float:
    value = read_number(text)
    if value is None or not 0 < value <= most:
        raise Usage(f"{option} '{text}': it must be a number above 0, at most {most:.9g}")
    return value
