"""Writes a dense array as an OpenVDB file, without OpenVDB: one grid of type Tree_float_5_4_3, stored as half floats or as floats.

The layout is that of OpenVDB's file version 224 (openvdb/io/Archive.cc, tree/RootNode.h, tree/InternalNode.h,
tree/LeafNode.h): a header, the grid's metadata and transform, the tree's topology from the root down, then the leaves'
values. Of each node only the active values are stored (compression flag 2), so an empty leaf costs nothing and the file
needs no library to read beyond OpenVDB itself.
"""
import struct

import numpy as np

FILE_VERSION = 224
LIBRARY_VERSION = (10, 0)
ACTIVE_MASK_COMPRESSION = 2
ONLY_ACTIVE_VALUES = b"\x00"  # a node's byte before its values: those that are not active are the background
LEAF, LOWER, UPPER = 8, 16, 32  # a leaf's voxels, a lower node's leaves and an upper node's lower nodes along an axis
SPAN = LEAF * LOWER * UPPER


def _text(s):
    return struct.pack("<I", len(s)) + s.encode("ascii")


def _metadata(entries):
    out = struct.pack("<I", len(entries))
    for name, kind, value in entries:
        out += _text(name) + _text(kind) + struct.pack("<I", len(value)) + value
    return out


def _mask(bits):
    """Bits in the order of a node's children, the first in the lowest bit of the first byte."""
    return np.packbits(bits.reshape(-1), bitorder="little").tobytes()


def _blocks(array, edge):
    """A cubic array of n * edge entries along an axis as an array [x, y, z, :, :, :] of its blocks."""
    n = array.shape[0] // edge
    return array.reshape(n, edge, n, edge, n, edge).transpose(0, 2, 4, 1, 3, 5)


def _tree(values, stored_as):
    """Topology and leaf buffers of the non-zero voxels; indices start at 0 and end below SPAN."""
    if max(values.shape) > SPAN:
        raise ValueError(f"a grid of {values.shape} voxels is larger than {SPAN} along an axis")
    lower_span = LEAF * LOWER
    padded = np.zeros([-(-n // lower_span) * lower_span for n in values.shape], dtype=stored_as)
    padded[tuple(slice(n) for n in values.shape)] = values
    lower_there = np.zeros((UPPER,) * 3, dtype=bool)
    lower_topology, buffers = [], []
    for x, y, z in np.ndindex(*[n // lower_span for n in padded.shape]):
        lo = np.array([x, y, z]) * lower_span
        leaves = _blocks(padded[tuple(slice(o, o + lower_span) for o in lo)], LEAF)
        active = leaves != 0
        there = active.any(axis=(3, 4, 5))
        if not there.any():
            continue
        lower_there[x, y, z] = True
        lower_topology.append(_mask(there) + bytes(LOWER ** 3 // 8) + ONLY_ACTIVE_VALUES)
        for at in np.argwhere(there):
            mask = active[tuple(at)]
            lower_topology.append(_mask(mask))
            buffers.append(_mask(mask) + ONLY_ACTIVE_VALUES + leaves[tuple(at)][mask].tobytes())
    root = struct.pack("<IfII", 1, 0.0, 0, 1) + struct.pack("<3i", 0, 0, 0)  # buffers, background, tiles, children; origin
    upper = _mask(lower_there) + bytes(UPPER ** 3 // 8) + ONLY_ACTIVE_VALUES
    return root + upper + b"".join(lower_topology), b"".join(buffers)


def write_vdb(path, values, name, origin, voxel, half=True):
    """values[x, y, z] >= 0; the centre of voxel (0, 0, 0) lies at `origin`, in scene units; `voxel` is an edge's length."""
    topology, buffers = _tree(values, "<f2" if half else "<f4")
    header = struct.pack("<q3IB", 0x56444220, FILE_VERSION, *LIBRARY_VERSION, 1)
    header += b"00000000-0000-0000-0000-000000000000"  # made at random by OpenVDB; the same bytes for the same steam here
    header += _metadata([]) + struct.pack("<I", 1)
    descriptor = _text(name) + _text("Tree_float_5_4_3" + ("_HalfFloat" if half else "")) + _text("")
    grid_at = len(header) + len(descriptor) + 24
    matrix = [voxel, 0, 0, 0, 0, voxel, 0, 0, 0, 0, voxel, 0, *map(float, origin), 1]  # applied to row vectors
    grid = struct.pack("<I", ACTIVE_MASK_COMPRESSION)
    grid += _metadata([("class", "string", b"fog volume"), ("is_saved_as_half_float", "bool", bytes([half])),
                       ("name", "string", name.encode("ascii"))])
    grid += _text("AffineMap") + struct.pack("<16d", *matrix) + topology
    blocks_at = grid_at + len(grid)
    offsets = struct.pack("<3q", grid_at, blocks_at, blocks_at + len(buffers))
    with open(path, "wb") as f:
        f.write(header + descriptor + offsets + grid + buffers)
