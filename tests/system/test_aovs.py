"""AOVs end to end: the same layers however they are computed, and the same colour with and without them."""

import json
import os
import re
import struct

import numpy as np
import pytest
from cli_kit import FOG, digest, lightshaft, write_fog
from exr_layers import read, write_rgb
from local_farm import SCENE, HttpError

STANDARD_ERRORS = 5  # kStandardErrors of tests/support/significance.h
SPP = 12  # rounds of 2, 2, 4 and a cut one of 4
ALL = ("albedo,alpha,coverage,depth,direct,emission,geo_normal,indirect,material_id,multiple,normal,opacity,position,"
       "shadow_catcher,shape_id,single,surface,uv,volume,volume_opacity")


@pytest.fixture(scope="module")
def fog(tmp_path_factory):
    """The fog, and a named floor below it."""
    scene = write_fog(tmp_path_factory.mktemp("fog"))
    floor = ('<bsdf type="diffuse" id="plaster"/><shape type="rectangle" id="floor"><transform name="to_world">'
             '<rotate x="1" angle="-90"/><scale value="3"/><translate y="-1.2"/></transform><ref id="plaster"/></shape>')
    scene.write_text(FOG.replace("<emitter type=\"constant\">", floor + "<emitter type=\"constant\">"))
    return scene


def render(scene, out, *flags, spp=SPP, **options):
    return lightshaft("render", scene, "-o", out, "--spp", spp, *flags, **options)


@pytest.fixture(scope="module")
def expected(fog, tmp_path_factory):
    """(digest of the colour without AOVs, the image with all of them), from one thread."""
    folder = tmp_path_factory.mktemp("one")
    plain = digest(render(fog, folder / "plain.exr", "--threads", 1))
    assert digest(render(fog, folder / "out.exr", "--aov", ALL, "--threads", 1)) == plain
    return plain, folder / "out.exr"


def layers(path):
    return read(path)[0]


@pytest.mark.parametrize("flags", [("--threads", "3"), ("--isolate", "--threads", "2")], ids=" ".join)
def test_threads_and_isolation_do_not_change_a_layer(fog, expected, tmp_path, flags):
    assert digest(render(fog, tmp_path / "out.exr", "--aov", ALL, *flags)) == expected[0]
    assert layers(tmp_path / "out.exr") == layers(expected[1])


def test_what_every_image_has_may_be_asked_for_and_adds_nothing(fog, expected, tmp_path):
    assert digest(render(fog, tmp_path / "out.exr", "--aov", "spp,stderr", "--threads", 1)) == expected[0]
    rows, strings, _ = read(tmp_path / "out.exr")
    assert sorted(rows) == ["B", "G", "R", "spp", "stderr.B", "stderr.G", "stderr.R"]
    assert json.loads(strings["lightshaft:job"])["aov"] == []


def test_partials_have_the_channels_and_merge_to_the_same_layers(fog, expected, tmp_path):
    kept = tmp_path / "partials"
    render(fog, tmp_path / "out.exr", "--aov", ALL, "--partial-dir", kept)
    assert digest(lightshaft("merge", kept, "-o", tmp_path / "merged.exr")) == expected[0]

    assert layers(tmp_path / "merged.exr") == layers(expected[1])
    # Partials bear no names: those are the scene's.
    def names(image):
        return {key: text for key, text in read(image)[1].items() if key.startswith("cryptomatte/")}
    assert not any(key.endswith("/manifest") for key in names(tmp_path / "merged.exr"))
    lightshaft("merge", kept, "-o", tmp_path / "named.exr", "--scene", fog)
    assert names(tmp_path / "named.exr") == names(expected[1]) and layers(tmp_path / "named.exr") == layers(expected[1])
    said = lightshaft("merge", kept, "-o", tmp_path / "no.exr", "--scene", fog, "-D", "density=3", code=2).stderr
    assert "is another scene: give the same scene file" in said and not (tmp_path / "no.exr").exists()
    # Nobody who does not ask for them pays for them.
    plain = tmp_path / "plain"
    render(fog, tmp_path / "out.exr", "--partial-dir", plain)
    one = next(plain.glob("*.exr")).read_bytes()
    assert b"aov." not in one and b"id." not in one


def test_the_layers_are_typed_named_and_add_up(expected):
    rows, strings, types = read(expected[1])
    width, height = 72, 40

    assert {types[c] for c in ("depth.Z", "position.X", "uv.U", "crypto_object00.R", "crypto_material02.A", "stderr.A")} == {"f"}
    assert {types[c] for c in ("R", "A", "opacity.R", "albedo.R", "normal.Z", "direct.G", "coverage.A")} == {"e"}
    for y in range(height):
        for x in range(width):
            whole = rows["G"][y][x]
            # Three halves of 11 bits each, of numbers not above the sum's.
            close = 4 * 2 ** -11 * whole + 1e-6
            assert abs(rows["direct.G"][y][x] + rows["indirect.G"][y][x] - whole) <= close
            parts = rows["surface.G"][y][x] + rows["volume.G"][y][x] + rows["emission.G"][y][x]
            assert abs(parts - whole) <= close
            # Halves of numbers up to 1
            assert abs(sum(rows[f"opacity.{c}"][y][x] for c in "RGB") / 3 - rows["A"][y][x]) <= 2 ** -11
            assert rows["volume_opacity.G"][y][x] - 2 ** -11 <= rows["opacity.G"][y][x]
            ranks = [rows[f"crypto_object{i // 4:02}.{'RGBA'[i % 4]}"][y][x] for i in range(12)]
            assert abs(sum(ranks[1::2]) - rows["coverage.A"][y][x]) <= 2 ** -11
            assert all(a >= b for a, b in zip(ranks[1::2], ranks[3::2]))
    # The floor's name is the identifier of most pixels at the bottom.
    key = next(k for k in strings if k.startswith("cryptomatte/") and strings[k] == "crypto_object").rsplit("/", 1)[0]
    manifest = json.loads(strings[key + "/manifest"])
    assert strings[key + "/hash"] == "MurmurHash3_32" and strings[key + "/conversion"] == "uint32_to_float32"
    assert set(manifest) == {"cube_0", "rectangle_1", "floor"}
    floor, = struct.unpack(">f", bytes.fromhex(manifest["floor"]))
    assert rows["crypto_object00.R"][height - 1][width // 2] == floor
    assert rows["crypto_object00.G"][height - 1][width // 2] == 1
    assert rows["normal.Y"][height - 1][width // 2] == 1 and rows["albedo.G"][height - 1][width // 2] == .5
    assert rows["coverage.A"][0][0] == rows["depth.Z"][0][0] == 0 and rows["A"][0][0] == 1, "the environment alone"
    assert rows["A"][height - 1][width // 2] == 1 and rows["stderr.A"][height - 1][width // 2] == 0


def test_a_transparent_film_has_alpha_in_every_form(fog, tmp_path):
    scene = fog.parent / "transparent.xml"
    scene.write_text(fog.read_text().replace('<film type="hdrfilm">',
                                             '<film type="hdrfilm"><boolean name="transparent" value="true"/>'))
    report = tmp_path / "report.json"
    render(scene, tmp_path / "film.exr", "--report", report, "--partial-dir", tmp_path / "partials")
    render(scene, tmp_path / "film.png")
    render(fog, tmp_path / "whole.exr", "--aov", "alpha")
    film, whole = layers(tmp_path / "film.exr"), layers(tmp_path / "whole.exr")

    assert json.loads(read(tmp_path / "film.exr")[1]["lightshaft:job"])["aov"] == ["alpha"]
    assert any("transparent film" in used for used in json.loads(report.read_text())["features_used"])
    assert {a for row in whole["A"] for a in row} == {1}, "an environment that the camera sees is opaque"
    assert film["A"][0][0] == 0 and film["R"][0][0] == 0 < whole["R"][0][0]
    # The header of a PNG: 8 bits a channel, colour type 6, which is RGB and alpha.
    assert (tmp_path / "film.png").read_bytes()[24:26] == bytes([8, 6])
    lightshaft("merge", tmp_path / "partials", "-o", tmp_path / "merged.exr")
    assert layers(tmp_path / "merged.exr") == film


def test_shadows_on_shadow_catchers_add_up_over_partials(fog, tmp_path):
    scene = fog.parent / "catcher.xml"
    text = fog.read_text().replace('<film type="hdrfilm">', '<film type="hdrfilm"><boolean name="transparent" value="true"/>')
    scene.write_text(text.replace('<shape type="rectangle" id="floor">',
                                  '<shape type="rectangle" id="floor"><boolean name="shadow_catcher" value="true"/>'))
    assert "shadow_catcher" in scene.read_text()
    render(scene, tmp_path / "film.exr", "--partial-dir", tmp_path / "partials")
    film = {c: np.array(rows) for c, rows in layers(tmp_path / "film.exr").items()}

    assert json.loads(read(tmp_path / "film.exr")[1]["lightshaft:job"])["aov"] == ["alpha", "shadow_catcher"]
    floor = film["shadow_catcher.T"] == 1  # with no fog in front
    assert floor.any() and not film["R"][floor].any() and film["shadow_catcher.U"][floor].min() > 0
    shadow = 1 - film["shadow_catcher.L"][floor] / film["shadow_catcher.U"][floor]
    assert np.allclose(film["A"][floor], shadow, atol=.01 + 2 ** -11) and shadow.max() > 0
    lightshaft("merge", tmp_path / "partials", "-o", tmp_path / "merged.exr")
    assert layers(tmp_path / "merged.exr") == layers(tmp_path / "film.exr")


def test_over_a_plate_it_is_the_image_with_the_plate_behind_it(tmp_path):
    """By the arithmetic of `oiiotool --over`. The plate is a sky that varies too little within a pixel to matter."""
    write_rgb(tmp_path / "sky.exr", {c: [[.1 + .1 * (x + y + i) for x in range(4)] for y in range(3)] for i, c in enumerate("RGB")})
    sky = '<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>'
    scene = write_fog(tmp_path).read_text().replace('<emitter type="constant"><rgb name="radiance" value="0.1"/></emitter>', sky)
    film = scene.replace('<film type="hdrfilm">', '<film type="hdrfilm"><boolean name="transparent" value="true"/>')
    scenes = {"shot": scene, "smoke": film, "plate": re.sub("<shape.*</shape>", "", scene, flags=re.DOTALL)}
    image = {}
    for name, text in scenes.items():
        (tmp_path / f"{name}.xml").write_text(text)
        render(tmp_path / f"{name}.xml", tmp_path / f"{name}.exr", spp=64)
        image[name] = {c: np.array(rows) for c, rows in layers(tmp_path / f"{name}.exr").items()}
    shot, smoke, plate = (image[name] for name in scenes)

    assert .1 < smoke["A"].mean() < .9 and smoke["A"].max() > .9
    for c in "RGB":
        over = smoke[c] + (1 - smoke["A"]) * plate[c]
        # The errors of one pixel may be those of the same samples: they add up. Pixels are independent.
        error = shot[f"stderr.{c}"] + smoke[f"stderr.{c}"] + plate[c] * smoke["stderr.A"] + plate[f"stderr.{c}"]
        rounding = 2 ** -11 * (shot[c] + smoke[c] + 2 * plate[c])  # halves, of A up to 1
        band = STANDARD_ERRORS * np.sqrt((error ** 2).sum()) / error.size + rounding.mean()
        assert band < .02 * shot[c].mean()
        assert abs((over - shot[c]).mean()) < band


def test_mitsubas_wrapper_asks_for_layers(fog, expected, tmp_path):
    scene = fog.parent / "wrapped.xml"
    scene.write_text(fog.read_text().replace('<integrator type="volpath"/>', """<integrator type="aov">
      <string name="aovs" value="depth:depth,nn:sh_normal"/><integrator type="volpath"/></integrator>"""))

    done = render(scene, tmp_path / "out.exr", "--aov", "uv")

    assert digest(done) == expected[0] and '"nn" is "normal"' in done.stderr
    rows = layers(tmp_path / "out.exr")
    assert all(rows[c] == layers(expected[1])[c] for c in ("depth.Z", "normal.X", "uv.U"))
    assert "position.X" not in rows


def test_verify_renders_the_layers_again(fog, expected):
    assert "as sealed" in lightshaft("verify", expected[1], "--scene", fog, "--tiles", 2, "--seed", 1).stdout


def test_an_unknown_name_is_refused_with_the_list(fog, tmp_path):
    said = render(fog, tmp_path / "out.exr", "--aov", "depth,radiosity", code=2).stderr

    assert '"radiosity"' in said and "position" in said and "stderr" in said


def submit(farm, scene, *flags):
    env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
    return lightshaft("submit", scene, "--spp", SPP, *flags, env=env).stdout.split()[0]


def fetched(farm, job, path):
    path.write_bytes(farm.request("GET", f"/api/v1/jobs/{job}/image.exr"))
    return path


def test_a_farm_that_is_killed_gives_the_same_layers(farm, fog, expected, tmp_path):
    farm.add_workers(2, fake=False)
    job = submit(farm, fog, "--aov", ALL)
    farm.wait_for_progress(job, 3)
    farm.workers[0].kill()
    farm.restart_coordinator()
    farm.add_worker(fake=False)

    assert farm.pixels(job) == expected[0]
    image = fetched(farm, job, tmp_path / "farm.exr")
    assert layers(image) == layers(expected[1])
    keys = [k for k in read(image)[1] if k.endswith("/manifest")]
    assert [read(image)[1][k] for k in keys] == [read(expected[1])[1][k] for k in keys] and len(keys) == 2


def test_a_job_is_extended_to_the_layers_of_one_shot(farm, fog, tmp_path):
    farm.add_worker(fake=False)
    job = submit(farm, fog, "--aov", "depth,shape_id,volume")
    farm.wait_for_job(job)
    farm.request("PATCH", f"/api/v1/jobs/{job}", json.dumps({"spp": 2 * SPP}).encode(), "application/json")
    pixels = farm.pixels(job)
    one_shot = digest(render(fog, tmp_path / "one.exr", "--aov", "depth,shape_id,volume", spp=2 * SPP))

    assert pixels == one_shot
    assert layers(fetched(farm, job, tmp_path / "farm.exr")) == layers(tmp_path / "one.exr")


def test_the_spec_over_http_asks_for_layers_and_is_told_what_there_is(farm, tmp_path):
    farm.add_worker(fake=True)
    with pytest.raises(HttpError) as refused:
        farm.submit(SCENE, aov="depth,radiosity")
    assert refused.value.status == 400
    assert "radiosity" in str(refused.value) and "position" in str(refused.value)

    job = farm.submit(SCENE, aov="material_id,depth", spp=4)
    farm.wait_for_job(job)

    channels = set(layers(fetched(farm, job, tmp_path / "fake.exr")))
    assert {"depth.Z", "crypto_material00.R"} <= channels and "crypto_object00.R" not in channels
