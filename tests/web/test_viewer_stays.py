"""What the viewer keeps still and keeps shown: the picture under a drag, values, keys without a click; and single channels, ranges, histogram."""
import base64
import json

import pytest

from stub_farm import Layer, job

from test_viewer import SRGB_HALF, VIEW, colour, compared, press, query, viewer  # noqa: F401: fixtures


def test_a_region_dragged_in_a_running_job_is_where_the_pointer_was(farm, viewer):  # noqa: F811
    page = viewer("zoom=4&x=48&y=32")
    corners = page.evaluate(f"(() => {{ const v = {VIEW}, b = v.getBoundingClientRect(); return [[20, 16], [60, 48]].map((p) => {{ const w = v.windowPoint(p); return [b.left + w[0] + 2, b.top + w[1] + 2]; }}); }})()")
    middle = [(corners[0][i] + corners[1][i]) / 2 for i in (0, 1)]
    mouse = lambda kind, at: page.call("Input.dispatchMouseEvent", {"type": kind, "x": at[0], "y": at[1], "button": "left", "buttons": 1, "clickCount": 1, "modifiers": 8})  # Shift
    top = page.evaluate(f"{VIEW}.getBoundingClientRect().top")

    mouse("mousePressed", corners[0])
    mouse("mouseMoved", middle)
    page.wait("document.querySelector('.viewer-focus button')")
    mouse("mouseMoved", corners[1])
    mouse("mouseReleased", corners[1])

    page.wait("location.hash.includes('region=20%2C16%2C61%2C49')")
    assert page.evaluate(f"{VIEW}.getBoundingClientRect().top") == top


def test_keys_work_without_a_click(farm, viewer):  # noqa: F811
    page = viewer()
    press(page, "e")
    assert query(page) == "ev=0.5"


def test_values_stay_when_the_layer_or_the_comparison_changes(farm, viewer):  # noqa: F811
    farm.layers["albedo"] = Layer(["R", "G", "B"], lambda x, y: (0.125, 0.25, 0.75))
    farm.jobs["j-2"] = job("j-2", "two.xml", size=farm.size)
    farm.layers_of["j-2"] = {**farm.layers, "albedo": Layer(["R", "G", "B"], lambda x, y: (0.625, 0.25, 0.75))}
    page = viewer()
    at = page.evaluate(f"(() => {{ const b = {VIEW}.getBoundingClientRect(), w = {VIEW}.windowPoint([10.5, 20.5]); return [b.left + w[0], b.top + w[1]]; }})()")
    page.call("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": at[0], "y": at[1]})
    page.wait("document.querySelector('.viewer-reading').innerText.includes('Pixel 10, 20')")

    page.evaluate("(() => { const s = document.getElementById('view-layer'); s.value = 'albedo'; s.dispatchEvent(new Event('change')); })()")
    page.wait("document.querySelector('.viewer-reading').innerText.replace(/\\s+/g, ' ').includes('R 0.1250')")
    page.evaluate("(() => { const s = document.getElementById('view-with'); s.value = 'j-2'; s.dispatchEvent(new Event('change')); })()")
    page.wait("document.querySelector('.viewer-reading').innerText.includes('0.6250')")


def test_a_depth_is_spread_from_its_nearest_to_its_farthest(farm, viewer):  # noqa: F811
    farm.layers["depth"] = Layer(["Z"], lambda x, y: (2 + 8 * (x // 32) / 2,))
    page = viewer("layer=depth")

    page.wait(f"JSON.stringify({json.dumps([0, 0, 0])}) === JSON.stringify({shown(5, 5)})")

    assert colour(page, 40, 5) == [128, 128, 128] and colour(page, 90, 5) == [255, 255, 255], "4 stops above white by exposure alone"
    assert page.evaluate("document.getElementById('ev').disabled"), "it is no light"


def shown(x, y):
    return f"(() => {{ const v = {VIEW}, c = v.querySelector('canvas'), at = v.windowPoint([{x} + 0.5, {y} + 0.5]).map((w) => Math.round(w * devicePixelRatio)); return [...c.getContext('2d').getImageData(at[0], at[1], 1, 1).data].slice(0, 3); }})()"


def test_single_channels_are_shown_as_grey(farm, viewer):  # noqa: F811
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (0, 0.5, 2))
    page = viewer()
    for wanted in ([0] * 3, [SRGB_HALF] * 3, [255] * 3, [0, SRGB_HALF, 255]):
        press(page, "k")
        assert colour(page, 10, 10) == wanted
    press(page, "k")
    assert query(page) == "channel=0"


def test_the_histogram_counts_every_pixel(farm, viewer):  # noqa: F811
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (1 if x < 24 else 4, 2, 2))
    page = viewer()
    page.key("h")

    lines = page.wait("document.querySelectorAll('.viewer-histogram polyline').length === 3 && [...document.querySelectorAll('.viewer-histogram polyline')].map(l => l.getAttribute('points').split(' ').map(p => +p.split(',')[1]))")

    heights = [[40 - v for v in line] for line in lines]
    assert heights[0][0] == pytest.approx(10, abs=0.01) and heights[0][-1] == pytest.approx(30, abs=0.01), "a quarter at 1, three at 4; drawn to two digits"
    assert heights[1][32] == 40 and sum(heights[1]) == 40, "2 is the middle between 1 and 4 by logarithms"


def test_numbers_show_the_first_picture_and_those_of_the_list(farm, viewer):  # noqa: F811
    farm.jobs["j-2"] = job("j-2", "two.xml", size=farm.size, submitted_unix=1, spp_done=512)
    farm.layers_of["j-2"] = {**farm.layers, "rgb": Layer(["R", "G", "B"], lambda x, y: (2, 2, 2))}
    page = viewer()
    page.wait("document.querySelector('#view-with').options.length === 2")
    assert page.evaluate("document.querySelector('#view-with').options[1].text").startswith("2: two.xml, 512 spp · ")

    page.key("2")
    page.wait(f"JSON.stringify({shown(20, 20)}) === '[255,255,255]'")
    page.key("1")
    page.wait(f"JSON.stringify({shown(0, 0)}) === '[0,0,188]'")


def test_what_is_seen_is_saved_as_a_png(farm, viewer):  # noqa: F811
    page = viewer()
    page.evaluate("""void (() => {
      window.saved = null;
      HTMLAnchorElement.prototype.click = async function () {
        const bytes = new Uint8Array(await (await window.blobs.get(this.href)).arrayBuffer());
        window.saved = [this.download, btoa(String.fromCharCode(...bytes))];
      };
      window.blobs = new Map();
      const real = URL.createObjectURL;
      URL.createObjectURL = (blob) => { const href = real(blob); window.blobs.set(href, blob); return href; };
    })()""")
    page.evaluate("[...document.querySelectorAll('.viewer button')].find(b => b.innerText === 'Save as PNG').click()")

    name, data = page.wait("window.saved")

    assert name == "steam-rgb.png" and base64.b64decode(data)[:8] == b"\x89PNG\r\n\x1a\n"


def test_a_picture_that_has_not_come_says_that_it_loads(farm, dashboard):
    farm.jobs["j-1"] = job(size=farm.size)
    page = dashboard()
    page.hold_reply("url.includes('/pixels')")
    page.evaluate("void (location.hash = '#/view/j-1')")
    word = f"getComputedStyle({VIEW}, '::after').content"
    page.wait(f"window.held && {word} === '\"Loading …\"'")
    page.release_reply()
    page.wait(f"{VIEW}.dataset.painted && {word} === 'none'")


def test_flip_says_that_it_is_computed(compared):  # noqa: F811
    page = compared("with=j-2")
    page.evaluate(f"""void (window.words = [], new MutationObserver(() => window.words.push({VIEW}.dataset.busy)).observe({VIEW}, {{ attributes: true, attributeFilter: ["data-busy"] }}))""")
    page.click("[name=by][value=flip]")
    page.wait("window.words.includes('Computing FLIP …')")
    page.wait(f"{VIEW}.dataset.painted && {VIEW}.dataset.busy === ''")


def test_a_viewer_of_no_job_ends_in_its_error(farm, dashboard):
    page = dashboard("#/view/NOPE")
    page.wait("document.querySelector('.notice.bad')?.innerText.includes('There is no job \"NOPE\"')")
    assert page.count(".waiting") == 0


def test_a_finished_denoised_job_opens_on_the_denoised_layer_with_its_error(farm, viewer):  # noqa: F811
    farm.jobs["j-1"] = job(state="done", denoise=True, size=farm.size)
    farm.layers["denoised"] = Layer(["R", "G", "B"], lambda x, y: (0.5, 0.5, 0.5))
    farm.report = {"convergence": [], "denoised": {"relmse": 0.00175, "relmse_ci95": [0.00117, 0.00234]}}
    page = viewer()

    assert colour(page, 10, 10) == [SRGB_HALF] * 3
    assert page.text(".viewer-error") == "relMSE 0.00175 (95 %: 0.00117 – 0.00234)"
    page.evaluate("(() => { const s = document.getElementById('view-layer'); s.value = 'rgb'; s.dispatchEvent(new Event('change')); })()")
    page.wait("location.hash.endsWith('layer=rgb')")


def test_the_wipe_says_which_side_is_which(compared):  # noqa: F811
    page = compared("with=j-2")
    page.wait(f"{VIEW}.dataset.painted")
    page.evaluate(f"""void (() => {{
      window.words = [];
      const real = CanvasRenderingContext2D.prototype.fillText;
      CanvasRenderingContext2D.prototype.fillText = function (text, x, ...more) {{ window.words.push([text, this.textAlign]); return real.call(this, text, x, ...more); }};
      {VIEW}.dispatchEvent(new KeyboardEvent("keydown", {{ key: "]" }}));
    }})()""")
    words = page.wait("window.words.length >= 2 && window.words.slice(0, 2)")
    assert words[0][0].startswith("First: ") and words[0][1] == "right" and words[1][0].startswith("Second: ") and words[1][1] == "left"
