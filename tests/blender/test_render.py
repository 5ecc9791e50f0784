"""The engine as Blender runs it: on a farm and on this machine, with progress, cancel, passes, frames and refusals."""

import numpy as np
import pytest


@pytest.fixture
def on_farm(farm, stage):
    stage.settings.where = "FARM"
    return farm


@pytest.fixture
def engine(blender, monkeypatch):
    """The class of the engine, restored after the test."""
    import sys

    found = sys.modules["bl_ext.user_default.lightshaft.engine"]
    monkeypatch.setattr(found, "SHOW", 0.0)
    return found.LightshaftEngine


def simple(stage):
    from stage import diffuse, fog

    stage.plane(diffuse())
    stage.ball(diffuse((0.2, 0.4, 0.8), "Ball"))
    stage.cube(fog(Density=0.05), 20)
    stage.light("SUN", 2, rotation=(0.5, 0.2, 0))


def test_a_farm_gives_the_pixels_of_this_machine(stage, on_farm):
    simple(stage)

    there = stage.render(samples=8)
    stage.settings.where = "LOCAL"
    here = stage.render(samples=8)

    assert there.mean() > 0.01
    assert np.array_equal(there, here)
    job = on_farm.get("/api/v1/jobs")["jobs"][0]
    assert job["state"] == "done" and job["size"] == [96, 72]


@pytest.mark.parametrize("where", ["FARM", "LOCAL"])
def test_the_image_comes_bit_by_bit(stage, farm, engine, monkeypatch, where):
    simple(stage)
    stage.settings.where = where
    brightness = []
    show = engine.show

    def counted(self, data, scene, size):
        show(self, data, scene, size)
        brightness.append(len(data or b""))

    monkeypatch.setattr(engine, "show", counted)
    final = stage.render(samples=256)

    assert len(brightness) >= 2, "only the finished image was shown"
    assert final.mean() > 0.01


def test_escape_cancels_the_job(stage, on_farm, engine, monkeypatch):
    simple(stage)
    shown = []
    show = engine.show
    monkeypatch.setattr(engine, "show", lambda self, *rest: (show(self, *rest), shown.append(1)))
    monkeypatch.setattr(engine, "escaped", lambda self: bool(shown))

    stage.render(samples=1 << 20)

    assert "cancelled" in [job["state"] for job in on_farm.get("/api/v1/jobs")["jobs"]]


def test_escape_ends_the_program(stage, engine, monkeypatch):
    simple(stage)
    jobs, follow = [], engine.follow
    monkeypatch.setattr(
        engine, "follow", lambda self, job, *rest: (jobs.append(job), follow(self, job, *rest))
    )
    monkeypatch.setattr(engine, "escaped", lambda self: True)

    stage.render(samples=1 << 20)

    assert jobs[0].process.poll() is not None and not jobs[0].ended


def test_passes(stage):
    from stage import bpy

    simple(stage)
    bpy.context.view_layer.use_pass_z = bpy.context.view_layer.use_pass_normal = True
    stage.settings.pass_noise = stage.settings.pass_volume = True

    stage.render(samples=16)
    ours = stage.layers
    stage.render("CYCLES", 16)

    assert {"Depth", "Normal", "Noise", "Volume Light"} <= set(ours)
    # Of the floor in front, where both see it (Cycles has no depth where a ray is scattered by the fog). Depths vary by 2 %
    # within a pixel, of which Cycles keeps one, so the mean over hundreds of pixels is within 0.5 %.
    floor = np.s_[50:66, 30:66]
    here, there = (next(iter(layers["Depth"].values()))[floor] for layers in (ours, stage.layers))
    seen = (here < 1e3) & (there < 1e3)
    assert seen.sum() > 200
    assert here[seen].mean() == pytest.approx(there[seen].mean(), rel=0.005)
    assert ours["Normal"]["Z"][floor].mean() == pytest.approx(1, abs=0.01)


def test_each_frame_of_an_animation_is_that_frame(stage):
    from stage import bpy, diffuse

    stage.sky(1)
    ball = stage.ball(diffuse(), (-2, 0, 1))
    ball.keyframe_insert("location", frame=1)
    ball.location.x = 2
    ball.keyframe_insert("location", frame=2)
    frames = []
    for frame in (1, 2):
        stage.scene.frame_set(frame)
        frames.append(stage.render(samples=8).mean(axis=2))

    moved = frames[0] - frames[1]
    left, right = moved[:, :48].mean(), moved[:, 48:].mean()
    assert left * right < 0, "the ball did not move from one side to the other"
    assert bpy.context.scene.frame_current == 2


def test_a_negative_frame_is_rendered(stage):
    stage.sky(1)
    stage.scene.frame_set(-10)

    assert stage.render(samples=1).mean() > 0.9


@pytest.mark.parametrize("kind", ["number", "checker"])
def test_colours_above_one_are_rendered_as_one(stage, kind):
    from stage import feed, material

    def shown(brightness):
        painted = material("Painted", "ShaderNodeBsdfDiffuse", Color=(brightness, 0.5, 0.5))
        if kind == "checker":
            checker = feed(painted, "Color", "ShaderNodeTexChecker")
            checker.inputs["Color1"].default_value = checker.inputs["Color2"].default_value = (
                brightness,
                0.5,
                0.5,
                1,
            )
            where = painted.node_tree.nodes.new("ShaderNodeTexCoord")
            painted.node_tree.links.new(where.outputs["UV"], checker.inputs["Vector"])
        plane.data.materials.clear()
        plane.data.materials.append(painted)
        return stage.render(samples=1)

    stage.sky(1)
    plane = stage.plane(None)

    assert np.array_equal(shown(2.0), shown(1.0))


def refused(stage):
    with pytest.raises(RuntimeError) as error:
        stage.render(samples=1)
    return str(error.value)


def test_everything_that_is_wrong_is_told_at_once(stage):
    from stage import bpy, material, principled

    stage.ball(principled("Skin", Subsurface_Weight=0.5))
    stage.cube(material("Cel", "ShaderNodeBsdfToon"))
    stage.put(bpy.data.objects.new("Dust", bpy.data.pointclouds.new("Dust")))

    told = refused(stage)

    assert (
        "object 'Skin thing', material 'Skin', node 'Principled BSDF': Subsurface Weight. Set it to 0" in told
    )
    assert "object 'Cel thing', material 'Cel', node 'Toon BSDF'" in told and "Use a Principled BSDF" in told
    assert "object 'Dust'" in told and "Convert it to a mesh" in told


def test_what_lightshaft_lacks_can_be_left_out(stage):
    from stage import principled

    stage.sky(1)
    stage.ball(principled("Skin", Subsurface_Weight=0.5))
    stage.settings.unsupported = "LEAVE_OUT"

    assert stage.render(samples=1).mean() > 0.01


def test_fog_in_an_open_mesh_is_refused(stage):
    from stage import fog

    stage.plane(fog("Mist"))

    assert "object 'Mist thing', material 'Mist': a volume needs a closed mesh" in refused(stage)


def test_density_by_nodes_is_refused(stage):
    from stage import feed, fog

    mist = fog("Mist")
    feed(mist, "Density", "ShaderNodeTexNoise")
    stage.cube(mist)

    assert "node 'Principled Volume': Density varies by nodes" in refused(stage)


def test_no_camera(stage):
    stage.scene.camera = None
    with pytest.raises(RuntimeError):
        stage.render(samples=1)


def test_a_farm_that_is_not_there(stage, monkeypatch):
    stage.sky(1)
    stage.settings.where = "FARM"
    monkeypatch.setenv("LIGHTSHAFT_URL", "http://127.0.0.1:9")

    assert "The farm at http://127.0.0.1:9 does not respond" in refused(stage)


def test_a_wrong_token(stage, on_farm, monkeypatch):
    stage.sky(1)
    monkeypatch.setenv("LIGHTSHAFT_TOKEN", "wrong")

    assert "The farm does not accept this token" in refused(stage)


def test_the_denoised_pass_is_that_of_the_finished_image(stage, on_farm):
    import sys

    simple(stage)
    stage.settings.denoise = True
    before = {job["id"] for job in on_farm.get("/api/v1/jobs")["jobs"]}

    stage.render(samples=8)

    (job,) = {job["id"] for job in on_farm.get("/api/v1/jobs")["jobs"]} - before
    exr = sys.modules["bl_ext.user_default.lightshaft.exr"]
    layers = exr.read(on_farm.request("GET", f"/api/v1/jobs/{job}/image.exr"))
    for channel in "RGB":
        assert np.array_equal(stage.layers["Denoised"][channel], layers[f"denoised.{channel}"])
        assert not np.array_equal(stage.layers["Denoised"][channel], stage.layers["Combined"][channel])


def test_no_denoiser_is_said_in_words(stage, monkeypatch):
    stage.sky(1)
    stage.settings.denoise = True
    monkeypatch.setenv("LIGHTSHAFT_OIDN", "/no/such/folder")

    assert "Open Image Denoise" in refused(stage)


def test_what_cycles_leaves_out_is_refused_by_name(stage):
    import bpy

    bpy.ops.mesh.primitive_plane_add()
    lamp = stage.light("POINT", 10)
    lamp.name, lamp.visible_glossy = "Lamp", False
    stage.scene.world.cycles_visibility.diffuse = False
    try:
        told = refused(stage)
    finally:
        stage.scene.world.cycles_visibility.diffuse = True

    for part in (
        "light 'Lamp': hidden from rays (glossy) alone",
        f"world '{stage.scene.world.name}': hidden from rays (diffuse) alone",
    ):
        assert part in told, told


def test_the_material_and_the_world_of_the_view_layer_override_others(stage):
    import bpy
    from stage import diffuse, material

    layer = bpy.context.view_layer
    stage.plane(diffuse((0.9, 0.1, 0.1)), 40)
    layer.material_override = material("Over", "ShaderNodeEmission", Color=(0.2, 0.4, 0.6))
    try:
        assert stage.render(samples=2).mean(axis=(0, 1))[:3] == pytest.approx((0.2, 0.4, 0.6), rel=1e-3)
    finally:
        layer.material_override = None
