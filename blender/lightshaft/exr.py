"""Reads the images of Lightshaft and writes textures, without libraries that Blender's Python lacks. Supports the
part of OpenEXR that these files use: one part of scan lines, uncompressed or compressed with ZIP or ZIPS."""

import struct
import zlib

import numpy as np

KINDS = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
LINES = {0: 1, 2: 1, 3: 16}  # of a block, by compression: none, ZIPS, ZIP


def read(data):
    """Returns the layers by channel name, each an array of float32 with the top row first. Raises ValueError if
    the file is damaged."""
    try:
        return read_parts(data)
    except (struct.error, IndexError, zlib.error) as error:
        raise ValueError(f"the image is damaged: {error}") from error


def read_parts(data):
    if data[:4] != b"\x76\x2f\x31\x01" or data[5] & 0x1A:
        raise ValueError("not an EXR image of one part of scan lines")
    attributes, at = {}, 8
    while data[at]:
        (name, kind), at = strings(data, at)
        size = struct.unpack_from("<i", data, at)[0]
        attributes[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    at += 1
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height, compression = right - left + 1, bottom - top + 1, attributes["compression"][0]
    if compression not in LINES:
        raise ValueError(f"compression {compression} is not read")
    channels = channel_list(attributes["channels"])
    line = sum(kind.itemsize for _, kind in channels) * width
    layers = {name: np.zeros((height, width), np.float32) for name, _ in channels}
    blocks = -(-height // LINES[compression])
    for offset in struct.unpack_from(f"<{blocks}Q", data, at):
        y, size = struct.unpack_from("<ii", data, offset)
        count = min(LINES[compression], bottom + 1 - y)
        block = data[offset + 8 : offset + 8 + size]
        if size < line * count:
            block = unpacked(block)
        if len(block) != line * count:
            raise ValueError(f"the block of line {y} is cut off")
        for row in range(count):
            begin = row * line
            for name, kind in channels:
                layers[name][y - top + row] = np.frombuffer(block, kind, width, begin)
                begin += kind.itemsize * width
    return layers


def strings(data, at):
    found = []
    for _ in range(2):
        end = data.index(b"\0", at)
        found.append(data[at:end].decode())
        at = end + 1
    return found, at


def channel_list(data):
    channels, at = [], 0
    while data[at]:
        end = data.index(b"\0", at)
        channels.append((data[at:end].decode(), KINDS[struct.unpack_from("<i", data, end + 1)[0]]))
        at = end + 17
    return channels


def unpacked(block):
    """Undoes OpenEXR's ZIP prediction: the data are differences of bytes, with the even bytes before the odd ones."""
    coded = np.frombuffer(zlib.decompress(block), np.uint8).astype(np.int64)
    coded[1:] -= 128
    values = np.cumsum(coded).astype(np.uint8)
    result = np.empty_like(values)
    half = (len(values) + 1) // 2
    result[0::2], result[1::2] = values[:half], values[half:]
    return result.tobytes()


def write(pixels):
    """Encodes an image (float32, height x width x 3, top row first) as an EXR file. Returns its bytes."""
    pixels = np.asarray(pixels, "<f4")
    height, width, _ = pixels.shape
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = (
        b"".join(name + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    )
    header = b"\x76\x2f\x31\x01\x02\0\0\0"
    for name, kind, value in (
        (b"channels", b"chlist", channels),
        (b"compression", b"compression", b"\0"),
        (b"dataWindow", b"box2i", window),
        (b"displayWindow", b"box2i", window),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        (b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    ):
        header += name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    header += b"\0"
    line = 12 * width
    first = len(header) + 8 * height
    offsets = struct.pack(f"<{height}Q", *(first + y * (line + 8) for y in range(height)))
    planes = np.ascontiguousarray(pixels[:, :, ::-1].transpose(0, 2, 1))
    return (
        header + offsets + b"".join(struct.pack("<ii", y, line) + planes[y].tobytes() for y in range(height))
    )


def write_png(pixels):
    """Encodes bytes (height x width x 1 or 3, top row first) as a PNG file."""
    height, width, channels = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], axis=1)

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    size = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2}[channels], 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", size)
        + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6))
        + chunk(b"IEND", b"")
    )
