"""Files as people really have them: each is rendered as it was meant, or refused with a message that says what to do.

Everything is written here, byte by byte or by OpenVDB's own module, with no more in it than the oddity.
"""

import gzip
import json
import math
import os
import struct

import local_farm
import pytest
from cli_kit import lightshaft, load

SCENE = """<scene version="3.0.0"><integrator type="volpath"><integer name="max_depth" value="3"/></integrator>
<sensor type="perspective"><float name="fov" value="40"/><transform name="to_world"><lookat origin="0, -4, 0" target="0, 0, 0" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
%s</scene>"""
BALL = '<shape type="sphere"><bsdf type="diffuse">%s</bsdf></shape>'


def exr(width, height, channels, origin=(0, 0)):
    """An uncompressed scanline EXR of float channels {name: value or function of (x, y)}; origin: of its data window."""
    def text(s):
        return s.encode() + b"\0"

    def attribute(name, kind, value):
        return text(name) + text(kind) + struct.pack("<i", len(value)) + value

    names = sorted(channels)
    rate = {name: 2 if name in ("RY", "BY") else 1 for name in names}
    listed = b"".join(text(n) + struct.pack("<iBBBBii", 2, 0, 0, 0, 0, rate[n], rate[n]) for n in names) + b"\0"
    x0, y0 = origin
    window = struct.pack("<iiii", x0, y0, x0 + width - 1, y0 + height - 1)
    header = struct.pack("<ii", 20000630, 2) + attribute("channels", "chlist", listed) + attribute("compression", "compression", b"\0") + \
        attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", struct.pack("<iiii", 0, 0, 3, 3)) + \
        attribute("lineOrder", "lineOrder", b"\0") + attribute("pixelAspectRatio", "float", struct.pack("<f", 1)) + \
        attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)) + attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"

    def row(y):
        data = b""
        for n in names:
            if y % rate[n] == 0:
                value = channels[n]
                data += b"".join(struct.pack("<f", value(x, y) if callable(value) else value) for x in range(0, width, rate[n]))
        return struct.pack("<ii", y0 + y, len(data)) + data

    rows = [row(y) for y in range(height)]
    start, offsets = len(header) + 8 * height, []
    for r in rows:
        offsets.append(start)
        start += len(r)
    return header + struct.pack(f"<{height}Q", *offsets) + b"".join(rows)


def render(folder, body, code=0, spp=16):
    (folder / "scene.xml").write_text(SCENE % body)
    done = lightshaft("render", folder / "scene.xml", "-o", folder / "out.exr", "--spp", spp, "--threads", 1, "--report", folder / "r.json",
                      code=code)
    if code == 0:
        assert load(folder / "r.json")["nonfinite_samples"] == 0
    return done


def pixels(folder):
    return load(folder / "r.json")["pixels_sha256"]


def textured(name):
    return '<emitter type="constant"/>' + BALL % f'<texture type="bitmap" name="reflectance"><string name="filename" value="{name}"/><boolean name="raw" value="true"/></texture>'


def sky(name):
    return f'<emitter type="envmap"><string name="filename" value="{name}"/></emitter>' + BALL % ""


def test_an_exr_is_known_by_its_bytes_and_names_may_have_spaces(tmp_path):
    half = exr(4, 4, {"R": .5, "G": .5, "B": .5})
    seen = []
    for name in ("grey.exr", "grey.png", "a grey picture (1).exr"):
        (tmp_path / name).write_bytes(half)
        render(tmp_path, textured(name))
        seen.append(pixels(tmp_path))

    assert len(set(seen)) == 1


def test_an_exr_is_what_its_data_window_holds_wherever_that_lies(tmp_path):
    seen = []
    for origin in ((0, 0), (-7, 3), (100, 100)):
        (tmp_path / "t.exr").write_bytes(exr(4, 4, {"R": lambda x, y: x / 4, "G": .5, "B": .5}, origin))
        render(tmp_path, textured("t.exr"))
        seen.append(pixels(tmp_path))

    assert len(set(seen)) == 1


def test_luminance_and_chroma_are_refused_with_what_they_are(tmp_path):
    (tmp_path / "t.exr").write_bytes(exr(4, 4, {"Y": .5, "RY": 0, "BY": 0}))

    said = render(tmp_path, textured("t.exr"), code=2).stderr

    assert "t.exr" in said and "luminance/chroma" in said


def test_the_alpha_of_an_exr_masks(tmp_path):
    """The left half of the picture is there, the right half is not: as if the card ended there."""
    half = {c: .5 for c in "RGB"} | {"A": lambda x, y: 1 if x < 2 else 0}
    (tmp_path / "t.exr").write_bytes(exr(4, 4, half))
    card = '<emitter type="constant"/><shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/>%s</transform>%s</shape>'
    black = '<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>'
    image = '<texture type="bitmap" name="opacity"><string name="filename" value="t.exr"/><string name="filter_type" value="nearest"/>%s</texture>'
    seen = []
    for channel in ("", '<string name="channel" value="alpha"/>'):
        render(tmp_path, card % ("", f'<bsdf type="mask">{image % channel}{black}</bsdf>'))
        seen.append(pixels(tmp_path))
    render(tmp_path, card % ('<scale x=".5"/><translate x="-.5"/>', black))

    assert seen == [pixels(tmp_path)] * 2


def test_files_packed_by_gzip_are_the_same_picture(tmp_path):
    ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" \
          "element face 1\nproperty list uchar int vertex_indices\nend_header\n-1 0 -1\n1 0 -1\n0 0 1\n3 0 1 2\n"
    body = '<emitter type="constant"/><shape type="ply"><string name="filename" value="%s"/></shape>'
    (tmp_path / "a.ply").write_text(ply)
    (tmp_path / "a.ply.gz").write_bytes(gzip.compress(ply.encode()))
    render(tmp_path, body % "a.ply")
    plain = pixels(tmp_path)
    render(tmp_path, body % "a.ply.gz")

    assert pixels(tmp_path) == plain
    (tmp_path / "scene.xml.gz").write_bytes(gzip.compress((tmp_path / "scene.xml").read_bytes()))
    lightshaft("render", tmp_path / "scene.xml.gz", "-o", tmp_path / "out.exr", "--spp", 16, "--threads", 1, "--report", tmp_path / "r.json")
    assert pixels(tmp_path) == plain


@pytest.mark.parametrize("scene", [textured, sky], ids=["texture", "environment"])
@pytest.mark.parametrize("value, what", [(math.nan, "not a number"), (math.inf, "infinite")], ids=["NaN", "infinity"])
def test_a_texel_that_is_no_number_is_refused_with_its_place(tmp_path, scene, value, what):
    (tmp_path / "t.exr").write_bytes(exr(4, 4, {"R": .5, "G": lambda x, y: value if (x, y) == (2, 1) else .5, "B": .5}))

    said = render(tmp_path, scene("t.exr"), code=2).stderr

    assert "t.exr" in said and "x 2, y 1" in said and what in said


def test_negative_texels_of_an_environment_are_counted_and_give_no_light(tmp_path):
    seen = []
    for value in (-3, 0):
        (tmp_path / "sky.exr").write_bytes(exr(8, 4, {c: lambda x, y: value if (x, y) == (5, 1) else 1 for c in "RGB"}))
        render(tmp_path, sky("sky.exr"))
        seen.append(pixels(tmp_path))
    (tmp_path / "sky.exr").write_bytes(exr(8, 4, {c: lambda x, y: -3 if (x, y) == (5, 1) else 1 for c in "RGB"}))
    told = json.loads(lightshaft("inspect", tmp_path / "scene.xml", "--json").stdout)

    assert seen[0] == seen[1]
    assert told["clamped_inputs"] > 0


def test_a_sun_of_34000_in_an_environment_is_sampled(tmp_path):
    (tmp_path / "sky.exr").write_bytes(exr(64, 32, {c: lambda x, y: 34000 if (x, y) == (40, 6) else .5 for c in "RGB"}))

    render(tmp_path, sky("sky.exr"), spp=64)

    # Found by chance alone, one direction in a thousand, a diffuse ball's relMSE would be of the order of 10.
    assert load(tmp_path / "r.json")["relmse"] < .05


def test_a_volume_that_is_cut_off_ends_its_job_on_a_farm_and_no_other(tmp_path):
    (tmp_path / "cloud.nvdb").write_bytes(b"NanoVDB0")
    volume = '<volume name="sigma_t" type="gridvolume"><string name="filename" value="cloud.nvdb"/></volume>'
    scene = tmp_path / "scene.xml"
    scene.write_text(SCENE % f'<shape type="cube"><bsdf type="null"/><medium name="interior" type="heterogeneous">{volume}</medium></shape>')
    with local_farm.LocalFarm(tmp_path / "farm") as farm:
        farm.add_worker(fake=False)
        environment = {**os.environ, "LIGHTSHAFT_URL": farm.url(), "LIGHTSHAFT_TOKEN": farm.token}

        told = lightshaft("submit", scene, "--spp", 2, "--wait", "-o", tmp_path / "out.exr", env=environment, code=1).stderr

        assert "on worker-1: cloud.nvdb: not a readable NanoVDB file: damaged, or cut short" in told and not (tmp_path / "out.exr").exists()
        farm.wait_for_job(farm.submit(local_farm.SCENE, spp=2))
