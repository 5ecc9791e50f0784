"""Deep images end to end: they flatten to the picture, whoever renders it, and merge to the picture of both parts."""

import json
import os
import pathlib
import subprocess

import numpy as np
import pytest
from cli_kit import digest, lightshaft, write_fog
from exr_layers import read, read_header
from local_farm import HttpError

SPP = 12  # rounds of 2, 2, 4 and a cut one of 4
SLICES = 6

SHAPES = """<scene version="3.0.0">
  <integrator type="volpath"/>
  <sensor type="{sensor}">
    <float name="fov" value="40"/>{lens}
    <transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="30"/>
      <boolean name="transparent" value="{transparent}"/></film>
  </sensor>
  {shapes}
</scene>
"""
FOG_BOX = """<shape type="cube"><bsdf type="null"/>
    <medium name="interior" type="homogeneous"><rgb name="sigma_t" value="0.6"/><rgb name="albedo" value="{albedo}"/>
      <rgb name="emission" value="0.2 0.3 0.5"/></medium></shape>"""
BALL = """<shape type="sphere"><transform name="to_world"><scale value="0.4"/><translate x="{x}" z="{z}"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="{colour}"/></emitter></shape>"""
SKY = '<emitter type="constant"><rgb name="radiance" value="0.5 1 2"/></emitter>'


def write(folder, name, shapes, sensor="perspective", lens="", transparent="false"):
    path = folder / f"{name}.xml"
    path.write_text(SHAPES.format(sensor=sensor, lens=lens, shapes=shapes, transparent=transparent))
    return path


def fog(albedo="0.5"):
    return FOG_BOX.format(albedo=albedo)


def balls():
    return BALL.format(x="-0.5", z="0.2", colour="3 2 1") + BALL.format(x="0.4", z="-2", colour="1 4 2")


def render(scene, out, *flags, spp=SPP, **options):
    return lightshaft("render", scene, "-o", out, "--spp", spp, *flags, **options)


def deep(path):
    return path.with_suffix(".deep.exr")


def oiiotool(*arguments):
    subprocess.run(["oiiotool", *map(str, arguments)], check=True, capture_output=True, text=True)


def layers(path):
    return {name: np.array(rows, dtype=float) for name, rows in read(path)[0].items()}


def flat(image):
    out = image.with_suffix(".flat.exr")
    oiiotool(image, "--flatten", "-d", "float", "--compression", "zip", "--scanline", "-o", out)
    return layers(out)


def sealed(path):
    """Digests of all samples, by channel."""
    return sealed_in(path.read_bytes())


def sealed_in(data):
    header, _ = read_header(data)
    return sorted(line for line in header["lightshaft:seal"][1].decode().splitlines() if " layer " in line)


# A colour of the deep image is rounded to half once, as the flat one is: by 2^-11 of itself each. What is below the
# normal halves is rounded by 2^-25 in each of up to 65 samples.
def assert_flattens(out):
    picture, flattened = layers(out), flat(deep(out))
    for c in "RGB":
        assert np.all(np.abs(picture[c] - flattened[c]) <= 2.1 * 2 ** -11 * picture[c] + 66 * 2 ** -25), c
    # The alpha of a sample behind which there is light may be rounded by a whole unit of the halves below 1.
    assert np.all(np.abs(np.clip(picture["A"], 0, 1) - flattened["A"]) <= 2 ** -11 + 2 ** -12)
    return picture


@pytest.mark.parametrize("scene", ["grid", "fog before surfaces and a sky", "a lens", "without media", "nothing", "one pixel", "whitted"])
def test_a_deep_image_flattens_to_the_picture(scene, tmp_path):
    flags = ()
    if scene == "grid":
        path = write_fog(tmp_path)
    elif scene == "a lens":
        lens = '<float name="aperture_radius" value="0.2"/><float name="focus_distance" value="5"/>'
        path = write(tmp_path, "lens", fog() + balls() + SKY, "thinlens", lens)
    else:
        path = write(tmp_path, "scene", {"without media": balls() + SKY, "nothing": ""}.get(scene, fog() + balls() + SKY))
        flags = {"one pixel": ("--size", "1x1"), "whitted": ("--integrator", "whitted")}.get(scene, ())
    out = tmp_path / "out.exr"

    plain = digest(render(path, tmp_path / "plain.exr", "--aov", "alpha", *flags))
    assert digest(render(path, out, "--deep", SLICES, "--aov", "alpha", *flags)) == plain

    picture = assert_flattens(out)
    assert picture["R"].max() > 0 or scene == "nothing"
    assert not (tmp_path / "plain.deep.exr").exists()
    if scene != "nothing":
        assert "all layers and headers match" in lightshaft("verify", out, "--scene", path, "--tiles", 2, "--seed", 1).stdout


def test_a_deep_image_of_any_number_of_slices_flattens_to_the_picture(tmp_path):
    path = write(tmp_path, "scene", fog() + balls() + SKY)
    for slices in (1, 2, 64):
        out = tmp_path / f"{slices}.exr"
        render(path, out, "--deep", slices, "--aov", "alpha", "--color-space", "acescg")
        assert_flattens(out)


def test_merged_deep_images_are_the_picture_of_both(tmp_path):
    """Parts that absorb and shine, but scatter nothing, do not light each other."""
    parts = {"fog": fog("0"), "balls": balls(), "both": fog("0") + balls()}
    for name, shapes in parts.items():
        render(write(tmp_path, name, shapes, transparent="true"), tmp_path / f"{name}.exr", "--deep", 16, "--float", spp=64)
    merged = tmp_path / "merged.exr"
    oiiotool(deep(tmp_path / "balls.exr"), deep(tmp_path / "fog.exr"), "--deepmerge", "-o", merged)

    together, picture = flat(merged), layers(tmp_path / "both.exr")

    # Alpha has no noise in homogeneous fog, and splitting its samples is exact but for float32; only the rims of the fog and
    # of the balls, where a pixel's transmittance is a mean, differ by their product.
    assert np.quantile(np.abs(together["A"] - picture["A"]), .9) <= 1e-5
    # The colour behind fog has noise in the picture of both, and none in its parts. Five standard errors of the mean.
    for c in "RGB":
        error = np.sqrt((picture[f"stderr.{c}"] ** 2).sum())
        assert abs((together[c] - picture[c]).sum()) <= 5 * error + 1e-4 * picture[c].sum(), c
        assert picture[c].sum() > 20 * error


def test_mutual_holdouts_merge_to_the_picture_of_both(tmp_path):
    """Each part sees the other as a holdout, which cuts it out where it is in front."""
    near, away = BALL.format(x="-0.1", z="0.8", colour="3 2 1"), BALL.format(x="0.2", z="-0.5", colour="1 4 2")
    held = '<boolean name="holdout" value="true"/></shape>'
    parts = {"near": near + away.replace("</shape>", held), "away": near.replace("</shape>", held) + away, "both": near + away}
    for name, shapes in parts.items():
        render(write(tmp_path, name, shapes, transparent="true"), tmp_path / f"{name}.exr", "--deep", 4, "--float", spp=64)
    merged = tmp_path / "merged.exr"
    oiiotool(deep(tmp_path / "near.exr"), deep(tmp_path / "away.exr"), "--deepmerge", "-o", merged)

    together, picture = flat(merged), layers(tmp_path / "both.exr")

    # Inside the balls pixels are covered by one of them, and equal. At rims alphas of both parts are laid over each other as
    # if they were independent, which holdouts are not: at most a quarter of the light is missing there (1 - a)(1 - b) for a
    # + b = 1. Rims are a small part of the picture.
    wrong = np.max([np.abs(together[c] - picture[c]) / max(1e-6, picture[c].max()) for c in "RGBA"], axis=0)
    assert np.quantile(wrong, .9) <= 1e-5 and wrong.max() <= .26


def test_nothing_shines_through_a_surface_that_is_merged_between_two_others(tmp_path):
    """The rims of a black rectangle, with a floor that shines far behind it, and a black plane between them."""
    def plane(z, scale, angle=0, radiance="0"):
        place = f'<scale value="{scale}"/><rotate z="1" angle="{angle}"/><translate z="{z}"/>'
        return f'''<shape type="rectangle"><transform name="to_world">{place}</transform>
            <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
            <emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>'''

    for name, shapes in {"far": plane(-4, 9, radiance="9") + plane(2, .6, 20), "between": plane(0, 9)}.items():
        render(write(tmp_path, name, shapes, transparent="true"), tmp_path / f"{name}.exr", "--deep", 8, "--float", spp=64)
    merged = tmp_path / "merged.exr"
    oiiotool(deep(tmp_path / "far.exr"), deep(tmp_path / "between.exr"), "--deepmerge", "-o", merged)

    together = flat(merged)

    # Alphas of float32 add up to 1 but for a few roundings. Where 16 probes all meet the rectangle, the floor beside it is at the
    # rectangle's depth: less than two probes' share of it.
    assert together["A"].min() >= 1 - 1e-6 and layers(tmp_path / "far.exr")["R"].max() > 8
    assert all(together[c].max() <= 9 * 2 / 16 for c in "RGB")


@pytest.fixture(scope="module")
def image(tmp_path_factory):
    folder = tmp_path_factory.mktemp("image")
    scene = write_fog(folder)
    render(scene, folder / "out.exr", "--deep", SLICES, "--threads", 1)
    return scene, folder / "out.exr"


def environment(farm):
    return {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}


def fetch(farm, job, out):
    lightshaft("fetch", job, "-o", out, env=environment(farm))
    return sealed(deep(out))


def test_merged_partials_have_the_deep_image(image, tmp_path):
    scene, whole = image
    render(scene, tmp_path / "out.exr", "--deep", SLICES, "--partial-dir", tmp_path / "parts", "--threads", 2, "--isolate")
    lightshaft("merge", tmp_path / "parts", "-o", tmp_path / "merged.exr")
    assert sealed(deep(tmp_path / "out.exr")) == sealed(deep(whole)) == sealed(deep(tmp_path / "merged.exr"))


def test_a_farm_that_is_killed_and_a_job_that_is_extended_give_the_same_deep_image(farm, image, tmp_path):
    scene, whole = image
    farm.add_workers(2, fake=False)
    job, short, other = (lightshaft("submit", scene, "--spp", spp, *flags, env=environment(farm)).stdout.split()[0]
                         for spp, *flags in ((SPP, "--deep", SLICES), (4, "--deep", SLICES), (SPP,)))
    farm.wait_for_progress(job, 3)
    farm.workers[0].kill()
    farm.restart_coordinator()
    farm.add_worker(fake=False)
    for one in (job, short, other):
        farm.wait_for_job(one)
    lightshaft("extend", short, "--spp", SPP, env=environment(farm))
    farm.wait_for_job(short)
    again = lightshaft("again", other, "--deep", SLICES, env=environment(farm)).stdout.split()[0]
    farm.wait_for_job(again)

    for one in (job, short, again):
        assert fetch(farm, one, tmp_path / f"{one}.exr") == sealed(deep(whole)), one
    assert farm.request("GET", f"/api/v1/jobs/{job}/deep.exr") == deep(tmp_path / f"{job}.exr").read_bytes()
    assert farm.job(job)["deep"] == SLICES and farm.job(other)["deep"] == 0
    with pytest.raises(HttpError, match="409"):
        farm.request("GET", f"/api/v1/jobs/{other}/deep.exr")


def test_a_job_has_no_deep_image_before_it_ends(farm, image):
    scene, _ = image
    job = lightshaft("submit", scene, "--spp", 2, "--deep", SLICES, env=environment(farm)).stdout.split()[0]
    with pytest.raises(HttpError, match="has not ended"):
        farm.request("GET", f"/api/v1/jobs/{job}/deep.exr")
    farm.add_worker(fake=False)
    farm.wait_for_job(job)
    assert sealed_in(farm.request("GET", f"/api/v1/jobs/{job}/deep.exr"))


def test_a_png_does_not_replace_the_deep_image_of_an_exr_of_the_same_name(tmp_path):
    scene = write(tmp_path, "balls", balls())
    render(scene, tmp_path / "a.exr", "--deep", SLICES)
    before = deep(tmp_path / "a.exr").read_bytes()

    render(scene, tmp_path / "a.png", "--deep", SLICES, "--seed", 9)

    assert deep(tmp_path / "a.exr").read_bytes() == before
    assert sealed(tmp_path / "a.png.deep.exr")


def test_verify_tells_a_deep_image_that_was_changed_or_is_of_other_samples(image, tmp_path):
    scene, whole = image
    out = tmp_path / "out.exr"
    out.write_bytes(whole.read_bytes())
    verify = ("verify", out, "--scene", scene, "--tiles", 1, "--seed", 1)
    assert "the deep image is not verified" in lightshaft(*verify).stderr

    data = bytearray(deep(whole).read_bytes())
    at = data.index(b"lightshaft:build\0")
    data[at + data[at:].index(b"string\0") + 12] ^= 1
    deep(out).write_bytes(data)
    assert "header lightshaft:build" in lightshaft(*verify, code=1).stdout

    render(scene, tmp_path / "seed.exr", "--deep", SLICES, "--seed", 9)
    deep(out).write_bytes(deep(tmp_path / "seed.exr").read_bytes())
    assert "it is the deep image of other samples" in lightshaft(*verify, code=2).stderr
    deep(out).write_bytes(b"no image")
    assert "not an EXR file" in lightshaft(*verify, code=2).stderr


def test_a_deep_image_without_colours_has_the_same_alpha(image, tmp_path):
    scene, whole = image
    render(scene, tmp_path / "alpha.exr", "--deep", SLICES, "--deep-alpha")
    channels = read_header(deep(tmp_path / "alpha.exr").read_bytes())[0]["channels"][1]
    assert b"A\0" in channels and b"ZBack\0" in channels and b"R\0" not in channels
    # Where no light is behind, an alpha may be rounded to 1 that is not with colours.
    assert np.abs(flat(deep(tmp_path / "alpha.exr"))["A"] - flat(deep(whole))["A"]).max() <= 2 * 2 ** -11


def test_what_cannot_be_is_refused_with_its_name(image, tmp_path):
    scene, _ = image
    for flags, words in ((("--deep", 65), "--deep must be"), (("--deep", -1), "--deep"), (("--deep-alpha",), "give deep, too"),
                         (("--deep", 64, "--size", "3840x2160"), "64 slices of a deep image")):
        said = render(scene, tmp_path / "no.exr", *flags, code=2).stderr
        assert words in said, said
    assert not pathlib.Path(tmp_path / "no.exr").exists()
    assert digest(render(scene, tmp_path / "zero.exr", "--deep", 0))
    assert not (tmp_path / "zero.deep.exr").exists()


def test_a_sequence_has_a_deep_image_for_each_frame(farm, tmp_path):
    farm.add_worker(fake=False)
    scene = write(tmp_path, "fog", fog() + balls())
    job = lightshaft("submit", scene, "--spp", 4, "--deep", SLICES, "--frames", "1-2", "--wait", "-o", tmp_path / "a_#.exr", env=environment(farm)).stdout.split()[0]
    lightshaft("fetch", job, "-o", tmp_path / "b_#.exr", env=environment(farm))

    assert farm.get(f"/api/v1/jobs/{job}")["deep"] == SLICES
    for frame in (1, 2):
        assert (tmp_path / f"a_{frame}.deep.exr").read_bytes() == (tmp_path / f"b_{frame}.deep.exr").read_bytes()
    without = json.loads(farm.request("POST", f"/api/v1/jobs/{job}/again", b'{"deep": 0, "spp": 2}'))["id"]
    assert farm.get(f"/api/v1/jobs/{without}")["deep"] == 0


def test_shadows_that_are_caught_have_no_deep_image(tmp_path):
    """They are at no depth, so the deep image would flatten to another alpha than the picture's."""
    floor = '<shape type="rectangle"><boolean name="shadow_catcher" value="true"/></shape>'
    scene = write(tmp_path, "caught", floor + balls() + SKY, transparent="true")

    refused = render(scene, tmp_path / "a.exr", "--deep", SLICES, code=2)

    assert "shadow catchers" in refused.stderr and "leave deep out" in refused.stderr
    assert not (tmp_path / "a.exr").exists()
    render(write(tmp_path, "opaque", floor + balls() + SKY), tmp_path / "b.exr", "--deep", SLICES)
    assert deep(tmp_path / "b.exr").exists(), "without a transparent film nothing is caught"
