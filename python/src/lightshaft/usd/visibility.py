"""Which rays meet a prim, as other renderers' primvars say: those of Arnold, RenderMan and Karma."""

from __future__ import annotations

import math
import re
from typing import Any

from pxr import Usd, UsdGeom

from .problems import Problems

ALL = ("camera", "shadow", "reflection", "volume")
"""The rays that have a parameter here."""
ARNOLD = {  # ray: (bit of arnold:visibility, the ray here)
    "camera": (0x01, "camera"),
    "shadow": (0x02, "shadow"),
    "diffuse_transmit": (0x04, "reflection"),
    "specular_transmit": (0x08, "reflection"),
    "volume": (0x10, "volume"),
    "diffuse_reflect": (0x20, "reflection"),
    "specular_reflect": (0x40, "reflection"),
}
RENDERMAN = {"camera": ("camera",), "indirect": ("reflection", "volume"), "transmission": ("shadow",)}
KARMA = {
    "primary": "camera",
    "shadow": "shadow",
    "diffuse": "reflection",
    "reflect": "reflection",
    "refract": "reflection",
}
Told = dict[str, list[bool]]
"""For each ray here, whether the rays of another renderer that it stands for meet the prim."""
MATTE = ("arnold:matte", "ri:attributes:Ri:Matte")


class Visibility:
    """The parameters that a prim's primvars, its own or inherited ones, ask for."""

    def __init__(self, prim: Usd.Prim, time: Usd.TimeCode, problems: Problems) -> None:
        self._prim, self._time, self._problems = prim, time, problems
        self._primvars = UsdGeom.PrimvarsAPI(prim)
        told = (self._arnold(), self._renderman(), self._karma())
        self._hidden = [ray for ray in ALL if any(self._is_hidden(ray, one.get(ray, [])) for one in told)]
        self._matte = any(self._number(name) for name in MATTE)

    def of_shape(self) -> dict[str, Any]:
        flags: dict[str, Any] = {f"visible_{ray}": False for ray in self._hidden}
        return {**flags, "holdout": True} if self._matte else flags

    def of_light(self) -> dict[str, Any]:
        """Returns the parameters of an emitter that the camera does not see in any case."""
        return {f"visible_{ray}": False for ray in self._hidden if ray in ("reflection", "volume")}

    def of_sky(self) -> dict[str, Any]:
        return {f"visible_{ray}": False for ray in self._hidden if ray != "shadow"}

    def _value(self, name: str) -> Any:
        primvar = self._primvars.FindPrimvarWithInheritance(name)
        return primvar.Get(self._time) if primvar else None

    def _number(self, name: str) -> int | None:
        """Returns the value of a primvar that may be a bool or a number; None if there is none."""
        value = self._value(name)
        if value is None:
            return None
        if isinstance(value, (bool, int, float)) and math.isfinite(value):
            return int(value)
        self._problems.warn(self._prim, f"its primvar {name} has no effect: it is not a number")
        return None

    def _arnold(self) -> Told:
        told: Told = {}
        mask = self._number("arnold:visibility")
        for ray, (bit, ours) in ARNOLD.items():
            own = self._number(f"arnold:visibility:{ray}")
            seen = bool(own) if own is not None else mask is None or bool(mask & bit)
            told.setdefault(ours, []).append(seen)
        return told

    def _renderman(self) -> Told:
        told: Told = {}
        for ray, all_ours in RENDERMAN.items():
            value = self._number(f"ri:attributes:visibility:{ray}")
            if value is not None:
                told.update({ours: [bool(value)] for ours in all_ours})
        return told

    def _karma(self) -> Told:
        """Reads an expression such as "*", "primary|shadow", "-primary" or "* ^shadow". "" names no rays."""
        value = self._value("karma:object:rendervisibility")
        if value is None:
            return {}
        words = [word for word in re.split(r"[\s|&,]+", str(value)) if word]
        names = [word.lstrip("-^") for word in words]
        unknown = [name for name in names if name not in ("*", "volume", *KARMA)]
        if unknown:
            self._problems.warn(
                self._prim,
                f"its primvar karma:object:rendervisibility has no effect: it names {unknown[0]!r}",
            )
            return {}
        without = [word[0] in "-^" for word in words]
        on = set(KARMA) if words and all(without) else set()
        volume = bool(words)
        for name, off in zip(names, without):
            named = set(KARMA) if name == "*" else {name}
            on = on - named if off else on | named
            volume = volume and not (off and name in ("*", "volume"))
        told: Told = {"volume": [volume]}
        for ray, ours in KARMA.items():
            told.setdefault(ours, []).append(ray in on)
        return told

    def _is_hidden(self, ray: str, told: list[bool]) -> bool:
        if any(told) and not all(told):
            self._problems.warn(
                self._prim,
                "hidden from some of the rays that surfaces reflect or refract has no effect: one parameter "
                "(visible_reflection) is for all of them",
            )
        return bool(told) and not any(told)
