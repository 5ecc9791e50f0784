"""`lightshaft validate`: tests of light in media with closed forms, and of bsdfs, each passed for its own reason."""

import json
import subprocess
import sys

import pytest
from cli_kit import lightshaft
from local_farm import ROOT

CASES = {"absorption": 9, "emission": 9, "hetero-constant": 18, "furnace-noscatter": 18, "scattering-distant": 9}


@pytest.fixture(scope="module")
def tests(tmp_path_factory):
    folder = tmp_path_factory.mktemp("validate")
    subprocess.run([sys.executable, ROOT / "scenes" / "validate" / "make_tests.py", folder], check=True)
    return folder


def cases_of(file, tmp_path, *arguments, code=0):
    out = tmp_path / "out.json"
    lightshaft("validate", file, "--json", out, *arguments, code=code)
    return json.loads(out.read_text())


@pytest.mark.parametrize("name", CASES)
def test_media_match_their_closed_forms_in_every_channel(tests, tmp_path, name):
    table = cases_of(tests / f"test-medium-{name}.xml", tmp_path)

    assert len(table["cases"]) == table["passed"] == CASES[name]
    for case in table["cases"]:
        assert case["verdict"] == "pass" and case["nonfinite"] == 0
        assert abs(case["got"] - case["expected"]) <= .02 * case["expected"], "the test has no power"


def test_a_wrong_reference_fails_its_case_alone(tests, tmp_path):
    text = (tests / "test-medium-absorption.xml").read_text()
    start = text.index('name="references" value="') + len('name="references" value="')
    numbers = text[start:text.index('"', start)].split(", ")
    numbers[4] = str(float(numbers[4]) * 1.02)
    wrong = tests / "wrong.xml"
    wrong.write_text(text[:start] + ", ".join(numbers) + text[text.index('"', start):])

    table = cases_of(wrong, tmp_path, code=1)

    failed = [case for case in table["cases"] if case["verdict"] == "fail"]
    assert [case["name"] for case in failed] == ["scene 2, green"]
    assert "p = " in failed[0]["why"] and table["failed"] == 1


def test_the_table_names_the_build_the_class_and_the_seed(tests, tmp_path):
    file = tests / "test-medium-absorption.xml"
    whole = cases_of(file, tmp_path, "--seed", 7)
    part = cases_of(file, tmp_path, "--case", "scene 3, red")

    assert whole["build"] in lightshaft("--version").stdout
    assert len(whole["numeric_class"]) == 64 and whole["numeric_class"] == part["numeric_class"]
    assert whole["seed"] == 7 and "only" not in whole
    assert part["seed"] == 0 and part["only"] == "scene 3, red"


def test_cases_are_chosen_by_name_and_seeds_change_what_is_drawn(tests, tmp_path):
    file = tests / "test-medium-scattering-distant.xml"
    first = cases_of(file, tmp_path, "--case", "scene 3, red")["cases"]
    other = cases_of(file, tmp_path, "--case", "scene 3, red", "--seed", 7)["cases"]

    assert [case["name"] for case in first] == ["scene 3, red"]
    assert first[0]["got"] != other[0]["got"] and other[0]["verdict"] == "pass"


BSDFS = """<test type="ttest">
  <string name="angles" value="0, 40, 80"/>
  <string name="references" value="0.3, 0.3, 0.3, {mirror}"/>
  <bsdf type="diffuse"><color name="albedo" value="0.3, 0.3, 0.3"/></bsdf>
  <bsdf type="mirror"/>
</test>
"""
CHI2 = """<test type="chi2test">
  <bsdf type="diffuse"/>
  <bsdf type="roughconductor"><string name="material" value="Au"/><float name="alpha" value="0.3"/></bsdf>
</test>
"""


def test_bsdfs_reflect_what_they_should(tmp_path):
    file = tmp_path / "bsdfs.xml"
    file.write_text(BSDFS.format(mirror="1, 1, 1"))
    names = [case["name"] for case in cases_of(file, tmp_path)["cases"]]
    assert names == [f"bsdf {b} at {a} degrees" for b in (1, 2) for a in (0, 40, 80)]

    file.write_text(BSDFS.format(mirror="1, 0.99, 1"))
    failed = [case["name"] for case in cases_of(file, tmp_path, code=1)["cases"] if case["verdict"] == "fail"]
    assert failed == ["bsdf 2 at 40 degrees"]


# A closed room that shines 1 and reflects half: 1 + .5 where lamps alone light it, and 1 / (1 - .5) by all light.
FURNACE = """<test type="ttest">
  <string name="references" value="{references}"/>
  {scenes}
</test>
"""
ROOM = """<scene>
    <integrator type="{integrator}"/>
    <sampler type="independent"><integer name="sampleCount" value="256"/></sampler>
    <camera type="perspective"><float name="fov" value="60"/><integer name="width" value="4"/><integer name="height" value="4"/></camera>
    <mesh type="obj"><string name="filename" value="room.obj"/>
      <emitter type="area"><color name="radiance" value="1, 1, 1"/></emitter>
      <bsdf type="diffuse"><color name="albedo" value="0.5, 0.5, 0.5"/></bsdf></mesh>
  </scene>"""
# The cube [-2, 2]^3: its corners, and its sides with their normals, which point inwards.
CORNERS = [(x, y, z) for x in (-2, 2) for y in (-2, 2) for z in (-2, 2)]
SIDES = {(1, 0, 0): (3, 4, 2, 1), (-1, 0, 0): (6, 8, 7, 5), (0, 1, 0): (2, 6, 5, 1), (0, -1, 0): (7, 8, 4, 3),
         (0, 0, 1): (5, 7, 3, 1), (0, 0, -1): (4, 8, 6, 2)}
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + "".join(f"vn {x} {y} {z}\n" for x, y, z in SIDES)
OBJ += "".join(f"f {a}//{n} {b}//{n} {c}//{n} {d}//{n}\n" for n, (a, b, c, d) in enumerate(SIDES.values(), 1))


def test_a_furnace_tells_the_integrators_of_nori_apart(tmp_path):
    expected = {"whitted": 1.5, "direct_mis": 1.5, "path_mis": 2}
    (tmp_path / "room.obj").write_text(OBJ)
    file = tmp_path / "furnace.xml"
    file.write_text(FURNACE.format(references=", ".join(map(str, expected.values())),
                                   scenes="".join(ROOM.format(integrator=name) for name in expected)))

    table = cases_of(file, tmp_path)

    assert table["passed"] == len(table["cases"]) and len(table["cases"]) >= len(expected)
    for case in table["cases"]:
        assert abs(case["got"] - case["expected"]) <= .02 * case["expected"], "the test has no power"


def test_bsdfs_draw_directions_with_their_density(tmp_path):
    file = tmp_path / "chi2.xml"
    file.write_text(CHI2)

    table = cases_of(file, tmp_path)

    assert len(table["cases"]) == table["passed"] == 10
    assert all(case["p"] > case["level"] > 0 for case in table["cases"])


def test_what_is_no_test_is_refused(tmp_path):
    scene = tmp_path / "scene.xml"
    scene.write_text('<scene version="3.0.0"/>')
    assert "no <test>" in lightshaft("validate", scene, code=2).stderr
    assert "no such file" in lightshaft("validate", tmp_path / "none.xml", code=2).stderr
