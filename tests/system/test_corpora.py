"""bench/refusals.py judges refusals by reading the files itself: true ones get a verdict, false ones are found."""

import sys

import pytest
from cli_kit import lightshaft
from local_farm import ROOT

sys.path.insert(0, str(ROOT / "bench"))
import refusals  # noqa: E402

SENSOR = '<sensor type="perspective"/>'
NORI = '<scene><integrator type="path"/><camera type="perspective"/>{}</scene>'
GLTF = '{{"asset": {{"version": "{}"}}, "scenes": [{{"nodes": []}}], "extensionsRequired": [{}]}}'
FILES = {
    "curve.pbrt": ('Camera "perspective"\nWorldBegin\nShape "curve"\n', refusals.OUTSIDE),
    "part.pbrt": ('Camera "perspective"\nWorldBegin\nShape "sphere" "float phimax" 90\n', refusals.OUTSIDE),
    "open.pbrt": ('Camera "perspective"\nWorldBegin\nAttributeBegin\nShape "sphere"\n', refusals.WRONG),
    "absent.pbrt": ('Camera "perspective"\nWorldBegin\nShape "plymesh" "string filename" "no.ply"\n', refusals.INCOMPLETE),
    "hair.xml": (f'<scene version="3.0.0">{SENSOR}<shape type="sphere"><bsdf type="hair"/></shape></scene>', refusals.OUTSIDE),
    "absent.xml": (f'<scene version="3.0.0">{SENSOR}<shape type="ply"><string name="filename" value="no.ply"/></shape></scene>', refusals.INCOMPLETE),
    "own.xml": (NORI.format('<mesh type="sphere"><bsdf type="velvet"/></mesh>'), refusals.OUTSIDE),
    "solid.xml": (NORI.format('<mesh type="sphere"><bsdf type="diffuse"><texture type="solid"/></bsdf></mesh>'), refusals.OUTSIDE),
    "more.xml": (NORI.format('<mesh type="sphere"><bsdf type="mirror"><color name="albedo" value="1 1 1"/></bsdf></mesh>'), refusals.OUTSIDE),
    "old.gltf": (GLTF.format("1.0", ""), refusals.OUTSIDE),
    "basis.gltf": (GLTF.format("2.0", '"KHR_texture_basisu"'), refusals.OUTSIDE),
}


@pytest.mark.parametrize("name", FILES)
def test_a_true_refusal_gets_its_verdict(tmp_path, name):
    text, verdict = FILES[name]
    scene = tmp_path / name
    scene.write_text(text)

    told = lightshaft("inspect", scene, code=2).stderr
    place, _, message = next(line for line in told.splitlines() if ": error: " in line).partition(": error: ")

    assert refusals.judge(refusals.Case(scene, place), message)[0] == verdict, told


@pytest.mark.parametrize("name, place, message", [
    ("curve.pbrt", "3:8", 'Shape "cone" is not read: write it as a plymesh'),  # it is none
    ("curve.pbrt", "1:9", 'Shape "curve" is not read: hair is not supported: leave it out'),  # it is elsewhere
    ("part.pbrt", "3:8", 'Shape "sphere" is not read: leave it out'),  # no page says so
    ("open.pbrt", "4:1", "this is begun and not ended"),
    ("hair.xml", "1:1", 'the bsdf "hair" is not supported: hair is not supported'),
    ("absent.xml", "1:1", 'there is no file "absent.xml"'),
    ("own.xml", "1:60", "a message of no known kind"),
    ("basis.gltf", "1:1", "extensionsRequired[0]: KHR_draco_mesh_compression is not read: unpack the file"),
])
def test_a_false_refusal_is_found(tmp_path, name, place, message):
    scene = tmp_path / name
    scene.write_text(FILES[name][0])

    with pytest.raises((ValueError, AssertionError)):
        refusals.judge(refusals.Case(scene, f"{scene}:{place}"), message)
