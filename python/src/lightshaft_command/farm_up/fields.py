"""Reads fields of JSON that other programs wrote. A field may be missing or have the wrong type."""

import math
from typing import Any

MOST_WHOLE = 1 << 63


def at(value: Any, *keys: str | int) -> Any:
    """The value under a path of keys and indices; None if there is none."""
    for key in keys:
        if isinstance(value, dict) and key in value:
            value = value[key]
        elif isinstance(value, list) and isinstance(key, int) and key < len(value):
            value = value[key]
        else:
            return None
    return value


def text(value: Any, *keys: str | int) -> str:
    found = at(value, *keys)
    return found if isinstance(found, str) else ""


def number(value: Any, *keys: str | int) -> float | None:
    found = at(value, *keys)
    if not isinstance(found, int | float) or isinstance(found, bool):
        return None
    try:
        value = float(found)
    except OverflowError:  # a whole number with hundreds of digits
        return None
    return value if math.isfinite(value) else None


def whole(value: Any, key: str, otherwise: int) -> int:
    found = at(value, key)
    return found if isinstance(found, int) and not isinstance(found, bool) and abs(found) < MOST_WHOLE else otherwise


def elements(value: Any, key: str) -> list[Any]:
    found = at(value, key)
    return found if isinstance(found, list) else []
