"""`lightshaft convert`: the same scene, digest and pixels, wherever it is written to."""

import json
import subprocess
import sys

import pytest
from cli_kit import FOG, digest, lightshaft, vol_bytes, write_fog
from local_farm import ROOT


def convert(scene, out, *arguments):
    """The digest that it prints."""
    lines = lightshaft("convert", scene, out, *arguments).stdout.splitlines()
    assert len(lines) == 1 and lines[0].startswith("scene_sha256 "), lines
    return lines[0].split()[1]


def identity(scene):
    return json.loads(lightshaft("inspect", scene, "--json").stdout)["scene_sha256"]


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    kit = ROOT / "scenes" / "steam_room"
    subprocess.run([sys.executable, kit / "make_steam.py", folder / "steam.vol", "--voxel", "0.2"], check=True)
    subprocess.run([sys.executable, kit / "make_scene.py", folder / "steam_room.xml"], check=True)
    return folder / "steam_room.xml"


def test_the_demo_scene_stays_itself(demo, tmp_path):
    out = tmp_path / "out" / "canonical.xml"
    out.parent.mkdir()

    printed = convert(demo, out)

    assert printed == identity(demo) == identity(out)
    assert (out.parent / "steam.vol").read_bytes() == (demo.parent / "steam.vol").read_bytes()
    again = tmp_path / "out" / "again.xml"
    assert convert(out, again) == printed
    assert again.read_bytes() == out.read_bytes()


def test_a_converted_scene_renders_the_same_pixels(tmp_path):
    scene = write_fog(tmp_path)
    out = tmp_path / "there"
    out.mkdir()

    convert(scene, out / "fog.xml", "-D", "density=3")

    def pixels(path, *more):
        return digest(lightshaft("render", path, "-o", out / "x.exr", "--spp", 4, *more))
    assert pixels(out / "fog.xml") == pixels(scene, "-D", "density=3") != pixels(scene)


def test_files_from_elsewhere_come_into_the_folder(tmp_path):
    for name, n in (("a", 4), ("b", 5)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "fog.vol").write_bytes(vol_bytes([1] * n ** 3, n, n, n))
    (tmp_path / "scenes").mkdir()
    cube = FOG[FOG.index('  <shape type="cube">'):FOG.index('  <shape type="rectangle">')]
    text = FOG.replace("fog.vol", "../a/fog.vol").replace("</scene>", cube.replace("fog.vol", str(tmp_path / "b" / "fog.vol")) + "</scene>")
    scene = tmp_path / "scenes" / "two.xml"
    scene.write_text(text)
    out = tmp_path / "out"
    out.mkdir()

    done = lightshaft("convert", scene, out / "two.xml")

    assert "is renamed to" in done.stderr
    names = sorted(p.name for p in out.iterdir())
    assert len(names) == 3 and names[1] == "fog.vol" and names[0].endswith("-fog.vol"), names
    assert identity(out / "two.xml") == done.stdout.split()[1]
    beside = tmp_path / "scenes" / "canonical.xml"
    assert convert(scene, beside) == identity(scene)
    assert sorted(p.name for p in beside.parent.iterdir()) == ["canonical.xml", "two.xml"]


def test_nothing_is_overwritten_but_out_itself(tmp_path):
    scene = write_fog(tmp_path)
    out = tmp_path / "out"
    out.mkdir()
    (out / "fog.vol").write_bytes(b"another one")

    assert "another folder" in lightshaft("convert", scene, out / "fog.xml", code=1).stderr
    assert (out / "fog.vol").read_bytes() == b"another one" and not (out / "fog.xml").exists()
    assert "is the scene itself" in lightshaft("convert", scene, scene, code=2).stderr
    assert scene.read_text() == FOG
    (out / "fog.vol").unlink()
    (out / "fog.xml").write_text("old")
    assert convert(scene, out / "fog.xml") == identity(scene)


def test_a_bad_scene_is_told_with_places_and_writes_nothing(tmp_path):
    scene = tmp_path / "bad.xml"
    scene.write_text(FOG.replace("gridvolume", "gridvolme"))

    said = lightshaft("convert", scene, tmp_path / "out.xml", code=2).stderr

    assert "bad.xml:" in said and "gridvolume" in said
    assert [p.name for p in tmp_path.iterdir()] == ["bad.xml"]


def test_what_only_lightshaft_reads_is_named(tmp_path):
    scene, out = tmp_path / "scene.xml", tmp_path / "out.xml"
    scene.write_text('<scene version="3.0.0"><sensor type="perspective"/>'
                     '<shape type="rectangle"><boolean name="holdout" value="true"/></shape></scene>')

    said = lightshaft("convert", scene, out).stderr

    assert f"warning: only Lightshaft reads 'holdout' of shape \"rectangle\"; Mitsuba 3 refuses {out}" in said
    assert "only Lightshaft reads" not in lightshaft("convert", write_fog(tmp_path), tmp_path / "fog2.xml").stderr


NORI = """<scene><integrator type="path_mis"/>
<camera type="perspective"><float name="fov" value="40"/><transform name="toWorld"><lookat origin="0,1,-4" target="0,0,0" up="0,1,0"/></transform>
<integer name="width" value="16"/><integer name="height" value="12"/></camera><sampler type="independent"><integer name="sampleCount" value="4"/></sampler>
<mesh type="obj"><string name="filename" value="flat.obj"/><bsdf type="diffuse"/></mesh>
<mesh type="obj"><string name="filename" value="smooth.obj"/><bsdf type="diffuse"/><emitter type="area"><color name="radiance" value="1,2,3"/></emitter></mesh></scene>"""


def test_nori_meshes_without_normals_are_flat_in_mitsubas_words(tmp_path):
    corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 1\n"
    (tmp_path / "flat.obj").write_text(corners + "f 1 2 3\nf 1 3 4\n")
    (tmp_path / "smooth.obj").write_text("v -1.5 0 0\nv -0.5 0 0\nv -0.5 1 0\nvn 0 0 -1\nvn 0.6 0 -0.8\nf 1//1 3//1 2//2\n")
    scene, out = tmp_path / "nori.xml", tmp_path / "there" / "scene.xml"
    scene.write_text(NORI)
    out.parent.mkdir()

    done = lightshaft("convert", scene, out)

    assert "only Lightshaft reads" not in done.stderr
    text = out.read_text()
    assert "flat_without_normals" not in text
    assert [name in text for name in ("flat.obj", "smooth.obj")] == [True, True]
    shading = [part.split("</shape>")[0] for part in text.split('<shape type="obj">')[1:]]
    assert ['"face_normals" value="true"' in part for part in shading] == ["flat.obj" in part for part in shading]
    assert digest(lightshaft("render", out, "-o", tmp_path / "a.exr")) == digest(lightshaft("render", scene, "-o", tmp_path / "b.exr"))
