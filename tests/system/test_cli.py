"""What the command answers to good and bad input on one machine: exit codes, diagnostics with a place, `inspect`."""

import json
import re
import struct

import pytest
from cli_kit import FOG, fog_values, lightshaft, vol_bytes, write_fog


@pytest.fixture
def fog(tmp_path):
    return write_fog(tmp_path)


def refused(scene, *flags):
    """Both commands refuse the scene with exit code 2; what `render` says."""
    lightshaft("inspect", scene, *[f for f in flags if str(f).startswith("-D")], code=2, cwd=scene.parent)
    return lightshaft("render", scene, *flags, code=2, cwd=scene.parent).stderr


def changed(fog, old, new):
    text = FOG.replace(old, new)
    assert text != FOG
    fog.write_text(text)
    return fog


def line_of(fog, text):
    return 1 + fog.read_text()[:fog.read_text().index(text)].count("\n")


def test_version_names_the_build():
    assert re.fullmatch(r"lightshaft \S+, build [0-9a-f]{64}\n", lightshaft("--version").stdout)


def test_wrong_usage_is_exit_code_2():
    for arguments in [(), ("rendr",), ("render",), ("render", "a.xml", "--what"), ("merge",), ("show",), ("extend", "j-1")]:
        lightshaft(*arguments, code=2)


@pytest.mark.parametrize("old, new, place, text", [
    ('type="gridvolume"', 'type="gridvolme"', "gridvolme", "gridvolume"),
    ('name="albedo"', 'name="albdo"', "albdo", "albedo"),
    ('value="45"', 'value="forty"', "forty", "forty"),
    ('<float name="fov"', '<flot name="fov"', "flot", "flot"),
    ('value="fog.vol"', 'value="frog.vol"', "frog.vol", "fog.vol"),
], ids=["plugin", "parameter", "value", "tag", "file"])
def test_a_mistake_in_the_scene_is_told_with_its_place(fog, old, new, place, text):
    scene = changed(fog, old, new)

    said = refused(scene)

    assert re.search(rf"^{re.escape(str(scene))}:{line_of(scene, place)}:\d+: error: .*{re.escape(text)}", said, re.M), said


def test_xml_that_is_cut_off_is_told_with_its_place(fog):
    fog.write_text(FOG[:700])

    assert re.search(r"fog\.xml:\d+:\d+: error: ", refused(fog))


@pytest.mark.parametrize("command", ("render", "inspect", "submit", "convert"))
def test_a_stage_of_usd_is_told_the_command_that_reads_it(tmp_path, command):
    stage = tmp_path / "shot.usda"
    stage.write_text("#usda 1.0\n")
    out = [tmp_path / "out.xml"] if command == "convert" else []

    told = lightshaft(command, stage, *out, *(["--to", "http://localhost:1"] if command == "submit" else []), code=2).stderr

    assert told.startswith(f"{stage}: error: a stage of USD is read by the Python package: ")
    assert f"python3 -m lightshaft.usd {stage} -o shot-scene" in told and "shot-scene/scene.xml" in told


def test_a_scene_that_is_not_there_is_named(tmp_path):
    assert "nowhere.xml: error: " in refused(tmp_path / "nowhere.xml")
    assert "error: " in refused(tmp_path)


@pytest.mark.parametrize("flags, text", [
    (("--spp", "1e9"), "1e9"), (("--spp", "0"), "--spp"), (("--spp", "-4"), "-4"), (("--spp", "1000000000"), "1000000000"),
    (("--size", "0x10"), "--size"), (("--size", "99999x99999"), "pixels"), (("--size", "12"), "WIDTHxHEIGHT"),
    (("--time", "-1"), "--time"), (("--target-error", "nan"), "--target-error"), (("--threads", "0"), "--threads"),
    (("--aov", "depth,radiosity"), "position"), (("--integrator", "radiosity"), "volpath"), (("--pixel", "1,2"), "--sample"),
    (("-D", "density"), "NAME=VALUE"), (("--seed", "x"), "--seed"), (("-o", "nowhere/out.exr"), "nowhere"),
], ids=lambda v: " ".join(v) if isinstance(v, tuple) else "")
def test_an_impossible_option_is_refused_and_named(fog, flags, text):
    said = lightshaft("render", fog, *flags, code=2, cwd=fog.parent).stderr

    assert "error: " in said and text in said
    assert not (fog.parent / "fog.exr").exists()


def test_defines_set_the_scenes_parameters(fog):
    def centre(*flags):
        return lightshaft("render", fog, "--pixel", "36,20", "--sample", 3, *flags, cwd=fog.parent).stdout

    assert centre("-D", "density=2") == centre()  # the scene's default
    assert centre("-D", "density=9") != centre()
    said = refused(fog, "-Ddenisty=9")
    assert "denisty" in said and "$density" in said


def test_strict_makes_warnings_errors(fog):
    scene = changed(fog, '<integrator type="volpath"/>', '<integrator type="path"/>')
    warned = lightshaft("render", scene, "--spp", 2, cwd=fog.parent)
    assert "media" in warned.stderr

    lightshaft("render", scene, "--spp", 2, "--strict", code=2, cwd=fog.parent)


GOOD = vol_bytes(fog_values(6), 6, 6, 6)


@pytest.mark.parametrize("content", [
    GOOD[:-5], GOOD[:20], b"", b"not a grid at all, but long enough to be one's header, at least by its size",
    GOOD[:48] + struct.pack("<f", float("nan")) + GOOD[52:],
    GOOD[:48] + struct.pack("<f", float("inf")) + GOOD[52:],
    b"VOL\x03" + struct.pack("<5i6f", 1, 2 ** 30, 2 ** 30, 2 ** 30, 1, 0, 0, 0, 1, 1, 1),
], ids=["truncated", "header only", "empty", "foreign", "NaN", "infinite", "huge"])
def test_a_bad_grid_is_refused_by_name(fog, content):
    (fog.parent / "fog.vol").write_bytes(content)

    said = refused(fog)

    assert "error: " in said and "fog.vol" in said
    assert "fog.vol" in lightshaft("render", fog, "--isolate", code=2, cwd=fog.parent).stderr


PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" \
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


@pytest.mark.parametrize("content", [PLY[:-20], PLY[:60], "", PLY.replace("3 0 1 2", "3 0 1 9")],
                         ids=["truncated", "header cut", "empty", "index out of range"])
def test_a_bad_mesh_is_refused_by_name(fog, content):
    scene = changed(fog, "</scene>", '<shape type="ply"><string name="filename" value="leaf.ply"/></shape></scene>')
    mesh = fog.parent / "leaf.ply"
    mesh.write_text(PLY)
    lightshaft("inspect", scene)
    mesh.write_text(content)

    said = refused(scene)

    assert "error: " in said and "leaf.ply" in said


def test_a_truncated_texture_is_refused_by_name(fog):
    scene = changed(fog, '<bsdf type="diffuse"/>', '<bsdf type="diffuse"><texture name="reflectance" type="bitmap">'
                    '<string name="filename" value="wood.png"/></texture></bsdf>')
    (fog.parent / "wood.png").write_bytes(b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sIIBBBBB", 13, b"IHDR", 8, 8, 8, 2, 0, 0, 0))

    said = refused(scene)

    assert "error: " in said and "wood.png" in said


def test_merge_refuses_what_is_no_partial(fog, tmp_path):
    lightshaft("render", fog, "-o", tmp_path / "image.exr", "--spp", 2)

    assert "image.exr" in lightshaft("merge", tmp_path / "image.exr", "-o", tmp_path / "out.exr", code=2).stderr
    assert "nothing.exr" in lightshaft("merge", tmp_path / "nothing.exr", "-o", tmp_path / "out.exr", code=1).stderr


def test_inspect_tells_what_the_scene_needs(fog):
    told = json.loads(lightshaft("inspect", fog, "--json").stdout)

    assert told["size"] == [72, 40] and told["spp"] == 8 and told["integrator"] == "volpath"
    assert [(a["name"], a["bytes"]) for a in told["assets"]] == [("fog.vol", (fog.parent / "fog.vol").stat().st_size)]
    assert told["variant"] and told["features_used"] and told["features_left_out"]
    assert any(s["bytes"] > 0 for s in told["structures"])
    text = lightshaft("inspect", fog).stdout
    assert "fog.vol" in text and "72 x 40" in text and not (fog.parent / "fog.exr").exists()


def test_a_scene_without_light_is_told_to_be_black(tmp_path):
    sphere = '<scene version="3.0.0">{}<shape type="sphere"/><sensor type="perspective"/></scene>'
    dark = tmp_path / "dark.xml"
    dark.write_text(sphere.format(""))
    medium = '<medium name="interior" type="homogeneous"><rgb name="emission" value="1 1 1"/></medium>'
    lights = ['<emitter type="constant"/>', '<shape type="disk"><emitter type="area"/></shape>',
              f'<shape type="cube"><bsdf type="null"/>{medium}</shape>']

    said = lightshaft("render", dark, "-o", tmp_path / "out.exr", "--size", "4x4", "--spp", 2, "--quiet").stderr

    assert said == f"{dark}: warning: the scene has no light, so that the picture is black\n"
    for k, light in enumerate(lights):
        lit = tmp_path / f"lit{k}.xml"
        lit.write_text(sphere.format(light))
        assert "the scene has no light" not in lightshaft("inspect", lit).stderr
