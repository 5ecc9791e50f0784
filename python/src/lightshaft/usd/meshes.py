"""Writes meshes as PLY files: triangulated polygons with normals, texture coordinates and colours of their
vertices."""

from __future__ import annotations

import dataclasses
from typing import Any

import mapbox_earcut
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating[Any]]
Ints = npt.NDArray[np.int64]


@dataclasses.dataclass
class Polygons:
    """Faces as in USD: the number of vertices of each face, and the point of each vertex."""

    points: Floats
    counts: Ints
    indices: Ints

    def fault(self) -> str:
        """Returns what is wrong with the polygons. Empty: nothing."""
        if self.points.ndim != 2 or self.points.shape[1] != 3 or not np.isfinite(self.points).all():
            return "its points are not three finite numbers each"
        if (self.counts < 0).any() or self.counts.sum() != len(self.indices):
            return "the sum of faceVertexCounts is not the number of faceVertexIndices"
        if len(self.indices) and not 0 <= self.indices.min() <= self.indices.max() < len(self.points):
            return "faceVertexIndices name points that it does not have"
        return ""

    def triangles(self) -> tuple[Ints, Ints]:
        """Returns (vertices, three for each triangle; the face of each triangle)."""
        counts = np.maximum(self.counts - 2, 0)
        starts = np.cumsum(self.counts) - self.counts
        face = np.repeat(np.arange(len(counts)), counts)
        step = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts)
        corners = np.stack([starts[face], starts[face] + step + 1, starts[face] + step + 2], axis=1)
        for index in self._concave(starts):
            own = np.arange(starts[index], starts[index] + self.counts[index])
            corners[face == index] = own[self._cut(own, counts[index])]
        return corners, face

    def _concave(self, starts: Ints) -> Ints:
        """Returns the faces of more than three vertices that a fan of triangles does not cover."""
        if not len(self.indices) or self.counts.max() < 4:
            return np.empty(0, np.int64)
        follower = np.arange(len(self.indices)) + 1
        full = self.counts > 0
        follower[(starts + self.counts)[full] - 1] = starts[full]
        place = self.points[self.indices].astype(np.float64)
        edge = place[follower] - place
        turn = np.cross(edge, edge[follower])
        owner = np.repeat(np.arange(len(self.counts)), self.counts)
        normal = np.zeros((len(self.counts), 3))
        np.add.at(normal, owner, np.cross(place - place[starts[owner]], edge))
        inward = np.einsum("ij,ij->i", turn, normal[owner]) < -1e-12 * np.square(normal[owner]).sum(axis=1)
        found: Ints = np.unique(owner[inward & (self.counts[owner] > 3)])
        return found

    def _cut(self, corners: Ints, count: int) -> Ints:
        """Triangulates a concave polygon, seen along the axis that it faces most."""
        place = self.points[self.indices[corners]].astype(np.float64)
        normal = np.cross(place - place[0], np.roll(place, -1, axis=0) - place[0]).sum(axis=0)
        axis = int(np.abs(normal).argmax())
        flat = np.ascontiguousarray(np.delete(place, axis, axis=1))
        found = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32))
        cut = np.asarray(found, np.int64).reshape(-1, 3)
        if len(cut) != count:  # it crosses itself, or has corners on one line
            return np.stack([np.zeros(count, np.int64), np.arange(count) + 1, np.arange(count) + 2], axis=1)
        a, b, c = (place[cut[:, k]] for k in range(3))
        turned = np.cross(b - a, c - a) @ normal < 0
        cut[turned] = cut[turned][:, ::-1]
        return cut


@dataclasses.dataclass
class Corners:
    """The values of a primvar, and the index of each vertex's value."""

    values: Floats
    index: Ints


def smooth_normals(points: Floats, triangles: Ints) -> Floats:
    """Returns for each point the sum of the normals of its triangles, weighted by their angles. It does not depend
    on how polygons are triangulated."""
    corner = [points[triangles[:, k]].astype(np.float64) for k in range(3)]
    normals = np.zeros((len(points), 3))
    for k in range(3):
        one, two = (corner[(k + i) % 3] - corner[k] for i in (1, 2))
        across = np.cross(one, two)
        length = np.linalg.norm(across, axis=1)
        angle = np.arctan2(length, np.einsum("ij,ij->i", one, two))
        np.add.at(normals, triangles[:, k], across * (angle / np.where(length > 0, length, 1))[:, None])
    return normals


def is_closed(triangles: Ints) -> bool:
    """Returns True if each edge belongs to two triangles that run along it in opposite directions."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(
        np.int64
    )
    one_way = np.sort(edges[:, 0] << 32 | edges[:, 1])
    other_way = np.sort(edges[:, 1] << 32 | edges[:, 0])
    return bool(np.array_equal(one_way, other_way))


@dataclasses.dataclass
class Part:
    """The triangles of one surface. A row is (x, y, z, and optionally a normal, u and v, and r, g and b); a
    triangle has three rows."""

    names: tuple[str, ...]
    table: Floats
    triangles: Ints
    closed: bool = False

    @classmethod
    def of(
        cls,
        polygons: Polygons,
        corners: Ints,
        normals: Corners | None,
        coordinates: Corners | None,
        colours: Corners | None,
    ) -> Part:
        vertex = polygons.indices[corners]
        columns, names = [polygons.points[polygons.indices]], ["x", "y", "z"]
        given = (
            (normals, ("nx", "ny", "nz")),
            (coordinates, ("u", "v")),
            (colours, ("r", "g", "b")),
        )
        for primvar, own in given:
            if primvar is not None:
                columns.append(primvar.values[primvar.index])
                names.extend(own)
        table = np.concatenate(columns, axis=1).astype("<f4") + np.float32(0)  # no -0, which differs from 0
        return cls(tuple(names), table, corners, is_closed(vertex))

    def ply(self) -> bytes:
        """Encodes the rows in use, each distinct one once."""
        rows = np.ascontiguousarray(self.table[self.triangles.ravel()])
        packed = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))).ravel()
        _, first, index = np.unique(packed, return_index=True, return_inverse=True)
        faces = np.empty(len(self.triangles), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
        faces["count"], faces["corners"] = 3, index.reshape(-1, 3)
        header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(first)}"]
        header += [f"property float {name}" for name in self.names]
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
        return "\n".join(header).encode() + rows[first].tobytes() + faces.tobytes()

    def back(self, share: float) -> Part:
        """Returns the same sheet with its front reversed, a fraction of its size behind it."""
        table = self.table.copy()
        if "nx" in self.names:
            normals = table[:, 3:6].astype(np.float64)
            table[:, 3:6] *= -1
        else:
            normals = smooth_normals(table[:, :3], self.triangles)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        extent = float(np.abs(table[:, :3]).max(initial=0))
        table[:, :3] -= (share * extent * normals / np.where(length > 0, length, 1)).astype("<f4")
        return Part(self.names, table, self.triangles[:, ::-1], self.closed)

    def area(self) -> float:
        a, b, c = (self.table[self.triangles[:, k], :3].astype(np.float64) for k in range(3))
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    def moved(self, matrix: npt.NDArray[np.float64]) -> Part:
        """Moves the mesh and drops normals and other attributes."""
        points = self.table[:, :3] @ matrix[:3, :3].T + matrix[:3, 3]
        triangles = self.triangles[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else self.triangles
        return Part(("x", "y", "z"), points.astype("<f4"), triangles, self.closed)
