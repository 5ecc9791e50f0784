"""Where prims are while the shutter is open, and the motion that the renderer can follow."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np
from pxr import Gf, Usd, UsdGeom

from .problems import Problems
from .transforms import Matrix, column_matrix, is_similarity, is_usable, mirrors

STEPS = 9  # times of the exposure at which places are asked for, beside those that the stage has
MOST_POSES = 500
LATEST = 1e9  # as in the scene format
MOST_KEYS = 50_000  # of all prims together, each two elements of the 500 000 that a scene can have
ALIKE = 1e-12  # share of their size by which the numbers of two poses differ that count as one
ON_THE_WAY = 1e-7  # the same for a pose that the renderer's own steps between two others give
SHEAR = 1e-3  # the cosine between two axes of a transform that counts as none, as in the renderer


@dataclasses.dataclass(frozen=True)
class Placement:
    """The pose of a prim at the frame, and its poses at the times of the exposure: a stack of matrices, or None if
    it does not move."""

    still: Matrix
    poses: Matrix | None = None

    def __matmul__(self, inner: Placement | Matrix) -> Placement:
        if not isinstance(inner, Placement):
            inner = Placement(inner)
        if self.poses is None and inner.poses is None:
            return Placement(self.still @ inner.still)
        return Placement(self.still @ inner.still, self._during() @ inner._during())

    def inverted(self) -> Placement:
        return Placement(np.linalg.inv(self.still), None if self.poses is None else np.linalg.inv(self.poses))

    @property
    def moves(self) -> bool:
        return self.poses is not None and not all(_alike(pose, self.still) for pose in self.poses)

    def is_similarity(self) -> bool:
        return is_similarity(self.still) and (
            self.poses is None or all(is_similarity(pose) for pose in self.poses)
        )

    def _during(self) -> Matrix:
        return self.still if self.poses is None else self.poses


@dataclasses.dataclass(frozen=True)
class Exposure:
    """The times at which the stage is asked where its prims are, relative to `frame`, from the opening of the
    shutter to its closing."""

    frame: float
    times: tuple[float, ...]

    @classmethod
    def of(cls, camera: UsdGeom.Camera, time: Usd.TimeCode) -> Exposure | None:
        """Returns None if the shutter is closed, or the stage has no times."""
        opens, closes = shutter(camera, time)
        if not (opens < closes and time.IsNumeric()):
            return None
        if max(abs(opens), abs(closes)) > LATEST:
            raise ValueError(f"shutter:open and shutter:close are times of at most {LATEST:g} in size")
        frame = time.GetValue()
        evenly = [float(step) for step in np.linspace(opens, closes, STEPS)]
        during = Gf.Interval(frame + opens, frame + closes)
        found: set[float] = set()
        for prim in Usd.PrimRange.Stage(camera.GetPrim().GetStage(), Usd.TraverseInstanceProxies()):
            if prim.IsA(UsdGeom.Xformable):
                found.update(UsdGeom.Xformable(prim).GetTimeSamplesInInterval(during))
            if prim.IsA(UsdGeom.PointInstancer):
                for name in ("positions", "orientations", "scales"):
                    found.update(prim.GetAttribute(name).GetTimeSamplesInInterval(during))
        times = sorted({*evenly, *(at - frame for at in found if opens < at - frame < closes)})
        if len(times) > MOST_POSES:
            times = [float(step) for step in np.linspace(opens, closes, MOST_POSES)]
        return cls(frame, tuple(times))

    @property
    def codes(self) -> list[Usd.TimeCode]:
        return [Usd.TimeCode(self.frame + at) for at in self.times]

    def changed(self, prim: Usd.Prim, names: Iterable[str]) -> list[str]:
        """Returns those of the attributes whose values change while the shutter is open."""
        found = []
        for name in names:
            attribute = prim.GetAttribute(name)
            if attribute and attribute.ValueMightBeTimeVarying():
                now = attribute.Get(Usd.TimeCode(self.frame))
                if any(attribute.Get(at) != now for at in (self.codes[0], self.codes[-1])):
                    found.append(name)
        return found


def shutter(camera: UsdGeom.Camera, time: Usd.TimeCode) -> tuple[float, float]:
    """Returns when the shutter opens and closes, in frames from the one that is rendered."""
    values = (camera.GetPrim().GetAttribute(f"shutter:{name}").Get(time) for name in ("open", "close"))
    opens, closes = (0.0 if value is None else float(value) for value in values)
    return opens, closes


class Motions:
    """Makes the animations of the prims that move, and reports what moves and cannot be blurred."""

    def __init__(self, problems: Problems, exposure: Exposure | None) -> None:
        self._problems, self.exposure = problems, exposure
        self._keys = 0

    @property
    def any(self) -> bool:
        return self._keys > 0

    def local(self, prim: Usd.Prim, still: Matrix) -> Placement:
        """Returns the own transform of a prim, which is `still` at the frame."""
        xformable = UsdGeom.Xformable(prim)
        if self.exposure is None or not xformable.TransformMightBeTimeVarying():
            return Placement(still)
        poses = np.stack([_local_at(xformable, at) for at in self.exposure.codes])
        usable = all(is_usable(pose) and np.array_equal(pose[3], (0, 0, 0, 1)) for pose in poses)
        if usable and not mirrors_apart(poses, still):
            return Placement(still, poses)
        why = "a transform while the shutter is open flattens it or mirrors unlike that of the frame"
        self._problems.warn(prim, f"its motion is not blurred: {why}")
        return Placement(still)

    def to_world(self, prim: object, placement: Placement, rigid: bool = False) -> Matrix | dict[float, Matrix]:
        """Returns what places an object: a matrix, or matrices by times. `rigid`: the renderer refuses poses that
        stretch it."""
        if self.exposure is None or placement.poses is None or not placement.moves:
            return placement.still
        poses = placement.poses
        why = ""
        if not all(is_usable(pose) for pose in poses) or mirrors_apart(poses, placement.still):
            why = "a transform while the shutter is open flattens it or mirrors unlike that of the frame"
        elif any(_shears(pose) for pose in poses):
            why = "its transform shears"
        elif rigid and not all(is_similarity(pose) for pose in poses):
            why = "its transform stretches it, and it gives off light"
        kept = [0] if why or all(_alike(pose, poses[0]) for pose in poses) else _needed(self.exposure.times, poses)
        if not why and self._keys + len(kept) > MOST_KEYS:
            why = "too many prims of the stage move"
        if why:
            self._problems.warn(prim, f"its motion is not blurred: {why}")
            return placement.still
        if len(kept) == 1:  # it stands somewhere else at the frame than while the shutter is open
            return np.array(poses[0])
        self._keys += len(kept)
        return {self.exposure.times[i]: poses[i] for i in kept}

    def stands(self, prim: Usd.Prim, placement: Placement, what: str) -> None:
        """Reports the motion of a prim of a kind that the renderer does not move."""
        if placement.moves:
            self._problems.warn(prim, f"its motion is not blurred: {what} is rendered where it is at the frame")

    def deforms(self, prim: Usd.Prim, names: Iterable[str]) -> None:
        """Reports the attributes of a shape that change while the shutter is open."""
        for name in self.exposure.changed(prim, names) if self.exposure is not None else ():
            self._problems.warn(prim, f"{name} changes while the shutter is open: its value at the frame is taken")


def mirrors_apart(poses: Matrix, still: Matrix) -> bool:
    return any(mirrors(pose) != mirrors(still) for pose in poses)


def _local_at(xformable: UsdGeom.Xformable, time: Usd.TimeCode) -> Matrix:
    """Returns the own transform of a prim. Between two matrices it turns at a constant rate, as in the renderer,
    where USD's mean of their numbers would shrink and shear it."""
    ops = xformable.GetOrderedXformOps()
    if len(ops) == 1 and ops[0].GetOpType() == UsdGeom.XformOp.TypeTransform and not ops[0].IsInverseOp():
        attribute, at = ops[0].GetAttr(), time.GetValue()
        around = attribute.GetBracketingTimeSamples(at)
        held = xformable.GetPrim().GetStage().GetInterpolationType() == Usd.InterpolationTypeHeld
        if len(around) == 2 and around[0] < at < around[1] and not held:
            one, two = (column_matrix(attribute.Get(sample)) for sample in around)
            fit = is_usable(one) and is_usable(two) and not _shears(one) and not _shears(two)
            if fit and mirrors(one) == mirrors(two):
                share = (at - around[0]) / (around[1] - around[0])
                return _between(one, two, np.array([share])).reshape(4, 4)
    return column_matrix(xformable.GetLocalTransformation(time))


def _alike(one: Matrix, two: Matrix, share: float = ALIKE) -> bool:
    size = np.abs(one).max(axis=0)
    return bool((np.abs(one - two) <= share * np.maximum(size, size[:3].max(initial=0))).all())


def _shears(pose: Matrix) -> bool:
    axes = pose[:3, :3] / np.linalg.norm(pose[:3, :3], axis=0)
    return bool(np.abs(axes.T @ axes - np.eye(3)).max() > SHEAR)


def _needed(times: tuple[float, ...], poses: Matrix) -> list[int]:
    """Returns the indices of the poses of which the renderer makes the others (Douglas and Peucker, 1973)."""
    kept, waiting = {0, len(times) - 1}, [(0, len(times) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        inner = np.arange(first + 1, last)
        shares = (np.array(times)[inner] - times[first]) / (times[last] - times[first])
        off = np.abs(_between(poses[first], poses[last], shares) - poses[inner])
        size = np.abs(poses[[first, last]]).max(axis=0)
        excess = (off / np.maximum(size, size[:3, :3].max())).max(axis=(1, 2))
        if excess.max() > ON_THE_WAY:
            worst = int(inner[excess.argmax()])
            kept.add(worst)
            waiting += [(first, worst), (worst, last)]
    return sorted(kept)


def _between(one: Matrix, two: Matrix, shares: Matrix) -> Matrix:
    """Returns the poses at these shares of the time between two: translation and scale change linearly, and the
    rotation at a constant rate along the shorter way."""
    sizes = [np.linalg.norm(pose[:3, :3], axis=0) for pose in (one, two)]
    if mirrors(one):
        for size in sizes:
            size[0] = -size[0]
    turns = [pose[:3, :3] / size for pose, size in zip((one, two), sizes)]
    way = Gf.Matrix3d((turns[0].T @ turns[1]).T.tolist()).GetOrthonormalized(False).ExtractRotation()
    angle, axis = math.radians(way.GetAngle()), np.array(way.GetAxis())
    if angle > math.pi:
        angle, axis = 2 * math.pi - angle, -axis
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turned = angle * shares[:, None, None]
    rotation = np.eye(3) + np.sin(turned) * cross + (1 - np.cos(turned)) * (cross @ cross)
    poses = np.tile(np.eye(4), (len(shares), 1, 1))
    rest = (1 - shares)[:, None]
    size = rest * sizes[0] + shares[:, None] * sizes[1]
    poses[:, :3, :3] = turns[0] @ rotation * size[:, None, :]
    poses[:, :3, 3] = rest * one[:3, 3] + shares[:, None] * two[:3, 3]
    return poses
