"""The images as other programs read them: attributes, colour spaces, compressions and parts."""

import re
import struct
import subprocess

import pytest
from cli_kit import FOG, PATIENCE, digest, lightshaft, write_fog
from exr_layers import read, read_header, write, write_rgb
from local_farm import SCENE, LocalFarm

SPP = 8
AOVS = "albedo,direct,indirect,depth,normal,position,shape_id,alpha,denoising_albedo"
COLOURS = ["", "albedo.", "direct.", "indirect.", "denoising_albedo."]
LOSSLESS = ["none", "rle", "zips", "zip", "piz"]
LOSSY = ["dwaa", "dwab"]


@pytest.fixture(scope="module")
def fog(tmp_path_factory):
    return write_fog(tmp_path_factory.mktemp("fog"))


def render(scene, out, *flags, **options):
    return lightshaft("render", scene, "-o", out, "--spp", SPP, "--threads", 2, *flags, **options)


def oiiotool(*arguments, code=0):
    done = subprocess.run(["oiiotool", *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def plain(fog, tmp_path_factory):
    """(what the command said, the image) with all default settings."""
    out = tmp_path_factory.mktemp("plain") / "out.exr"
    return render(fog, out, "--aov", AOVS, "--float"), out


def floats(path, name):
    kind, value = read_header(path.read_bytes())[0][name]
    return kind, struct.unpack(f"<{len(value) // 4}f", value)


# ---- attributes ----

BALL = """<shape type="sphere"><float name="radius" value="0.08"/><transform name="to_world">{}</transform>
  <emitter type="area"><rgb name="radiance" value="50"/></emitter></shape>"""


@pytest.mark.parametrize("sensor", ["perspective", "orthographic"])
def test_a_ball_shines_where_the_matrix_says(tmp_path, sensor):
    """A light at a known place of the world, in the crop of a frame."""
    place = (.5, .3, -.7)
    scene = tmp_path / "ball.xml"
    text = FOG[:FOG.index("<shape")] + BALL.format(f'<translate x="{place[0]}" y="{place[1]}" z="{place[2]}"/>') + "</scene>"
    text = text.replace('<rfilter type="gaussian"/>', '<integer name="crop_offset_x" value="24"/><integer name="crop_offset_y" '
                        'value="4"/><integer name="crop_width" value="40"/><integer name="crop_height" value="24"/>')
    if sensor == "orthographic":
        text = text.replace("perspective", sensor).replace('<float name="fov" value="45"/>', "")
    scene.write_text(text.replace('target="0,0,0"', 'target="0.1,0.05,0"'))
    render(scene, tmp_path / "ball.exr", "--size", "80x48")
    kind, m = floats(tmp_path / "ball.exr", "worldToNDC")
    x, y, _, w = (sum(p * m[4 * row + c] for row, p in enumerate((*place, 1))) for c in range(4))

    rows = read(tmp_path / "ball.exr")[0]["G"]
    light = [(value, px + .5, py + .5) for py, row in enumerate(rows) for px, value in enumerate(row)]
    whole = sum(value for value, _, _ in light)
    centre = [sum(value * at[k] for value, *at in light) / whole for k in (0, 1)]

    assert kind == "m44f" and whole > 100
    # The image of a ball off the axis is an ellipse whose centre is off by less than a tenth of its radius, which is
    # 3 pixels here.
    assert abs(centre[0] - 80 * x / w) < .3 and abs(centre[1] - 48 * y / w) < .3
    assert floats(tmp_path / "ball.exr", "worldToCamera")[0] == "m44f"


def test_another_program_reads_the_attributes(fog, tmp_path):
    render(fog, tmp_path / "out.exr", "--fps", 23.976)

    said = oiiotool("--info", "-v", tmp_path / "out.exr")

    assert re.search(r"chromaticities: 0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329\n", said), said
    assert re.search(r"worldToCamera: -?\d.*\n", said) and "worldToNDC" in said
    assert "PixelAspectRatio: 1\n" in said and "24000/1001" in said


def test_merged_partials_have_the_camera_of_their_scene(fog, tmp_path):
    done = render(fog, tmp_path / "out.exr", "--color-space", "acescg", "--partial-dir", tmp_path / "partials")
    merged = lightshaft("merge", tmp_path / "partials", "-o", tmp_path / "merged.exr", "--scene", fog, "--color-space", "acescg")

    assert digest(merged) == digest(done)
    assert read(tmp_path / "merged.exr")[0] == read(tmp_path / "out.exr")[0]
    for name in ("worldToCamera", "worldToNDC", "chromaticities"):
        assert floats(tmp_path / "merged.exr", name) == floats(tmp_path / "out.exr", name)
    lightshaft("merge", tmp_path / "partials", "-o", tmp_path / "without.exr")
    assert "worldToNDC" not in read_header((tmp_path / "without.exr").read_bytes())[0], "partials do not know the camera"


# ---- colour spaces ----

# From Rec. 709. ACEScg: the matrix that ACES gives out for its utility `Utility - Linear - sRGB`, by Bradford. Rec. 2020:
# ITU-R BT.2087. XYZ: IEC 61966-2-1. All have so many digits.
PUBLISHED = {"acescg": ([.613097, .339523, .047379, .070194, .916354, .013452, .020616, .109570, .869815], 2e-6),
             "rec2020": ([.6274, .3293, .0433, .0691, .9195, .0114, .0164, .0880, .8956], 5e-5),
             "xyz": ([.4124, .3576, .1805, .2126, .7152, .0722, .0193, .1192, .9505], 5e-5)}


@pytest.mark.parametrize("space", PUBLISHED)
def test_colours_are_those_of_the_space_and_data_stay(fog, plain, tmp_path, space):
    done = render(fog, tmp_path / "out.exr", "--aov", AOVS, "--float", "--color-space", space)
    before, after = read(plain[1])[0], read(tmp_path / "out.exr")[0]
    matrix, digits = PUBLISHED[space]

    assert digest(done) == digest(plain[0]), "what is rendered is the same"
    for layer in COLOURS:
        for y in range(0, 40, 3):
            for x in range(72):
                rgb = [before[layer + c][y][x] for c in "RGB"]
                for k, c in enumerate("RGB"):
                    wanted = sum(matrix[3 * k + i] * rgb[i] for i in range(3))
                    # The published digits, and the roundings of each stage to float
                    assert abs(after[layer + c][y][x] - wanted) <= (digits + 2 ** -22) * sum(map(abs, rgb)), (layer, x, y)
    colours = {layer + c for layer in COLOURS for c in "RGB"}
    for name in set(before) - colours - {"stderr.R", "stderr.G", "stderr.B"}:
        assert after[name] == before[name], name
    assert after["stderr.R"] != before["stderr.R"] and all(v >= 0 for row in after["stderr.R"] for v in row)
    lightshaft("verify", tmp_path / "out.exr", "--scene", fog, "--tiles", 99)


def test_a_png_stays_srgb(fog, tmp_path):
    render(fog, tmp_path / "a.png")
    render(fog, tmp_path / "b.png", "--color-space", "acescg")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_reference_of_another_space_is_refused(fog, tmp_path):
    render(fog, tmp_path / "wide.exr", "--color-space", "rec2020")
    said = render(fog, tmp_path / "out.exr", "--reference", tmp_path / "wide.exr", code=2).stderr
    assert "not those of Rec. 709" in said and "color_space rec709" in said


# ---- images that scenes read ----

SKY = """<scene version="3.0.0"><integrator type="path"/><sensor type="perspective"><film type="hdrfilm"><integer name="width"
  value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
  <emitter type="envmap"><string name="filename" value="sky.exr"/>{}</emitter></scene>"""


def seen(folder, space, rgb=(.4, .6, .3), primaries=None, **options):
    """What the camera sees of a sky of one colour; None if the command fails."""
    write_rgb(folder / "sky.exr", {c: [[value] * 8] * 4 for c, value in zip("RGB", rgb)})
    if primaries:
        header, _ = read_header((folder / "sky.exr").read_bytes())
        rows = {c: [[value] * 8] * 4 for c, value in zip("RGB", rgb)}
        write(folder / "sky.exr", {**header, "chromaticities": ("chromaticities", struct.pack("<8f", *primaries))}, rows)
    (folder / "sky.xml").write_text(SKY.format(f'<string name="color_space" value="{space}"/>' if space else ""))
    done = render(folder / "sky.xml", folder / "seen.exr", "--float", *options.pop("flags", ()), **options)
    return done.stderr if options else [read(folder / "seen.exr")[0][c][4][4] for c in "RGB"]


def test_an_environment_is_in_the_space_that_the_scene_says(tmp_path):
    rgb = (.4, .6, .3)  # Rec. 709 holds it in every space
    close = 2e-6  # a dozen roundings to float of numbers up to 1.3: both matrices, the radiance, the means
    assert seen(tmp_path, None) == pytest.approx(rgb, abs=close)
    assert seen(tmp_path, "rec709", primaries=(.708, .292, .17, .797, .131, .046, .3127, .329)) == pytest.approx(rgb, abs=close)
    for space in ("rec2020", "acescg", "aces2065-1", "p3-d65", "xyz"):
        assert seen(tmp_path, space, flags=("--color-space", space)) == pytest.approx(rgb, abs=close), space
    assert seen(tmp_path, "acescg", (.5, .5, .5)) == pytest.approx((.5, .5, .5), abs=close), "a grey stays grey"
    assert seen(tmp_path, "srgb", (.5, .5, .5)) == pytest.approx([.214041] * 3, abs=close), "IEC 61966-2-1"


@pytest.mark.parametrize("primaries", [(.3,) * 8, (float("nan"),) * 8, (1e38, -1e38) * 4, (float("inf"), 0) * 4], ids=["one point", "nan", "huge", "inf"])
def test_primaries_of_no_space_are_refused(tmp_path, primaries):
    said = seen(tmp_path, None, primaries=primaries, code=2)
    assert "sky.exr" in said and ("chromaticities" in said or "texel" in said)
    assert seen(tmp_path, "rec709", primaries=primaries) == pytest.approx((.4, .6, .3), abs=2e-6), "the scene says better"


def test_an_unknown_colour_space_is_refused_with_a_suggestion(tmp_path):
    said = seen(tmp_path, "acescgg", code=2)
    assert "acescgg" in said and "acescg" in said and "sky.xml:" in said


# ---- compressions and parts ----

@pytest.mark.parametrize("parts", ["one", "layers"])
@pytest.mark.parametrize("compression", LOSSLESS)
def test_lossless_variants_have_the_same_pixels(fog, plain, tmp_path, compression, parts):
    out = tmp_path / "out.exr"
    render(fog, out, "--aov", AOVS, "--float", "--exr-compression", compression, "--exr-parts", parts)

    assert f'compression: "{compression}"' in oiiotool("--info", "-v", out)
    wanted = sorted(name for name in read(plain[1])[0])
    found = re.findall(r"channel list: (.*)", oiiotool("-a", "--info", "-v", out))
    names = [name.split(" ")[0] for line in found for name in line.split(", ")]
    assert sorted(names) == wanted and len(found) == (1 if parts == "one" else len({part_of(n) for n in names}))
    for names in found:
        names = ",".join(name.split(" ")[0] for name in names.split(", "))
        part = part_of(names.split(",")[0])
        chosen = ("--subimage", part) if parts == "layers" else ()
        oiiotool(plain[1], "--ch", names, out, *chosen, "--ch", names, "--diff")
    assert "all layers and headers match the seal" in lightshaft("verify", out, "--scene", fog, "--tiles", 2).stdout


def part_of(channel):
    return channel.rpartition(".")[0] or ("rgba" if len(channel) == 1 else channel)


@pytest.mark.parametrize("compression", LOSSY)
def test_a_lossy_compression_keeps_away_from_data(fog, plain, tmp_path, compression):
    out = tmp_path / "out.exr"
    said = render(fog, out, "--exr-compression", compression, code=2).stderr
    assert "--exr-compression is " + compression in said and "identifiers" in said and not out.exists()

    render(fog, out, "--aov", AOVS, "--float", "--exr-compression", compression, "--exr-parts", "layers")

    assert f'compression: "{compression}"' in oiiotool("--info", "-v", out)
    for part, names in {"stderr": "stderr.R,stderr.A", "position": "position.Y", "crypto_object00": "crypto_object00.R", "spp": "spp",
                        "normal": "normal.Y"}.items():
        oiiotool(plain[1], "--ch", names, out, "--subimage", part, "--ch", names, "--diff")
    # The colours differ, by less than can be seen.
    oiiotool("--fail", 0, plain[1], "--ch", "R,G,B", out, "--subimage", "rgba", "--ch", "R,G,B", "--diff", code=1)
    oiiotool("--fail", .1, plain[1], "--ch", "R,G,B", out, "--subimage", "rgba", "--ch", "R,G,B", "--diff")
    assert "lossy compression" in lightshaft("verify", out, "--scene", fog, code=2).stderr


def test_unknown_names_are_refused_with_the_known_ones(fog, tmp_path):
    for option, wrong, known in (("--color-space", "aces", "rec709 or rec2020"), ("--exr-compression", "gzip", "zip or zips"),
                                 ("--exr-parts", "two", "one or layers")):
        said = render(fog, tmp_path / "out.exr", option, wrong, code=2).stderr
        assert option in said and known in said and wrong in said


# ---- a farm ----

def test_a_farm_writes_the_same_image(tmp_path):
    spec = {"spp": 4, "color_space": "acescg", "exr_compression": "piz", "exr_parts": "layers", "fps": 25, "aov": "albedo"}
    with LocalFarm(tmp_path) as farm:
        farm.add_worker(fake=False)
        job = farm.submit(SCENE, **spec)
        farm.pixels(job)
        image = farm.request("GET", f"/api/v1/jobs/{job}/image.exr")
    (tmp_path / "farm.exr").write_bytes(image)
    (tmp_path / "scene.xml").write_text(SCENE)
    lightshaft("render", tmp_path / "scene.xml", "-o", tmp_path / "local.exr", "--spp", 4, "--color-space", "acescg", "--exr-compression",
               "piz", "--exr-parts", "layers", "--fps", 25, "--aov", "albedo")

    oiiotool("-a", tmp_path / "farm.exr", tmp_path / "local.exr", "--diff")
    for name in ("chromaticities", "worldToCamera", "worldToNDC", "framesPerSecond", "lightshaft:color_space"):
        assert read_header((tmp_path / "farm.exr").read_bytes())[0][name] == read_header((tmp_path / "local.exr").read_bytes())[0][name]
