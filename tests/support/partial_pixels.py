"""The pixels of an image from its partials (`render --partial-dir`), which are uncompressed: no EXR library is needed."""

import json
import struct

from exr_layers import read_header


def green(folder, width, height):
    """Rows of the image's green channel, top to bottom: the mean over all samples of both halves."""
    sums = [[0.0] * width for _ in range(height)]
    samples = [[0] * width for _ in range(height)]
    for file in sorted(folder.glob("*.exr")):
        data = file.read_bytes()
        header, at = read_header(data)
        x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"][1])
        unit = json.loads(header["lightshaft:unit"][1])
        columns, lines = x1 - x0 + 1, y1 - y0 + 1
        for offset in struct.unpack_from(f"<{lines}Q", data, at):
            y, _ = struct.unpack_from("<2i", data, offset)
            planes = struct.unpack_from(f"<{6 * columns}f", data, offset + 8)  # planes A.B A.G A.R B.B B.G B.R
            for x in range(columns):
                sums[y][x0 + x] += planes[columns + x] + planes[4 * columns + x]
                samples[y][x0 + x] += unit["s1"] - unit["s0"]
    return [[s / n for s, n in zip(*row)] for row in zip(sums, samples)]
