"""Image files (PNG, Radiance HDR) and the noise that textures and steam are made of.

The noise needs only integer hashing and polynomials: the same bits on every machine.
"""
import struct
import zlib

import numpy as np


def write_png(path, pixels):
    """pixels [rows, columns] or [rows, columns, 3] in [0, 1], stored as they are (8 bits)."""
    values = np.floor(np.clip(pixels, 0, 1) * 255 + .5).astype(np.uint8)
    rows, columns = values.shape[:2]
    colour_type = 2 if values.ndim == 3 else 0
    flat = values.reshape(rows, -1)
    filtered = np.concatenate([np.zeros((rows, 1), np.uint8), flat], axis=1)
    if colour_type == 2:  # filter 1: each byte less that of the pixel to the left
        filtered[:, 0] = 1
        filtered[:, 4:] = flat[:, 3:] - flat[:, :-3]

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, colour_type, 0, 0, 0))
                + chunk(b"IDAT", zlib.compress(filtered.tobytes(), 9)) + chunk(b"IEND", b""))


def write_hdr(path, pixels):
    """pixels [rows, columns, 3] >= 0, linear: Radiance's shared-exponent format, without run lengths."""
    largest = pixels.max(axis=2)
    _, exponent = np.frexp(largest)
    coded = np.zeros(pixels.shape[:2] + (4,), np.uint8)
    coded[..., :3] = np.floor(np.ldexp(pixels, (8 - exponent)[..., None]))
    coded[..., 3] = np.where(largest > 1e-30, exponent + 128, 0)
    with open(path, "wb") as f:
        f.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + f"-Y {pixels.shape[0]} +X {pixels.shape[1]}\n".encode() + coded.tobytes())


def hash01(seed, *coordinates):
    """A number in [0, 1) for every tuple of integers (arrays of one shape)."""
    h = np.uint32(seed * 0x9E3779B1 & 0xFFFFFFFF)
    with np.errstate(over="ignore"):  # it is meant to wrap around
        for c in coordinates:
            h = (np.asarray(c).astype(np.int64).astype(np.uint32) + h) * np.uint32(0x85EBCA6B)
            h = (h ^ (h >> np.uint32(15))) * np.uint32(0xC2B2AE35)
            h = h ^ (h >> np.uint32(13))
    return h / 2.0 ** 32


def noise(seed, *coordinates, period=None):
    """Smooth value noise in [0, 1] of one to three coordinates; period: whole numbers after which it repeats."""
    cells = [np.floor(c).astype(np.int64) for c in coordinates]
    fractions = [c - k for c, k in zip(coordinates, cells)]
    weights = [t * t * t * (t * (t * 6 - 15) + 10) for t in fractions]
    total = 0.0
    for corner in np.ndindex(*(2,) * len(cells)):
        weight = 1.0
        for w, bit in zip(weights, corner):
            weight = weight * (w if bit else 1 - w)
        at = [k + bit for k, bit in zip(cells, corner)]
        if period is not None:
            at = [a % p if p else a for a, p in zip(at, period)]
        total = total + weight * hash01(seed, *at)
    return total


def fractal(seed, *coordinates, octaves=4, gain=.5, period=None):
    """Octaves of noise, scaled back to [0, 1]."""
    total, amplitude, sum_of = 0.0, 1.0, 0.0
    for k in range(octaves):
        repeat = None if period is None else [p * 2 ** k for p in period]
        total = total + amplitude * noise(seed + 101 * k, *[c * 2 ** k for c in coordinates], period=repeat)
        sum_of += amplitude
        amplitude *= gain
    return total / sum_of


def smoothstep(lo, hi, x):
    t = np.clip((x - lo) / (hi - lo), 0, 1)
    return t * t * (3 - 2 * t)


def mix(a, b, t):
    return np.asarray(a) * (1 - t) + np.asarray(b) * t
