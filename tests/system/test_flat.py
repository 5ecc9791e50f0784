"""The flat `scenes/flat`: its generator, and that its lamps are chosen by place."""

import json
import subprocess
import sys

import pytest
from cli_kit import lightshaft
from local_farm import ROOT


@pytest.mark.parametrize("rooms, fog", [(3, 0), (2, 0.1)])
def test_lamps_in_other_rooms_are_seldom_asked(tmp_path, rooms, fog):
    make = [sys.executable, "-B", ROOT / "scenes/flat/make_flat.py", tmp_path, "--rooms", str(rooms), "--fog", str(fog)]
    subprocess.run(make, check=True)
    scene = (tmp_path / "flat.xml").read_text()
    subprocess.run(make, check=True)
    assert (tmp_path / "flat.xml").read_text() == scene

    told = json.loads(lightshaft("inspect", tmp_path / "flat.xml", "--json").stdout)

    assert "local_lights" in [one["name"] for one in told["techniques"]]
    assert scene.count("<emitter ") == rooms * rooms


def test_a_flat_without_rooms_is_refused(tmp_path):
    told = subprocess.run([sys.executable, "-B", ROOT / "scenes/flat/make_flat.py", tmp_path, "--rooms", "0"], capture_output=True, text=True)

    assert told.returncode == 2
    assert "at least one room" in told.stderr
