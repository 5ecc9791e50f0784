"""Where the camera is while the shutter is open."""

STEPS = 8  # equal parts of the exposure, between which the camera is asked for


def exposure(render):
    """When the shutter opens and closes, in frames from the one that is rendered."""
    shutter = render.motion_blur_shutter
    return {"START": (0, shutter), "CENTER": (-shutter / 2, shutter / 2), "END": (-shutter, 0)}[
        render.motion_blur_position
    ]


def poses_of_camera(engine, depsgraph):
    """Returns the camera's matrices by times, in frames from the one that is rendered. Empty if it does not move.

    The engine sets the times, as Blender lets nobody else do so while it renders."""
    scene = depsgraph.scene
    render, camera = scene.render, scene.camera
    if not render.use_motion_blur or camera is None or not render.motion_blur_shutter > 0:
        return {}
    opens, closes = exposure(render)
    frame, subframe = scene.frame_current, scene.frame_subframe
    poses = {}
    try:
        for step in range(STEPS + 1):
            time = opens + (closes - opens) * step / STEPS
            whole = int((frame + subframe + time) // 1)
            engine.frame_set(whole, frame + subframe + time - whole)
            poses[time] = camera.evaluated_get(depsgraph).matrix_world.copy()
    finally:
        engine.frame_set(frame, subframe)
    first = poses[opens]  # the field of view and the focus are those of the frame
    return poses if any(pose != first for pose in poses.values()) else {}
