"""Traverses a stage and collects its objects and their positions. Everything that is instanced is stored once.

A content is what a stage or a prototype contains: leaves (shapes), single objects (lights and volumes), and instances
of other contents. The scene format has groups of shapes, but no groups within groups: so each content with shapes
becomes one group, and nested instances become instances of the innermost group.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdLux, UsdShade

from ..errors import StageRejected
from .document import Document, reference
from .geometry import Geometry, Leaf
from .ignored import SILENT, tell_prim
from .lights import Lights, is_light
from .links import Links
from .motion import Motions, Placement
from .problems import Problems
from .transforms import Matrix, column_matrix, is_usable
from .visibility import Visibility
from .volumes import Volumes

SHOWN = ("default", "render")  # purposes
MAX_PLACED = 120_000  # shapes and instances, each four elements or more of the 500 000 that a scene can have
MAX_NESTING = 32  # of instances in instances


@dataclasses.dataclass
class Content:
    name: str
    leaves: list[Leaf] = dataclasses.field(default_factory=list)
    others: list[tuple[Usd.Prim, Placement, Callable[[Usd.Prim, Placement], None]]] = dataclasses.field(
        default_factory=list
    )
    instances: list[tuple[Content, Placement]] = dataclasses.field(default_factory=list)
    group: str | None = None
    uses: int = 0
    placed: int = 0
    """Number of objects that one instance places, up to one more than the limit."""

    def measure(self) -> None:
        """Measures the content after the contents that it has instances of."""
        alone = sum(leaf.alone for leaf in self.leaves)
        own = alone + (len(self.leaves) > alone) + len(self.others)
        self.placed = min(own + sum(inner.placed for inner, _ in self.instances), MAX_PLACED + 1)

    def share_uses(self) -> None:
        for inner, _ in self.instances:
            inner.uses = min(inner.uses + self.uses, MAX_PLACED)


class Walk:
    def __init__(
        self,
        document: Document,
        problems: Problems,
        time: Usd.TimeCode,
        geometry: Geometry,
        lights: Lights,
        volumes: Volumes,
        links: Links,
        motions: Motions,
    ) -> None:
        self._document, self._problems, self._time, self._motions = document, problems, time, motions
        self._geometry, self._lights, self._volumes, self._links = geometry, lights, volumes, links
        self._prototypes: dict[Any, Content] = {}
        self._building: list[Any] = []

    def run(self, stage: Usd.Stage) -> None:
        root = Content("the stage")
        for prim in stage.GetPseudoRoot().GetChildren():
            self._visit(prim, Placement(np.eye(4)), root)
        root.measure()
        if root.placed > MAX_PLACED:
            raise StageRejected(f"the stage shows more than {MAX_PLACED} shapes and instances")
        root.uses = 1
        root.share_uses()
        for content in reversed(self._prototypes.values()):  # each before those within it
            content.share_uses()
        self._place(root, Placement(np.eye(4)), whole=True)

    def _visit(self, first: Usd.Prim, around: Placement, content: Content) -> None:
        """Visits a prim and everything below it, without recursion, because hierarchies may be deep."""
        waiting = [(first, around)]
        while waiting:
            prim, parent = waiting.pop()
            with self._problems.reading(prim):
                matrix = self._matrix(prim, parent)
                if matrix is None or not self._seen(prim):
                    continue
                if prim.IsInstance():
                    self._instance(prim, matrix, content)
                elif prim.IsA(UsdGeom.PointInstancer):
                    self._point_instances(prim, matrix, content)
                else:
                    self._add(prim, matrix, content)
                    waiting += [(child, matrix) for child in reversed(_children(prim))]

    def _matrix(self, prim: Usd.Prim, parent: Placement) -> Placement | None:
        if not prim.IsA(UsdGeom.Xformable):
            return parent
        xformable = UsdGeom.Xformable(prim)
        own = column_matrix(xformable.GetLocalTransformation(self._time))
        reset = xformable.GetResetXformStack()
        matrix = own if reset else parent.still @ own
        if not np.isfinite(matrix).all():
            self._problems.error(prim, "its transform is not finite")
            return None
        if not np.array_equal(own[3], (0, 0, 0, 1)):
            self._problems.error(prim, "its transform is a perspective. Make the last column of its matrix 0, 0, 0, 1")
            return None
        if not is_usable(matrix):  # what is flattened is not seen
            return None
        placement = self._motions.local(prim, own)
        return placement if reset else parent @ placement

    def _seen(self, prim: Usd.Prim) -> bool:
        if not prim.IsA(UsdGeom.Imageable):
            return not prim.IsA(UsdShade.Material)
        visibility = UsdGeom.Imageable(prim).GetVisibilityAttr().Get(self._time)
        return bool(visibility != UsdGeom.Tokens.invisible)

    def _add(self, prim: Usd.Prim, matrix: Placement, content: Content) -> None:
        kind = str(prim.GetTypeName())
        tell_prim(prim, self._problems)
        if kind == "SkelAnimation":
            self._motions.deforms(prim, ("translations", "rotations", "scales", "blendShapeWeights"))
        if kind == "SkelRoot" and prim.IsInstanceProxy():
            self._problems.warn(prim, "skinning of an instance is ignored: its meshes stay in their bind pose")
        if not kind or kind in SILENT or not prim.IsA(UsdGeom.Imageable):
            return
        if str(UsdGeom.Imageable(prim).ComputePurpose()) not in SHOWN:
            return
        if is_light(prim):
            content.others.append((prim, matrix, self._lights.add))
        elif kind == "Volume":
            content.others.append((prim, matrix, self._volumes.add))
        elif prim.IsA(UsdGeom.Gprim):
            if prim.HasAPI(UsdLux.LightAPI):
                self._problems.warn(prim, "the light of a mesh is ignored: give it an emissiveColor")
            leaves = self._geometry.leaves(prim, matrix)
            flags = Visibility(prim, self._time, self._problems).of_shape() if leaves else {}
            if leaves:
                flags.update(self._links.of_object(prim))
            for leaf in leaves:
                leaf.shape.update(flags)
            content.leaves += leaves
        elif kind not in SILENT:
            self._problems.warn(prim, f"a {kind} is not read")

    def _instance(self, prim: Usd.Prim, matrix: Placement, content: Content) -> None:
        """Makes an instance. A prototype that looks different because of inherited properties (material, colour,
        purpose) becomes a separate content."""
        material = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)[0]
        primvars = UsdGeom.PrimvarsAPI(prim).FindPrimvarsWithInheritance()
        inherited = tuple((str(p.GetPrimvarName()), str(p.Get(self._time))) for p in primvars)
        purpose = str(UsdGeom.Imageable(prim).ComputePurpose()) if prim.IsA(UsdGeom.Imageable) else ""
        path = material.GetPath() if material else ""
        key = (str(prim.GetPrototype().GetPath()), str(path), purpose, inherited, self._links.key(prim))

        def fill(own: Content) -> None:
            self._add(prim, Placement(np.eye(4)), own)
            for child in _children(prim):
                self._visit(child, Placement(np.eye(4)), own)

        content.instances.append((self._prototype(key, prim, fill), matrix))

    def _point_instances(self, prim: Usd.Prim, matrix: Placement, content: Content) -> None:
        instancer = UsdGeom.PointInstancer(prim)
        if str(instancer.ComputePurpose()) not in SHOWN:
            return
        tell_prim(prim, self._problems)
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        indices = np.asarray(instancer.GetProtoIndicesAttr().Get(self._time) or [], np.int64)
        if indices.size and not 0 <= indices.min() <= indices.max() < len(targets):
            self._problems.error(prim, f"protoIndices name prototypes that it does not have ({len(targets)})")
            return
        places = instancer.ComputeInstanceTransformsAtTime(
            self._time,
            self._time,
            UsdGeom.PointInstancer.IncludeProtoXform,
            UsdGeom.PointInstancer.IgnoreMask,
        )
        if len(places) != indices.size:
            self._problems.error(prim, "positions, orientations or scales do not have as many values as protoIndices")
            return
        mask = instancer.ComputeMaskAtTime(self._time)
        during = self._point_poses(instancer, indices.size)
        prototypes: dict[int, Content] = {}
        for i, index in enumerate(indices):
            if len(mask) and not mask[i]:
                continue
            own = column_matrix(places[i])
            placed = matrix @ Placement(own, during(i, own))
            if not is_usable(placed.still):
                continue
            if index not in prototypes:
                root = prim.GetStage().GetPrimAtPath(targets[index])
                if not root:
                    self._problems.error(prim, f"its prototype {targets[index]} does not exist")
                    return
                prototypes[index] = self._point_prototype(root)
            content.instances.append((prototypes[index], placed))

    def _point_poses(
        self, instancer: UsdGeom.PointInstancer, count: int
    ) -> Callable[[int, Matrix], Matrix | None]:
        """Returns a function of the index and the pose of an instance: its poses while the shutter is open, or None
        if it stands."""
        exposure = self._motions.exposure
        if exposure is None:
            return lambda index, still: None
        found = [
            np.array(places, np.float64).reshape(-1, 4, 4)
            for places in instancer.ComputeInstanceTransformsAtTimes(
                exposure.codes,
                self._time,
                UsdGeom.PointInstancer.IncludeProtoXform,
                UsdGeom.PointInstancer.IgnoreMask,
            )
        ]
        if any(len(places) != count for places in found):
            told = "its motion is not blurred: the number of its instances changes while the shutter is open"
            self._problems.warn(instancer.GetPrim(), told)
            return lambda index, still: None
        poses = np.stack(found).transpose(1, 0, 3, 2)
        return lambda index, still: None if (poses[index] == still).all() else poses[index]

    def _point_prototype(self, root: Usd.Prim) -> Content:
        def fill(own: Content) -> None:
            xformable = UsdGeom.Xformable(root) if root.IsA(UsdGeom.Xformable) else None
            local = column_matrix(xformable.GetLocalTransformation(self._time)) if xformable else np.eye(4)
            if is_usable(local):  # instances have it in their own transforms
                placement = self._motions.local(root, local) if xformable else Placement(local)
                self._visit(root, placement.inverted(), own)

        return self._prototype(str(root.GetPath()), root, fill)

    def _prototype(self, key: Any, prim: Usd.Prim, fill: Callable[[Content], None]) -> Content:
        if key not in self._prototypes:
            if key in self._building or len(self._building) >= MAX_NESTING:
                raise StageRejected(
                    f"{prim.GetPath()}: instances are nested more than {MAX_NESTING} deep, or "
                    "within themselves"
                )
            self._building.append(key)
            content = Content(str(prim.GetPath()))
            fill(content)
            self._building.pop()
            content.measure()
            self._prototypes[key] = content
        return self._prototypes[key]

    def _place(self, content: Content, matrix: Placement, whole: bool = False) -> None:
        single = whole or content.uses == 1
        grouped = [leaf for leaf in content.leaves if not single and not leaf.alone]
        if grouped:
            if content.group is None:
                parts = {
                    f"part{i}": self._geometry.placed(leaf, leaf.matrix) for i, leaf in enumerate(grouped)
                }
                content.group = self._document.define(content.name, {"type": "shapegroup", **parts})
            to_world = self._motions.to_world(content.name, matrix)
            instance = {"type": "instance", "group": reference(content.group), "to_world": to_world}
            self._document.define(f"{content.name} instance", instance)
        for leaf in content.leaves:
            if single or leaf.alone:
                self._document.define(leaf.name, self._geometry.placed(leaf, matrix @ leaf.matrix))
        for prim, own, place in content.others:
            with self._problems.reading(prim):
                place(prim, matrix @ own)
        for inner, own in content.instances:
            self._place(inner, matrix @ own)


def _children(prim: Usd.Prim) -> list[Usd.Prim]:
    found: list[Usd.Prim] = prim.GetFilteredChildren(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))
    return found
