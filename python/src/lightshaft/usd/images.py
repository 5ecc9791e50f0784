"""Images of textures: sent unchanged if possible, else converted and written to new files."""

from __future__ import annotations

import dataclasses
import io
import os
import struct
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenEXR
from PIL import Image

from ..errors import FileRefused
from .files import Asset, Files

READ_AS_THEY_ARE = (".png", ".jpg", ".jpeg", ".bmp", ".exr", ".hdr")
CHANNELS = {"r": (0,), "g": (1,), "b": (2,), "a": (3,), "rgb": (0, 1, 2)}
Pixels = npt.NDArray[np.float32]
LEAST_OF_A_MAP = (3, 2)  # rows and columns that an `envmap` of the scene format has at least


@dataclasses.dataclass(frozen=True)
class Look:
    """How a shader uses a file's texels: values = texel * scale + bias, for some channels."""

    channels: str = "rgb"
    scale: tuple[float, ...] = (1, 1, 1, 1)
    bias: tuple[float, ...] = (0, 0, 0, 0)
    space: str = "auto"  # auto, raw, sRGB
    threshold: float = 0  # above 0: what is below becomes 0, all else 1
    bounded: bool = True  # values beyond 0 and 1 are cut off

    def changes(self) -> bool:
        chosen = CHANNELS[self.channels]
        same = all(self.scale[k] == 1 and self.bias[k] == 0 for k in chosen)
        return not same or self.threshold > 0


class Images:
    def __init__(self, files: Files) -> None:
        self._files = files
        self._written: dict[tuple[tuple[str, str], Look], tuple[str, bool]] = {}

    def name(self, asset: Asset, look: Look) -> tuple[str, bool]:
        """Returns (name of the file, True if its values are linear)."""
        key = asset.key, look
        if key not in self._written:
            self._written[key] = self._name(asset, look)
        return self._written[key]

    def fault(self, node: Any, value: Any) -> str:
        """Returns why the image of an asset path cannot be read. Empty: it can be read."""
        if not self._files.exists(value):
            return "is not found"
        asset = self._files.find(node, value)
        if asset is None or asset.suffix == ".hdr":
            return ""
        try:
            _exr_texels(asset) if asset.suffix == ".exr" else _open(asset)
        except FileRefused:
            return "cannot be read"
        return ""

    def _name(self, asset: Asset, look: Look) -> tuple[str, bool]:
        picture = None if asset.suffix in (".exr", ".hdr") else _open(asset)
        grey = picture is not None and picture.mode in ("L", "1")
        raw = _is_raw(picture, look.space)
        plain = look.channels == "rgb" or (grey and look.channels == "r" and raw)
        # Texels of EXR and HDR are linear, whatever color space the stage names.
        fits = picture.format is not None if picture is not None else look.space != "sRGB"
        if plain and fits and not look.changes() and asset.suffix in READ_AS_THEY_ARE:
            return self._files.take(asset), raw
        texels = _exr_texels(asset) if picture is None else _texels(picture, raw)
        if look.channels == "a" and texels.shape[2] < 4:
            texels = np.ones_like(texels[:, :, :1])
            channels: tuple[int, ...] = (0,)
        else:
            channels = CHANNELS[look.channels]
        scale, bias = (np.array([x[k] for k in CHANNELS[look.channels]]) for x in (look.scale, look.bias))
        values = texels[:, :, list(channels)] * scale + bias
        if look.threshold > 0:
            values = (values >= look.threshold).astype(np.float32)
        values = np.clip(values, 0, 1) if look.bounded else np.maximum(values, 0)
        if look.channels != "rgb" and picture is not None and raw and not look.changes():
            return self._files.write(_png(values[:, :, 0]), ".png"), True
        return self._files.write(exr(np.repeat(values, 3 // values.shape[2], axis=2)), ".exr"), True


def _open(asset: Asset) -> Image.Image:
    """Opens the image. If it was converted, it has no `format`, because the scene format does not support the file
    (palettes, CMYK)."""
    try:
        picture: Image.Image = Image.open(io.BytesIO(asset.read()))
        picture.load()
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise FileRefused(f"{asset.prim}: the image {asset.path.name} cannot be read: {error}") from None
    if picture.mode not in ("L", "1", "LA", "RGB", "RGBA", "I;16", "I", "F"):
        picture = picture.convert("RGBA" if "transparency" in picture.info else "RGB")
    return picture


def _is_raw(picture: Image.Image | None, space: str) -> bool:
    """Applies USD's rule for `auto`: 8-bit images of three or four channels are sRGB."""
    if space != "auto":
        return space == "raw"
    return picture is None or picture.mode not in ("RGB", "RGBA")


def _texels(picture: Image.Image, raw: bool) -> Pixels:
    """Returns linear texels as an array (height, width, 3 or 4)."""
    if picture.mode in ("I;16", "I", "F"):
        top = 1.0 if picture.mode == "F" else 65535.0
        values = np.asarray(picture, np.float32)[:, :, None] / np.float32(top)
    else:
        mode = "RGBA" if picture.mode in ("RGBA", "LA") else "RGB"
        values = np.asarray(picture.convert(mode), np.float32) / np.float32(255)
    if values.shape[2] == 1:
        values = np.repeat(values, 3, axis=2)
    if not raw:
        colour = values[:, :, :3]
        low = colour <= 0.04045
        values[:, :, :3] = np.where(low, colour / 12.92, ((np.maximum(colour, 0) + 0.055) / 1.055) ** 2.4)
    return values


def _exr_texels(asset: Asset) -> Pixels:
    if asset.suffix != ".exr":
        raise FileRefused(
            f"{asset.prim}: one channel, a scale or a colour of {asset.path.name} is asked for, which is no "
            "image that can be computed with. Write it as EXR"
        )
    # The library reads files only, and the coordinator's sandbox lets none be written: so this one is in memory.
    with open(os.memfd_create("image.exr"), "wb") as copy:
        copy.write(asset.read())
        copy.flush()
        try:
            with OpenEXR.File(f"/proc/self/fd/{copy.fileno()}", separate_channels=True) as file:
                channels = {name: np.asarray(c.pixels, np.float32) for name, c in file.channels().items()}
        except Exception as error:  # the reader's own kind, of no class in common
            raise FileRefused(f"{asset.prim}: the image {asset.path.name} cannot be read: {error}") from None
    if not {"R", "G", "B"} <= set(channels):
        grey = next((channels[name] for name in ("Y", "R", *channels) if name in channels), None)
        if grey is None:
            raise FileRefused(f"{asset.prim}: the image {asset.path.name} has no channels")
        channels.update(R=grey, G=grey, B=grey)
    return np.stack([channels[name] for name in "RGBA" if name in channels], axis=2)


def is_tiny(asset: Asset) -> bool:
    """True if an image of 8 or 16 bits has fewer rows or columns than a map of the sky needs."""
    if asset.suffix in (".exr", ".hdr"):
        return False
    width, height = _open(asset).size
    return height < LEAST_OF_A_MAP[0] or width < LEAST_OF_A_MAP[1]


def scaled(asset: Asset, colour: list[float], least: tuple[int, int] = (1, 1)) -> bytes:
    """Writes an image of light, multiplied by a colour, as EXR of at least so many rows and columns."""
    picture = None if asset.suffix in (".exr", ".hdr") else _open(asset)
    texels = _exr_texels(asset) if picture is None else _texels(picture, raw=False)
    for axis, wanted in enumerate(least):
        texels = np.repeat(texels, -(-wanted // texels.shape[axis]), axis=axis)
    return exr(np.maximum(texels[:, :, :3], 0) * np.array(colour, np.float32))


def exr(values: npt.NDArray[Any]) -> bytes:
    """Encodes (height, width, 3) as an EXR file of half floats, by ZIP. Larger values are clamped.

    The library writes files only, and the coordinator's sandbox lets none be written. Format: "OpenEXR File
    Layout" of the OpenEXR documentation.
    """
    rows, lines = values.shape[0], 16  # of a block
    pixels = np.clip(values, -65504, 65504).astype("<f2")
    channels = b"".join(name + struct.pack("<xiBxxxii", 1, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, values.shape[1] - 1, rows - 1)
    attributes = (
        (b"channels", b"chlist", channels),
        (b"compression", b"compression", b"\3"),
        (b"dataWindow", b"box2i", window),
        (b"displayWindow", b"box2i", window),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        (b"screenWindowCenter", b"v2f", bytes(8)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    )
    header = b"\x76\x2f\x31\x01" + struct.pack("<i", 2)
    for name, kind, value in attributes:
        header += name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    blocks = []
    for first in range(0, rows, lines):
        # Row by row, and in each the channels B, G, R one after the other
        plain = np.ascontiguousarray(pixels[first : first + lines, :, ::-1].transpose(0, 2, 1)).tobytes()
        data = np.frombuffer(plain, np.uint8)
        split = np.concatenate([data[0::2], data[1::2]])
        steps = np.concatenate([split[:1], split[1:] - split[:-1] + np.uint8(128)])
        packed = zlib.compress(steps.tobytes())
        content = packed if len(packed) < len(plain) else plain
        blocks.append(struct.pack("<ii", first, len(content)) + content)
    places = len(header) + 8 * len(blocks) + np.cumsum([0, *map(len, blocks)])[:-1]
    return header + places.astype("<u8").tobytes() + b"".join(blocks)


def _png(values: Pixels) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(np.round(values * 255).astype(np.uint8)).save(stream, "PNG")
    return stream.getvalue()
