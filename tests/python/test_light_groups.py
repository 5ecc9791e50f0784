"""Mixes of light groups: of the farm, and of arrays."""

import numpy as np
import pytest
from local_farm import SCENE

import lightshaft

FOG = """<shape type="cube"><transform name="to_world"><scale value="2"/></transform><bsdf type="null"/>
  <medium name="interior" type="homogeneous"><float name="sigma_t" value="0.3"/><float name="albedo" value="0.9"/></medium></shape>
  <emitter type="point"><point name="position" x="2" y="2" z="3"/><rgb name="intensity" value="30, 20, 10"/>
  <string name="light_group" value="lamp"/></emitter>"""
ROOM = SCENE.replace("</scene>", FOG + "</scene>")
HALF = 2.0**-11  # the relative error of rounding to a half
TINY = 2.0**-25  # the absolute one below the least normal half


@pytest.fixture(scope="module")
def job(local_farm):
    with lightshaft.Farm(local_farm.url(), local_farm.token) as client:
        yield client.submit(ROOM, spp=8, size=(24, 16), aov=["volume_light_groups"]).wait()


@pytest.mark.parametrize(
    "factors",
    [{}, {"lamp": 3}, {"other": [0.5, 0.25, 0], "lamp": 0}, {"lamp": {"volume": 4}, "other": {"surface": 0.5}}],
)
def test_a_mix_of_arrays_is_the_farms(job, factors):
    layers = job.layers()

    colour, error = lightshaft.mix(layers, factors)

    theirs = job.image(mix=factors)
    their_error = job.image("stderr", mix=factors)
    # Here each layer is a half, and in the farm their sum is rounded to one: HALF of the sizes of all terms, and of the sum.
    for ours, other, half in ((colour, theirs, ""), (error, their_error, ".delta")):
        sizes = np.zeros(ours.shape)
        for group in ("lamp", "other"):
            parts = factors.get(group, 1)
            surface, volume = (
                (parts.get("surface", 1), parts.get("volume", 1)) if isinstance(parts, dict) else (parts, parts)
            )
            surface, volume = np.asarray(surface, float), np.asarray(volume, float)
            for layer, factor in (("", surface), (".volume", volume - surface)):
                sizes += np.abs(factor) * (HALF * np.abs(layers[f"RGB_{group}{layer}{half}"]) + TINY)
        assert np.all(np.abs(ours - other) <= sizes * (1 + HALF) + HALF * np.abs(other) + TINY)
    assert theirs.max() > 0.1 or factors


def test_the_error_of_a_mix(job):
    plain, mixed = job.mix({}), job.mix({"lamp": 3})

    low, high = job.report()["relmse_ci95"]
    assert low < plain["relmse"] < high
    assert mixed["relmse_ci95"][0] < mixed["relmse"] < mixed["relmse_ci95"][1]
    assert mixed["mix"] == {"lamp": 3} and mixed["groups"] == ["lamp", "other"]
    assert isinstance(mixed["trusted"], bool)


def test_files_and_pngs_of_a_mix(job, tmp_path):
    job.save(tmp_path / "plain.exr")
    job.save(tmp_path / "mixed.exr", mix={"lamp": 3})

    assert (tmp_path / "plain.exr").read_bytes() != (tmp_path / "mixed.exr").read_bytes()
    assert job.png(mix={"lamp": 3}) != job.png() and job.png(mix={}) == job.png()


def test_a_mix_that_the_image_does_not_have_is_refused(job):
    layers = job.layers()
    no_volume = {name: values for name, values in layers.items() if ".volume" not in name}
    for mixed in (lambda: job.mix({"moon": 1}), lambda: job.image(mix={"lamp": -1})):
        with pytest.raises(lightshaft.RequestRejected):
            mixed()
    for of, factors, error, words in (
        (layers, {"moon": 1}, lightshaft.NotFound, "no light group 'moon'; it has lamp, other"),
        ({"color": layers["color"]}, {}, lightshaft.NotFound, "light_groups"),
        (no_volume, {"lamp": {"volume": 2}}, lightshaft.NotFound, "volume_light_groups"),
        (layers, {"lamp": {"fog": 2}}, lightshaft.RequestRejected, "'fog'"),
        (layers, {"lamp": -1}, lightshaft.RequestRejected, "not negative"),
        (layers, {"lamp": "two"}, lightshaft.RequestRejected, "'two'"),
        (layers, {"lamp": [1, 2]}, lightshaft.RequestRejected, "or three of them"),
    ):
        with pytest.raises(error, match=words):
            lightshaft.mix(of, factors)
