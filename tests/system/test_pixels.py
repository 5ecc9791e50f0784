"""Layers of an image as numbers over HTTP: those of the final EXR, bit by bit, of jobs in memory and on the disk."""

import struct

import pytest
from exr_layers import read
from local_farm import SCENE, HttpError

WIDTH, HEIGHT = 96, 64  # of SCENE
AOVS = "depth,normal,shape_id,denoising_albedo"


def numbers(farm, job, layer, rect=(0, 0, WIDTH, HEIGHT), level=0):
    """The numbers of each channel, row by row."""
    channels = len(layer["channels"])
    body = farm.request("GET", f"/api/v1/jobs/{job}/pixels?layer={layer['name']}&level={level}&rect={','.join(map(str, rect))}")
    kind = "e" if layer["format"] == "half" else "f"
    values = struct.unpack(f"<{len(body) // struct.calcsize(kind)}{kind}", body)
    return [list(values[c::channels]) for c in range(channels)]


@pytest.fixture
def done(farm):
    farm.add_worker()
    job = farm.submit(SCENE, spp=16, aov=AOVS)
    farm.wait_for_job(job)
    return job


def expected(farm, job, folder):
    """The layers of the final image, in the names and formats of `pixels`."""
    file = folder / "image.exr"
    file.write_bytes(farm.request("GET", f"/api/v1/jobs/{job}/image.exr"))
    found = {}
    for name, rows in read(file)[0].items():
        found[name] = [v for row in rows for v in row]
    return found


def as_half(values):
    return list(struct.unpack(f"<{len(values)}e", struct.pack(f"<{len(values)}e", *values)))


def test_a_done_jobs_layers_are_those_of_its_exr_also_after_a_restart(farm, done, tmp_path):
    image = expected(farm, done, tmp_path)
    for _ in range(2):
        answer = farm.get(f"/api/v1/jobs/{done}/layers")
        assert answer["size"] == [WIDTH, HEIGHT]
        layers = {layer["name"]: layer for layer in answer["layers"]}
        assert list(layers) == ["rgb", "stderr", "error", "spp", "denoising_albedo", "depth", "normal", "crypto_object"]
        assert numbers(farm, done, layers["rgb"]) == [image[c] for c in "RGB"]
        assert numbers(farm, done, layers["stderr"]) == [as_half(image[f"stderr.{c}"]) for c in "RGB"]
        assert numbers(farm, done, layers["spp"]) == [[16.0] * WIDTH * HEIGHT]
        assert numbers(farm, done, layers["depth"]) == [as_half(image["depth.Z"])]
        assert numbers(farm, done, layers["normal"]) == [as_half(image[f"normal.{c}"]) for c in "XYZ"]
        assert numbers(farm, done, layers["crypto_object"])[:2] == [image["crypto_object00.R"], image["crypto_object00.G"]]
        assert len(layers["crypto_object"]["names"]) == 1
        farm.restart_coordinator()


def test_levels_of_a_job_that_renders_fill_in_tile_by_tile(farm):
    job = farm.submit(SCENE, spp=16)
    rgb = {"name": "rgb", "channels": ["R", "G", "B"], "format": "half"}
    assert all(v != v for v in numbers(farm, job, rgb, (0, 0, 24, 16), 2)[0]), "NaN before the first tile"
    farm.add_worker("--fake-delay", 50)
    farm.wait_for_progress(job, 1)
    some = numbers(farm, job, rgb, (0, 0, 24, 16), 2)[0]
    assert any(v == v for v in some)
    farm.wait_for_job(job)
    assert all(v == v for v in numbers(farm, job, rgb, (0, 0, 24, 16), 2)[0])


def test_an_image_of_which_nothing_came_has_no_numbers(farm):
    job = farm.submit(SCENE, spp=16)
    farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "cancelled"}')
    farm.wait_for_job(job, ("cancelled",))
    red, _, _ = numbers(farm, job, {"name": "rgb", "channels": ["R", "G", "B"], "format": "half"}, (90, 60, 96, 64))
    assert len(red) == 24 and all(v != v for v in red)


@pytest.mark.parametrize("query", ["layer=rgb&rect=0,0,97,64", "rect=0,0,1,1&layer=depth", "rect=0,0,1,1&level=11", ""])
def test_what_cannot_be_had_is_refused_with_a_sentence(farm, query):
    job = farm.submit(SCENE, spp=16)
    with pytest.raises(HttpError) as refused:
        farm.request("GET", f"/api/v1/jobs/{job}/pixels?{query}")
    assert refused.value.status == 400 and "'" in refused.value.body
