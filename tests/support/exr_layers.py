"""Channels and header strings of the images that we write (scanline, ZIP), read without a library, and changed: what a test compares."""

import hashlib
import struct
import zlib

TYPES = {0: "I", 1: "e", 2: "f"}
LINES = 16  # rows of a ZIP block


def _text(data, at):
    end = data.index(0, at)
    return data[at:end].decode(), end + 1


def read_header(data):
    """Attributes {name: (type, bytes)} of a single-part scanline file, and where its line offsets begin."""
    assert data[:4] == b"\x76\x2f\x31\x01", "no EXR file"
    at, found = 8, {}
    while data[at]:
        name, at = _text(data, at)
        kind, at = _text(data, at)
        size, = struct.unpack_from("<i", data, at)
        found[name] = (kind, data[at + 4:at + 4 + size])
        at += 4 + size
    return found, at + 1


def _unzipped(block, size):
    if len(block) == size:
        return block
    raw = bytearray(zlib.decompress(block))
    for i in range(1, len(raw)):
        raw[i] = (raw[i - 1] + raw[i] - 128) & 255
    half = (len(raw) + 1) // 2
    out = bytearray(len(raw))
    out[0::2], out[1::2] = raw[:half], raw[half:]
    return bytes(out)


def channel_types(header):
    """[(channel, its type, one of "Ief")], sorted by name as in the file."""
    channels, raw, place = [], header["channels"][1], 0
    while raw[place]:
        name, place = _text(raw, place)
        channels.append((name, TYPES[struct.unpack_from("<i", raw, place)[0]]))
        place += 16
    return channels


def read(path):
    """({channel: rows of numbers}, {name: string of the header}, {channel: its type, one of "Ief"})."""
    data = path.read_bytes()
    header, at = read_header(data)
    channels = channel_types(header)
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"][1])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    line = sum(struct.calcsize("<" + kind) * width for _, kind in channels)
    rows = {name: [None] * height for name, _ in channels}
    for offset in struct.unpack_from(f"<{-(-height // LINES)}Q", data, at):
        first, size = struct.unpack_from("<2i", data, offset)
        lines = min(LINES, y1 + 1 - first)
        block, place = _unzipped(data[offset + 8:offset + 8 + size], lines * line), 0
        for y in range(first - y0, first - y0 + lines):
            for name, kind in channels:
                rows[name][y] = struct.unpack_from(f"<{width}{kind}", block, place)
                place += struct.calcsize("<" + kind) * width
    strings = {name: value.decode() for name, (kind, value) in header.items() if kind == "string"}
    return rows, strings, dict(channels)


def _attribute(name, kind, value):
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def write(path, header, rows):
    """An uncompressed picture with these attributes {name: (type, bytes)}, its channels among them: whoever changes an image."""
    kinds = {name: kind for name, kind in channel_types(header)}
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"][1])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    stored = {**header, "compression": ("compression", b"\0")}
    # Names of 32 characters and more need a flag in the version field.
    version = 2 | (1024 if any(len(name) > 31 for name in [*header, *kinds]) else 0)
    head = struct.pack("<2i", 20000630, version) + b"".join(_attribute(name, *a) for name, a in stored.items()) + b"\0"
    lines = [b"".join(struct.pack(f"<{width}{kinds[name]}", *rows[name][y]) for name in sorted(rows)) for y in range(height)]
    chunks = [struct.pack("<2i", y0 + y, len(line)) + line for y, line in enumerate(lines)]
    first = len(head) + 8 * height
    offsets = struct.pack(f"<{height}Q", *(first + y * len(chunks[0]) for y in range(height)))
    path.write_bytes(head + offsets + b"".join(chunks))


def write_rgb(path, layers):
    """A plain picture of the layers R, G and B (rows of floats), with nothing said about itself."""
    window = struct.pack("<4i", 0, 0, len(layers["R"][0]) - 1, len(layers["R"]) - 1)
    channels = b"".join(name.encode() + b"\0" + struct.pack("<4i", 2, 0, 1, 1) for name in "BGR") + b"\0"
    write(path, {"channels": ("chlist", channels), "dataWindow": ("box2i", window), "displayWindow": ("box2i", window),
                 "lineOrder": ("lineOrder", b"\0"), "pixelAspectRatio": ("float", struct.pack("<f", 1)),
                 "screenWindowCenter": ("v2f", bytes(8)), "screenWindowWidth": ("float", struct.pack("<f", 1))},
          {name: layers[name] for name in "BGR"})


def seal(header, rows):
    """What `lightshaft:seal` of this picture would be, by the words of docs/reference/image-file.md and none of the program's code."""
    left_out = ("compression", "lineOrder", "lightshaft:seal")
    lines = [f"{hashlib.sha256(kind.encode() + bytes(1) + value).hexdigest()} header {name}"
             for name, (kind, value) in sorted(header.items()) if name not in left_out]
    kinds = dict(channel_types(header))
    for name in sorted(rows):
        values = [value for row in rows[name] for value in row]
        packed = struct.pack(f"<{len(values)}{'I' if kinds[name] == 'I' else 'f'}", *values)
        lines.append(f"{hashlib.sha256(packed).hexdigest()} layer {name}")
    return "".join(line + "\n" for line in lines)
