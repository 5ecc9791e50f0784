"""Dictionaries in the style of mi.load_dict become XML, or are refused with the keys of what is wrong."""

import pathlib

import numpy as np
import pytest

from lightshaft import SceneDictError, scene_of_dict


def lines(**objects):
    """The lines between <scene> and </scene>, without their indentation."""
    xml = scene_of_dict({"type": "scene", **objects}).xml
    return [line.strip() for line in xml.splitlines()][1:-1]


def test_objects_get_the_element_of_their_plugin_and_keys_name_them():
    assert lines(ball={"type": "sphere", "bsdf": {"type": "diffuse", "id": "white"}}) == [
        '<shape type="sphere" id="ball">',
        '<bsdf type="diffuse" name="bsdf" id="white"/>',
        "</shape>",
    ]


@pytest.mark.parametrize(
    "value, line",
    [
        (True, '<boolean name="x" value="true"/>'),
        (np.bool_(False), '<boolean name="x" value="false"/>'),
        (3, '<integer name="x" value="3"/>'),
        (np.int64(-4), '<integer name="x" value="-4"/>'),
        (0.1, '<float name="x" value="0.1"/>'),
        (np.float32(0.1), '<float name="x" value="0.10000000149011612"/>'),
        ('a<b & "c"', """<string name="x" value='a&lt;b &amp; "c"'/>"""),
        (pathlib.PurePosixPath("a/b.ply"), '<string name="x" value="a/b.ply"/>'),
        ("costs $5", '<string name="x" value="costs \\$5"/>'),
        ([1, 2.5, -3], '<point name="x" value="1.0 2.5 -3.0"/>'),
        (np.array([1, 2, 3]), '<point name="x" value="1.0 2.0 3.0"/>'),
        ({"type": "rgb", "value": [0.1, 0.2, 0.3]}, '<rgb name="x" value="0.1 0.2 0.3"/>'),
        ({"type": "rgb", "value": 0.5}, '<rgb name="x" value="0.5"/>'),
        (
            {"type": "spectrum", "value": [(400, 0.1), (700, 0.9)]},
            '<spectrum name="x" value="400.0:0.1, 700.0:0.9"/>',
        ),
        ({"type": "ref", "id": "white"}, '<ref name="x" id="white"/>'),
    ],
)
def test_values_of_each_kind(value, line):
    assert lines(ball={"type": "sphere", "x": value})[1:-1] == [line]


class LikeMitsuba:
    """As ScalarTransform4f: the numbers are in .matrix."""

    def __init__(self, matrix):
        self.matrix = matrix


MATRIX = [[1, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]


@pytest.mark.parametrize(
    "transform",
    [
        MATRIX,
        np.array(MATRIX, np.float32),
        LikeMitsuba(np.array(MATRIX)),
        LikeMitsuba(np.array(MATRIX)[..., None]),
    ],
    ids=["lists", "numpy", "object", "one entry of many"],
)
def test_transforms_are_matrices_row_by_row(transform):
    numbers = " ".join(f"{float(x)!r}" for row in MATRIX for x in row)
    assert lines(ball={"type": "sphere", "to_world": transform})[1] == (
        f'<transform name="to_world"><matrix value="{numbers}"/></transform>'
    )


def test_a_key_decides_between_plugins_of_one_name():
    assert lines(x={"type": "hair"})[0].startswith("<shape ")
    assert lines(x={"type": "sphere", "bsdf": {"type": "hair"}})[1].startswith("<bsdf ")


RING = {"type": "sphere"}
RING["again"] = RING


@pytest.mark.parametrize(
    "objects, path, words",
    [
        ({"ball": {"type": "sfere"}}, "ball", "did you mean 'sphere'?"),
        ({"ball": {"type": "sphere", "bsdf": {"reflectance": 1}}}, "ball.bsdf", "needs a 'type'"),
        ({"ball": {"type": "sphere", "radius": float("nan")}}, "ball.radius", "nan"),
        ({"ball": {"type": "sphere", "center": [1, 2]}}, "ball.center", "shape (2,)"),
        ({"ball": {"type": "sphere", "center": object()}}, "ball.center", "object is not possible here"),
        (
            {
                "ball": {
                    "type": "sphere",
                    "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [1, 2]}},
                }
            },
            "ball.bsdf.reflectance",
            "1 or 3 numbers",
        ),
        ({"ball": {"type": "sphere", "x": {"type": "ref"}}}, "ball.x", "a reference is"),
        ({"ball": {"type": "sphere", "name": "a\x00b"}}, "ball.name", "are not allowed in scenes"),
        ({"ball": {"type": "sphere", 3: 4}}, "ball", "keys must be strings"),
        ({"ball": RING}, None, "more than 64 deep"),
    ],
)
def test_what_is_wrong_is_told_with_its_keys(objects, path, words):
    with pytest.raises(SceneDictError) as error:
        scene_of_dict({"type": "scene", **objects})

    assert words in error.value.message and words in str(error.value)
    assert path is None or error.value.path == path


def test_the_outermost_must_be_a_scene():
    with pytest.raises(SceneDictError, match="'type': 'scene'"):
        scene_of_dict({"type": "sphere"})


def test_the_flag_of_flat_faces_is_no_attribute_of_a_mesh():
    mesh = {"type": "ply", "filename": "a.ply", "face_normals": True}
    text = scene_of_dict({"type": "scene", "mesh": mesh})
    assert '<boolean name="face_normals" value="true"/>' in text.xml and not text.files


def test_a_product_is_a_volume_within_media_and_a_texture_elsewhere():
    noise = {"type": "noise", "scale": 2.0}
    inner = {"type": "product", "first": noise, "second": 2.0}
    text = "".join(
        lines(
            air={"type": "heterogeneous", "sigma_t": {"type": "product", "first": noise, "second": inner}},
            wall={"type": "diffuse", "reflectance": {"type": "product", "first": 0.5, "second": 0.5}},
        )
    )
    assert text.count('<volume type="product"') == 2
    assert text.count('<texture type="product"') == 1


def test_transforms_by_times_are_an_animation():
    moved = np.eye(4)
    moved[0, 3] = 2
    text = "".join(lines(eye={"type": "perspective", "shutter_close": 1.0, "to_world": {1.0: moved, 0: np.eye(4)}}))
    assert '<animation name="to_world">' in text
    assert text.index('<transform time="0.0"><matrix value="1') < text.index('<transform time="1.0"><matrix value="1')


@pytest.mark.parametrize(
    "keys, words",
    [
        ({0.0: np.eye(4), "1": np.eye(4)}, "'type'"),
        ({(0,): np.eye(4)}, "the keys of an animation are times"),
        ({True: np.eye(4)}, "the keys of an animation are times"),
        ({0.0: 3.0}, "a transform (4 x 4 numbers) at each of its times"),
        ({float("nan"): np.eye(4)}, "nan"),
    ],
)
def test_an_animation_of_anything_else_is_refused(keys, words):
    with pytest.raises(SceneDictError) as error:
        scene_of_dict({"type": "scene", "eye": {"type": "perspective", "to_world": keys}})
    assert words in str(error.value)
