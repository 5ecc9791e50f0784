"""The scene: a dictionary in the style of Mitsuba's load_dict, whose keys are paths of prims."""

from __future__ import annotations

from typing import Any

from .files import Files


def colour(values: list[float]) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(x) for x in values]}


def reference(identifier: str) -> dict[str, Any]:
    return {"type": "ref", "id": identifier}


class Document:
    def __init__(self, files: Files) -> None:
        self.files = files
        self.scene: dict[str, Any] = {"type": "scene"}
        self._counts: dict[str, int] = {}

    def define(self, wanted: str, value: dict[str, Any]) -> str:
        """Adds an object under an unused id like `wanted` and returns the id."""
        identifier, count = wanted, self._counts.get(wanted, 1)
        while identifier in self.scene:
            count += 1
            identifier = f"{wanted} {count}"
        self._counts[wanted] = count
        self.scene[identifier] = value
        return identifier
