"""Motion blur of the camera, beside Cycles and by its exported scene."""

import pytest
from test_against_cycles import EXACT, compare

SAMPLES = 64


@pytest.fixture
def moving(stage):
    """A camera that moves aside and turns from frame 1 to frame 2, before a ball on a floor under a sky and a lamp."""
    from stage import diffuse

    stage.plane(diffuse())
    stage.ball(diffuse((0.1, 0.7, 0.1)))
    stage.sky(0.5)
    stage.light("SPOT", 300, (2, 2, 4), (0.4, 0, 2.4), spot_size=1.2, shadow_soft_size=0)
    camera = stage.camera
    for frame, move, turn in ((1, 0.0, 0.0), (2, 1.5, 0.25)):
        camera.location = (7.36 - move, -6.93 + move, 4.96)
        camera.rotation_euler = (1.109, 0.05 * turn, 0.815 + turn)
        camera.keyframe_insert("location", frame=frame)
        camera.keyframe_insert("rotation_euler", frame=frame)
    stage.scene.render.use_motion_blur = True
    stage.scene.render.motion_blur_shutter = 0.8
    stage.scene.frame_set(1)
    yield stage
    stage.scene.render.use_motion_blur = False
    stage.scene.render.motion_blur_position = "CENTER"
    camera.animation_data_clear()


@pytest.mark.parametrize("position", ["START", "CENTER", "END"])
def test_the_camera_blurs_as_in_cycles(moving, position):
    moving.scene.render.motion_blur_position = position
    ours = moving.render(samples=SAMPLES)
    theirs = moving.render("CYCLES", SAMPLES)
    compare(ours, theirs, EXACT)
    # The camera moves after the first key, so only a shutter that ends there gives the picture without blur.
    moving.scene.render.use_motion_blur = False
    still = moving.render(samples=SAMPLES)
    if position == "END":
        compare(still, theirs, EXACT)
    else:
        with pytest.raises(AssertionError):
            compare(still, theirs, EXACT)
