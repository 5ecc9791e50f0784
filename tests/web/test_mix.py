"""Light groups in the viewer: the mix that it shows is the one that the farm gives, by mouse, by keyboard, from links and from files."""
import json
import os
import subprocess
import urllib.parse

import pytest
from exr_layers import read
from local_farm import LocalFarm, bin_dir

from stub_farm import Layer, job
from test_viewer import VIEW, colour, query, viewer  # noqa: F401: fixtures

SUN, LAMP, LAMP_FOG = (0.5, 0.25, 0.125), (0.125, 0.125, 0.25), (0.125, 0.0625, 0.125)
GROUPS = {"RGB_sun": SUN, "RGB_lamp": LAMP, "RGB_lamp.volume": LAMP_FOG, "RGB_sun.volume": (0, 0, 0)}
MIX = f"{VIEW}.dataset.painted === 'mix a'"


@pytest.fixture
def lit(farm, viewer):  # noqa: F811
    """A picture of two groups, whose halves differ by twice an eighth of them."""
    for name, light in GROUPS.items():
        farm.layers[name] = Layer(["R", "G", "B"], lambda x, y, light=light: light)
        farm.layers[f"{name}.delta"] = Layer(["R", "G", "B"], lambda x, y, light=light: [v / 8 for v in light])
    return viewer


def change(page, label, value, event="change"):
    """As a person sets a field: by its name."""
    page.wait(f"document.querySelector('[aria-label={json.dumps(label)}]')")
    page.evaluate(f"(() => {{ const e = document.querySelector('[aria-label={json.dumps(label)}]'); e.value = {json.dumps(value)}; e.dispatchEvent(new Event('{event}', {{ bubbles: true }})); }})()")


def press(page, label):
    page.click(f"[aria-label={json.dumps(label)}]")


def press_button(page, name):
    page.evaluate(f"[...document.querySelectorAll('button')].find((b) => b.innerText === {json.dumps(name)}).click()")


def point_at(page, x, y):
    at = page.evaluate(f"(() => {{ const b = {VIEW}.getBoundingClientRect(), w = {VIEW}.windowPoint([{x} + 0.5, {y} + 0.5]); return [b.left + w[0], b.top + w[1]]; }})()")
    page.call("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": at[0], "y": at[1]})


def reads(page, text):
    page.wait(f"document.querySelector('.viewer-reading').innerText.replace(/\\s+/g, ' ').includes({json.dumps(text)})")


def code(light):
    return round(255 * min(1, light))


def shows(page, light):
    """Through the linear curve a code is 255 times the light; halves at the codes' steps are exact enough to round alike."""
    page.wait(f"{MIX} && (() => {{ const v = {VIEW}, at = v.windowPoint([10.5, 10.5]).map(Math.round); const d = v.querySelector('canvas').getContext('2d').getImageData(at[0], at[1], 1, 1).data; return String([...d].slice(0, 3)) === '{','.join(str(code(v)) for v in light)}'; }})()")


def test_gains_solo_and_mute_are_seen_and_read(lit):
    page = lit("curve=linear")
    change(page, "sun: gain in stops", "1")
    shows(page, [2 * s + v for s, v in zip(SUN, LAMP)])
    point_at(page, 10, 10)
    reads(page, "Pixel 10, 10 R 1.125 ± 0.14 G 0.6250 ± 0.078 B 0.5000 ± 0.063")

    press(page, "Mute lamp")
    shows(page, [2 * s for s in SUN])
    point_at(page, 10, 10)
    reads(page, "R 1.000 ± 0.13")
    press(page, "Solo lamp")  # what is muted stays so
    shows(page, (0, 0, 0))
    press(page, "Mute lamp")
    shows(page, LAMP)
    assert query(page) == "layer=mix&curve=linear&mix=sun*g1&mix=lamp*s"
    assert page.evaluate("document.querySelector('[aria-label=\"Solo lamp\"]').getAttribute('aria-pressed')") == "true"


@pytest.mark.parametrize("width", [1280, 375])
def test_nothing_moves_when_the_error_of_a_mix_comes(lit, width):
    page = lit("", width=width, height=900, phone=width < 500)
    mute = "document.querySelector('[aria-label=\"Mute lamp\"]')"
    page.wait(f"{mute} && document.querySelector('.mix-top p')?.innerText === 'as rendered'")
    place = f"{mute}.getBoundingClientRect().top + scrollY"
    page.hold_reply("url.includes('/mix?')")
    change(page, "sun: gain in stops", "1")
    page.wait("window.held && document.querySelector('.mix-top p').innerText === 'relMSE …'")
    before = page.evaluate(place)

    page.release_reply()
    page.wait("document.querySelector('.mix-top p').innerText.includes('95 %')")

    assert page.evaluate(place) == before


def test_media_have_gains_of_their_own(lit):
    page = lit("curve=linear")
    page.click("[aria-label='lamp: media apart']")
    change(page, "lamp, media: gain in stops", "1")
    shows(page, [s + v + fog for s, v, fog in zip(SUN, LAMP, LAMP_FOG)])

    change(page, "lamp, surfaces: gain slider", "-2", "input")

    shows(page, [s + (v - fog) / 4 + 2 * fog for s, v, fog in zip(SUN, LAMP, LAMP_FOG)])
    page.click("[aria-label='lamp: media apart']")
    shows(page, [s + v / 4 for s, v in zip(SUN, LAMP)])


def test_a_link_opens_the_mix_and_moving_keeps_it(lit):
    page = lit("layer=mix&curve=linear&mix=sun*g-1*c1_0.5_0.25&mix=lamp*m*x*g_*k*c1_2_3&mix=nobody*s")
    shows(page, [s / 2 * c for s, c in zip(SUN, (1, 0.5, 0.25))])
    page.evaluate(f"{VIEW}.focus()")
    page.key("z")
    page.wait("location.hash.includes('zoom=1')")
    page.key("ArrowRight")
    shows(page, [s / 2 * c for s, c in zip(SUN, (1, 0.5, 0.25))])

    change(page, "sun: gain in stops", "-2")

    page.wait("location.hash.includes('mix=sun*g-2*c1_0.5_0.25&mix=lamp*m')")
    page.click(".mix-files button")
    page.wait("!location.hash.includes('mix')")


def saved(page):
    return json.loads(urllib.parse.unquote(page.evaluate("document.querySelector('.mix-files [download=\"mix.json\"]').href").partition(",")[2]))


def test_a_mix_is_saved_and_loaded(lit, tmp_path):
    page = lit("curve=linear")
    page.wait("document.querySelector('.viewer-mix')")
    assert saved(page) == {}
    file = tmp_path / "evening.json"
    file.write_text('{"sun": [0.5, 0.25, 0], "lamp": {"volume": 3}}')

    page.set_files("#mix-file", [file])

    shows(page, [0.5 * SUN[0] + LAMP[0] + 2 * LAMP_FOG[0], 0.25 * SUN[1] + LAMP[1] + 2 * LAMP_FOG[1], LAMP[2] + 2 * LAMP_FOG[2]])
    mix = saved(page)
    assert mix["sun"] == [0.5, 0.25, 0] and mix["lamp"] == {"surface": 1, "volume": 3}
    assert urllib.parse.unquote(page.evaluate("[...document.querySelectorAll('.mix-files a')].at(-1).href")).endswith(f"/api/v1/jobs/j-1/image.exr?mix={json.dumps(mix, separators=(',', ':'))}")


@pytest.mark.parametrize("text, words", [
    ("{", "It is no JSON."), ("[1]", "no JSON object of light groups"), ('{"moon": 1}', 'no light group "moon"; it has sun, lamp'),
    ('{"sun": -1}', "no number from 0 to"), ('{"sun": {"fog": 1}}', 'more than "surface" and "volume"'), ('{"sun": [1, 2]}', "no list of three")])
def test_a_file_that_is_no_mix_of_this_image_is_refused_with_words(lit, tmp_path, text, words):
    file = tmp_path / "mix.json"
    file.write_text(text)
    page = lit()
    page.wait("document.querySelector('.viewer-mix')")

    page.set_files("#mix-file", [file])

    page.wait(f"document.querySelector('.viewer-mix [role=alert]')?.innerText.includes({json.dumps(words)})")
    assert "mix.json: " in page.text(".viewer-mix [role=alert]") and "mix=" not in query(page)


def test_the_error_of_the_mix_stands_beside(farm, lit):
    page = lit()
    assert page.text(".mix-top [role=status]") == "as rendered"
    change(page, "sun: gain in stops", "1")
    page.wait("document.querySelector('.mix-top [role=status]').innerText === 'relMSE 0.0200 (95 %: 0.0180 – 0.0220)'")
    asked = [urllib.parse.unquote(path) for _, path in farm.requests if "/mix?" in path]
    assert asked == ['/api/v1/jobs/j-1/mix?mix={"sun":2}']

    farm.mix = {**farm.mix, "relmse": 0.5, "trusted": False, "verdict": "too early"}
    change(page, "sun: gain in stops", "2")
    page.wait("document.querySelector('.mix-top [role=status]').innerText === 'relMSE 0.500 (too early)'")
    farm.mix = "The image is away."
    change(page, "sun: gain in stops", "3")
    page.wait("document.querySelector('.mix-top .field-error')?.innerText === 'The image is away.'")


def test_an_answer_of_an_earlier_mix_is_not_shown(farm, lit):
    page = lit()
    page.hold_reply("url.includes('/mix?')")
    change(page, "sun: gain in stops", "1")
    page.wait("window.held")
    assert page.text(".mix-top [role=status]") == "relMSE …"
    farm.mix = {**farm.mix, "relmse": 0.5}
    change(page, "sun: gain in stops", "2")
    page.wait("document.querySelector('.mix-top [role=status]').innerText.startsWith('relMSE 0.500')")

    page.release_reply()

    assert page.text(".mix-top [role=status]").startswith("relMSE 0.500")


def test_a_mix_follows_the_samples_of_a_job_that_renders(farm, lit):
    page = lit("curve=linear&layer=mix&mix=sun*g1")
    shows(page, [2 * s + v for s, v in zip(SUN, LAMP)])
    page.wait("document.querySelector('.mix-top [role=status]').innerText.startsWith('relMSE 0.0200')")

    farm.layers["RGB_sun"] = Layer(["R", "G", "B"], lambda x, y: (0.125, 0.25, 0.25))
    farm.mix = {**farm.mix, "relmse": 0.01}
    farm.emit("tile", {"job": "j-1", "tile": 0, "rect": [0, 0, 96, 64], "state": "folded", "spp": 8, "worker": "w-1"})

    shows(page, (0.375, 0.625, 0.75))
    page.wait("document.querySelector('.mix-top [role=status]').innerText.startsWith('relMSE 0.0100')")


def test_two_jobs_are_compared_in_the_same_mix(farm, lit):
    farm.jobs["j-2"] = job("j-2", size=farm.size)
    farm.layers_of["j-2"] = {**farm.layers, "RGB_sun": Layer(["R", "G", "B"], lambda x, y: (0.25, 0.25, 0.25))}
    page = lit("curve=linear&layer=mix&mix=sun*g1&mix=lamp*m&with=j-2&by=b")

    page.wait(f"{VIEW}.dataset.painted === 'mix b'")
    assert colour(page, 10, 10) == [128] * 3
    change(page, "sun: gain in stops", "0")
    page.wait(f"{VIEW}.dataset.painted === 'mix b' && (() => {{ const v = {VIEW}, at = v.windowPoint([10.5, 10.5]).map(Math.round); return v.querySelector('canvas').getContext('2d').getImageData(at[0], at[1], 1, 1).data[0] === 64; }})()")


def test_a_region_has_the_mean_of_the_mix_and_its_error(lit):
    page = lit("layer=mix&mix=lamp*m&region=0,0,8,8")
    reads(page, "mean R 0.5000 ± 0.0078 G 0.2500 ± 0.0039 B 0.1250 ± 0.0020")  # 64 pixels: an eighth of each pixel's error


def test_pictures_without_light_groups_have_no_panel_and_load_nothing_of_it(farm, viewer):  # noqa: F811
    page = viewer("mix=sun*g1&layer=mix")
    assert page.count(".viewer-mix") == 0
    assert not [path for _, path in farm.requests if "mix" in path]


def test_a_picture_without_media_apart_has_no_gains_for_them(farm, lit):
    for name in [name for name in farm.layers if ".volume" in name]:
        del farm.layers[name]
    page = lit("curve=linear&mix=lamp*vg1*g1&layer=mix")
    shows(page, [s + 2 * v for s, v in zip(SUN, LAMP)])
    assert page.count(".mix-head input") == 0


@pytest.mark.parametrize("width", [1280, 768, 375])
def test_the_panel_is_used_by_keyboard_alone_and_fits(lit, width):
    page = lit("mix=lamp*v*g1", width=width, height=800, phone=width < 500)
    page.wait("document.querySelectorAll('.mix-part').length === 3 && [...document.styleSheets].some((sheet) => sheet.href?.endsWith('mix.css'))")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    wanted = page.evaluate("[...document.querySelectorAll('.viewer-mix :is(a[href], button, input)')].filter((e) => !e.disabled).map((e) => e.getAttribute('aria-label') || e.labels?.[0]?.innerText || e.innerText)")
    assert len(set(wanted)) == len(wanted) and all(wanted)
    page.evaluate("document.querySelector('.viewer-mix button').focus()")
    seen = []
    for _ in wanted[1:]:
        page.key("Tab", virtual=9)
        seen.append(page.evaluate("(() => { const e = document.activeElement; return e.getAttribute('aria-label') || e.labels?.[0]?.innerText || e.innerText; })()"))
    assert seen == wanted[1:]
    page.evaluate("document.querySelector('[aria-label=\"sun: gain slider\"]').focus()")
    page.key("ArrowRight", virtual=39)
    page.wait("location.hash.includes('mix=sun*g0.1')")
    page.evaluate("document.querySelector('[aria-label=\"Mute sun\"]').focus()")
    page.key(" ", code="Space", virtual=32, text=" ")
    page.wait("location.hash.includes('mix=sun*m*g0.1')")


def test_changes_faster_than_the_page_is_drawn_are_all_kept(lit):
    page = lit("")
    page.wait("document.querySelector('[aria-label=\"Mute sun\"]')")

    page.evaluate("""(() => {
      const [gain, mute] = ["sun: gain slider", "Mute sun"].map((name) => document.querySelector(`[aria-label="${name}"]`));
      gain.value = "1";
      gain.dispatchEvent(new Event("input", { bubbles: true }));
      mute.click();
      document.querySelector('[aria-label="Solo lamp"]').click();
    })()""")

    assert query(page).endswith("mix=sun*m*g1&mix=lamp*s")


@pytest.mark.parametrize("kelvin, x, y", [(2856, 0.44757, 0.40745), (4000, 0.38045, 0.37675), (6500, 0.31352, 0.32363), (10000, 0.28063, 0.28829)])
def test_a_temperature_has_the_chromaticity_of_a_black_body_and_luminance_one(modules_page, kelvin, x, y):
    """x and y of Planck's law (CIE 1931). du and dv of 9e-5 are less than 4e-4 of x and y here, and the sRGB matrix has four digits."""
    r, g, b = modules_page.evaluate(f"import('/js/viewer/mix.js').then(({{ kelvinColour }}) => kelvinColour({kelvin}))")

    big_x, big_y, big_z = (0.4124 * r + 0.3576 * g + 0.1805 * b, 0.2126 * r + 0.7152 * g + 0.0722 * b, 0.0193 * r + 0.1192 * g + 0.9505 * b)
    assert big_y == pytest.approx(1, abs=1e-9)
    assert [big_x / (big_x + big_y + big_z), big_y / (big_x + big_y + big_z)] == pytest.approx([x, y], abs=5e-4)


@pytest.fixture
def modules_page(farm, open_page):
    return open_page(f"{farm.url}/demo.html")


# ---- a real farm ----

ROOM = """<scene version="3.0.0">
  <integrator type="volpath"/>
  <sensor type="perspective"><float name="fov" value="45"/>
    <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
  <shape type="sphere"><bsdf type="diffuse"/></shape>
  <shape type="cube"><transform name="to_world"><scale value="1.5"/></transform><bsdf type="null"/>
    <medium name="interior" type="homogeneous"><float name="sigma_t" value="0.3"/><float name="albedo" value="0.9"/></medium></shape>
  <emitter type="constant"><rgb name="radiance" value="0.2, 0.3, 0.5"/><string name="light_group" value="sky"/></emitter>
  <emitter type="point"><point name="position" x="2" y="2" z="2"/><rgb name="intensity" value="9, 7, 4"/><string name="light_group" value="lamp"/></emitter>
</scene>
"""


@pytest.fixture
def real_farm(tmp_path, programs):
    with LocalFarm(tmp_path / "farm", programs) as farm:
        farm.add_worker(fake=False)
        farm.wait_for_workers(1)
        yield farm


def test_the_viewer_and_fetch_give_the_same_mix(real_farm, open_page, tmp_path):
    """Each group comes as halves, rounded to a relative 2^-11, and their sum is rounded to a half once more; so is the file's."""
    id = real_farm.submit(ROOM, spp=8, aov="volume_light_groups")
    real_farm.wait_for_job(id)
    page = open_page(f"{real_farm.url()}/#token={real_farm.token}")
    page.wait("document.querySelector('.link.live')")
    page.evaluate(f"void (location.hash = '#/view/{id}?layer=mix&mix=sky*g-1*k4000&mix=lamp*g1*v*vg2')")
    page.wait(MIX)
    page.wait("document.querySelector('.mix-top [role=status]').innerText.startsWith('relMSE 0')")
    file, mixed = tmp_path / "mix.json", tmp_path / "mixed.exr"
    file.write_text(json.dumps(saved(page)))

    done = subprocess.run([bin_dir() / "lightshaft", "fetch", id, "--mix", file, "-o", mixed, "--to", real_farm.url()], capture_output=True, text=True, env={**os.environ, "LIGHTSHAFT_TOKEN": real_farm.token})

    assert done.returncode == 0, done.stderr
    channels, strings, _ = read(mixed)
    wanted = [channels[c][y][x] for y in range(32) for x in range(48) for c in "RGB"]
    seen = page.evaluate(f"""(async () => {{
      const [{{ MixedSource }}, {{ PixelSource }}, {{ api }}] = await Promise.all(["mixing", "source", "../api"].map((name) => import(`/js/viewer/${{name}}.js`)));
      const source = new MixedSource(new PixelSource(await api.layers("{id}"), (...what) => api.pixels("{id}", ...what), () => {{}}));
      source.mix(["sky*g-1*k4000", "lamp*g1*v*vg2"]);
      return [...await source.values("mix", 0, [0, 0, 48, 32])];
    }})()""")
    # The roundings of both, and of the sum of floats
    assert all(abs(v - w) <= (2**-10 + 2**-20) * w for v, w in zip(seen, wanted)) and min(wanted) > 0.01
    assert json.loads(strings["lightshaft:mix"]) == json.loads(file.read_text())
    point_at(page, 24, 16)
    page.wait("document.querySelector('.viewer-reading').innerText.includes('Pixel 24, 16')")
    page.wait("document.querySelectorAll('.viewer-value b').length === 3")
    shown = [float(v) for v in page.evaluate("[...document.querySelectorAll('.viewer-value b')].map((e) => e.innerText)")]
    assert shown == pytest.approx(seen[3 * (16 * 48 + 24):][:3], rel=5e-4), "four digits"
    assert float(strings["lightshaft:relmse"]) == pytest.approx(float(page.text(".mix-top [role=status]").split()[1]), rel=5e-3), "three digits"


def test_a_mix_follows_a_job_that_renders(real_farm, open_page):
    id = real_farm.submit(ROOM, spp=1 << 20, aov="light_groups")
    page = open_page(f"{real_farm.url()}/#token={real_farm.token}")
    page.wait("document.querySelector('.link.live')")
    page.evaluate(f"void (location.hash = '#/view/{id}?layer=mix&mix=sky*m')")
    page.wait(f"{MIX} && document.querySelector('.mix-top [role=status]').innerText.includes('95 %')")
    error = page.text(".mix-top [role=status]")

    page.wait(f"document.querySelector('.mix-top [role=status]').innerText !== {json.dumps(error)} && !document.querySelector('.mix-top [role=status]').innerText.includes('…')")
    page.wait("performance.getEntriesByType('resource').filter(({ name }) => name.includes('/pixels?layer=RGB_lamp&')).length > 2")

    real_farm.request("PATCH", f"/api/v1/jobs/{id}", b'{"state": "cancelled"}')


def test_a_mix_is_rendered_as_a_job(real_farm, open_page, tmp_path):
    id = real_farm.submit(ROOM, spp=4, aov="light_groups", float="true")
    real_farm.wait_for_job(id)
    page = open_page(f"{real_farm.url()}/#token={real_farm.token}")
    page.wait("document.querySelector('.link.live')")
    page.evaluate(f"void (location.hash = '#/view/{id}?layer=mix&mix=sky*g1&mix=lamp*g1')")
    page.wait(MIX)

    press_button(page, "Render as job")

    page.wait(f"location.hash.startsWith('#/jobs/') && !location.hash.includes({json.dumps(id)})")
    made = page.evaluate("location.hash").removeprefix("#/jobs/")
    real_farm.wait_for_job(made)
    images = [tmp_path / f"{job}.exr" for job in (id, made)]
    for job_id, path in zip((id, made), images):
        path.write_bytes(real_farm.request("GET", f"/api/v1/jobs/{job_id}/image.exr"))
    one, two = (read(path)[0]["G"] for path in images)
    assert [[2 * v for v in row] for row in one] == [list(row) for row in two], "twice the light changes no bit but the exponent"


def test_a_mix_that_cannot_be_rendered_is_refused_with_the_reason(farm, lit):
    page = lit("curve=linear&mix=lamp*g1*v*vg2")
    farm.refuse_again = 'mix: the light group "lamp" has other factors for media than for surfaces'
    page.wait("document.querySelector('.viewer-mix')")
    press_button(page, "Render as job")
    page.wait("document.querySelector('.viewer-mix [role=alert]')?.innerText.includes('other factors for media')")


def test_who_may_only_look_is_not_offered_to_render_a_mix(farm, lit):
    farm.role = "read"
    page = lit("curve=linear&mix=lamp*g1")
    page.wait("document.querySelector('.viewer-mix')")
    assert "Render as job" not in page.text(".viewer-mix")
