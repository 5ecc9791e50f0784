"""Reads the EXR images of the farm into arrays."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenEXR

from .errors import BadAnswer, NotFound

MAX_SIDE = 32_768  # pixels, as the farm allows
MAX_VALUES = 1 << 31  # pixels times channels that are decoded
ORDER = "RGBAXYZUV"

Array = npt.NDArray[Any]


def decode_layers(data: bytes) -> dict[str, Array]:
    """Returns {layer: values}, with shape (h, w) for one channel and (h, w, n) for more. Channels are in the order
    R G B A, X Y Z or U V. Halves become float32 without loss; counts stay integers. The colour is called 'color'."""
    try:
        named = set()
        for part in OpenEXR.File(io.BytesIO(data), header_only=True).parts:
            _check_size(part.header)
            named |= {channel.name for channel in part.header["channels"]}
        parts = OpenEXR.File(io.BytesIO(data), separate_channels=True).parts
        pixels = {name: channel.pixels for part in parts for name, channel in part.channels.items()}
        # The library leaves out, with a warning, the parts that it cannot read.
        if any(pixels.get(name) is None for name in named):
            raise BadAnswer("the farm's image is cut off or damaged: some of its layers have no pixels")
    except BadAnswer:
        raise
    except Exception as error:  # the library's errors have no common class
        raise BadAnswer(f"the farm's image cannot be read: {error}") from error
    layers: dict[str, dict[str, Array]] = {}
    for name, values in pixels.items():
        layer, _, channel = name.rpartition(".")
        if not layer and name not in tuple("RGBA"):
            layer = name  # 'spp'
        layers.setdefault(layer or "color", {})[channel] = values
    return {layer: _stacked(parts) for layer, parts in sorted(layers.items())}


def layer_of(layers: Mapping[str, Array], name: str) -> Array:
    if name not in layers:
        raise NotFound(f"the image has no layer {name!r}; it has {', '.join(layers)}")
    return np.ascontiguousarray(layers[name], dtype=np.float32)


def _check_size(header: Mapping[str, Any]) -> None:
    low, high = (np.asarray(corner, dtype=np.int64) for corner in header["dataWindow"])
    width, height = (int(side) for side in high - low + 1)
    channels = header["channels"]
    if not (
        0 < width <= MAX_SIDE
        and 0 < height <= MAX_SIDE
        and width * height * len(channels) <= MAX_VALUES
    ):
        raise BadAnswer(
            f"the image claims {width} x {height} pixels and {len(channels)} channels, more than a farm's images have"
        )
    if any(channel.xSampling != 1 or channel.ySampling != 1 for channel in channels):
        raise BadAnswer(
            "the image has channels of another size than its own, which no image of a farm has"
        )


def _stacked(parts: Mapping[str, Array]) -> Array:
    ordered = [parts[name] for name in sorted(parts, key=lambda name: (ORDER.find(name), name))]
    values = ordered[0] if len(ordered) == 1 else np.stack(ordered, axis=-1)
    return values.astype(np.float32) if values.dtype == np.float16 else values
