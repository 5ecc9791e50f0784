"""Techniques by which light is looked for: named by inspect and by the report, which say how to switch each off."""

import json
import pathlib
import subprocess
import sys

import pytest
from cli_kit import lightshaft
from local_farm import ROOT, LocalFarm

SCENE = """<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
    <sampler type="independent"><integer name="sample_count" value="4"/></sampler></sensor>
  <shape type="cube"><bsdf type="null"/>
    <medium name="interior" type="homogeneous"><rgb name="sigma_t" value="0.3"/><rgb name="albedo" value="0.9"/></medium></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="4"/><translate z="-2"/></transform></shape>
  <emitter type="point"><point name="position" x="0.3" y="0.2" z="0.1"/></emitter>
</scene>
"""
USED = ["equiangular", "lamp_directions", "lamp_flights"]


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "lamp.xml"
    file.write_text(SCENE)
    return file


def names(told):
    return [one["name"] for one in told["techniques"]]


def test_inspect_foretells_what_the_reports_of_a_render_and_of_a_farm_name(scene, tmp_path):
    inspected = json.loads(lightshaft("inspect", scene, "--json").stdout)
    lightshaft("render", scene, "-o", tmp_path / "a.exr", "--report", tmp_path / "a.json", "--html", tmp_path / "a.html")
    lightshaft("render", scene, "-o", tmp_path / "b.exr", "--report", tmp_path / "b.json", "--isolate")
    with LocalFarm(tmp_path / "farm") as farm:
        farm.add_workers(1, fake=False)
        job = farm.submit(SCENE)
        farm.wait_for_job(job)
        on_farm = farm.report(job)

    assert names(inspected) == USED
    for report in (json.loads((tmp_path / "a.json").read_text()), json.loads((tmp_path / "b.json").read_text()), on_farm):
        assert report["techniques"] == inspected["techniques"]
    assert 'phase_only="true"' in lightshaft("inspect", scene).stdout
    assert "lamp_flights=&quot;-1&quot;" in (tmp_path / "a.html").read_text()


def test_a_job_chooses_techniques_in_place_of_its_scene(scene, tmp_path):
    def pixels(report):
        return json.loads((tmp_path / report).read_text())["pixels_sha256"]

    chosen = "--techniques=-equiangular,-path_reuse"
    lightshaft("render", scene, chosen, "-o", tmp_path / "option.exr", "--report", tmp_path / "option.json")
    with LocalFarm(tmp_path / "farm") as farm:
        farm.add_workers(1, fake=False)
        job = farm.submit(SCENE, techniques="-equiangular,-path_reuse")
        farm.wait_for_job(job)
        on_farm = farm.report(job)
    off = '<integer name="equiangular" value="-1"/><integer name="path_reuse" value="-1"/>'
    written = tmp_path / "written.xml"
    written.write_text(SCENE.replace('value="4"/></integrator>', f'value="4"/>{off}</integrator>'))
    lightshaft("render", written, "-o", tmp_path / "written.exr", "--report", tmp_path / "written.json")

    assert names(json.loads((tmp_path / "option.json").read_text())) == []
    assert pixels("option.json") == pixels("written.json") == on_farm["pixels_sha256"]
    assert "match the seal" in lightshaft("verify", tmp_path / "option.exr", "--scene", scene, chosen).stdout
    assert "--techniques" in lightshaft("verify", tmp_path / "option.exr", "--scene", scene, code=2).stderr
    assert "path_reuse" in lightshaft("render", scene, "--techniques=-reuse", "-o", tmp_path / "no.exr", code=2).stderr


def test_a_scene_that_uses_none_names_none(scene, tmp_path):
    off = '<integer name="equiangular" value="-1"/><integer name="path_reuse" value="-1"/>'
    scene.write_text(SCENE.replace('value="4"/></integrator>', f'value="4"/>{off}</integrator>'))
    lightshaft("render", scene, "-o", tmp_path / "a.exr", "--report", tmp_path / "a.json", "--html", tmp_path / "a.html")

    assert names(json.loads((tmp_path / "a.json").read_text())) == []
    assert "How it looked for light" not in (tmp_path / "a.html").read_text()


def test_the_script_tells_what_each_technique_costs_and_brings(scene):
    script = [sys.executable, ROOT / "bench/techniques.py", f"{scene}@16x12", "--seeds", "2", "--spp", "4", "--json", scene.with_suffix(".json")]
    page = subprocess.run(script, check=True, capture_output=True, text=True).stdout
    rows = json.loads(scene.with_suffix(".json").read_text())

    assert [row["technique"] for row in rows] == USED
    assert all(row["error"][0] > 0 and row["seconds"][0] > 0 and row["off"]["parameter"] in page for row in rows)


def test_the_script_tells_what_learning_costs(scene):
    script = [sys.executable, ROOT / "bench/learning.py", f"{scene}@16x12", "--runs", "2"]
    *_, row = subprocess.run(script, check=True, capture_output=True, text=True).stdout.splitlines()
    name, techniques, load, learning, *shares = row.strip("| ").split(" | ")

    assert (name, techniques) == ("lamp, 16x12", ", ".join(USED))
    assert float(load) > 0 and learning.count("to") == 1
    ten, sixty, six_hundred = (float(share.removesuffix(" %")) for share in shares)
    assert ten >= sixty >= six_hundred >= 0


def test_the_script_tells_how_rendering_scales(scene):
    script = [sys.executable, ROOT / "bench/threads.py", f"{scene}@16x12", "--spp", "4", "--threads", "1,2,3"]
    head, _, row = subprocess.run(script, check=True, capture_output=True, text=True).stdout.splitlines()
    name, *figures = row.strip("| ").split(" | ")

    assert head == "| scene | load, 1 thread | load, 3 threads | 2 threads | 3 threads |"
    assert name == "lamp, 16x12" and len(figures) == 4 and all(float(figure) >= 0 for figure in figures)
