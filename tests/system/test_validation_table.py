"""`lightshaft validate` without a file: the table of stiff and extreme cases passes, by its quick bands in every run."""

import json
import re

import pytest
from cli_kit import lightshaft, rate_of
from local_farm import ROOT

pytestmark = pytest.mark.slow

ATTEMPTS = 3  # of an interval that came out too wide (validation/measure/judge.h)
SECTION_7 = ["7.1", "7.2", "7.5", "7.6a", "7.6b", "7.6c", "7.6d", "7.6e", "7.6f", "7.6g", "7.6h", "7.7"]


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    out = tmp_path_factory.mktemp("table") / "table.json"
    lightshaft("validate", "--quick", "--json", out, patience=900)  # of a minute on quiet cores: others may have them
    return json.loads(out.read_text())


def test_every_case_passes_with_figures_of_its_own(table):
    assert table["failed"] == 0 and table["passed"] == len(table["cases"]) > 0
    for case in table["cases"]:
        assert case["verdict"] == "pass" and case["nonfinite"] == 0
        assert case["kind"] in ("exact", "statistical") and case["about"] and case["rows"], case["name"]
        # Bands of .3 % are 1 % here.
        assert ("why_band" in case) == (case.get("band", 0) > .0101), case["name"]
        # The interval covers the answer: at most 6.6 errors, of 40 degrees of freedom, and the allowance.
        assert abs(case["z"]) < 7.6, case["name"]


def test_the_table_keeps_to_its_part_of_the_rate_of_false_alarms(table):
    levels = [ATTEMPTS * case["level"] for case in table["cases"] if case["kind"] == "statistical"]
    assert 0 < sum(levels) <= rate_of("table") * 1.001  # of so small rates the sum is that of Sidak


# What --quick took on two quiet cores for the paths below: 27.6 s, of the 50 that it may take. Paths are counted, seconds
# are not: they are the machine's.
QUICK_PATHS = 48_738_304


def test_the_quick_table_has_not_grown(table):
    assert sum(case.get("paths", 0) for case in table["cases"]) < QUICK_PATHS * 50 / 27.6


def test_every_row_of_the_list_is_a_case_or_a_test_that_is_named(table):
    """N1 to N70 of the list of stiff and extreme cases, and the tables and closed forms of its section 7."""
    rows = {row for case in table["cases"] + table["left_out"] for row in case["rows"].split()}
    page = (ROOT / "docs" / "design" / "validation.md").read_text()
    for row, test, file in re.findall(r"^\| (N\d+) \| (.+) \| `(\S+)` \|$", page, re.MULTILINE):
        assert test in (ROOT / file).read_text(), f"{file} has no {test}"
        rows.add(row)
    missing = [row for row in [f"N{n}" for n in range(1, 71)] + SECTION_7 + ["seed", "bug"] if row not in rows]
    assert missing == []


SCENE = """<scene version="3.0.0">
  <sensor type="perspective">{sensor}<film type="hdrfilm"/></sensor>
  <medium type="homogeneous" id="fog"><phase type="{phase}">{values}</phase></medium>
  <shape type="cube"><bsdf type="null"/><ref id="fog" name="interior"/></shape>
  <emitter type="constant"/>
</scene>
"""


def inspected(tmp_path, code, sensor="", phase="isotropic", values=""):
    scene = tmp_path / "scene.xml"
    scene.write_text(SCENE.format(sensor=sensor, phase=phase, values=values))
    return lightshaft("inspect", scene, code=code)


def test_a_steep_table_of_a_phase_function_is_read_and_one_with_a_negative_value_refused(tmp_path):
    inspected(tmp_path, 0, phase="tabphase", values='<string name="values" value="1, 2, 1e6"/>')
    said = inspected(tmp_path, 2, phase="tabphase", values='<string name="values" value="1, -2, 1e6"/>').stderr
    assert "scene.xml:3:" in said and "'values'" in said


def test_a_closed_shutter_stops_a_camera_with_a_warning(tmp_path):
    moving = '<animation name="to_world"><transform time="0"/><transform time="1"><translate x="0.5"/></transform></animation>'
    for close, stops in (("0", True), ("1", False)):
        sensor = f'<float name="shutter_open" value="0"/><float name="shutter_close" value="{close}"/>'
        assert "shutter opens" not in inspected(tmp_path, 0, sensor=sensor).stderr
        said = inspected(tmp_path, 0, sensor=sensor + moving)
        assert ("give shutter_open and shutter_close" in said.stderr) == stops
        assert ("the camera moves while the shutter is open" in said.stdout) == (not stops)


NO_NUMBERS = {"inf": "wants a", "-inf": "wants a", "nan": "wants a", "-1": "out of its range"}


@pytest.mark.parametrize("value", NO_NUMBERS)
@pytest.mark.parametrize("light", ["point", "constant", "area"])
def test_lights_that_are_no_number_are_refused(tmp_path, light, value):
    name = "intensity" if light == "point" else "radiance"
    emitter = f'<emitter type="{light}"><rgb name="{name}" value="1, {value}, 1"/></emitter>'
    scene = tmp_path / "scene.xml"
    scene.write_text('<scene version="3.0.0"><sensor type="perspective"><film type="hdrfilm"/></sensor>\n'
                     + (f'<shape type="sphere">{emitter}</shape>' if light == "area" else emitter) + "</scene>")
    said = lightshaft("render", scene, "-o", tmp_path / "out.exr", "--spp", "2", code=2).stderr
    assert NO_NUMBERS[value] in said and "scene.xml" in said


@pytest.mark.parametrize("lens", ['aperture_radius="inf"', 'aperture_radius="-1"', 'aperture_radius="nan"',
                                  'focus_distance="0"', 'focus_distance="inf"', 'focus_distance="-1"', 'focus_distance="nan"'])
def test_lenses_that_cannot_be_are_refused(tmp_path, lens):
    name, value = lens.replace('"', "").split("=")
    numbers = {"aperture_radius": ".1", "focus_distance": "2", name: value}
    floats = "".join(f'<float name="{n}" value="{v}"/>' for n, v in numbers.items())
    scene = tmp_path / "scene.xml"
    scene.write_text(f'<scene version="3.0.0"><sensor type="thinlens">{floats}<film type="hdrfilm"/></sensor></scene>')
    said = lightshaft("inspect", scene, code=2).stderr
    assert "scene.xml:1:" in said and f"'{name}'" in said and ("out of its range" in said or "wants a" in said)


def test_cases_are_chosen_by_prefix_or_glob(tmp_path):
    out = tmp_path / "one.json"
    lightshaft("validate", "--case", "N01-no*/grid/volpath", "--json", out)
    assert [case["name"] for case in json.loads(out.read_text())["cases"]] == ["N01-no-extinction/grid/volpath"]
    assert "no such case" in lightshaft("validate", "--case", "nothing", code=2).stderr
