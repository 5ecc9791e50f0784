"""Arrays in dictionaries become the files that they stand for, with the pixels of those files."""

import io
import struct
import zipfile

import numpy as np
import OpenEXR
import pytest
from cli_kit import FOG, digest, fog_values, lightshaft as command, vol_bytes, write_fog

import lightshaft
from lightshaft import SceneDictError, scene_of_dict

VIEW = {
    "type": "scene",
    "integrator": {"type": "path"},
    "sensor": {
        "type": "perspective",
        "fov": 45,
        "to_world": [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 4], [0, 0, 0, 1]],
        "film": {"type": "hdrfilm", "width": 24, "height": 24},
    },
    "sky": {"type": "constant"},
}
COLOURS = np.linspace(0, 0.9, 5 * 4 * 3, dtype=np.float32).reshape(5, 4, 3)
BYTES = (np.arange(5 * 4 * 3) * 4).astype(np.uint8).reshape(5, 4, 3)
CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


def picture(value, **more):
    """A rectangle with an image on it."""
    return {**VIEW, "wall": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": value}}, **more}


def pixels(job):
    return job.wait().report()["pixels_sha256"]


def only_file(scene):
    ((name, data),) = scene_of_dict(scene).files.items()
    return name, data


def test_an_image_of_floats_is_linear_and_of_bytes_srgb(farm, tmp_path):
    OpenEXR.File({}, {"RGB": COLOURS}).write(str(tmp_path / "a.exr"))
    named = {"type": "bitmap", "filename": "a.exr"}
    plain = pixels(farm.submit(picture(named), spp=2, folder=tmp_path))

    assert pixels(farm.submit(picture({"type": "bitmap", "data": COLOURS}), spp=2)) == plain
    assert pixels(farm.submit(picture({"type": "bitmap", "bitmap": COLOURS.astype(np.float64)}), spp=2)) == plain

    # What a byte means as sRGB, by its definition (IEC 61966-2-1), to the bits of the same image in floats.
    code = BYTES / 255
    decoded = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    for raw, values in ((False, decoded), (True, code)):
        of_bytes = farm.submit(picture({"type": "bitmap", "data": BYTES, "raw": raw}), spp=2).wait().image()
        of_floats = farm.submit(picture({"type": "bitmap", "data": values}), spp=2).wait().image()
        # The image that is shown is of halves: two roundings to 11 bits.
        assert np.allclose(of_bytes, of_floats, rtol=2**-10, atol=0) and of_bytes.max() > 0.1


def test_grey_words_and_four_channels_are_taken(farm):
    grey = farm.submit(picture({"type": "bitmap", "data": COLOURS[..., 0], "raw": True}), spp=2)
    thrice = farm.submit(picture({"type": "bitmap", "data": np.repeat(COLOURS[..., :1], 3, 2), "raw": True}), spp=2)
    assert pixels(grey) == pixels(thrice)
    words = BYTES.astype(np.uint16) * 257  # the same values of 16 bits
    assert pixels(farm.submit(picture({"type": "bitmap", "data": words, "raw": True}), spp=2)) == pixels(
        farm.submit(picture({"type": "bitmap", "data": BYTES, "raw": True}), spp=2)
    )
    alpha = np.zeros((2, 2, 4), np.uint8)
    alpha[..., :3] = 200
    mask = {"type": "mask", "opacity": {"type": "bitmap", "data": alpha}, "bsdf": {"type": "diffuse"}}
    seen = farm.submit({**VIEW, "wall": {"type": "rectangle", "bsdf": mask}}, spp=2).wait().image()
    assert (seen == 1).all()  # the sky through a wall of opacity 0


def test_an_array_is_an_environment(farm, tmp_path):
    sky = np.linspace(0.5, 2, 4 * 8 * 3, dtype=np.float32).reshape(4, 8, 3)
    OpenEXR.File({}, {"RGB": sky}).write(str(tmp_path / "sky.exr"))
    ball = {"type": "sphere", "bsdf": {"type": "diffuse"}}
    jobs = [
        farm.submit({**VIEW, "ball": ball, "sky": {"type": "envmap", **given}}, spp=2, folder=tmp_path)
        for given in ({"filename": "sky.exr"}, {"bitmap": sky})
    ]
    assert pixels(jobs[0]) == pixels(jobs[1])


def test_a_grid_has_the_pixels_of_its_file(farm, tmp_path):
    expected = digest(command("render", write_fog(tmp_path), "-o", tmp_path / "out.exr", "--spp", 4))
    values = np.array(list(fog_values(12)), np.float32).reshape(12, 12, 12)
    name, data = only_file({"type": "scene", "v": {"type": "gridvolume", "data": values}})

    assert data == vol_bytes(fog_values(12), 12, 12, 12) and name.endswith(".vol")
    assert pixels(farm.submit(FOG, spp=4, assets={"fog.vol": data})) == expected
    # Of colours, and as z, y, x, channel.
    _, colours = only_file({"type": "scene", "v": {"type": "gridvolume", "grid": np.ones((2, 3, 4, 3))}})
    assert struct.unpack("<3sB5i", colours[:24]) == (b"VOL", 3, 1, 4, 3, 2, 3)


def test_a_mesh_has_the_pixels_of_its_file(farm, tmp_path):
    colours = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], np.float32) * 0.8
    rows = "".join(f"{x:g} {y:g} {z:g} {r:g} {g:g} {b:g}\n" for (x, y, z), (r, g, b) in zip(CORNERS, colours))
    (tmp_path / "wall.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\n"
        + "".join(f"property float {name}\n" for name in ("x", "y", "z", "r", "g", "b"))
        + f"element face 2\nproperty list uchar int vertex_indices\nend_header\n{rows}3 0 1 2\n3 0 2 3\n"
    )
    bsdf = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}
    arrays = {"vertex_positions": CORNERS, "faces": FACES, "vertex_color": colours}
    flat = {key: value.ravel() for key, value in arrays.items() if key != "vertex_color"}

    jobs = [
        farm.submit({**VIEW, "wall": {"type": "ply", "bsdf": bsdf, **given}}, spp=2, folder=tmp_path)
        for given in ({"filename": "wall.ply"}, arrays, {**flat, "vertex_color": colours})
    ]

    first, *others = map(pixels, jobs)
    assert others == [first, first] and jobs[0].image().std() > 0.1


def test_a_mesh_has_normals_coordinates_and_attributes_of_faces(farm):
    mesh = {
        "type": "ply",
        "vertex_positions": CORNERS,
        "faces": FACES,
        "vertex_normals": np.tile([0.0, 0.0, 1.0], (4, 1)),
        "vertex_texcoords": (CORNERS[:, :2] + 1) / 2,
        "face_heat": [[0.25], [0.75]],
    }
    checks = {"type": "bitmap", "data": COLOURS, "raw": True}
    heat = {"type": "mesh_attribute", "name": "face_heat"}
    seen = [
        farm.submit({**VIEW, "wall": {**mesh, "bsdf": {"type": "diffuse", "reflectance": value}}}, spp=2)
        .wait()
        .image()
        for value in (checks, heat)
    ]
    wall = farm.submit(picture(checks), spp=2).wait().image()
    # A rectangle of the same uv. Its rays may fall on the other side of the diagonal, or of the edge.
    assert np.median(np.abs(seen[0] - wall)) < 1e-3
    middle = seen[1][6:-6, 6:-6]
    assert np.isclose(middle.min(), 0.25, rtol=1e-3) and np.isclose(middle.max(), 0.75, rtol=1e-3)


class Foreign:
    """As a Bitmap or a TensorXf of Mitsuba: NumPy reads it."""

    def __array__(self, dtype=None, copy=None):
        return COLOURS


def test_what_numpy_reads_is_an_array_and_equal_ones_are_one_file():
    scene = picture({"type": "bitmap", "data": Foreign()}, more={"type": "envmap", "data": COLOURS})

    name, data = only_file(scene)

    assert scene_of_dict(scene).xml.count(f'value="{name}"') == 2
    read = OpenEXR.File(io.BytesIO(data)).channels()["RGB"].pixels
    assert np.array_equal(read, COLOURS)


MESH = {"type": "ply", "vertex_positions": CORNERS, "faces": FACES}


@pytest.mark.parametrize(
    "thing, path, words",
    [
        ({"type": "bitmap", "data": COLOURS, "filename": "a.exr"}, "x.data", "give only one of the two"),
        ({"type": "bitmap", "data": COLOURS, "bitmap": COLOURS}, "x.bitmap", "give only one of the two"),
        ({"type": "bitmap", "data": COLOURS[0, 0]}, "x.data", "(3,"),
        ({"type": "bitmap", "data": COLOURS[..., :2]}, "x.data", "(5, 4, 2)"),
        ({"type": "bitmap", "data": COLOURS.astype(int)}, "x.data", "int64"),
        ({"type": "bitmap", "data": COLOURS + np.inf}, "x.data", "infinite"),
        ({"type": "bitmap", "data": COLOURS.astype(float) + 1e300}, "x.data", "too large"),
        ({"type": "bitmap", "data": np.zeros((0, 4, 3))}, "x.data", "shape (0, 4, 3)"),
        ({"type": "bitmap", "data": "a.exr"}, "x.data", "array of numbers"),
        ({"type": "gridvolume", "data": np.ones((2, 2))}, "x.data", "(z, y, x)"),
        ({"type": "ply", "faces": FACES}, "x.vertex_positions", "needs vertex_positions and faces"),
        ({**MESH, "faces": FACES + 2}, "x.faces", "the corner 5"),
        ({**MESH, "faces": FACES - 1}, "x.faces", "the corner -1"),
        ({**MESH, "faces": FACES * 1.0}, "x.faces", "float64"),
        ({**MESH, "vertex_normals": CORNERS[:3]}, "x.vertex_normals", "there are 3"),
        ({**MESH, "face_heat": [[1]]}, "x.face_heat", "2 faces"),
        ({**MESH, "vertex_texcoords": CORNERS}, "x.vertex_texcoords", "(n, 2)"),
        ({"type": "sphere", "data": COLOURS}, "x.data", "images are the 'data' of a 'bitmap'"),
    ],
)
def test_a_wrong_array_is_told_with_its_keys(thing, path, words):
    with pytest.raises(SceneDictError) as error:
        scene_of_dict({"type": "scene", "x": thing})

    assert error.value.path == path and words in error.value.message


def test_an_archive_is_a_scene_with_its_files(farm, tmp_path):
    fog = write_fog(tmp_path)
    with zipfile.ZipFile(tmp_path / "fog.zip", "w") as archive:
        for file in ("fog.xml", "fog.vol"):
            archive.write(tmp_path / file, f"scene/{file}")

    settings = {"spp": 4, "size": (36, 20), "defines": {"density": 3}, "aov": ["depth", "normal"], "denoise": False}
    jobs = [farm.submit(scene, **settings) for scene in (fog, tmp_path / "fog.zip")]

    assert pixels(jobs[0]) == pixels(jobs[1]) and {"depth", "normal"} <= set(jobs[1].layers())
    with pytest.raises(lightshaft.RequestRejected, match="contains all its files: folder has no effect"):
        farm.submit(tmp_path / "fog.zip", folder=tmp_path)
    with pytest.raises(lightshaft.FileRefused, match="none.zip"):
        farm.submit(tmp_path / "none.zip")
