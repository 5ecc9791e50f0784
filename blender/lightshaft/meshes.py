"""Writes meshes as PLY files: one part for each material, with normals and texture coordinates of the vertices."""

import numpy as np


class Part:
    """The triangles of one material slot of an evaluated mesh."""

    def __init__(self, slot, table, corners, closed):
        self.slot, self.table, self.corners, self.closed = slot, table, corners, closed

    def front(self):
        return ply(self.table, self.corners)

    def back(self, distance):
        """Returns the same sheet with its front reversed, `distance` behind it."""
        table = self.table.copy()
        table[:, :3] -= distance * table[:, 3:6]
        table[:, 3:6] *= -1
        return ply(table, self.corners[:, ::-1])


def parts(mesh):
    """Returns the parts of a mesh that have at least one triangle."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    if not count:
        return []
    corners = taken(mesh.loop_triangles, "loops", count * 3, np.int32).reshape(-1, 3)
    polygon = taken(mesh.loop_triangles, "polygon_index", count, np.int32)
    vertex = taken(mesh.loops, "vertex_index", len(mesh.loops), np.int32)
    point = taken(mesh.vertices, "co", len(mesh.vertices) * 3, np.float32).reshape(-1, 3)
    normal = taken(mesh.corner_normals, "vector", len(mesh.loops) * 3, np.float32).reshape(-1, 3)
    columns = [point[vertex], normal]
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    if layer:
        uv = taken(layer.uv, "vector", len(mesh.loops) * 2, np.float32).reshape(-1, 2)
        columns.append(np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1))  # images begin at the top here
    table = np.concatenate(columns, axis=1).astype("<f4") + 0  # no -0, so that equal corners have equal bytes
    slot = taken(mesh.polygons, "material_index", len(mesh.polygons), np.int32)[polygon]
    found = []
    for index in np.unique(slot):
        chosen = corners[slot == index]
        found.append(Part(int(index), table, chosen, is_closed(vertex[chosen])))
    return found


def taken(collection, attribute, size, kind):
    values = np.empty(size, kind)
    collection.foreach_get(attribute, values)
    return values


def is_closed(triangles):
    """Returns True if each edge belongs to two triangles that run along it in opposite directions."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(
        np.int64
    )
    one_way = np.sort(edges[:, 0] << 32 | edges[:, 1])
    other_way = np.sort(edges[:, 1] << 32 | edges[:, 0])
    return bool(np.array_equal(one_way, other_way))


def ply(table, corners):
    """Encodes the vertices in use as a binary PLY file, each distinct one once."""
    rows = np.ascontiguousarray(table[corners.ravel()])
    packed = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1]))).ravel()
    _, first, index = np.unique(packed, return_index=True, return_inverse=True)
    names = ("x", "y", "z", "nx", "ny", "nz", "u", "v")[: rows.shape[1]]
    faces = np.empty(len(corners), np.dtype([("count", "u1"), ("corners", "<i4", 3)]))
    faces["count"], faces["corners"] = 3, index.reshape(-1, 3)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(first)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    return "\n".join(header).encode() + rows[first].tobytes() + faces.tobytes()
