"""Makes triangles of basic shapes that the scene format does not have or cannot stretch."""

from __future__ import annotations

import numpy as np

from .meshes import Floats, Ints, Part

AROUND = 128  # corners of a circle: a chord lies within 0.0003 radii of it
TURNS = {  # the axis z of a shape turned to x, y or z, in order of the others
    "X": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], float),
    "Y": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], float),
    "Z": np.eye(3),
}


def revolved(heights: Floats, radii: Floats, normals: Floats, axis: str) -> Part:
    """Makes the surface that a line of (radius, height) with normals (outward, upward) draws around an axis."""
    angle = np.linspace(0, 2 * np.pi, AROUND + 1)[:-1]
    cos, sin = np.cos(angle)[None, :], np.sin(angle)[None, :]
    flat = np.ones_like(cos)
    place = np.stack([radii[:, None] * cos, radii[:, None] * sin, heights[:, None] * flat], axis=2)
    normal = np.stack([normals[:, :1] * cos, normals[:, :1] * sin, normals[:, 1:] * flat], axis=2)
    rows = len(heights)
    turn = TURNS[axis].T
    table = np.concatenate([place.reshape(-1, 3) @ turn, normal.reshape(-1, 3) @ turn], axis=1)
    i, k = np.meshgrid(np.arange(rows - 1), np.arange(AROUND), indexing="ij")
    a, b = i * AROUND + k, i * AROUND + (k + 1) % AROUND
    quads = np.stack([a, b, b + AROUND, a + AROUND], axis=2).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    corner = table[triangles, :3]
    wide = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    names = ("x", "y", "z", "nx", "ny", "nz")
    kept: Ints = triangles[wide > 1e-14 * np.abs(table[:, :3]).max() ** 2]
    return Part(names, table.astype("<f4"), kept, closed=True)


def rectangle_part() -> Part:
    """Makes the square from (-1, -1) to (1, 1) that faces +z."""
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], "<f4")
    return Part(("x", "y", "z"), corners, np.array([[0, 1, 2], [0, 2, 3]]))


def sphere_part(radius: float) -> Part:
    polar = np.linspace(-np.pi / 2, np.pi / 2, AROUND // 2 + 1)
    around = np.stack([np.cos(polar), np.sin(polar)], axis=1)
    return revolved(radius * around[:, 1], radius * around[:, 0], around, "Z")


def cylinder_part(bottom: float, top: float, height: float, axis: str, caps: bool = True) -> Part:
    """Makes a cylinder, a cone (`top` 0) or a truncated cone."""
    slope = np.array([height, bottom - top]) / np.hypot(height, bottom - top)
    low, high = -height / 2, height / 2
    heights, radii, normals = [low, high], [bottom, top], [slope, slope]
    if caps:
        down, up = np.array([0.0, -1.0]), np.array([0.0, 1.0])
        heights, radii = [low, low, *heights, high, high], [0.0, bottom, *radii, top, 0.0]
        normals = [down, down, *normals, up, up]
    return revolved(np.array(heights), np.array(radii), np.array(normals), axis)


def capsule_part(radius: float, height: float, axis: str) -> Part:
    polar = np.linspace(-np.pi / 2, np.pi / 2, AROUND // 2 + 2)
    around = np.stack([np.cos(polar), np.sin(polar)], axis=1)
    shift = np.where(np.arange(len(polar)) < len(polar) // 2, -height / 2, height / 2)
    return revolved(radius * around[:, 1] + shift, radius * around[:, 0], around, axis)
