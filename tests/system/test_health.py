"""A scene that really gives samples that can't be added up: counted, located, told everywhere, and seen again by the command that is
printed."""

import json
import os
import shlex

import pytest
from cli_kit import lightshaft, load
from local_farm import LocalFarm

# A lamp brighter than sums can hold, in a part of the picture only. Each wall around it sees it, too, and its light is too much
# there as well: max_depth 1 leaves just the lamp.
LAMP = """<scene version="3.0.0">
  <default name="glow" value="1"/>
  <integrator type="path"><integer name="max_depth" value="1"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="8"/></sampler>
    <film type="hdrfilm"><integer name="width" value="70"/><integer name="height" value="40"/><rfilter type="box"/></film>
  </sensor>
  <shape type="sphere"><float name="radius" value="0.2"/><emitter type="area"><rgb name="radiance" value="$glow"/></emitter></shape>
  <emitter type="constant"><rgb name="radiance" value="0.5"/></emitter>
</scene>
"""
BRIGHT = "1e30, 1, 1"


@pytest.fixture(scope="module")
def lamp(tmp_path_factory):
    path = tmp_path_factory.mktemp("lamp") / "a lamp.xml"
    path.write_text(LAMP)
    return path


def told(lines):
    """The command after "see it again:"."""
    found = [line.split("see it again:")[1].strip() for line in lines.splitlines() if "see it again:" in line]
    assert len(found) == 1, lines
    return shlex.split(found[0])


def rejected_by_hand(lamp, size, seed, spp):
    """What each sample says for itself, by the replay."""
    width, height = size
    count = 0
    for y in range(height):
        for x in range(width):
            for sample in range(spp):
                said = lightshaft("render", lamp, "--size", f"{width}x{height}", "--seed", seed, "-D", f"glow={BRIGHT}",
                                  "--pixel", f"{x},{y}", "--sample", sample).stdout
                count += "too bright to be added up; it counts as zero" in said
    return count


def test_an_unhealthy_render_says_what_where_and_how_to_see_it_again(lamp, tmp_path):
    report, again = tmp_path / "r.json", tmp_path / "again.json"
    flags = ("render", lamp, "-o", tmp_path / "o.exr", "--seed", 5, "-D", f"glow={BRIGHT}", "--size", "35x20", "--spp", 6)
    said = lightshaft(*flags, "--report", report)
    quiet = lightshaft(*flags, "--report", again, "--quiet", "--threads", 1, "--isolate")

    figures = load(report)
    health = figures["health"]
    assert figures["nonfinite_samples"] == health["nonfinite"] == health["causes"][0]["count"] > 0 and not health["clean"]
    assert load(again)["health"] == health, "a function of the job alone"
    assert health["causes"][0]["cause"] == "too_large" and len(health["causes"]) == 1
    assert "not clean" in said.stderr and "not clean" in quiet.stderr and "too bright" in said.stderr
    assert b"lightshaft:health" in (tmp_path / "o.exr").read_bytes() and b'{"too_large"' in (tmp_path / "o.exr").read_bytes()

    command = told(said.stderr)
    first = health["causes"][0]["first"][0]
    assert command[0] == "lightshaft" and command == shlex.split(health["causes"][0]["replay"])
    assert command[-4:] == ["--pixel", f"{first['pixel'][0]},{first['pixel'][1]}", "--sample", str(first["sample"])]
    shown = lightshaft(*command[1:], cwd=tmp_path).stdout
    assert "e+30 1 1" in shown and "too bright to be added up" in shown
    # The same place without the settings is another sample.
    assert "e+30" not in lightshaft("render", lamp, *command[-4:]).stdout


def test_the_count_is_that_of_the_samples_one_by_one(lamp, tmp_path):
    report = tmp_path / "r.json"
    lightshaft("render", lamp, "-o", tmp_path / "o.exr", "--seed", 2, "-D", f"glow={BRIGHT}", "--size", "7x4", "--spp", 2,
               "--report", report)

    assert load(report)["nonfinite_samples"] == rejected_by_hand(lamp, (7, 4), 2, 2) > 0


def test_a_healthy_render_says_nothing_of_it(lamp, tmp_path):
    report = tmp_path / "r.json"
    said = lightshaft("render", lamp, "-o", tmp_path / "o.exr", "--size", "35x20", "--spp", 4, "--report", report)

    assert load(report)["health"] == {"clean": True, "nonfinite": 0, "negative": 0, "majorant_violations": 0, "causes": []}
    assert "clean" not in said.stderr


def test_values_that_a_half_image_cuts_are_told(lamp, tmp_path):
    flags = ("render", lamp, "-o", tmp_path / "o.exr", "--size", "35x20", "--spp", 4, "-D", "glow=1e6", "--report", tmp_path / "r.json")
    half = lightshaft(*flags)
    count = load(tmp_path / "r.json")["clamped_values"]
    full = lightshaft(*flags, "--float")

    assert count > 0 and f"{count} values are above 65504" in half.stderr
    assert load(tmp_path / "r.json")["clamped_values"] == 0 and "65504" not in full.stderr


def test_inputs_that_were_changed_are_told(tmp_path):
    from cli_kit import FOG, fog_values, vol_bytes
    values = fog_values(12)
    values[100] = values[500] = -1.0
    (tmp_path / "fog.vol").write_bytes(vol_bytes(values, 12, 12, 12))
    (tmp_path / "fog.xml").write_text(FOG)
    said = lightshaft("render", tmp_path / "fog.xml", "-o", tmp_path / "o.exr", "--spp", 2, "--report", tmp_path / "r.json")

    cause, = load(tmp_path / "r.json")["health"]["causes"]
    assert cause["text"] == "2 negative values of volumes of the scene were made 0" and cause["first"] == []
    assert cause["text"] in said.stderr and "see it again" not in said.stderr


def test_a_farm_tells_the_same_as_render_and_remembers_it(lamp, tmp_path):
    flags = ("--seed", 5, "-D", f"glow={BRIGHT}", "--size", "70x40", "--spp", 6)
    lightshaft("render", lamp, "-o", tmp_path / "alone.exr", "--report", tmp_path / "alone.json", *flags)
    alone = load(tmp_path / "alone.json")["health"]
    with LocalFarm(tmp_path) as farm:
        env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
        for _ in range(2):
            farm.add_worker(fake=False)
        sent = lightshaft("submit", lamp, *flags, "--wait", "--report", tmp_path / "farm.json", env=env)
        job = sent.stdout.split()[0]
        of_farm = load(tmp_path / "farm.json")["health"]

        assert [c["first"] for c in of_farm["causes"]] == [c["first"] for c in alone["causes"]]
        assert {**of_farm, "causes": []} == {**alone, "causes": []}
        command = told(sent.stderr)
        assert "e+30 1 1" in lightshaft(*command[1:], cwd=lamp.parent).stdout
        assert farm.get(f"/api/v1/jobs/{job}")["health"] == of_farm
        assert "not clean" in lightshaft("jobs", env=env).stdout
        farm.restart_coordinator()
        shown = lightshaft("show", job, env=env).stdout
        watched = lightshaft("watch", job, env=env)

    assert "too bright" in shown and "not clean" in shown
    assert told(shown) == told(watched.stderr) == command


def test_a_sequence_points_to_the_first_frame_that_is_not_clean(tmp_path):
    (tmp_path / "s.xml").write_text(LAMP.replace("$glow", "1e$frame"))
    with LocalFarm(tmp_path) as farm:
        env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
        farm.add_worker(fake=False)
        sent = lightshaft("submit", tmp_path / "s.xml", "--frames", "27-31x2", "--size", "14x8", "--spp", 2, "--wait", "--report",
                          tmp_path / "r.json", env=env)

    cause, = json.loads((tmp_path / "r.json").read_text())["health"]["causes"]
    assert cause["frame"] == 29
    assert "first in frame 29 at pixel" in sent.stderr
    command = told(sent.stderr)
    assert command[command.index("--frames") + 1] == "29"
    assert "e+29" in lightshaft(*command[1:], cwd=tmp_path).stdout
