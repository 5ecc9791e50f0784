"""Converts meshes and basic shapes of a stage to shapes of the scene, without their position."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdShade

from .document import Document, reference
from .gprims import capsule_part, cylinder_part, sphere_part
from .materials import GREY, Materials, Surface, constant_colour
from .meshes import Corners, Floats, Ints, Part, Polygons, smooth_normals
from .motion import Motions, Placement
from .problems import Problems
from .shading import Primvar
from .transforms import Matrix, mirrors, scale

SIZES = ("radius", "height", "size", "width", "length", "radiusBottom", "radiusTop")
SHEET = 1e-5  # the back of a sheet that gives off light stands this share of its size behind the front
Dict = dict[str, Any]


@dataclasses.dataclass
class Leaf:
    """A shape and its position in its parent."""

    name: str
    shape: Dict
    matrix: Placement

    @property
    def shines(self) -> bool:
        return "emitter" in self.shape

    @property
    def alone(self) -> bool:
        """Whether it cannot be in a group of shapes."""
        return self.shines or self.matrix.moves


class Geometry:
    def __init__(
        self,
        document: Document,
        materials: Materials,
        problems: Problems,
        time: Usd.TimeCode,
        motions: Motions,
    ) -> None:
        self._document, self._materials, self._motions = document, materials, motions
        self._problems, self._time = problems, time

    def leaves(self, prim: Usd.Prim, matrix: Placement) -> list[Leaf]:
        """Returns the shapes of a prim. Returns none and reports a warning if its type is not supported."""
        kind = str(prim.GetTypeName())
        if kind == "Mesh":
            return self._mesh(prim, matrix)
        build = SHAPES.get(kind)
        if build is None:
            self._problems.warn(prim, f"a {kind} is not supported: make it a Mesh")
            return []
        self._motions.deforms(prim, SIZES)
        surface = self._surface(prim)
        if surface.coordinates is not None or surface.colours is not None:
            self._problems.warn(prim, f"a {kind} has no primvars for its material: displayColor is used")
            surface = self._materials.of_colour(prim, *self._display(prim))
        shapes = [
            Leaf(str(prim.GetPath()), self._shaded(shape, surface), matrix @ own)
            for shape, own in build(self, prim)
        ]
        return shapes

    def placed(self, leaf: Leaf, matrix: Placement) -> Dict:
        """Places the shape of a leaf at `matrix`. A sphere that would be stretched becomes triangles."""
        shape = leaf.shape
        if shape["type"] == "sphere" and not matrix.is_similarity():
            kept = {key: value for key, value in shape.items() if key not in ("type", "radius")}
            shape = {**self._ply(sphere_part(shape["radius"])), **kept}
        # Mirrored, spheres and flat triangles are turned inside out: their normals follow their parameters.
        inside_out = mirrors(matrix.still) and (shape["type"] == "sphere" or shape.get("face_normals", False))
        to_world = self._motions.to_world(leaf.name, matrix, rigid=leaf.shines)
        return {**shape, "to_world": to_world, **({"flip_normals": True} if inside_out else {})}

    def _get(self, prim: Usd.Prim, name: str, default: Any = None) -> Any:
        attribute = prim.GetAttribute(name)
        value = attribute.Get(self._time) if attribute else None
        return default if value is None else value

    # Surfaces

    def _surface(self, prim: Usd.Prim, mesh: Usd.Prim | None = None) -> Surface:
        """Returns the surface of a prim, or of a subset of a mesh."""
        api = UsdShade.MaterialBindingAPI(prim)
        material = api.ComputeBoundMaterial(UsdShade.Tokens.full)[0]
        surface = self._materials.of_material(material) if material else None
        return surface or self._materials.of_colour(prim, *self._display(mesh or prim))

    def _display(self, prim: Usd.Prim) -> tuple[list[float] | Primvar, float]:
        primvars = UsdGeom.PrimvarsAPI(prim)
        opacity = primvars.FindPrimvarWithInheritance("displayOpacity")
        values = np.asarray(opacity.ComputeFlattened(self._time) or [1.0]) if opacity else np.ones(1)
        if values.size and np.ptp(values) > 0:
            self._problems.warn(prim, "displayOpacity that varies is ignored")
            values = np.ones(1)
        colours = primvars.FindPrimvarWithInheritance("displayColor")
        found = colours.ComputeFlattened(self._time) if colours else None
        given: list[float] | Primvar = list(GREY)
        if found is not None and len(found):
            single = len(found) == 1 or not prim.IsA(UsdGeom.Mesh)
            given = constant_colour(found[0]) if single else Primvar("displayColor", GREY)
        return given, float(np.clip(values[0], 0, 1)) if values.size else 1.0

    def _shaded(self, shape: Dict, surface: Surface) -> Dict:
        found = {**shape, "bsdf": reference(surface.bsdf)}
        if surface.emission is not None:
            found["emitter"] = {"type": "area", "radiance": surface.emission}
        return found

    # Meshes

    def _mesh(self, prim: Usd.Prim, matrix: Placement) -> list[Leaf]:
        polygons = self._polygons(prim)
        if polygons is None:
            return []
        self._motions.deforms(prim, ("points",))
        corners, face = polygons.triangles()
        if str(self._get(prim, "orientation", "rightHanded")) == "leftHanded":
            corners = corners[:, ::-1]
        holes = np.asarray(self._get(prim, "holeIndices", []), np.int64)
        keep = ~np.isin(face, holes)
        vertex = polygons.indices[corners]
        keep &= (
            (vertex[:, 0] != vertex[:, 1]) & (vertex[:, 1] != vertex[:, 2]) & (vertex[:, 2] != vertex[:, 0])
        )
        normals = self._normals(prim, polygons, corners)
        leaves = []
        for owner, faces in self._parts(prim, len(polygons.counts)):
            own = keep if faces is None else keep & np.isin(face, faces)
            if not own.any():
                continue
            surface = self._surface(owner, prim)
            part = Part.of(
                polygons,
                corners[own],
                normals,
                self._coordinates(prim, polygons, surface),
                self._colours(prim, polygons, surface),
            )
            leaves += self._sides(str(owner.GetPath()), part, surface, matrix)
        return leaves

    def _polygons(self, prim: Usd.Prim) -> Polygons | None:
        points, counts, indices = (
            self._get(prim, name, []) for name in ("points", "faceVertexCounts", "faceVertexIndices")
        )
        if not len(points) or not len(counts):
            self._problems.warn(prim, "it has no faces: nothing of it is seen")
            return None
        found = Polygons(np.asarray(points), np.asarray(counts, np.int64), np.asarray(indices, np.int64))
        fault = found.fault()
        if fault:
            self._problems.error(prim, fault)
            return None
        return found

    def _normals(self, prim: Usd.Prim, polygons: Polygons, corners: Ints) -> Corners | None:
        """Returns the normals. None: each face is flat."""
        subdivided = str(self._get(prim, "subdivisionScheme", "catmullClark")) != "none"
        if subdivided:
            self._problems.warn(prim, "a subdivision surface: its base mesh is rendered")
        primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("normals")
        if primvar and primvar.HasAuthoredValue():
            return self._corners(prim, primvar, polygons, 3)
        mesh = UsdGeom.Mesh(prim)
        values = mesh.GetNormalsAttr().Get(self._time)
        if values is not None and len(values):
            kind = str(mesh.GetNormalsInterpolation())
            return self._spread(prim, "normals", np.asarray(values), kind, polygons)
        if subdivided:  # as its limit is
            return Corners(smooth_normals(polygons.points, polygons.indices[corners]), polygons.indices)
        return None

    def _coordinates(self, prim: Usd.Prim, polygons: Polygons, surface: Surface) -> Corners | None:
        if surface.coordinates is None:
            return None
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(surface.coordinates)
        found = self._corners(prim, primvar, polygons, 2) if primvar else None
        if found is None:
            self._problems.warn(
                prim, f"it has no primvar {surface.coordinates}, which its material looks up images with"
            )
            found = Corners(np.zeros((1, 2)), np.zeros(len(polygons.indices), np.int64))
        values = np.stack(
            [found.values[:, 0], 1 - found.values[:, 1]], axis=1
        )  # images begin at the top here
        return Corners(values, found.index)

    def _colours(self, prim: Usd.Prim, polygons: Polygons, surface: Surface) -> Corners | None:
        if surface.colours is None:
            return None
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(surface.colours.name)
        found = self._corners(prim, primvar, polygons, 3) if primvar else None
        if found is None:
            one = np.array([surface.colours.fallback])
            return Corners(one, np.zeros(len(polygons.indices), np.int64))
        return Corners(np.clip(found.values, 0, 1), found.index)

    def _corners(
        self, prim: Usd.Prim, primvar: UsdGeom.Primvar, polygons: Polygons, width: int
    ) -> Corners | None:
        values = primvar.ComputeFlattened(self._time)
        if values is None:
            return None
        try:
            array = np.asarray(values, np.float64)
        except (TypeError, ValueError):
            array = np.empty(0)
        if array.ndim != 2 or array.shape[1] != width:
            self._problems.warn(prim, f"its primvar {primvar.GetPrimvarName()} has not {width} numbers each")
            return None
        name, kind = str(primvar.GetPrimvarName()), str(primvar.GetInterpolation())
        return self._spread(prim, name, array, kind, polygons)

    def _spread(
        self, prim: Usd.Prim, name: str, values: Floats, kind: str, polygons: Polygons
    ) -> Corners | None:
        """Returns the index of each vertex's value, by the interpolation."""
        size = len(polygons.indices)
        if kind in ("vertex", "varying"):
            index = polygons.indices
        elif kind == "faceVarying":
            index = np.arange(size)
        elif kind == "uniform":
            index = np.repeat(np.arange(len(polygons.counts)), polygons.counts)
        else:
            index = np.zeros(size, np.int64)
        wanted = int(index.max(initial=-1)) + 1
        if len(values) < wanted or not np.isfinite(values).all():
            self._problems.warn(
                prim,
                f"its primvar {name} has too few values for {kind}, or ones that are not finite: left out",
            )
            return None
        return Corners(values, index)

    def _parts(self, prim: Usd.Prim, count: int) -> list[tuple[Usd.Prim, Ints | None]]:
        """Returns pairs (the prim that has the material, its faces). None: all faces."""
        subsets = UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets()
        if not subsets:
            return [(prim, None)]
        free = np.ones(count, bool)
        parts: list[tuple[Usd.Prim, Ints | None]] = []
        for subset in subsets:
            faces = np.asarray(subset.GetIndicesAttr().Get(self._time) or [], np.int64)
            if faces.size and not 0 <= faces.min() <= faces.max() < count:
                self._problems.error(subset.GetPrim(), "its indices name faces that the mesh does not have")
                continue
            faces = np.unique(faces[free[faces]])  # a face is of the first subset that names it
            free[faces] = False
            parts.append((subset.GetPrim(), faces))
        return [*parts, (prim, np.flatnonzero(free))]

    def _sides(self, name: str, part: Part, surface: Surface, matrix: Placement) -> list[Leaf]:
        sides = [part]
        if surface.emission is not None and not part.closed:  # a sheet gives off light on both sides
            sides.append(part.back(SHEET))
        return [Leaf(name, self._shaded(self._ply(side), surface), matrix) for side in sides]

    def _ply(self, part: Part) -> Dict:
        shape = {"type": "ply", "filename": self._document.files.write(part.ply(), ".ply")}
        return shape if "nx" in part.names else {**shape, "face_normals": True}

    # Basic shapes: (shape, its transform) each

    def _size(self, prim: Usd.Prim, name: str, default: float) -> float:
        value = float(self._get(prim, name, default))
        if not (np.isfinite(value) and value > 0):
            self._problems.warn(prim, f"its {name} is not above 0: left out")
            return 0.0
        return value

    def _sphere(self, prim: Usd.Prim) -> list[tuple[Dict, Matrix]]:
        radius = self._size(prim, "radius", 1.0)
        return [({"type": "sphere", "radius": radius}, np.eye(4))] if radius else []

    def _cube(self, prim: Usd.Prim) -> list[tuple[Dict, Matrix]]:
        half = self._size(prim, "size", 2.0) / 2
        return [({"type": "cube"}, scale(half, half, half))] if half else []

    def _plane(self, prim: Usd.Prim) -> list[tuple[Dict, Matrix]]:
        width, length = self._size(prim, "width", 2.0), self._size(prim, "length", 2.0)
        if not width or not length:
            return []
        turn = {  # (x, y) of the rectangle to the plane's width and length, +z to its axis
            "X": [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]],
            "Y": [[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]],
            "Z": np.eye(4),
        }[str(self._get(prim, "axis", "Z"))]
        return [({"type": "rectangle"}, np.array(turn, float) @ scale(width / 2, length / 2, 1))]

    def _cylinder(self, prim: Usd.Prim) -> list[tuple[Dict, Matrix]]:
        height, axis = self._size(prim, "height", 2.0), str(self._get(prim, "axis", "Z"))
        if prim.HasAttribute("radiusTop"):
            bottom, top = (float(self._get(prim, name, 1.0)) for name in ("radiusBottom", "radiusTop"))
        else:
            bottom = top = self._size(prim, "radius", 1.0)
        if not height or min(bottom, top) < 0 or max(bottom, top) <= 0:
            return []
        return [(self._ply(cylinder_part(bottom, top, height, axis)), np.eye(4))]

    def _cone(self, prim: Usd.Prim) -> list[tuple[Dict, Matrix]]:
        radius, height = self._size(prim, "radius", 1.0), self._size(prim, "height", 2.0)
        if not radius or not height:
            return []
        part = cylinder_part(radius, 0.0, height, str(self._get(prim, "axis", "Z")))
        return [(self._ply(part), np.eye(4))]

    def _capsule(self, prim: Usd.Prim) -> list[tuple[Dict, Matrix]]:
        radius, height = self._size(prim, "radius", 0.5), self._size(prim, "height", 1.0)
        if not radius or not height:
            return []
        return [(self._ply(capsule_part(radius, height, str(self._get(prim, "axis", "Z")))), np.eye(4))]


SHAPES = {
    "Sphere": Geometry._sphere,
    "Cube": Geometry._cube,
    "Plane": Geometry._plane,
    "Cylinder": Geometry._cylinder,
    "Cylinder_1": Geometry._cylinder,
    "Cone": Geometry._cone,
    "Capsule": Geometry._capsule,
}
