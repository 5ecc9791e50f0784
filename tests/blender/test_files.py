"""What the add-on writes and reads, without Blender."""

import io
import struct
import types
import zlib

import numpy as np
import pytest
from lightshaft import document, exr, lights, meshes, textures, volumes, voxels, world


def test_an_image_is_read_as_it_was_written():
    pixels = np.random.default_rng(1).random((7, 5, 3), np.float32)

    layers = exr.read(exr.write(pixels))

    assert all(np.array_equal(layers[name], pixels[:, :, i]) for i, name in enumerate("RGB"))


@pytest.mark.parametrize("cut", [0, 3, 20, 200, 400, -1])
def test_a_cut_off_image_is_an_error(cut):
    whole = exr.write(np.ones((7, 5, 3)))

    with pytest.raises(ValueError):
        exr.read(whole[:cut])


def test_zipped_lines_are_unpacked():
    values = np.arange(200, dtype=np.uint8)
    apart = np.concatenate([values[0::2], values[1::2]]).astype(np.int64)
    coded = np.diff(apart, prepend=0)
    coded[1:] += 128

    assert exr.unpacked(zlib.compress(coded.astype(np.uint8).tobytes())) == values.tobytes()


def test_a_png_has_its_size_and_sums():
    data = exr.write_png(np.zeros((3, 4, 1), np.uint8))

    assert struct.unpack(">II", data[16:24]) == (4, 3)
    assert struct.unpack(">I", data[29:33])[0] == zlib.crc32(data[12:29])


def test_a_ply_shares_equal_corners():
    square = np.array([[0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 1], [1, 1, 0, 0, 0, 1], [0, 1, 0, 0, 0, 1]], "<f4")

    data = meshes.ply(square, np.array([[0, 1, 2], [0, 2, 3]]))

    header = io.BytesIO(data)
    lines = [header.readline().decode().strip() for _ in range(12)]
    assert "element vertex 4" in lines and "element face 2" in lines


def test_a_body_is_closed_and_a_sheet_is_not():
    body = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])

    assert meshes.is_closed(body)
    assert not meshes.is_closed(body[:3])


def test_equal_content_is_one_file(tmp_path):
    written = document.Document(tmp_path)

    assert written.write(b"mesh", ".ply") == written.write(b"mesh", ".ply")
    assert len(list(tmp_path.iterdir())) == 1


def test_ids_are_not_taken_twice(tmp_path):
    written = document.Document(tmp_path)

    names = [written.define("Cube.001 ä", document.element("bsdf", "null")) for _ in range(2)]

    assert names == ["Cube.001_ä", "Cube.001_ä_2"]


def test_a_spot_is_bright_within_and_dark_beyond():
    profile = lights.spot_profile(0.5, 0.3)

    assert profile[lights.PROFILE // 2, lights.PROFILE // 2] == 1
    assert profile[0, 0] == 0 and np.all(np.diff(profile[lights.PROFILE // 2, lights.PROFILE // 2 :]) <= 0)


def test_the_middle_of_the_worlds_image_is_plus_x():
    assert np.array_equal(world.AXES @ [0, 0, 1, 0], [1, 0, 0, 0])
    assert np.array_equal(world.AXES @ [1, 0, 0, 0], [0, 1, 0, 0])


def test_turning_upside_down_twice_is_nothing():
    assert np.array_equal(textures.UPSIDE_DOWN @ textures.UPSIDE_DOWN, np.eye(4))


def test_phase_functions_at_the_ends_of_blenders_sliders_are_ones_that_the_scene_takes():
    values = {"Anisotropy": 1.0, "Alpha": 1e4, "Backscatter": 0.0, "IOR": 9.0, "Diameter": 0.0}
    made = {kind: make(values) for kind, (_, make) in volumes.PHASES.items()}

    assert made["HENYEY_GREENSTEIN"] == ("hg", {"g": 0.999})
    assert made["DRAINE"] == ("draine", {"g": 0.999, "alpha": 1000.0})
    assert made["FOURNIER_FORAND"] == ("fournier_forand", {"backscatter": 1e-5, "ior": 5.0})
    assert made["MIE"] == ("droplets", {"diameter": 1e-3})


def test_the_nesting_of_blends_is_counted():
    phase = volumes.ISOTROPIC
    for depth in range(1, 10):
        assert volumes.nesting(phase) == depth
        phase = ("blendphase", {"weight": 0.5, "parts": (phase, volumes.ISOTROPIC)})


def test_voxels_are_found_in_their_layers():
    item = types.SimpleNamespace(bound_box=[(x, y, z) for x in (0, 2) for y in (0, 1) for z in (0, 3)])
    grid = voxels.Grid(item, 6)
    assert list(grid.counts) == [4, 2, 6]
    width, height = grid.image_size
    assert (width, height) == (3 * 4, 2 * 2)
    # Each pixel holds its own voxel, as the layers lie in the image: three in a row.
    pixels = np.zeros((height, width, 4), np.float32)
    for z in range(6):
        for y in range(2):
            for x in range(4):
                pixels[z // 3 * 2 + y, z % 3 * 4 + x, :3] = (x, y, z)
    image = types.SimpleNamespace(
        pixels=types.SimpleNamespace(foreach_get=lambda out: out.__setitem__(slice(None), pixels.ravel()))
    )
    values = grid.values(image)
    z, y, x = np.mgrid[0:6, 0:2, 0:4]
    assert np.array_equal(values, np.stack([x, y, z], axis=-1))
