"""Reads the camera of a stage and the size of its frame."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pxr import Gf, Usd, UsdGeom

from ..errors import StageRejected
from .document import Document
from .ignored import tell_prim
from .motion import MOST_POSES, STEPS, Motions, shutter
from .problems import Problems
from .shading import plain
from .transforms import Matrix, column_matrix, is_usable, scale, translation, unscaled

TURNED = scale(-1, 1, -1)  # looks along +z with +x to the left
NEAR, FAR = 1e-4, 1e7  # of the depths that are seen, unless the camera says otherwise
WIDTH = 960  # pixels of a frame whose size nobody gives
FRAMED = 50.0  # degrees of the view of a stage without a camera
TENTH = 0.1  # apertures and focal lengths are in tenths of a scene unit


def chosen(stage: Usd.Stage, wanted: str | None) -> UsdGeom.Camera | None:
    """Returns the camera with the given path; else that of the render settings, or the only one. None: the stage
    has none."""
    if wanted is None:
        settings = render_settings(stage)
        relationship = settings.GetRelationship("camera") if settings else None
        targets = relationship.GetForwardedTargets() if relationship else []
        wanted = str(targets[0]) if targets else None
    if wanted is not None:
        prim = stage.GetPrimAtPath(wanted) if wanted.startswith("/") else None
        if not prim or not prim.IsA(UsdGeom.Camera):
            raise StageRejected(f"there is no camera {wanted}; {_known(stage)}")
        return UsdGeom.Camera(prim)
    found = _cameras(stage)
    if len(found) > 1:
        raise StageRejected(f"give camera=, the path of one: {_known(stage)}")
    return found[0] if found else None


def _cameras(stage: Usd.Stage) -> list[UsdGeom.Camera]:
    prims = Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies())
    return [UsdGeom.Camera(prim) for prim in prims if prim.IsA(UsdGeom.Camera)]


def _known(stage: Usd.Stage) -> str:
    paths = [str(camera.GetPath()) for camera in _cameras(stage)]
    return f"the stage has {', '.join(paths)}" if paths else "the stage has none"


def render_settings(stage: Usd.Stage) -> Usd.Prim | None:
    path = stage.GetMetadata("renderSettingsPrimPath")
    prim = stage.GetPrimAtPath(path) if path else None
    return prim if prim else None


def frame_size(stage: Usd.Stage, given: tuple[int, int] | None, aspect: float) -> tuple[int, int]:
    if given:
        return given
    settings = render_settings(stage)
    resolution = settings.GetAttribute("resolution").Get() if settings else None
    if resolution is not None:
        return int(resolution[0]), int(resolution[1])
    return WIDTH, max(round(WIDTH / aspect), 1)


def add_camera(
    document: Document,
    problems: Problems,
    camera: UsdGeom.Camera,
    time: Usd.TimeCode,
    size: tuple[int, int] | None,
    medium: str | None,
    motions: Motions,
) -> None:
    prim = camera.GetPrim()

    def get(name: str, default: float) -> float:
        value = prim.GetAttribute(name).Get(time)
        return default if value is None else float(value)

    across, along = get("horizontalAperture", 20.955), get("verticalAperture", 15.2908)
    focal = get("focalLength", 50.0)
    if not (across > 0 and along > 0 and focal > 0):
        raise StageRejected(f"{camera.GetPath()}: apertures and focal length must be above 0")
    if get("exposure", 0.0) != 0:
        problems.warn(prim, "exposure has no effect: images are linear, and --exposure shows them brighter")
    if plain(prim.GetAttribute("clippingPlanes").Get(time)):
        problems.warn(prim, "clippingPlanes are left out")
    width, height = frame_size(camera.GetPrim().GetStage(), size, across / along)
    # The frame holds all of the aperture: where its shape differs it shows more.
    wide = width / height >= across / along
    shown = (along * width / height, along) if wide else (across, across * height / width)
    opens, closes = shutter(camera, time)
    if opens < closes and time.IsNumeric():
        for name in ("focalLength", "focusDistance", "fStop", "horizontalAperture", "verticalAperture"):
            attribute = prim.GetAttribute(name)
            if len({attribute.Get(time.GetValue() + at) for at in (opens, closes)}) > 1:
                problems.warn(prim, f"{name} changes while the shutter is open: its value at the frame is taken")
    poses = _poses(camera, time, opens, closes)
    tell_prim(prim, problems)
    shift = get("horizontalApertureOffset", 0.0), get("verticalApertureOffset", 0.0)
    sensor: dict[str, Any] = {"type": "perspective"}
    if len(poses) > 1:
        sensor["shutter_open"], sensor["shutter_close"] = min(poses), max(poses)
    elif motions.any and motions.exposure is not None:
        sensor["shutter_open"], sensor["shutter_close"] = (motions.exposure.times[i] for i in (0, -1))

    def place(inner: Matrix) -> None:
        matrices = {at: pose @ inner for at, pose in poses.items()}
        sensor["to_world"] = matrices if len(matrices) > 1 else matrices.popitem()[1]

    if str(prim.GetAttribute("projection").Get(time)) == "orthographic":
        sensor["type"] = "orthographic"
        half = shown[0] * TENTH / 2
        place(translation(shift[0] * TENTH, shift[1] * TENTH, 0) @ TURNED @ scale(half, half, 1))
    else:
        place(TURNED)
        axis = 1 if wide else 0
        sensor["fov_axis"] = "xy"[axis]
        sensor["fov"] = 2 * math.degrees(math.atan(shown[axis] / (2 * focal)))
        sensor["principal_point_offset_x"] = shift[0] / shown[0]
        sensor["principal_point_offset_y"] = -shift[1] / shown[1]
        stop, distance = get("fStop", 0.0), get("focusDistance", 0.0)
        if stop > 0 and distance > 0:
            sensor["type"] = "thinlens"
            sensor["aperture_radius"] = focal * TENTH / (2 * stop)
            sensor["focus_distance"] = distance
    sensor["near_clip"], sensor["far_clip"] = _clipping(problems, prim, time)
    _add(document, str(camera.GetPath()), sensor, (width, height), medium)


def _poses(
    camera: UsdGeom.Camera, time: Usd.TimeCode, opens: float, closes: float
) -> dict[float, Matrix]:
    """Returns where the camera is, without its scale, by times relative to that of the frame. One: it does not move."""

    def pose(at: Usd.TimeCode) -> Matrix:
        matrix = column_matrix(camera.ComputeLocalToWorldTransform(at))
        if not is_usable(matrix):
            raise StageRejected(f"{camera.GetPath()}: its transform flattens the camera to nothing")
        return unscaled(matrix)

    if time.IsNumeric() and opens < closes:
        frame = time.GetValue()
        times = {frame + float(step) for step in np.linspace(opens, closes, STEPS)}
        during = Gf.Interval(frame + opens, frame + closes)
        prim = camera.GetPrim()
        while prim:
            if prim.IsA(UsdGeom.Xformable):
                times.update(UsdGeom.Xformable(prim).GetTimeSamplesInInterval(during))
            prim = prim.GetParent()
        if len(times) > MOST_POSES:
            times = {frame + float(step) for step in np.linspace(opens, closes, MOST_POSES)}
        poses = {at - frame: pose(Usd.TimeCode(at)) for at in sorted(times)}
        first = next(iter(poses.values()))
        if any((other != first).any() for other in poses.values()):
            return poses
    return {0.0: pose(time)}


def _clipping(problems: Problems, prim: Usd.Prim, time: Usd.TimeCode) -> tuple[float, float]:
    """Returns the smallest and the largest visible depth. Everything is visible unless the camera limits it."""
    attribute = prim.GetAttribute("clippingRange")
    if not attribute.HasAuthoredValue():
        return NEAR, FAR
    near, far = plain(attribute.Get(time))
    if not near < far or far <= NEAR:
        problems.warn(prim, f"clippingRange ({near:g}, {far:g}) shows nothing: nothing is clipped")
        return NEAR, FAR
    return max(near, NEAR), far if math.isfinite(far) else FAR


def add_framing_camera(
    document: Document, problems: Problems, stage: Usd.Stage, time: Usd.TimeCode, size: tuple[int, int] | None
) -> None:
    """Adds a camera that shows the whole stage from its front: from +z, or from -y if z points up."""
    problems.warn("the stage", "it has no camera: all of it is seen, from its front")
    _drop_extents(stage)
    cache = UsdGeom.BBoxCache(time, [UsdGeom.Tokens.default_, UsdGeom.Tokens.render])
    box = cache.ComputeWorldBound(stage.GetPseudoRoot()).ComputeAlignedRange()
    if box.IsEmpty():
        raise StageRejected("the stage shows nothing: no mesh, shape or volume with an extent")
    middle, extent = np.array(box.GetMidpoint()), np.array(box.GetSize())
    stands = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
    width, height = frame_size(stage, size, 4 / 3)
    across, depth, along = (extent[0], extent[1], extent[2]) if stands else (extent[0], extent[2], extent[1])
    reach = max(across, along * width / height, 1e-6) / 2 / math.tan(math.radians(FRAMED / 2))
    to_world = np.eye(4)
    if stands:
        to_world[:3, :3] = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float)
        to_world[:3, 3] = middle - [0, depth / 2 + reach, 0]
    else:
        to_world[:3, 3] = middle + [0, 0, depth / 2 + reach]
    sensor: dict[str, Any] = {"type": "perspective", "to_world": to_world @ TURNED}
    sensor.update(fov=FRAMED, fov_axis="x", near_clip=NEAR, far_clip=FAR)
    _add(document, "camera", sensor, (width, height), None)


def _drop_extents(stage: Usd.Stage) -> None:
    """Blocks the extents of meshes, which may be wrong, so that the box is computed of their points."""
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        for prim in stage.Traverse():
            if prim.IsA(UsdGeom.PointBased) and prim.GetAttribute("extent").HasAuthoredValue():
                prim.GetAttribute("extent").Block()


def eye(camera: UsdGeom.Camera, time: Usd.TimeCode) -> Matrix:
    return column_matrix(camera.ComputeLocalToWorldTransform(time))[:3, 3]


def _add(
    document: Document, name: str, sensor: dict[str, Any], size: tuple[int, int], medium: str | None
) -> None:
    film = {"type": "hdrfilm", "width": size[0], "height": size[1], "rfilter": {"type": "gaussian"}}
    sensor["film"] = film
    if medium:
        sensor["medium"] = {"type": "ref", "id": medium}
    document.define(name, sensor)
