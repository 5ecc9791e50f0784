"""Mixes of light groups: the light of each group multiplied by factors, as if its lamps were brighter or of another
colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np

from .errors import NotFound, RequestRejected
from .images import Array

Factor: TypeAlias = float | Sequence[float]
"""One number, or three for red, green and blue."""
Mix: TypeAlias = Mapping[str, Factor | Mapping[str, Factor]]
"""{light group: factor}, or {light group: {"surface": factor, "volume": factor}}: `volume` is for light that was last
scattered in a medium, `surface` for all other light of the group. What is not named keeps its light."""

PREFIX, VOLUME, DELTA = "RGB_", ".volume", ".delta"


def mix(layers: Mapping[str, Array], factors: Mix) -> tuple[Array, Array]:
    """Mixes the light groups of an image, layers as of Job.layers(). Returns the colour and its standard error, both
    (height, width, 3) in float32. The two halves of the samples are mixed alike, and half of their difference has
    the error of the mix, with the covariances of the groups."""
    groups = [
        name.removeprefix(PREFIX) for name in layers if name.startswith(PREFIX) and "." not in name
    ]
    if not groups:
        raise NotFound("the image has no light groups; submit its job with aov=['light_groups']")
    for name in factors:
        if name not in groups:
            raise NotFound(f"the image has no light group {name!r}; it has {', '.join(groups)}")
    sums = [np.zeros(layers[PREFIX + groups[0]].shape, np.float64) for _ in range(2)]
    for group in groups:
        surface, volume = _factors(group, factors.get(group, 1.0))
        apart = bool(np.any(surface != volume))
        if apart and PREFIX + group + VOLUME not in layers:
            raise NotFound(
                "the image does not have the light of media apart; submit its job with aov=['volume_light_groups']"
            )
        for total, half in zip(sums, ("", DELTA)):
            total += surface * layers[PREFIX + group + half]
            if apart:
                total += (volume - surface) * layers[PREFIX + group + VOLUME + half]
    return sums[0].astype(np.float32), np.abs(sums[1]).astype(np.float32)


def _factors(group: str, value: Factor | Mapping[str, Factor]) -> tuple[Array, Array]:
    if not isinstance(value, Mapping):
        factor = _factor(group, value)
        return factor, factor
    if extra := set(value) - {"surface", "volume"}:
        raise RequestRejected(
            f"the light group {group!r} has factors for 'surface' and 'volume', not for {', '.join(map(repr, sorted(extra)))}"
        )
    return _factor(group, value.get("surface", 1.0)), _factor(group, value.get("volume", 1.0))


def _factor(group: str, value: Factor) -> Array:
    try:
        factor = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        factor = np.zeros(0)
    if factor.shape not in ((), (3,)) or not np.all(np.isfinite(factor) & (factor >= 0)):
        raise RequestRejected(
            f"the factor of the light group {group!r} must be a number that is not negative, or three of them, not {value!r}"
        )
    return factor
