"""The demo scene `scenes/bath`: its generator, its own OpenVDB writer, and that the command takes what they make."""

import json
import struct
import subprocess
import sys

import exr_layers
import pytest
from cli_kit import lightshaft, load
from local_farm import ROOT

numpy = pytest.importorskip("numpy")

KIT = ROOT / "scenes" / "bath"


def make(folder, *more):
    subprocess.run([sys.executable, "-B", KIT / "make_bath.py", folder, "--setting", "sketch", *more], check=True)
    return folder / "bath.xml"


@pytest.fixture(scope="module")
def bath(tmp_path_factory):
    return make(tmp_path_factory.mktemp("bath"))


@pytest.fixture(scope="module")
def vdb_writer():
    sys.path.insert(0, str(KIT))
    try:
        import vdb
    finally:
        sys.path.remove(str(KIT))
    return vdb


def test_the_same_setting_gives_the_same_bytes(bath, tmp_path):
    again = make(tmp_path / "new folder").parent

    names = sorted(p.name for p in bath.parent.iterdir())
    assert names == sorted(p.name for p in again.iterdir()) and "steam.vdb" in names
    assert [n for n in names if (bath.parent / n).read_bytes() != (again / n).read_bytes()] == []


def test_it_is_read_without_a_warning(bath):
    inspected = lightshaft("inspect", bath, "--strict", "--json")

    assert inspected.stderr == ""
    assert json.loads(inspected.stdout)["scene_sha256"]


def test_it_renders_without_a_sample_lost(bath, tmp_path):
    lightshaft("render", bath, "-o", tmp_path / "bath.exr", "--spp", 16, "--size", "24x18", "--strict", "--threads", 2, "--report", tmp_path / "r.json")

    assert load(tmp_path / "r.json")["nonfinite_samples"] == 0
    assert load(tmp_path / "r.json")["health"]["clean"], "no triangle without area either"
    channels, _, _ = exr_layers.read(tmp_path / "bath.exr")
    image = numpy.array([channels[c] for c in "RGB"]).sum(axis=0)
    assert image.shape == (18, 24) and numpy.isfinite(image).all()
    # Where the sun's beam crosses the steam is 16 times as much light as in the corner below the window. With relMSE .2, as of
    # 16 samples, the error of this ratio of means over 16 and 30 pixels is sqrt(.2 / 16 + .2 / 30) = 14 %, of 16: 2.2.
    assert image[7:11, 5:9].mean() > 4 * image[13:18, 18:24].mean() > 0
    # Somewhere near the middle of the image; light comes from all sides, so that not all of 16 samples end in the dark.
    seen = [lightshaft("render", bath, "--size", "24x18", "--pixel", "12,9", "--sample", k).stdout for k in range(16)]
    assert any(float(v) > 0 for text in seen for v in text.split(":")[1].split()), seen


def test_the_written_vdb_is_what_openvdb_reads(vdb_writer, tmp_path):
    openvdb = pytest.importorskip("pyopenvdb", reason="python3-openvdb is not installed")
    random = numpy.random.default_rng(5)
    values = random.random((21, 150, 9), dtype=numpy.float32)  # two lower nodes along y
    values[:, 40:80] *= random.random((21, 40, 9)) > .5  # leaves that are partly active
    values[8:16, 8:24] = 0  # and none at all
    vdb_writer.write_vdb(tmp_path / "v.vdb", values, "density", (1, -2, 3), 0.25)

    grid = openvdb.read(str(tmp_path / "v.vdb"), "density")

    back = numpy.zeros_like(values)
    grid.copyToArray(back)
    assert (back == values.astype(numpy.float16)).all()
    assert grid.activeVoxelCount() == numpy.count_nonzero(values.astype(numpy.float16))
    assert grid.gridClass == openvdb.GridClass.FOG_VOLUME
    assert grid.transform.indexToWorld((0, 0, 0)) == (1, -2, 3)
    assert grid.transform.indexToWorld((4, 2, 1)) == (2, -1.5, 3.25)


def test_its_steam_is_the_same_in_mitsubas_format(bath, tmp_path):
    openvdb = pytest.importorskip("pyopenvdb", reason="python3-openvdb is not installed")
    scene = make(tmp_path / "vol", "--grid", "vol")
    assert lightshaft("inspect", scene, "--strict").stderr == ""
    data = (scene.parent / "steam.vol").read_bytes()
    counts, box = struct.unpack_from("<3i", data, 8), numpy.array(struct.unpack_from("<6f", data, 24))
    values = numpy.frombuffer(data, "<f4", offset=48).reshape(counts[::-1]).transpose(2, 1, 0)

    grid = openvdb.read(str(bath.parent / "steam.vdb"), "density")

    back = numpy.zeros(values.shape, numpy.float32)  # not like values, whose axes are turned
    grid.copyToArray(back)
    assert (back == values.astype(numpy.float16)).all() and back.any()
    voxel = (box[3:] - box[:3]) / counts
    assert grid.transform.indexToWorld((0, 0, 0)) == pytest.approx(box[:3] + voxel / 2, abs=1e-6), "values are at the centres of cells"


def test_the_vdb_writer_says_what_is_too_large(vdb_writer, tmp_path):
    with pytest.raises(ValueError, match="4096 along an axis"):
        vdb_writer.write_vdb(tmp_path / "v.vdb", numpy.zeros((4097, 1, 1), numpy.float32), "density", (0, 0, 0), 1)
    assert not (tmp_path / "v.vdb").exists()
