"""The reference images of the bench scenes: two of each that say how they were made, and that a race takes as they are."""

import json
import struct
import subprocess
import sys

import pytest
from cli_kit import lightshaft
from exr_layers import read_header
from local_farm import ROOT

pytest.importorskip("numpy")

REFERENCES = ROOT / "scenes" / "bench" / "references"
NAMES = ("shafts", "fogbox", "cloud", "spotfog", "tint", "surface")


def test_every_scene_has_two_references_that_say_whose_they_are():
    for name in NAMES:
        said = []
        for k in (0, 1):
            image = REFERENCES / f"{name}.{k}.exr"
            header, _ = read_header(image.read_bytes())
            said.append(json.loads(header["reference"][1]))
            x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"][1])
            assert (x1 - x0 + 1, y1 - y0 + 1) == ((320, 240) if name == "shafts" else (256, 256))
            kinds = [header["channels"][1][18 * c:18 * c + 3] for c in range(3)]
            assert kinds == [b"B\0\1", b"G\0\1", b"R\0\1"], "half floats"
            assert header["compression"][1][0] <= 4, "PIZ is the last that loses nothing"
            assert image.stat().st_size < 1_000_000
        assert all(about["program"] in ("Cycles", "Mitsuba") and about["version"] and about["samples"] > 0 for about in said)
        assert said[0]["seed"] != said[1]["seed"] and said[0] == {**said[1], "seed": said[0]["seed"]}


def test_a_race_takes_them(tmp_path):
    subprocess.run([sys.executable, "-B", ROOT / "scenes" / "bench" / "make_bench.py", tmp_path], check=True)
    lightshaft("compare", tmp_path / "surface.xml", "--integrators", "volpath", "--references", REFERENCES, "--spp", 4, "--time", 60, "--seeds", 1,
               "--report", tmp_path / "out")

    report = (tmp_path / "out" / "report.md").read_text()
    assert "surface.0.exr and surface.1.exr, two independent references" in report
