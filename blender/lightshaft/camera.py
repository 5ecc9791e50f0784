"""The camera, the film and the integrator."""

import math

from .document import element, reference
from .problems import ExportError

TURNED = ((-1, 0, 0, 0), (0, 1, 0, 0), (0, 0, -1, 0), (0, 0, 0, 1))  # looks along +z with +x to the left


def add_camera(document, problems, camera, scene, size, medium, matrix_class, exposure):
    """Adds the camera. `medium`: the id of the medium around the camera, or None. `matrix_class`: Blender's
    Matrix. `exposure`: its Exposure, in which other objects may move."""
    data, name = camera.data, camera.name
    render = scene.render
    if abs(render.pixel_aspect_x - render.pixel_aspect_y) > 1e-6:
        raise ExportError("Output > Format: Aspect X and Y must be equal; Lightshaft's pixels are square")
    if render.use_border:
        raise ExportError("Output > Format: Render Region is not supported. Switch it off (Ctrl Alt B)")
    if data.type not in ("PERSP", "ORTHO"):
        kind = "panoramas" if data.type == "PANO" else "cameras of your own"
        raise ExportError(
            f"camera '{name}': {kind} are not supported. Choose Lens > Type: Perspective or Orthographic"
        )
    if render.use_multiview:
        problems.unsupported("Output > Stereoscopy. Lightshaft renders one view: switch it off")
    if abs(scene.cycles.film_exposure - 1) > 1e-6:
        problems.unsupported("Render Properties > Film: Exposure. Set it to 1, and use Color Management")
    if render.film_transparent and scene.cycles.film_transparent_glass:
        problems.unsupported(
            "Render Properties > Film: Transparent Glass. Lightshaft's glass is opaque: switch it off"
        )
    if scene.cycles.use_fast_gi:
        problems.warning(
            "Render Properties > Light Paths: Fast GI Approximation has no effect: all light is traced"
        )
    width, height = size
    poses = exposure.camera or {0: camera.matrix_world}
    if any(abs(pose.determinant()) < 1e-30 for pose in poses.values()):
        raise ExportError(f"camera '{name}': its scale is 0. Set it to 1")
    inner = matrix_class(TURNED)
    fit = data.sensor_fit if data.sensor_fit != "AUTO" else ("HORIZONTAL" if width >= height else "VERTICAL")
    frame = width if fit == "HORIZONTAL" else height
    values = {"near_clip": float(data.clip_start), "far_clip": float(data.clip_end)}
    plugin = "perspective"
    if data.type == "ORTHO":
        plugin = "orthographic"
        half = data.ortho_scale / 2 * width / frame
        step = data.ortho_scale
        inner = inner @ matrix_class.Translation((-data.shift_x * step, data.shift_y * step, 0))
        inner = inner @ matrix_class.Diagonal((half, half, 1, 1))
    else:
        # Where the fit is automatic the sensor's width is along the longer side.
        sensor = data.sensor_height if data.sensor_fit == "VERTICAL" else data.sensor_width
        values["fov"] = math.degrees(2 * math.atan(sensor / 2 / data.lens))
        values["fov_axis"] = "x" if fit == "HORIZONTAL" else "y"
        values["principal_point_offset_x"] = data.shift_x * frame / width
        values["principal_point_offset_y"] = -data.shift_y * frame / height
        dof = data.dof
        if dof.use_dof:
            plugin = "thinlens"
            values["aperture_radius"] = lens_radius(data)
            values["focus_distance"] = focus_distance(camera)
            if dof.aperture_blades >= 3 or abs(dof.aperture_ratio - 1) > 1e-6:
                problems.unsupported(
                    f"camera '{name}': Aperture > Blades and Ratio. Lightshaft's lens is round: set them to 0 and 1"
                )
    to_world = {time: unscaled(pose, matrix_class) @ inner for time, pose in poses.items()}
    if len(to_world) > 1:
        values["shutter_open"], values["shutter_close"] = float(min(to_world)), float(max(to_world))
    else:
        to_world = to_world.popitem()[1]
        if document.root.find(".//animation") is not None:
            values["shutter_open"], values["shutter_close"] = float(exposure.opens), float(exposure.closes)
    if render.use_motion_blur and scene.cycles.rolling_shutter_type != "NONE":
        problems.unsupported("Render Properties > Motion Blur: Rolling Shutter. Set it to None")
    transparent = True if render.film_transparent else None
    film = element(
        "film",
        "hdrfilm",
        None,
        element("rfilter", "gaussian"),
        width=width,
        height=height,
        transparent=transparent,
    )
    sampler = element("sampler", "independent", None, sample_count=int(scene.lightshaft.samples))
    inside = reference(medium, "medium") if medium else None
    document.add(element("sensor", plugin, None, film, sampler, inside, to_world=to_world, **values))
    document.add(element("integrator", "volpath", None, max_depth=int(scene.lightshaft.max_depth)))


def may_see(camera, scene, size, centre, radius, matrix_class):
    """Returns False if no ray of the camera meets the ball around `centre` before the ray is scattered."""
    data = camera.data
    x, y, z = unscaled(camera.matrix_world, matrix_class).inverted() @ centre
    depth, corners = -z, data.view_frame(scene=scene)
    # How far rays spread per unit of depth; the corners of a perspective frame are at the depth 1 / spread.
    spread = -1 / corners[0].z if data.type == "PERSP" else 0
    if spread and data.dof.use_dof:
        # A ray from the edge of the lens leaves the ray through its middle by |1 - depth / focus| of the lens's radius.
        radius += lens_radius(data) * max(1, (depth + radius) / focus_distance(camera))
    for place, axis in ((x, 0), (y, 1)):
        low, high = (bound(corner[axis] for corner in corners) for bound in (min, max))
        edge = 2 * (high - low) / size[axis]  # the filter reaches less than two pixels beyond the frame
        for side, outer in ((-1, edge - low), (1, edge + high)):
            slope = outer * spread
            if side * place > (slope * depth if spread else outer) + radius * math.hypot(1, slope):
                return False
    return depth > -radius


def lens_radius(data):
    return data.lens * 1e-3 / (2 * data.dof.aperture_fstop)


def unscaled(matrix, matrix_class):
    """Removes scale and shear. The axis z and the plane of z and y stay, and a mirroring stays."""
    y, z = matrix.col[1].xyz, matrix.col[2].xyz.normalized()
    x = y.cross(z).normalized()
    side = x if matrix.determinant() > 0 else -x
    rows = zip(side, z.cross(x), z, matrix.translation)
    return matrix_class([*map(list, rows), [0, 0, 0, 1]])


def focus_distance(camera):
    """Returns the distance in focus along the view axis, as Blender measures it: to the focus object, or the given
    value."""
    dof = camera.data.dof
    if dof.focus_object is None:
        return float(dof.focus_distance)
    rigid = camera.matrix_world.normalized()
    return max(1e-3, -(rigid.inverted() @ dof.focus_object.matrix_world.translation).z)
