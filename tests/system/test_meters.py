"""Scenes that measure numbers instead of making an image: the same values from any farm, and how they are told."""

import json
import math

import pytest
from cli_kit import digest, lightshaft
from local_farm import LocalFarm

# A hall with haze and a lamp, a floor that is a meter, and six points in the air.
POINTS = "; ".join(f"{x} {y} 0.5 0 0 1" for x in (-2, 0, 2) for y in (-1, 1))
SCENE = f"""<scene version="3.0.0">
  <medium type="homogeneous" id="haze"><float name="sigma_t" value="0.2"/><float name="albedo" value="0.9"/></medium>
  <shape type="cube">
    <transform name="to_world"><scale x="4" y="2" z="1.5"/><translate z="1.5"/></transform>
    <boolean name="flip_normals" value="true"/><ref name="exterior" id="haze"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
  </shape>
  <shape type="sphere"><float name="radius" value="0.2"/><transform name="to_world"><translate z="2.5"/></transform>
    <emitter type="area"><rgb name="radiance" value="20, 30, 10"/></emitter></shape>
  <shape type="rectangle"><transform name="to_world"><translate z="0.1"/></transform><bsdf type="diffuse"/>
    <sensor type="fluxmeter" id="floor"/></shape>
  <sensor type="irradiancemeter" id="hall"><string name="points" value="{POINTS}"/>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler></sensor>
</scene>
"""
# Under a constant environment of radiance 2: the irradiance is 2 pi.
SKY = """<scene version="3.0.0"><emitter type="constant"><rgb name="radiance" value="2"/></emitter>
  <sensor type="irradiancemeter" id="roof"><string name="points" value="0 0 0 0 0 1"/></sensor></scene>
"""


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "hall.xml"
    path.write_text(SCENE)
    return path


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    """(digest, values) of the scene, rendered by one command."""
    folder = tmp_path_factory.mktemp("one")
    (folder / "hall.xml").write_text(SCENE)
    pixels = digest(lightshaft("render", folder / "hall.xml", "-o", folder / "hall.json", "--threads", 1))
    return pixels, json.loads((folder / "hall.json").read_text())["meters"]


def test_a_render_writes_the_values_and_prints_them(scene, expected):
    out = lightshaft("render", scene, "--threads", 2, "--report", scene.parent / "report.json", cwd=scene.parent)

    meters = json.loads((scene.parent / "hall.json").read_text())["meters"]
    assert (digest(out), meters) == expected
    assert [m["name"] for m in meters] == ["floor"] + [f"hall[{i}]" for i in range(1, 7)]
    assert [m["unit"] for m in meters] == ["W"] + 6 * ["W/m^2"]
    assert json.loads((scene.parent / "report.json").read_text())["meters"] == meters
    for m in meters:
        assert m["samples"] == 16 * 256
        assert all(low < value < high for value, (low, high) in zip(m["value"], m["ci95"]))
        assert m["luminance_ci95"][0] < m["luminance"] < m["luminance_ci95"][1]
        assert m["name"] in out.stdout


def test_symmetric_points_agree_within_their_intervals(expected):
    values = {m["name"]: m for m in expected[1]}
    for a, b in [(1, 2), (3, 4), (5, 6), (1, 5)]:
        a, b = values[f"hall[{a}]"], values[f"hall[{b}]"]
        spread = math.hypot(*[(m["ci95"][1][1] - m["ci95"][1][0]) / 2 for m in (a, b)])
        assert abs(a["value"][1] - b["value"][1]) < 5 / 1.97 * spread  # five standard errors


def test_a_meter_that_sees_nothing_has_no_interval(scene):
    scene.write_text(SKY.replace('value="2"', 'value="0"'))
    out = lightshaft("render", scene, "--spp", 4, cwd=scene.parent)

    (dark,) = json.loads((scene.parent / "hall.json").read_text())["meters"]
    assert dark["value"] == [0, 0, 0] and dark["ci95"] is None and dark["luminance_ci95"] is None and not dark["trusted"]
    assert "no sample has found light" in out.stdout


def test_a_constant_sky_is_measured_exactly(scene):
    scene.write_text(SKY)
    lightshaft("render", scene, "-o", scene.parent / "sky.exr", "--report", scene.parent / "r.json", "--spp", 4)

    (roof,) = json.loads((scene.parent / "r.json").read_text())["meters"]
    assert roof["value"] == pytest.approx(3 * [2 * math.pi], rel=1e-5)  # float32 along a short path


def test_a_target_error_is_that_of_the_values(scene):
    lightshaft("render", scene, "--target-error", 1e-5, "--report", scene.parent / "r.json", cwd=scene.parent)

    report = json.loads((scene.parent / "r.json").read_text())
    half = lambda m, c: (m["ci95"][c][1] - m["ci95"][c][0]) / 2 / 1.96931
    own = [(half(m, c) ** 2) / (m["value"][c] ** 2 + .01) for m in report["meters"] for c in range(3)]
    assert report["stopped"] == "error" and report["relmse"] <= 1e-5
    assert sum(own) / len(own) == pytest.approx(report["relmse"], rel=.3)  # two estimates of one figure, from the same pixels


def test_more_samples_go_on_and_merged_partials_have_the_same_pixels(scene, expected):
    folder = scene.parent / "partials"
    out = lightshaft("render", scene, "--partial-dir", folder, cwd=scene.parent)
    merged = lightshaft("merge", *sorted(folder.glob("*.exr")), "-o", scene.parent / "merged.exr")

    assert digest(out) == digest(merged) == expected[0]


@pytest.mark.parametrize("workers", [1, 3])
def test_a_farm_measures_the_same(tmp_path, expected, workers):
    with LocalFarm(tmp_path) as farm:
        farm.add_workers(workers, fake=False)
        job = farm.submit(SCENE)

        assert farm.pixels(job) == expected[0]
        assert farm.get(f"/api/v1/jobs/{job}/meters")["meters"] == expected[1]
        assert farm.report(job)["meters"] == expected[1]
        assert farm.job(job)["meters"] == 7


def test_kills_and_a_restart_change_nothing(tmp_path, expected):
    with LocalFarm(tmp_path) as farm:
        farm.add_workers(2, fake=False)
        job = farm.submit(SCENE)
        farm.wait_for_progress(job, 3)
        farm.workers[0].kill()
        farm.restart_coordinator()
        farm.add_worker(fake=False)

        assert farm.pixels(job) == expected[0]
        assert farm.get(f"/api/v1/jobs/{job}/meters")["meters"] == expected[1]


def test_a_farm_hands_the_values_to_the_command(tmp_path, scene, expected):
    with LocalFarm(tmp_path / "farm") as farm:
        farm.add_worker(fake=False)
        to = ("--to", farm.url())
        env = {"LIGHTSHAFT_TOKEN": farm.token}
        points = scene.parent / "points.csv"
        points.write_text(POINTS.replace("; ", "\n"))
        scene.write_text(SCENE.replace(f'name="points" value="{POINTS}"', 'name="filename" value="points.csv"'))
        job = lightshaft("submit", scene, *to, "-o", tmp_path / "a.json", env=env, cwd=tmp_path).stdout.splitlines()[0]

        assert json.loads((tmp_path / "a.json").read_text())["meters"] == expected[1]
        lightshaft("fetch", job, *to, env=env, cwd=tmp_path)
        assert json.loads((tmp_path / "hall.json").read_text())["meters"] == expected[1]
        assert "hall[6]" in lightshaft("show", job, *to, env=env).stdout
        assert json.loads(lightshaft("show", job, *to, "--json", env=env).stdout)["meters"] == 7


@pytest.mark.parametrize("flags, words", [
    (("--size", "64x64"), "leave the size out"), (("--aov", "depth"), "AOVs"), (("-o", "x.tif"), ".json")])
def test_what_belongs_to_images_is_refused(scene, flags, words):
    assert words in lightshaft("render", scene, *flags, code=2, cwd=scene.parent).stderr


def test_an_image_is_not_written_as_values(scene):
    scene.write_text(SKY.replace(SKY[SKY.index("<sensor"):SKY.index("</scene>")], '<sensor type="perspective"/>'))
    assert "camera" in lightshaft("render", scene, "-o", "x.json", code=2, cwd=scene.parent).stderr


def test_a_wrong_row_is_told_with_its_line(scene):
    (scene.parent / "p.csv").write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n0,0,0,0,0\n")
    scene.write_text(SKY.replace('name="points" value="0 0 0 0 0 1"', 'name="filename" value="p.csv"'))

    assert "p.csv:3:1: error: a row has 6 numbers" in lightshaft("render", scene, code=2, cwd=scene.parent).stderr


def test_inspect_names_meters_and_what_is_left_out(scene):
    text = lightshaft("inspect", scene).stdout

    assert "7 values to measure" in text and "path_reuse and light_vertices are left out" in text
    assert "pinhole" not in text
    lightshaft("inspect", scene, "--variants")


def test_scenes_with_meters_are_converted(scene, expected):
    converted = scene.parent / "again.xml"
    lightshaft("convert", scene, converted)

    assert digest(lightshaft("render", converted, "--threads", 2, cwd=scene.parent)) == expected[0]
