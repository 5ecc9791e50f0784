"""Triangle meshes from grids of points, boxes, lathes and tubes, and their binary PLY files. Metres, +y up.

Points are rounded to a hundredth of a millimetre before they are stored: the last bits of sines differ between machines.
"""
import math
import struct

import numpy as np

CORNERS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)


class Mesh:
    """Vertices (position, normal, uv) and triangles; grows by `add`."""

    def __init__(self):
        self.vertices = []  # arrays of rows x y z nx ny nz u v
        self.triangles = []
        self.count = 0

    def add(self, points, normals, uvs, triangles):
        self.vertices.append(np.concatenate([points, normals, uvs], axis=1))
        self.triangles.append(np.asarray(triangles, dtype=np.int32) + self.count)
        self.count += len(points)

    def write(self, path):
        vertices = np.round(np.concatenate(self.vertices), 5) + 0.0  # + 0: no negative zeros
        triangles = np.concatenate(self.triangles)
        # Where a surface closes to a point, half of its last quads have no area: as the file has them, in float32.
        corners = vertices[:, :3].astype(np.float32).astype(np.float64)[triangles]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        triangles = triangles[areas > 0]
        properties = "".join(f"property float {p}\n" for p in ("x", "y", "z", "nx", "ny", "nz", "u", "v"))
        head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{properties}"
                f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
        rows = np.zeros(len(triangles), dtype=[("n", "u1"), ("v", "<i4", 3)])
        rows["n"], rows["v"] = 3, triangles
        with open(path, "wb") as f:
            f.write(head.encode("ascii") + vertices.astype("<f4").tobytes() + rows.tobytes())

    def surface(self, points, closed=False, uv_size=(1.0, 1.0), flip=False):
        """A grid of points [i, j, 3], smooth; closed: the last row joins the first. The normal is d/di x d/dj.

        uv runs over uv_size along i and j.
        """
        p = np.round(np.asarray(points, dtype=float), 5)
        if closed:
            p = np.concatenate([p, p[:1]])
        n_i, n_j = p.shape[:2]
        along_i, along_j = np.gradient(p, axis=0), np.gradient(p, axis=1)
        if closed:
            along_i[0] = along_i[-1] = (p[1] - p[-2]) / 2
        normals = np.cross(along_i, along_j)
        if flip:
            normals = -normals
        length = np.sqrt(normals[..., 0] ** 2 + normals[..., 1] ** 2 + normals[..., 2] ** 2)
        normals /= np.maximum(length, 1e-12)[..., None]
        u, v = np.meshgrid(np.linspace(0, uv_size[0], n_i), np.linspace(0, uv_size[1], n_j), indexing="ij")
        at = np.arange(n_i * n_j).reshape(n_i, n_j)
        a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
        triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
        if flip:
            triangles = triangles[:, ::-1]
        self.add(p.reshape(-1, 3), normals.reshape(-1, 3), np.stack([u.ravel(), v.ravel()], 1), triangles)

    def quad(self, corner, edge_u, edge_v, uv=None):
        """A parallelogram with the normal edge_u x edge_v; uv: of its corners, in metres if not given."""
        corner, edge_u, edge_v = (np.asarray(a, dtype=float) for a in (corner, edge_u, edge_v))
        normal = np.cross(edge_u, edge_v)
        normal /= math.sqrt(normal @ normal)
        if uv is None:
            uv = CORNERS * (math.sqrt(edge_u @ edge_u), math.sqrt(edge_v @ edge_v))
        self.add(corner + CORNERS[:, :1] * edge_u + CORNERS[:, 1:] * edge_v, np.tile(normal, (4, 1)), np.asarray(uv, dtype=float),
                 [(0, 1, 2), (0, 2, 3)])

    def box(self, lo, hi, grain=None, offset=(0.0, 0.0), turn=None):
        """An axis-parallel box with flat faces; grain: the axis along which v runs; uv in metres from `offset`.

        turn: (3 x 3 matrix, point): the box is turned about that point.
        """
        lo, hi = np.asarray(lo, dtype=float), np.asarray(hi, dtype=float)
        size = hi - lo
        for axis in range(3):
            u, v = [(1, 2), (2, 0), (0, 1)][axis]
            for top in (0, 1):
                eu, ev = np.zeros(3), np.zeros(3)
                eu[u], ev[v] = size[u], size[v]
                corner = lo.copy()
                corner[axis] = hi[axis] if top else lo[axis]
                if not top:
                    eu, ev = ev, eu
                along = {u: 0, v: 1} if top else {v: 0, u: 1}
                uv = CORNERS * (math.sqrt(eu @ eu), math.sqrt(ev @ ev))
                if grain is not None and along.get(grain, 1) == 0:
                    uv = uv[:, ::-1]
                if turn is not None:
                    matrix, about = turn
                    eu, ev, corner = matrix @ eu, matrix @ ev, matrix @ (corner - about) + about
                self.quad(corner, eu, ev, uv + offset)

    def lathe(self, profile, centre=(0, 0, 0), sides=40, uv_size=(1.0, 1.0)):
        """A profile of (radius, height), from the bottom's axis outwards and up, turned about the y axis."""
        turned = [[(r * math.cos(a), y, -r * math.sin(a)) for r, y in profile]
                  for a in (2 * math.pi * k / sides for k in range(sides))]
        self.surface(np.array(turned) + centre, closed=True, uv_size=uv_size)

    def tube(self, path, radius, sides=14, closed_path=False):
        """A round tube along points; radius: a number, or one per point. Its ends are rounded off."""
        p = np.asarray(path, dtype=float)
        radii = np.broadcast_to(np.asarray(radius, dtype=float), (len(p),)).copy()
        if not closed_path:
            d0, d1 = _unit(p[0] - p[1]), _unit(p[-1] - p[-2])
            p = np.concatenate([[p[0] + d0 * radii[0] * .5, p[0] + d0 * radii[0] * .4], p,
                                [p[-1] + d1 * radii[-1] * .4, p[-1] + d1 * radii[-1] * .5]])
            radii = np.concatenate([[radii[0] * .02, radii[0] * .6], radii, [radii[-1] * .6, radii[-1] * .02]])
        rings, side = [], None
        for k in range(len(p)):
            if closed_path:
                along = _unit(p[(k + 1) % len(p)] - p[k - 1])
            else:
                along = _unit(p[min(k + 1, len(p) - 1)] - p[max(k - 1, 0)])
            if side is None:
                side = np.cross(along, (0, 1, 0) if abs(along[1]) < .9 else (1, 0, 0))
            side = _unit(side - along * (side @ along))  # carried along: no twist
            other = np.cross(along, side)
            rings.append([p[k] + radii[k] * (math.cos(a) * side + math.sin(a) * other)
                          for a in (2 * math.pi * s / sides for s in range(sides))])
        if closed_path:
            rings.append(rings[0])
        self.surface(np.array(rings).transpose(1, 0, 2), closed=True)

    def ball(self, centre, radius, sides=28, squash=1.0):
        n = sides // 2
        profile = [(radius * max(math.sin(math.pi * k / n), 1e-3), -squash * radius * math.cos(math.pi * k / n)) for k in range(n + 1)]
        self.lathe(profile, centre, sides)


def _unit(v):
    return v / math.sqrt(v @ v)


def turn_y(degrees):
    """Turns from +x towards -z about the y axis."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array([(c, 0, s), (0, 1, 0), (-s, 0, c)])


def turn_z(degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array([(c, -s, 0), (s, c, 0), (0, 0, 1)])


def spline(points, steps=8):
    """A Catmull-Rom curve through the points."""
    p = [np.asarray(q, dtype=float) for q in points]
    p = [2 * p[0] - p[1]] + p + [2 * p[-1] - p[-2]]
    out = []
    for k in range(1, len(p) - 2):
        a, b, c, d = p[k - 1:k + 3]
        for s in range(steps):
            t = s / steps
            out.append(.5 * (2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t ** 2 + (3 * b - a - 3 * c + d) * t ** 3))
    return out + [p[-2]]
