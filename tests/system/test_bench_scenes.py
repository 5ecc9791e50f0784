"""The bench scenes `scenes/bench`: every figure of the benchmarks is of these very scenes and grids."""

import hashlib
import json
import struct
import subprocess
import sys

import pytest
from cli_kit import lightshaft
from local_farm import ROOT

numpy = pytest.importorskip("numpy")

KIT = ROOT / "scenes" / "bench"
SCENES = {  # canonical digests: values changed in any of them make its older figures those of another scene
    "shafts": "9027899b5a0ac417c71f9614b5f67bd29ae354a2642bc79415d055f2a85720e9",
    "fogbox": "fa85ae940c756521585fdf4d45aaaa8bcf9f28f7ef4dffee88799dc06b5d206a",
    "cloud": "3356f228b00b2687258e33c5f60c4544281982cd3cc7fb49cd5cd9741cb0e451",
    "spotfog": "3fa7860534db29d51402a24bb80109dc0b99866cde37d4148d1e26e4eb3ff378",
    "tint": "f56938e7294f476caad38d43215b20bccdb76b83233b8ca0ef8a45bc9ae65931",
    "surface": "03b7d6e6f5250bee91dca8a6844a37776906a6b238552dd2748dea6bc3ec878d",
}
GRIDS = {
    "steam.vol": "74a241d2e68ed7b5a9386c7f97a2e1f3bb4d0dd281b1f99cef49d16435dfe63a",
    "cloud.vol": "f2edde8a7b8ff3ca2533ee2f1df01e71e00ff4855e4ef8ef4092dcf7ae23b058",
    "steam.vdb": "0813d29284c7940ff45a724957f10806a4ed4aeab848dbc623436ccf8762ef60",
    "cloud.vdb": "69b9fb91b654855a32fa84df1c20975b32841fc99a475d2f18b439553f61b497",
}


def make(folder):
    subprocess.run([sys.executable, "-B", KIT / "make_bench.py", folder], check=True)
    return folder


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return make(tmp_path_factory.mktemp("bench"))


def test_every_run_gives_the_same_bytes(bench, tmp_path):
    again = make(tmp_path / "new folder")

    names = sorted(p.name for p in bench.iterdir())
    assert names == sorted([*(f"{name}.xml" for name in SCENES), *GRIDS])
    assert [n for n in names if (bench / n).read_bytes() != (again / n).read_bytes()] == []


def test_the_scenes_are_read_without_a_warning_as_those_that_were_measured(bench):
    for name, digest in SCENES.items():
        inspected = lightshaft("inspect", bench / f"{name}.xml", "--strict", "--json")

        assert (inspected.stderr, json.loads(inspected.stdout)["scene_sha256"]) == ("", digest), name


def test_the_grids_are_those_that_were_measured(bench):
    assert {name: hashlib.sha256((bench / name).read_bytes()).hexdigest() for name in GRIDS} == GRIDS


@pytest.mark.parametrize("grid", ["steam", "cloud"])
def test_both_files_of_a_grid_hold_the_same_floats_in_the_same_place(bench, grid):
    vdb = pytest.importorskip("pyopenvdb").read(str(bench / f"{grid}.vdb"), "density")
    data = (bench / f"{grid}.vol").read_bytes()
    nx, ny, nz, channels, *box = struct.unpack_from("<4i6f", data, 8)
    values = numpy.frombuffer(data, "<f4", offset=48).reshape(nz, ny, nx).transpose(2, 1, 0)
    read = numpy.zeros((nx, ny, nz), numpy.float32)
    vdb.copyToArray(read)

    assert channels == 1 and (read == values).all() and vdb.activeVoxelCount() == numpy.count_nonzero(values)
    for k, n in enumerate((nx, ny, nz)):  # the box's corners are floats, which round by 2^-24 of 3 at most
        ends = [vdb.transform.indexToWorld((-.5,) * 3)[k], vdb.transform.indexToWorld((n - .5,) * 3)[k]]
        assert ends == pytest.approx([box[k], box[3 + k]], abs=3 * 2 ** -24)
