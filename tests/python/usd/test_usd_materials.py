"""UsdPreviewSurface and its textures: looked at under a white sky, where a diffuse surface shows its
albedo."""

import contextlib
import math

import numpy as np
import pytest
from PIL import Image
from stage_kit import (
    Gf,
    Sdf,
    UsdShade,
    agree,
    bind,
    camera,
    colours,
    coordinates,
    exr,
    image,
    mesh,
    new_stage,
    path_of,
    png,
    preview,
    seen,
    sky,
    texture,
)

import lightshaft
import lightshaft.usd

MATT = {"roughness": 1.0, "useSpecularWorkflow": 1}  # with no specularColor: diffuse alone
SQUARE = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
ST = [(0, 0), (1, 0), (1, 1), (0, 1)]


@pytest.fixture
def stage(tmp_path):
    """A square with st from its lower left: it fills the view of one camera, and more than that of the
    other."""
    made = new_stage(tmp_path)
    sky(made)
    square = mesh(made, "/m", SQUARE, [(0, 1, 2, 3)])
    coordinates(square, ST)
    camera(made, (0, 0, 10), (0, 0, 0), math.degrees(2 * math.atan(0.1)), path="/whole")
    camera(made, (0, 0, 10), (0, 0, 0), 4.0, path="/middle")
    return made


def whole(farm, stage, spp, size=(32, 32)):
    return image(farm, stage, spp, size, camera="/whole")


def middle(farm, stage, spp):
    return seen(farm, stage, spp, camera="/middle")


def square(stage):
    return stage.GetPrimAtPath("/m")


def look(stage, **inputs):
    material = preview(stage, **{**MATT, **inputs})
    bind(square(stage), material)
    return material


def linear(stored):
    stored = np.asarray(stored, float)
    return np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)


def quarters(shown):
    """The means of a picture's quarters, as they lie: 2 x 2 x 3, without a border where texels blend."""
    size = len(shown) // 2
    edge = size // 4
    blocks = shown.reshape(2, size, 2, size, 3)[:, edge:-edge, :, edge:-edge]
    return blocks.mean(axis=(1, 3))


FOUR = np.array([[(0.8, 0.2, 0.2), (0.2, 0.8, 0.2)], [(0.2, 0.2, 0.8), (0.6, 0.6, 0.2)]])


def large(values):
    """Each value as 32 x 32 texels, so that no quarter's middle sees a neighbour's."""
    return np.repeat(np.repeat(np.asarray(values), 32, axis=0), 32, axis=1)


@pytest.mark.parametrize("suffix", ["png", "bmp", "tga"])
@pytest.mark.parametrize("space", ["auto", "raw", "sRGB"])
def test_an_image_lies_as_st_says_and_is_coded_as_told(farm, stage, tmp_path, suffix, space):
    file = png(tmp_path / f"a.{suffix}", large(FOUR))
    look(stage, diffuseColor=texture(stage, "/look/t", file, sourceColorSpace=space))
    stored = np.round(FOUR * 255) / 255
    expected = stored if space == "raw" else linear(stored)
    # 0.01: five standard errors of a quarter's middle, 64 pixels of 16 samples, of a white sky seen by
    # chance.
    assert np.abs(quarters(whole(farm, stage, 16)) - expected).max() < 0.01


def test_an_exr_is_linear(farm, stage, tmp_path):
    file = exr(tmp_path / "a.exr", large(FOUR))
    look(stage, diffuseColor=texture(stage, "/look/t", file))
    assert np.abs(quarters(whole(farm, stage, 16)) - FOUR).max() < 0.01


@pytest.mark.parametrize("transform", [
    {"rotation": 90.0},
    {"translation": Gf.Vec2f(0.5, 0.0)},
    {"scale": Gf.Vec2f(-1.0, 1.0), "rotation": 90.0, "translation": Gf.Vec2f(0.5, 0.5)},
])  # fmt: skip
def test_a_transform_of_texture_coordinates(farm, stage, tmp_path, transform):
    """The value at st is that of the image at T R S st, (0, 0) its lower left corner."""
    file = exr(tmp_path / "a.exr", large(FOUR))
    look(
        stage,
        diffuseColor=texture(stage, "/look/t", file, transform=transform, wrapS="repeat", wrapT="repeat"),
    )

    shown = quarters(whole(farm, stage, 16))

    a = math.radians(transform.get("rotation", 0))
    sx, sy = transform.get("scale", (1, 1))
    tx, ty = transform.get("translation", (0, 0))
    for row in range(2):
        for column in range(2):
            s, t = (0.25 + 0.5 * column) * sx, (0.75 - 0.5 * row) * sy
            u, v = math.cos(a) * s - math.sin(a) * t + tx, math.sin(a) * s + math.cos(a) * t + ty
            expected = FOUR[int((1 - v) % 1 * 2), int(u % 1 * 2)]
            assert shown[row, column] == pytest.approx(expected, abs=0.01), (row, column)


@pytest.mark.parametrize("output, scale, bias", [
    ("rgb", (0.5, 1.0, 0.25, 1.0), (0.1, 0.0, 0.2, 0.0)),
    ("g", (1.0, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0)),
    ("b", (1.0, 1.0, 0.5, 1.0), (0.0, 0.0, 0.25, 0.0)),
])  # fmt: skip
def test_channels_scale_and_bias(farm, stage, tmp_path, output, scale, bias):
    file = png(tmp_path / "a.png", large(FOUR))
    inputs = {"scale": Gf.Vec4f(*scale), "bias": Gf.Vec4f(*bias), "sourceColorSpace": "raw"}
    if output == "rgb":
        look(stage, diffuseColor=texture(stage, "/look/t", file, output, **inputs))
    else:  # a number: seen as an opacity before the sky
        look(stage, diffuseColor=(0.0, 0.0, 0.0), opacity=texture(stage, "/look/t", file, output, **inputs))

    shown = quarters(whole(farm, stage, 64))

    values = np.round(FOUR * 255) / 255 * scale[:3] + bias[:3]
    if output != "rgb":
        values = 1 - values[:, :, "rgb".index(output)][:, :, None].repeat(3, axis=2)
    # Of the opacity a sample sees the sky or black: 64 pixels of 64 samples have an error below 0.5 / 64; 5
    # of that.
    assert np.abs(shown - values).max() < (0.01 if output == "rgb" else 0.04)


def test_the_alpha_of_an_image_with_a_threshold_cuts_out(farm, stage, tmp_path):
    alpha = np.array([[0.9, 0.1], [0.4, 0.6]])
    file = png(
        tmp_path / "a.png", large(np.concatenate([np.full((2, 2, 3), 0.5), alpha[:, :, None]], axis=2))
    )
    look(
        stage,
        diffuseColor=(0.0, 0.0, 0.0),
        opacity=texture(stage, "/look/t", file, "a"),
        opacityThreshold=0.5,
    )
    shown = quarters(whole(farm, stage, 16))
    assert np.abs(shown - (alpha < 0.5)[:, :, None]).max() < 1e-3


def test_a_texture_without_a_file_is_its_fallback(farm, stage):
    output = texture(stage, "/look/t", "", fallback=Gf.Vec4f(0.3, 0.6, 0.2, 1))
    look(stage, diffuseColor=output)
    agree(middle(farm, stage, 16), (0.3, 0.6, 0.2))


def test_inputs_through_a_node_graph_and_the_materials_interface(farm, stage):
    material = look(stage, diffuseColor=(0.0, 0.0, 0.0))
    chosen = material.CreateInput("tint", Sdf.ValueTypeNames.Color3f)
    chosen.Set(Gf.Vec3f(0.2, 0.5, 0.7))
    shader = UsdShade.Shader(stage.GetPrimAtPath("/look/surface"))
    shader.GetInput("diffuseColor").ConnectToSource(chosen)
    agree(middle(farm, stage, 16), (0.2, 0.5, 0.7))


def test_a_primvar_as_colour(farm, stage):
    reader = UsdShade.Shader.Define(stage, "/look/reader")
    reader.CreateIdAttr("UsdPrimvarReader_float3")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("displayColor")
    output = reader.CreateOutput("result", Sdf.ValueTypeNames.Float3)
    colours(square(stage), [(0, 0, 0), (1, 0, 0), (1, 0, 0), (0, 0, 0)])
    look(stage, diffuseColor=output)
    shown = whole(farm, stage, 16, (16, 16))[4:12, :, 0].mean(axis=0)
    assert shown[2:14] == pytest.approx((np.arange(16)[2:14] + 0.5) / 16, abs=0.02)


def test_emission_is_the_radiance_on_both_sides(farm, stage):
    look(stage, diffuseColor=(0.0, 0.0, 0.0), emissiveColor=(3.0, 0.5, 0.25))
    camera(stage, (0, 0, -10), (0, 0, 0), 5.0, path="/behind")
    for path in ("/middle", "/behind"):
        agree(seen(farm, stage, 4, (8, 8), camera=path), (3.0, 0.5, 0.25))


def test_a_normal_map_of_any_coding_turns_the_light(farm, stage, tmp_path):
    """Normals that lean by 30 degrees to +s see a sun from there at a cosine of 1, instead of cos 30."""
    from stage_kit import UsdLux, place, turned

    stage.RemovePrim("/sky")
    sun = UsdLux.DistantLight.Define(stage, "/sun")
    sun.CreateAngleAttr(0.0)
    sun.CreateIntensityAttr(math.pi)
    place(sun, turned((0, 1, 0), 30))  # from +z turned to +x
    n = np.array([0.5, 0, math.sqrt(0.75)])
    for i, (scale, bias) in enumerate(((2, -1), (1, 0))):
        stored = (n - bias) / scale
        file = exr(tmp_path / f"n{i}.exr", large(np.broadcast_to(stored, (1, 1, 3))))
        output = texture(
            stage, f"/look/t{i}", file, sourceColorSpace="raw",
            scale=Gf.Vec4f(scale, scale, scale, 1), bias=Gf.Vec4f(bias, bias, bias, 0),
        )  # fmt: skip
        look(stage, diffuseColor=(0.5, 0.5, 0.5), normal=output)
        agree(middle(farm, stage, 16), 0.5, 5e-3)  # of halves in an image


def test_metal_and_coat_reflect_as_their_index_says(farm, stage):
    """Under a white sky all that is reflected is white: a metal shows its colour, a coat over black its
    reflectance."""
    look(stage, diffuseColor=(0.9, 0.6, 0.3), metallic=1.0, roughness=0.05, useSpecularWorkflow=0)
    # Schlick's rule straight on is the colour itself; at up to 6 degrees off (roughness 0.05, view 3
    # degrees) 1e-5 more.
    agree(middle(farm, stage, 64), (0.9, 0.6, 0.3), 5e-3)
    look(stage, diffuseColor=(0.0, 0.0, 0.0), metallic=0.0, roughness=0.05, ior=2.0, useSpecularWorkflow=0)
    agree(middle(farm, stage, 256), 1 / 9, 5e-3)
    look(stage, diffuseColor=(0.0, 0.0, 0.0), specularColor=(0.08, 0.04, 0.02), roughness=0.05)
    agree(middle(farm, stage, 256), (0.08, 0.04, 0.02), 5e-3)


def test_a_material_without_a_preview_surface_is_told(stage):
    material = UsdShade.Material.Define(stage, "/other")
    shader = UsdShade.Shader.Define(stage, "/other/surface")
    shader.CreateIdAttr("ND_standard_surface_surfaceshader")
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "out")
    bind(square(stage), material)
    warnings = lightshaft.usd.read(path_of(stage), camera="/whole").warnings
    assert any(w.startswith("/other: ") and "ND_standard_surface" in w for w in warnings)


def test_tiles_of_images_are_refused_by_name(stage):
    look(stage, diffuseColor=texture(stage, "/look/t", "a.<UDIM>.png"))
    with pytest.raises(lightshaft.StageRejected, match="UDIM") as caught:
        lightshaft.usd.read(path_of(stage), camera="/whole")
    assert caught.value.path == "/look/t"


def test_equal_images_are_sent_once_and_as_they_are(stage, tmp_path):
    for name in ("a.png", "b.png"):
        png(tmp_path / name, large(FOUR))
    look(
        stage,
        diffuseColor=texture(stage, "/look/a", tmp_path / "a.png"),
        emissiveColor=texture(stage, "/look/b", tmp_path / "b.png"),
    )
    files = lightshaft.usd.read(path_of(stage), camera="/whole").files
    images = [source for name, source in files.items() if name.endswith(".png")]
    assert len(images) == 1 and images[0].read(0, 1 << 20) == (tmp_path / "a.png").read_bytes()


def test_images_of_kinds_that_the_farm_does_not_read_are_written_anew(farm, stage, tmp_path):
    picture = Image.new("CMYK", (16, 16), (0, 255, 255, 0))  # red
    picture.save(tmp_path / "a.jpg", quality=100)
    look(stage, diffuseColor=texture(stage, "/look/t", tmp_path / "a.jpg"))
    agree(middle(farm, stage, 16), (1, 0, 0), 0.02)  # of the coding of JPEG


@pytest.mark.parametrize(
    "opacity, threshold, expected", [(0.25, 0.0, 0.25), (0.0, 0.5, 0.0), (0.6, 0.5, 1.0)]
)
def test_emission_is_as_much_less_as_is_cut_out(farm, stage, opacity, threshold, expected):
    """Before a black sky: what is behind gives no light."""
    stage.RemovePrim("/sky")
    look(
        stage,
        diffuseColor=(0.0, 0.0, 0.0),
        emissiveColor=(2.0, 1.0, 0.5),
        opacity=opacity,
        opacityThreshold=threshold,
    )
    with pytest.warns(lightshaft.SceneWarning) if expected == 0 else contextlib.nullcontext():
        shown = seen(farm, stage, 4, (8, 8), camera="/middle")
    if expected == 0:  # it has no light at all, so that a white sky is put around it
        agree(shown, 1.0)
    else:
        agree(shown, np.array((2.0, 1.0, 0.5)) * expected)


def test_emission_is_cut_out_by_an_image(farm, stage, tmp_path):
    stage.RemovePrim("/sky")
    alpha = np.array([[0.9, 0.1], [0.4, 0.6]])
    file = png(
        tmp_path / "a.png", large(np.concatenate([np.full((2, 2, 3), 0.5), alpha[:, :, None]], axis=2))
    )
    look(
        stage,
        diffuseColor=(0.0, 0.0, 0.0),
        emissiveColor=(1.0, 1.0, 1.0),
        opacity=texture(stage, "/look/t", file, "a"),
        opacityThreshold=0.5,
    )
    shown = quarters(whole(farm, stage, 16))
    assert np.abs(shown - (alpha >= 0.5)[:, :, None]).max() < 1e-3


@pytest.mark.parametrize("metallic", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("roughness", [0.3, 1.0])
def test_white_metal_keeps_the_light_of_a_white_sky(farm, stage, metallic, roughness):
    """A white plastic keeps it, too: 0.006, as light between its coat and its base is followed once more or less."""
    look(stage, diffuseColor=(1.0, 1.0, 1.0), metallic=metallic, roughness=roughness, useSpecularWorkflow=0)
    agree(middle(farm, stage, 64), 1.0, 2e-3 if metallic == 1 else 6e-3)


@pytest.mark.parametrize("content", [None, b"no image"])
def test_the_fallback_of_a_texture_takes_the_place_of_an_image_that_is_missing_or_broken(
    farm, stage, tmp_path, content
):
    if content:
        (tmp_path / "lost.png").write_bytes(content)
    output = texture(stage, "/look/t", "lost.png", fallback=Gf.Vec4f(0.3, 0.6, 0.2, 1))
    look(stage, diffuseColor=output)
    with pytest.warns(lightshaft.SceneWarning, match="/look/t: .*the shader's fallback is used"):
        agree(middle(farm, stage, 16), (0.3, 0.6, 0.2))


def test_an_image_that_is_missing_without_a_fallback_is_refused(stage):
    look(stage, diffuseColor=texture(stage, "/look/t", "lost.png"))
    with pytest.raises(lightshaft.StageRejected, match="lost.png@ is not found"):
        lightshaft.usd.read(path_of(stage), camera="/whole")


def test_what_has_no_effect_is_told_by_its_prim(stage):
    material = look(stage, diffuseColor=(0.5, 0.5, 0.5), sheen=0.5)
    displaced = UsdShade.Shader.Define(stage, "/look/displaced")
    displaced.CreateIdAttr("UsdPreviewSurface")
    material.CreateDisplacementOutput().ConnectToSource(displaced.ConnectableAPI(), "displacement")
    square(stage).GetAttribute("velocities").Set([Gf.Vec3f(1, 0, 0)] * 4)
    eye = stage.GetPrimAtPath("/whole")
    eye.GetAttribute("clippingRange").Set(Gf.Vec2f(50, 0.1))
    eye.GetAttribute("shutter:close").Set(0.5)
    eye.GetAttribute("exposure:iso").Set(400.0)
    sun = stage.DefinePrim("/sun", "DistantLight")
    sun.GetAttribute("inputs:angle").Set(1.0)
    sun.CreateAttribute("inputs:shadow:color", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(1, 0, 0))
    stage.DefinePrim("/procedural", "GenerativeProcedural")
    stage.DefinePrim("/physics", "Acme")
    stage.GetPrimAtPath("/m").CreateAttribute("userProperties:note", Sdf.ValueTypeNames.String).Set("quiet")

    told = lightshaft.usd.read(path_of(stage), camera="/whole").warnings

    for start, part in (
        ("/look/surface", "inputs:sheen has no effect"),
        ("/look", "outputs:displacement of a material has no effect"),
        ("/m", "velocities has no effect: points that move in a mesh are not blurred"),
        ("/whole", "clippingRange (50, 0.1) shows nothing"),
        ("/whole", "exposure:iso has no effect"),
        ("/sun", "inputs:shadow:color of a light has no effect"),
        ("/procedural", "a GenerativeProcedural is not read"),
        ("/physics", "a Acme has no effect"),
    ):
        assert any(w.startswith(f"{start}: ") and part in w for w in told), (start, part, told)
    assert not any("note" in w or "sky" in w for w in told)
