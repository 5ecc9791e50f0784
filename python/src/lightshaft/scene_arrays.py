"""Writes the arrays of a scene dictionary as files."""

from __future__ import annotations

import re
import struct
import tempfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import OpenEXR

from .images import Array

# Keys under which plugins that read a file accept an array instead. The first key present is used.
IMAGE_KEYS, GRID_KEYS = ("data", "bitmap"), ("data", "grid")
MESH_KEYS = ("vertex_positions", "faces", "vertex_normals", "vertex_texcoords")
ATTRIBUTE = re.compile("(?!face_normals$)(vertex|face)_[A-Za-z0-9_]{1,64}")  # not that flag of all meshes


class NoFile(ValueError):
    """An error in the array under `key`."""

    def __init__(self, key: str, text: str) -> None:
        super().__init__(text)
        self.key, self.text = key, text


def file_of(kind: str, values: Mapping[str, Any]) -> tuple[bytes, str, set[str]] | None:
    """Returns the file that a plugin would read, its suffix, and the keys that the file replaces. Returns None if
    the plugin has no arrays."""
    keys = _array_keys(kind, values)
    if not keys:
        return None
    if "filename" in values:
        raise NoFile(keys[0], "there is also a 'filename': give only one of the two")
    if kind == "ply":
        return _ply({key: values[key] for key in keys}), ".ply", set(keys)
    if len(keys) > 1:
        raise NoFile(keys[1], f"there is also an array {keys[0]!r}: give only one of the two")
    data, ending = (_grid if kind == "gridvolume" else _image)(keys[0], values[keys[0]])
    return data, ending, set(keys)


def _array_keys(kind: str, values: Mapping[str, Any]) -> list[str]:
    if kind in ("bitmap", "envmap"):
        return [key for key in IMAGE_KEYS if key in values]
    if kind == "gridvolume":
        return [key for key in GRID_KEYS if key in values]
    if kind == "ply":
        return [key for key in values if key in MESH_KEYS or ATTRIBUTE.fullmatch(key)]
    return []


def _array(key: str, value: Any, kinds: str = "fiu") -> Array:
    """Converts to an array whatever NumPy can read, such as a Bitmap, VolumeGrid or TensorXf of Mitsuba."""
    try:
        array = np.asarray(value)
    except Exception as error:  # whatever a foreign object raises
        raise NoFile(key, f"a {type(value).__name__} is not an array: {error}") from error
    if array.dtype.kind not in kinds or array.size == 0:
        raise NoFile(key, f"this must be an array of numbers, not of {array.dtype} and shape {array.shape}")
    return array


def _floats(key: str, array: Array) -> Array:
    with np.errstate(over="ignore"):
        floats = np.ascontiguousarray(array, dtype="<f4")
    if not np.isfinite(floats).all():
        raise NoFile(key, "a number is infinite, not a number (nan), or too large for single precision")
    return floats


def _image(key: str, value: Any) -> tuple[bytes, str]:
    """Encodes an image. Integers become an image of 8 or 16 bits, which is sRGB unless it is `raw`; floats are
    linear."""
    array = _array(key, value)
    if array.ndim == 2:
        array = array[..., None]
    whole = array.dtype in (np.uint8, np.uint16)
    if array.ndim != 3 or array.shape[2] not in ((1, 3, 4) if whole else (1, 3)):
        raise NoFile(
            key,
            f"an image is (height, width), or (height, width, 3) of floats, bytes or words, or of bytes or "
            f"words with 4 channels; this is {array.dtype} {array.shape}",
        )
    if whole:
        return _png(array), ".png"
    if array.dtype.kind != "f":
        raise NoFile(key, f"an image must have floats, uint8 or uint16, not {array.dtype}")
    return _exr(_floats(key, array)), ".exr"


def _png(array: Array) -> bytes:
    height, width, channels = array.shape
    bits = 8 * array.dtype.itemsize
    rows = np.ascontiguousarray(array, dtype=f">u{bits // 8}").view(np.uint8).reshape(height, -1)
    unfiltered = np.concatenate([np.zeros((height, 1), np.uint8), rows], axis=1)
    colour = {1: 0, 3: 2, 4: 6}[channels]

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(unfiltered.tobytes()))
        + chunk(b"IEND", b"")
    )


def _exr(array: Array) -> bytes:
    channels = {"Y": array[..., 0]} if array.shape[2] == 1 else {"RGB": array}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with tempfile.TemporaryDirectory() as folder:  # the library writes to paths only
        OpenEXR.File(header, channels).write(f"{folder}/image.exr")
        with open(f"{folder}/image.exr", "rb") as file:
            return file.read()


def _grid(key: str, value: Any) -> tuple[bytes, str]:
    array = _array(key, value)
    if array.ndim == 3:
        array = array[..., None]
    if array.ndim != 4 or array.shape[3] not in (1, 3):
        raise NoFile(key, f"a grid is (z, y, x), or (z, y, x, 3) of colours; this is {array.shape}")
    depth, height, width, channels = array.shape
    head = b"VOL\3" + struct.pack("<5i6f", 1, width, height, depth, channels, 0, 0, 0, 1, 1, 1)
    return head + _floats(key, array).tobytes(), ".vol"


def _ply(values: Mapping[str, Any]) -> bytes:
    for key in MESH_KEYS[:2]:
        if key not in values:
            raise NoFile(key, "a mesh needs vertex_positions and faces")
    faces = _rows("faces", values["faces"], (3,), "iu")
    vertices = _rows("vertex_positions", values["vertex_positions"], (3,))
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise NoFile(
            "faces", f"a face has the corner {faces.max() if faces.min() >= 0 else faces.min()}, "
            f"and there are {len(vertices)}"
        )
    names, columns = ["x", "y", "z"], [_floats("vertex_positions", vertices)]
    face_names: list[str] = []
    face_columns: list[Array] = []
    for key, value in values.items():
        if key in MESH_KEYS[:2]:
            continue
        known = {"vertex_normals": ("nx", "ny", "nz"), "vertex_texcoords": ("u", "v")}.get(key)
        table = _floats(key, _rows(key, value, (len(known),) if known else (1, 3)))
        on_faces = key.startswith("face_")
        if len(table) != len(faces if on_faces else vertices):
            raise NoFile(key, f"there are {len(table)} of these, but {len(faces if on_faces else vertices)} "
                         f"{'faces' if on_faces else 'vertices'}")
        # The attribute `color` is the properties color_0, color_1, color_2.
        name = key.partition("_")[2]
        properties = known or tuple(f"{name}_{i}" for i in range(table.shape[1]))
        (face_names if on_faces else names).extend(properties)
        (face_columns if on_faces else columns).append(table)
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    head += [f"property float {name}" for name in names]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    head += [f"property float {name}" for name in face_names]
    row = np.empty(len(faces), dtype=[("n", "u1"), ("corners", "<i4", 3), ("more", "<f4", (len(face_names),))])
    row["n"], row["corners"] = 3, faces
    if face_columns:
        row["more"] = np.concatenate(face_columns, axis=1)
    body = np.concatenate(columns, axis=1).astype("<f4").tobytes() + row.tobytes()
    return "\n".join([*head, "end_header", ""]).encode() + body


def _rows(key: str, value: Any, widths: tuple[int, ...], kinds: str = "fiu") -> Array:
    """Returns one row for each vertex or face. A flat list of numbers, as in Mitsuba, is divided into rows."""
    array = _array(key, value, kinds)
    if array.ndim == 1:
        width = widths[0]
        if array.size % width == 0:
            array = array.reshape(-1, width)
    if array.ndim != 2 or array.shape[1] not in widths:
        wanted = " or ".join(f"(n, {width})" for width in widths)
        raise NoFile(key, f"an array of shape {wanted} is needed, not {array.shape}")
    return array


