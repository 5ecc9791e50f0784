"""Stages that are cut short or of which a byte was changed are refused by name, or read: never an error of Python's own."""

import random

import pytest
from stage_kit import camera, mesh
from pxr import Usd, UsdLux

from lightshaft.errors import LightshaftError
from lightshaft.usd import read

TRIES = 200


def stage_bytes(folder, suffix):
    stage = Usd.Stage.CreateNew(str(folder / f"whole{suffix}"))
    camera(stage, (0, 1, 5), (0, 0, 0))
    mesh(stage, "/floor", [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], [(0, 3, 2, 1)])
    UsdLux.SphereLight.Define(stage, "/lamp").CreateIntensityAttr(3.0)
    stage.Save()
    return (folder / f"whole{suffix}").read_bytes()


def outcome(path):
    """"read", with the warnings about its end, or what the refusal says. Any other exception fails the test."""
    try:
        return "".join(["read", *(told for told in read(path).warnings if "cut short" in told)])
    except LightshaftError as error:
        return str(error)


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_a_stage_that_was_cut_is_refused_or_told(tmp_path, suffix):
    whole = stage_bytes(tmp_path, suffix)
    for i in range(TRIES):
        path = tmp_path / f"cut{i}{suffix}"  # USD keeps what it has read under a name
        # The last bytes of the text form are blank lines and closing braces; without those alone it may be whole.
        cut = whole[: (len(whole) - 3) * i // TRIES]
        path.write_bytes(cut)
        # Between two prims a text may end; that it was cut at a line's end can't be known.
        assert outcome(path) != "read" or (suffix == ".usda" and cut.endswith(b"}\n")), i


@pytest.mark.parametrize("suffix", [".usda", ".usdc"])
def test_a_stage_with_a_changed_byte_is_refused_or_read(tmp_path, suffix):
    whole, numbers = bytearray(stage_bytes(tmp_path, suffix)), random.Random(5)
    said = []
    for i in range(TRIES):
        changed = bytearray(whole)
        changed[numbers.randrange(len(whole))] ^= numbers.randrange(1, 256)
        path = tmp_path / f"changed{i}{suffix}"
        path.write_bytes(changed)
        said.append(outcome(path))
    assert any(words != "read" for words in said) and "read" in said


def test_a_byte_that_is_no_text_is_named(tmp_path):
    path = tmp_path / "broken.usda"
    path.write_bytes(b'#usda 1.0\n\ndef Xform "a\xe9b"\n{\n}\n')
    assert "broken.usda is no stage" in outcome(path)
