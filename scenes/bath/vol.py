"""Writes grids in the binary format of Mitsuba's `gridvolume`, version 3: float32, one channel, x fastest."""
import struct


def write_vol(path, values, low, high):
    """values: indexed [x, y, z]; low, high: the corners of the grid's box. Values are those at the centres of its cells."""
    with open(path, "wb") as file:
        file.write(b"VOL\x03" + struct.pack("<5i6f", 1, *values.shape, 1, *low, *high))
        file.write(values.transpose(2, 1, 0).astype("<f4").tobytes())
