"""Where the camera and the objects are while the shutter is open."""

import hashlib

import numpy as np

STEPS = 8  # equal parts of the exposure, between which places are asked for
SHEAR = 1e-3  # the cosine between two axes of a transform that counts as none, as in the renderer
STRETCH = 1e-5  # share by which the squares of the axes of a shape that emits may differ
ON_THE_WAY = 1e-5  # share of its size by which a pose of single precision may leave the way between two others


class Exposure:
    """What moves while the shutter is open. Empty if it is closed."""

    def __init__(self):
        self.opens = self.closes = 0
        self.camera = {}  # matrices by times, in frames from the one that is rendered
        self.objects = {}  # the same for each instance that moves, by key_of()
        self.deformed = set()  # names of the objects whose meshes change

    def placement(self, problems, instance):
        """Returns the Placement of an instance, whose pose at the frame is its matrix."""
        still = instance.matrix_world.copy()
        poses = self.objects.get(key_of(instance), {})
        item = instance.object
        if item.name in self.deformed:
            problems.warning(
                f"object '{item.name}': it deforms while the shutter is open, which is not blurred: its shape is that of the frame"
            )
        holders = [item, instance.parent] if instance.is_instance else [item]
        if not all(holder.cycles.use_motion_blur for holder in holders):
            poses = {}
        if poses and len(poses) <= STEPS:
            problems.warning(
                f"object '{item.name}': it appears or vanishes while the shutter is open, and its motion is not blurred"
            )
            poses = {}
        return Placement(item, still, poses)


class Placement:
    """The pose of an object at the frame, and its poses by times. None of these if it does not move."""

    def __init__(self, item, still, poses):
        self.kind, self.name = "light" if item.type == "LIGHT" else "object", item.name
        self.still, self.poses = still, poses

    def __matmul__(self, inner):
        """Returns the placement of a part of the object."""
        made = Placement.__new__(Placement)
        made.kind, made.name, made.still = self.kind, self.name, self.still @ inner
        made.poses = {time: pose @ inner for time, pose in self.poses.items()}
        return made

    def stands(self, problems, what):
        """Reports the motion of what the renderer does not move."""
        if self.poses:
            problems.warning(
                f"{self.kind} '{self.name}': its motion is not blurred: {what} is rendered where it is at the frame"
            )

    def to_world(self, problems, emits=False):
        """Returns a matrix, or matrices by times. `emits`: the renderer refuses poses that stretch it."""
        poses = list(self.poses.values())
        if not poses:
            return self.still
        why = None
        if any(abs(pose.determinant()) < 1e-30 for pose in poses):
            why = "it is flattened"
        elif len({pose.determinant() > 0 for pose in poses}) > 1:
            why = "it is mirrored on its way"
        elif any(shear(pose) > SHEAR for pose in poses):
            why = "its transform shears"
        elif emits and any(is_stretched(pose) for pose in poses):
            why = "its scale differs along its axes, and it emits light. Apply the scale"
        if why:
            problems.warning(f"{self.kind} '{self.name}': its motion is not blurred: {why}")
            return self.still
        first, last = min(self.poses), max(self.poses)
        if all(
            far(pose, between(self.poses[first], self.poses[last], (time - first) / (last - first))) <= ON_THE_WAY
            for time, pose in self.poses.items()
        ):
            return {time: self.poses[time] for time in (first, last)}
        return self.poses


def key_of(instance):
    """What an instance is known by at all times."""
    if not instance.is_instance:
        return instance.object.name_full
    return instance.object.name_full, instance.parent.name_full, tuple(instance.persistent_id)


def shutter(render):
    """When the shutter opens and closes, in frames from the one that is rendered."""
    length = render.motion_blur_shutter
    return {"START": (0, length), "CENTER": (-length / 2, length / 2), "END": (-length, 0)}[
        render.motion_blur_position
    ]


def exposure_of(engine, depsgraph):
    """Returns the Exposure of the frame.

    The engine sets the times, as Blender lets nobody else do so while it renders."""
    scene, found = depsgraph.scene, Exposure()
    render, camera = scene.render, scene.camera
    if not render.use_motion_blur or camera is None or not render.motion_blur_shutter > 0:
        return found
    found.opens, found.closes = shutter(render)
    frame, subframe = scene.frame_current, scene.frame_subframe
    deforming = {
        instance.object.name for instance in depsgraph.object_instances if may_deform(instance.object, scene)
    }
    camera_poses, objects, points = {}, {}, {}
    try:
        for step in range(STEPS + 1):
            time = found.opens + (found.closes - found.opens) * step / STEPS
            whole = int((frame + subframe + time) // 1)
            engine.frame_set(whole, frame + subframe + time - whole)
            seen = set()
            camera_poses[time] = camera.evaluated_get(depsgraph).matrix_world.copy()
            for instance in depsgraph.object_instances:
                objects.setdefault(key_of(instance), {})[time] = instance.matrix_world.copy()
                name = instance.object.name
                if name in deforming and name not in seen and step in (0, STEPS // 2, STEPS):
                    seen.add(name)
                    points.setdefault(name, set()).add(points_of(instance.object))
    finally:
        engine.frame_set(frame, subframe)
    # The camera's field of view and focus are those of the frame.
    found.camera = camera_poses if moves(camera_poses) else {}
    found.objects = {key: poses for key, poses in objects.items() if moves(poses)}
    found.deformed = {name for name, shapes in points.items() if len(shapes) > 1}
    return found


def moves(poses):
    first, *others = poses.values()
    return len(poses) <= STEPS or any(pose != first for pose in others)


def may_deform(item, scene):
    """Returns False if the shape of an object certainly is the same at all times."""
    if item.type != "MESH":
        return item.type in ("CURVE", "SURFACE", "FONT", "META")
    return len(item.modifiers) > 0 or item.original.is_deform_modified(scene, "RENDER")


def points_of(item):
    """Returns a digest of the vertices of an object."""
    mesh = item.to_mesh()
    found = np.empty(len(mesh.vertices) * 3 if mesh else 0, np.float32)
    if mesh:
        mesh.vertices.foreach_get("co", found)
    item.to_mesh_clear()
    return hashlib.sha256(found).digest()


def axes_of(pose):
    return [pose.col[i].xyz for i in range(3)]


def shear(pose):
    x, y, z = (axis.normalized() for axis in axes_of(pose))
    return max(abs(x @ y), abs(y @ z), abs(z @ x))


def is_stretched(pose):
    x, y, z = axes_of(pose)
    size = x @ x
    off = (y @ y - size, z @ z - size, x @ y, y @ z, z @ x)
    return max(map(abs, off)) > STRETCH * size


def between(one, two, share):
    """Returns the pose at this share of the time between two, as the renderer makes it."""
    (place, turn, size), (other_place, other_turn, other_size) = one.decompose(), two.decompose()
    return type(one).LocRotScale(
        place.lerp(other_place, share), turn.slerp(other_turn, share), size.lerp(other_size, share)
    )


def far(pose, other):
    """Returns the largest difference of two poses, as a share of their size."""
    rows = [(a, b) for row, other_row in zip(pose, other) for a, b in zip(row, other_row)]
    return max(abs(a - b) for a, b in rows) / max(abs(a) for a, _ in rows)
