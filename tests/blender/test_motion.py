"""Motion blur of the camera and of objects, beside Cycles and by the exported scene."""

import contextlib
import sys

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


@contextlib.contextmanager
def shutter(stage, length=0.8):
    """An open shutter while the block runs."""
    stage.scene.render.use_motion_blur, stage.scene.render.motion_blur_shutter = True, length
    stage.scene.frame_set(2)
    try:
        yield stage
    finally:
        stage.scene.render.use_motion_blur = False


def animate(item, begin, end, path="location"):
    """Keys at frames 1 and 3, with a constant rate between them; frame 2 is rendered."""
    for frame, value in ((1, begin), (3, end)):
        setattr(item, path, value)
        item.keyframe_insert(path, frame=frame)
    action = item.animation_data.action
    for bag in action.layers[0].strips[0].channelbags:
        for curve in bag.fcurves:
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"


def room(stage):
    from stage import diffuse

    stage.plane(diffuse())
    stage.sky(0.5)
    stage.light("POINT", 200, (2, -1, 5), shadow_soft_size=0)


def moves(stage):
    from stage import diffuse

    animate(stage.ball(diffuse((0.1, 0.7, 0.1), "Green")), (-2, -1, 1), (2, 1, 1.5))


def turns(stage):
    from stage import diffuse

    bar = stage.cube(diffuse((0.1, 0.1, 0.7), "Blue"), location=(0, 0, 1))
    bar.scale = (2, 0.4, 0.6)
    animate(bar, (0, 0, 0), (0, 0.3, 2.4), "rotation_euler")


def instanced(stage):
    """Two objects of one mesh below a parent that moves, of which one turns."""
    import bpy
    from stage import diffuse

    first = stage.cube(diffuse((0.7, 0.1, 0.1), "Red"), 1.0, (-1, 0, 0.8))
    second = stage.put(bpy.data.objects.new("Second", first.data), (1.5, 0, 0.8))
    parent = stage.put(bpy.data.objects.new("Parent", None))
    first.parent = second.parent = parent
    animate(parent, (-1, 0, 0), (1, 0.5, 0))
    animate(second, (0, 0, 0), (0.2, 0, 1.2), "rotation_euler")


def collection(stage):
    """Two instances of a collection, of which one moves; within it a part turns."""
    import bpy
    from stage import diffuse

    within = bpy.data.collections.new("Within")
    bar = stage.cube(diffuse((0.1, 0.6, 0.6), "Teal"), 1.0, (0, 0, 0.8))
    bar.scale = (1.5, 0.4, 0.4)
    animate(bar, (0, 0, 0), (0, 0, 1.5), "rotation_euler")
    for other in bar.users_collection:
        other.objects.unlink(bar)
    within.objects.link(bar)
    for i in range(2):
        holder = stage.put(bpy.data.objects.new(f"Holder{i}", None), (2 * i - 1, 0, 0))
        holder.instance_type, holder.instance_collection = "COLLECTION", within
    animate(holder, (1, -1, 0), (1, 1, 0.5))


@pytest.mark.parametrize("build", [moves, turns, instanced, collection])
def test_objects_blur_as_in_cycles(stage, build):
    room(stage)
    build(stage)
    for item in stage.scene.objects:
        item.cycles.motion_steps = 4  # of Cycles, which has three poses of an object otherwise
    with shutter(stage, 1.6):
        ours = stage.render(samples=SAMPLES)
        theirs = stage.render("CYCLES", SAMPLES)
    still = stage.render(samples=SAMPLES)
    compare(ours, theirs, EXACT)
    with pytest.raises(AssertionError):
        compare(still, theirs, EXACT)


def exported(stage, monkeypatch):
    """The text of the scene and the warnings of the export that a render makes."""
    engine = sys.modules["bl_ext.user_default.lightshaft.engine"]
    export, found = engine.export, []

    def keep(*arguments):
        path, document, warnings = export(*arguments)
        found.extend((path.read_text(), warnings))
        return path, document, warnings

    monkeypatch.setattr(engine, "export", keep)
    stage.render(samples=1)
    monkeypatch.undo()
    return found


def test_a_closed_shutter_exports_what_stands(stage, monkeypatch):
    room(stage)
    turns(stage)
    stage.scene.frame_set(2)
    closed, _ = exported(stage, monkeypatch)
    assert "animation" not in closed and "shutter" not in closed
    stage.scene.objects["Blue thing"].cycles.use_motion_blur = False
    with shutter(stage):
        assert exported(stage, monkeypatch) == [closed, []]


def test_a_straight_way_has_two_transforms(stage, monkeypatch):
    room(stage)
    moves(stage)
    with shutter(stage, 0.5):
        text, warnings = exported(stage, monkeypatch)
    assert text.count("<animation") == 1 and text.count("<transform time=") == 2
    assert not warnings
    assert '<float name="shutter_open" value="-0.25"' in text


def test_lamps_move_with_their_shapes(stage, monkeypatch):
    """The light of a moving lamp is that of the lamp at the times of the exposure: here by its mean over stills."""
    from stage import diffuse

    stage.plane(diffuse())
    ways = {
        "POINT": {"shadow_soft_size": 0.3},
        "AREA": {"shape": "RECTANGLE", "size": 1, "size_y": 0.4},
        "DISK": {"shape": "DISK", "size": 1},
    }
    for i, (kind, values) in enumerate(ways.items()):
        lamp = stage.light("AREA" if kind == "DISK" else kind, 100, (0, 0, 2), (0.2, 0, 0), **values)
        animate(lamp, (-2, i - 1, 1.5), (2, i - 1, 2.5))
    with shutter(stage, 2.0):
        text, warnings = exported(stage, monkeypatch)
        blurred = stage.render(samples=SAMPLES)
    assert text.count("<animation") == 3 and not warnings
    count, mean = 16, 0
    for k in range(count):
        at = 1 + 2 * (k + 0.5) / count
        stage.scene.frame_set(int(at), subframe=at % 1)
        mean = mean + stage.render(samples=SAMPLES // 4) / count
    compare(blurred, mean, EXACT)


def test_what_cannot_move_stands_and_is_told(stage, monkeypatch):
    import bpy
    from stage import diffuse, material

    room(stage)
    sun = stage.light("SUN", 1)
    animate(sun, (0, 0, 0), (0.5, 0, 0), "rotation_euler")
    mirrored = stage.cube(diffuse(name="Mirrored"), 0.5)
    animate(mirrored, (1, 1, 1), (-2, 1, 1), "scale")
    parent = stage.put(bpy.data.objects.new("Parent", None))
    parent.scale = (3, 1, 1)
    sheared = stage.cube(diffuse(name="Sheared"), 0.5)
    sheared.parent = parent
    animate(sheared, (0, 0, 0.2), (0, 0, 1.0), "rotation_euler")
    glow = stage.ball(material("Glow", "ShaderNodeEmission", Strength=1.0), (2, 2, 1))
    glow.scale = (1, 1, 2)
    animate(glow, (2, 2, 1), (2, 3, 1))
    bends = stage.cube(diffuse(name="Bends"), 0.5, (3, 0, 1))
    bends.shape_key_add(name="Basis")
    key = bends.shape_key_add(name="Tall")
    key.data[0].co.z += 1
    for frame in (1, 3):
        key.value = (frame - 1) / 2
        key.keyframe_insert("value", frame=frame)
    with shutter(stage, 1.6):
        text, warnings = exported(stage, monkeypatch)
    for name, why in (
        ("light 'Sun'", "a light without a shape is rendered where it is at the frame"),
        ("object 'Mirrored thing'", "it is mirrored on its way"),
        ("object 'Sheared thing'", "its transform shears"),
        ("object 'Glow thing'", "it emits light"),
        ("object 'Bends thing'", "its shape is that of the frame"),
    ):
        assert any(w.startswith(name) and why in w for w in warnings), (name, warnings)
    assert "<animation" not in text and "shutter" not in text
