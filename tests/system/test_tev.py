"""`--tev` of `fetch` and `watch`: images of a farm in the viewer tev, whose end of the protocol a stub plays."""

import os
import subprocess

import pytest
from cli_kit import lightshaft
from exr_layers import read
from local_farm import SCENE, LocalFarm, bin_dir, wait_until
from stub_tev import StubTev


@pytest.fixture(scope="module")
def farm(tmp_path_factory):
    with LocalFarm(tmp_path_factory.mktemp("farm")) as farm:
        yield farm


def environment(farm):
    return {**os.environ, "LIGHTSHAFT_URL": farm.url(), "LIGHTSHAFT_TOKEN": farm.token}


def pixels(image, channel):
    """The rows of a channel that tev has."""
    width, height = (1 + max(place[axis] for place in image[channel]) for axis in (0, 1))
    return [tuple(image[channel][x, y] for x in range(width)) for y in range(height)]


def test_fetch_shows_all_layers_in_tev(farm, tmp_path):
    farm.add_worker()
    job = farm.submit(SCENE, spp=4, size="530x20", aov="depth")  # of more than one block of pixels
    farm.wait_for_job(job)

    with StubTev() as tev:
        done = lightshaft("fetch", job, f"--tev={tev.address}", env=environment(farm))
        wait_until(lambda: tev.images and len(next(iter(tev.images.values()))["depth.Z"]) == 530 * 20, "the last layer has come")

    assert tev.trouble is None and done.stderr == ""
    (name, size, channels), = tev.created
    assert job in name and size == (530, 20) and {"R", "G", "B", "stderr.R", "depth.Z"} <= set(channels)
    lightshaft("fetch", job, "-o", tmp_path / "image.exr", env=environment(farm))
    rows = read(tmp_path / "image.exr")[0]
    for channel in "RGB":
        assert pixels(tev.images[name], channel) == rows[channel]


def test_watch_shows_the_image_while_it_renders_and_all_of_it_at_the_end(farm):
    farm.add_worker()
    job = farm.submit(SCENE, spp=1_000_000, size="64x64")
    wait_until(lambda: farm.job(job)["spp_done"] > 0, "something is rendered")
    lightshaft("pause", job, env=environment(farm))

    with StubTev() as tev:
        watching = subprocess.Popen([bin_dir() / "lightshaft", "watch", job, "--quiet", f"--tev={tev.address}"], env=environment(farm),
                                    stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        wait_until(lambda: tev.created, "tev has an image of the paused job")
        assert tev.created[0][1:] == ((64, 64), ["R", "G", "B"])
        lightshaft("cancel", job, env=environment(farm))
        _, error = watching.communicate()
        wait_until(lambda: len(tev.created) == 2 and tev.images[tev.created[1][0]]["B"], "the whole image has come")

    assert watching.returncode == 1 and "tev" not in error and tev.trouble is None
    assert tev.created[0][0] == tev.created[1][0] and "stderr.R" in tev.created[1][2]


def test_a_tev_that_is_not_there_is_an_error_that_says_what_to_do(farm):
    job = farm.submit(SCENE, spp=65536, size="64x64")  # not done before it is paused
    lightshaft("pause", job, env=environment(farm))

    with StubTev() as tev:
        gone = lightshaft("watch", job, "--tev=127.0.0.1:1", env=environment(farm), code=1)
        wrong = lightshaft("fetch", job, "--tev=here", env=environment(farm), code=2)
        mixed = lightshaft("fetch", job, f"--tev={tev.address}", "--mix", "a=2", env=environment(farm), code=2)

    assert "tev cannot be reached at 127.0.0.1:1: Connection refused" in gone.stderr and "--tev=HOST:PORT" in gone.stderr
    assert "'here' is no HOST:PORT" in wrong.stderr
    assert "without --mix" in mixed.stderr
