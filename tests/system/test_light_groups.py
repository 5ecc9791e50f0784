"""Light groups end to end: layers that add up and are mixed, with the error of the mix, and jobs that render a mix."""

import json
import os
from urllib.parse import quote

import numpy as np
import pytest
from cli_kit import digest, lightshaft, write_fog
from exr_layers import read
from local_farm import HttpError

SPP = 12  # rounds of 2, 2, 4 and a cut one of 4
MIX = "key=2,fill=0.5:0.25:4"
FACTORS = {"key": (2, 2, 2), "fill": (0.5, 0.25, 4), "other": (1, 1, 1)}
LAYERS = "light_groups,volume_light_groups"


def lamp(group, place, colour):
    return (f'<emitter type="point"><point name="position" x="{place[0]}" y="{place[1]}" z="{place[2]}"/>'
            f'<string name="light_group" value="{group}"/><rgb name="intensity" value="{colour}"/></emitter>')


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """The fog under its sky, which has no group, and two lamps."""
    path = write_fog(tmp_path_factory.mktemp("lamps"))
    path.write_text(path.read_text().replace(
        "</scene>", lamp("key", (2, 2, 1), "3 2 1") + lamp("fill", (-2, 1, 2), "2 5 10") + "</scene>"))
    return path


def render(scene, out, *flags, **options):
    return lightshaft("render", scene, "-o", out, "--spp", SPP, "--float", *flags, **options)


def layers(path):
    return {name: np.array(rows) for name, rows in read(path)[0].items()}


@pytest.fixture(scope="module")
def image(scene, tmp_path_factory):
    """(digest without groups, the image with them)."""
    folder = tmp_path_factory.mktemp("image")
    plain = digest(render(scene, folder / "plain.exr", "--threads", 1))
    assert digest(render(scene, folder / "groups.exr", "--aov", LAYERS, "--threads", 1)) == plain
    return plain, folder / "groups.exr"


def mixed(channels, factors=FACTORS, part=""):
    """(the mix of the groups' layers, its half difference) by channel."""
    def summed(of):
        return {c: sum(channels[f"RGB_{group}{of}.{c}"] * f["RGB".index(c)] for group, f in factors.items()) for c in "RGB"}
    return summed(part), summed(part + ".delta")


# Sums of three float32 values, each with a relative error of 2^-24, of one sign; the half differences have the
# errors of the means that they are differences of.
def close(values):
    return 8 * 2 ** -24 * np.abs(values).max()


def test_the_groups_add_up_to_the_colour_with_its_error(image):
    channels = layers(image[1])
    whole, difference = mixed(channels, {group: (1, 1, 1) for group in FACTORS})
    in_fog, _ = mixed(channels, {group: (1, 1, 1) for group in FACTORS}, ".volume")

    assert json.loads(read(image[1])[1]["lightshaft:job"])["light_groups"] == ["fill", "key", "other"]
    for c in "RGB":
        assert np.abs(whole[c] - channels[c]).max() <= close(channels[c])
        assert np.abs(np.abs(difference[c]) - channels[f"stderr.{c}"]).max() <= close(channels[c])
        assert np.all(in_fog[c] <= whole[c] + close(channels[c])) and in_fog[c].max() > 0
        assert min(channels[f"RGB_{group}.{c}"].mean() for group in FACTORS) > .01 * channels[c].mean()


def test_merged_partials_have_the_layers(scene, image, tmp_path):
    render(scene, tmp_path / "out.exr", "--aov", LAYERS, "--partial-dir", tmp_path / "parts", "--threads", 2, "--isolate")
    lightshaft("merge", tmp_path / "parts", "-o", tmp_path / "merged.exr", "--float", "--scene", scene)
    lightshaft("merge", tmp_path / "parts", "-o", tmp_path / "numbers.exr", "--float")

    assert read(tmp_path / "out.exr")[0] == read(image[1])[0] == read(tmp_path / "merged.exr")[0]
    numbers = read(tmp_path / "numbers.exr")[0]
    assert numbers["RGB_1.volume.delta.G"] == read(image[1])[0]["RGB_key.volume.delta.G"]


def test_verify_renders_the_groups_again(scene, image):
    assert "as sealed" in lightshaft("verify", image[1], "--scene", scene, "--tiles", 2, "--seed", 1).stdout


def test_a_scene_whose_lamps_are_multiplied_is_rendered_and_verified(scene, image, tmp_path):
    groups = lightshaft("render", scene, "-o", tmp_path / "mix.exr", "--spp", SPP, "--float", "--mix", "key=2,fill=2,other=2")
    plain = layers(image[1])
    # Factors of 2 change no bit but the exponent: all lamps twice as bright are the image twice as bright.
    assert np.array_equal(layers(tmp_path / "mix.exr")["G"], 2 * plain["G"]), groups.stderr
    verify = ("verify", tmp_path / "mix.exr", "--scene", scene, "--tiles", 1, "--seed", 1)
    assert "as sealed" in lightshaft(*verify, "--mix", "key=2,fill=2,other=2").stdout
    assert "with the same -D, --techniques, --mix and --frame" in lightshaft(*verify, code=2).stderr
    for wrong, words in (("rim=2", 'no light group "rim"; it has fill, key, other'), ("key", "GROUP=FACTOR"),
                         ("key.volume=2", "only a finished image can be mixed so"), ("key=-1", "from 0 to 1000000")):
        assert words in render(scene, tmp_path / "no.exr", "--mix", wrong, code=2).stderr


def environment(farm):
    return {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}


def submit(farm, scene, *flags):
    return lightshaft("submit", scene, "--spp", SPP, "--float", *flags, env=environment(farm)).stdout.split()[0]


def test_a_farm_that_is_killed_gives_the_same_groups_and_mixes_them(farm, scene, image, tmp_path):
    farm.add_workers(2, fake=False)
    job = submit(farm, scene, "--aov", LAYERS)
    farm.wait_for_progress(job, 3)
    farm.workers[0].kill()
    farm.restart_coordinator()
    farm.add_worker(fake=False)
    assert farm.pixels(job) == image[0]

    def fetch(out, *flags, code=0):
        return lightshaft("fetch", job, "-o", tmp_path / out, *flags, env=environment(farm), code=code)

    fetch("groups.exr")
    assert read(tmp_path / "groups.exr")[0] == read(image[1])[0]
    told = fetch("mix.exr", "--mix", MIX).stderr
    mix, strings, _ = read(tmp_path / "mix.exr")
    mix = {name: np.array(rows) for name, rows in mix.items()}
    colour, difference = mixed(layers(image[1]))
    for c in "RGB":
        assert np.abs(mix[c] - colour[c]).max() <= 4 * close(colour[c])  # factors up to 4
        assert np.abs(mix[f"stderr.{c}"] - np.abs(difference[c])).max() <= 4 * close(colour[c])
    assert not any(name.startswith("RGB_") for name in mix)
    answer = farm.get(f"/api/v1/jobs/{job}/mix?mix={quote(MIX)}")
    assert "relMSE of the mix" in told and answer["relmse"] == pytest.approx(float(strings["lightshaft:relmse"]), rel=1e-8)
    low, high = answer["relmse_ci95"]
    assert low < answer["relmse"] < high and answer["groups"] == ["fill", "key", "other"]
    assert json.loads(strings["lightshaft:mix"]) == answer["mix"] == {"key": 2, "fill": [.5, .25, 4]}
    said = lightshaft("verify", tmp_path / "mix.exr", "--scene", scene, code=2).stderr
    assert "it is a mix of light groups; only the image that it was mixed from can be verified" in said

    (tmp_path / "mix.json").write_text(strings["lightshaft:mix"])
    fetch("again.exr", "--mix", tmp_path / "mix.json")
    assert (tmp_path / "again.exr").read_bytes() == (tmp_path / "mix.exr").read_bytes()
    fetch("mix.png", "--mix", MIX)
    fetch("plain.png")
    assert (tmp_path / "mix.png").read_bytes() != (tmp_path / "plain.png").read_bytes()
    fetch("shaft.exr", "--mix", "other.volume=4")
    group, fog = mixed(layers(image[1]), {"other": (1, 1, 1)}), mixed(layers(image[1]), {"other": (3, 3, 3)}, ".volume")
    rest = mixed(layers(image[1]), {"key": (1, 1, 1), "fill": (1, 1, 1)})
    expected = group[0]["G"] + fog[0]["G"] + rest[0]["G"]
    assert np.abs(layers(tmp_path / "shaft.exr")["G"] - expected).max() <= 4 * close(expected)
    assert 'the image has no light group "rim"; it has fill, key, other' in fetch("no.exr", "--mix", "rim=2", code=2).stderr
    with pytest.raises(HttpError, match="400"):
        farm.request("GET", f"/api/v1/jobs/{job}/image.exr?mix={quote(json.dumps({'key': 'bright'}))}")


def test_a_mix_is_rendered_as_a_job(farm, scene, tmp_path):
    farm.add_worker(fake=False)
    job = submit(farm, scene, "--aov", "light_groups")
    farm.wait_for_job(job)

    again = lightshaft("again", job, "--mix", "key=2,fill=2,other=2", env=environment(farm)).stdout.split()[0]
    farm.wait_for_job(again)

    one, two = (tmp_path / f"{name}.exr" for name in ("one", "two"))
    for name, path in ((job, one), (again, two)):
        lightshaft("fetch", name, "-o", path, env=environment(farm))
    assert np.array_equal(layers(two)["R"], 2 * layers(one)["R"])
    assert np.array_equal(layers(two)["RGB_key.R"], 2 * layers(one)["RGB_key.R"])


def test_as_many_groups_as_there_may_be_are_rendered_by_a_farm_and_here(farm, scene, tmp_path):
    many = scene.with_name("many.xml")
    lamps = "".join(lamp(f"g{i:02}", (i / 8 - 2, 2, 2), "1 1 1") for i in range(31))
    many.write_text(scene.read_text().replace("</scene>", lamps + "</scene>").replace('value="key"', 'value="g00"').replace('value="fill"', 'value="g01"'))
    here = digest(render(many, tmp_path / "here.exr", "--aov", LAYERS))
    farm.add_worker(fake=False)

    job = submit(farm, many, "--aov", LAYERS)

    assert farm.pixels(job) == here
    (tmp_path / "farm.exr").write_bytes(farm.request("GET", f"/api/v1/jobs/{job}/image.exr"))
    assert read(tmp_path / "farm.exr")[0] == read(tmp_path / "here.exr")[0]
    assert len([name for name in layers(tmp_path / "here.exr") if name.endswith(".volume.delta.G")]) == 32


def test_a_job_without_groups_cannot_be_mixed(farm, scene, tmp_path):
    farm.add_worker(fake=False)
    job = submit(farm, scene)
    farm.wait_for_job(job)

    said = lightshaft("fetch", job, "-o", tmp_path / "no.exr", "--mix", "key=2", env=environment(farm), code=1).stderr

    assert "the image has no light groups: render it with --aov light_groups to mix them" in said
    assert not (tmp_path / "no.exr").exists()
