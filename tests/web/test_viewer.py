"""The viewer of pictures in numbers: what it shows is what the coordinator sent, by mouse and by keyboard."""
import json
import math
import struct
import urllib.parse
import zlib

import pytest

from stub_farm import Layer, gradient, job

VIEW = "document.querySelector('float-view')"
SRGB_HALF = 188  # 0.5 in linear light


@pytest.fixture
def viewer(farm, dashboard):
    """Opens a view of job j-1 and waits for its picture."""
    def open(query="", **more):
        farm.jobs.setdefault("j-1", job(size=farm.size))
        page = dashboard(f"#/view/j-1{'?' + query if query else ''}", **more)
        page.wait(f"{VIEW}?.dataset.painted")  # FLIP of a whole window is work
        return page
    return open


def colour(page, x, y):
    """[r, g, b] where the middle of a pixel of the image is drawn."""
    return page.evaluate(f"""(() => {{
      const view = {VIEW}, canvas = view.querySelector('canvas'), ratio = devicePixelRatio;
      const at = view.windowPoint([{x} + 0.5, {y} + 0.5]).map((v) => Math.round(v * ratio));
      return [...canvas.getContext('2d').getImageData(at[0], at[1], 1, 1).data].slice(0, 3);
    }})()""")


def focus(page):
    page.evaluate(f"{VIEW}.focus()")


def press(page, key):
    """A key with its letter, as a keyboard sends it; returns when the picture is painted again."""
    before = page.evaluate(f"{VIEW}.dataset.pictures")
    page.key(key)
    page.wait(f"{VIEW}.dataset.painted && {VIEW}.dataset.pictures !== '{before}'")


def query(page):
    return page.evaluate("location.hash.split('?')[1] ?? ''")


def test_values_become_colours_by_exposure_and_curve(farm, viewer):
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (0.5, 0.25, 2))
    page = viewer()
    assert colour(page, 10, 10) == [SRGB_HALF, 137, 255]

    page.evaluate("void (location.hash = '#/view/j-1?curve=linear&ev=-1')")
    page.wait(f"{VIEW}.dataset.painted && document.getElementById('ev').value === '-1'")

    page.wait("true")
    assert page.wait(f"JSON.stringify({[64, 32, 255]}) === JSON.stringify((() => {{ const v = {VIEW}, c = v.querySelector('canvas'); const at = v.windowPoint([10.5, 10.5]).map(Math.round); return [...c.getContext('2d').getImageData(at[0], at[1], 1, 1).data].slice(0, 3); }})())")


def test_an_image_with_alpha_lies_on_a_checkerboard(farm, viewer):
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (0.5, 0.25, 0) if x < 32 else (0, 0, 0))
    farm.layers["alpha"] = Layer(["A"], lambda x, y: (1.0 if x < 32 else 0.0,))

    page = viewer("curve=linear")

    # The squares have the light 1/16 and 1/8; a code is 255 times the light.
    assert [colour(page, x, 2) for x in (2, 34, 42)] == [[128, 64, 0], [16] * 3, [32] * 3]
    before = page.evaluate(f"{VIEW}.dataset.pictures")
    page.evaluate("void (location.hash = '#/view/j-1?curve=linear&ev=-1')")
    page.wait(f"document.getElementById('ev').value === '-1' && {VIEW}.dataset.pictures !== '{before}'")
    assert [colour(page, x, 2) for x in (2, 34, 42)] == [[64, 32, 0], [16] * 3, [32] * 3]


@pytest.mark.parametrize("curve", ["linear", "srgb"])
def test_every_curve_rises_from_black_to_white(modules_page, curve):
    codes = modules_page.evaluate(f"""(async () => {{
      const {{ paint }} = await import("/js/viewer/paint.js");
      const {{ halfBits }} = await import("/js/viewer/half.js");
      const values = Array.from({{ length: 60 }}, (_, i) => 2 ** (i / 2 - 20)).flatMap((v) => [v, v, v]);
      const rgba = paint(Uint16Array.from(values, halfBits).buffer, {{ name: "rgb", channels: ["R", "G", "B"], format: "half", blocks: "mean" }}, {{ exposure: 0, curve: {json.dumps(curve)}, falseColour: false, matte: new Set() }});
      return Array.from(rgba).filter((_, i) => i % 4 === 0);
    }})()""")

    assert codes == sorted(codes)
    assert codes[0] <= 1 and codes[-1] >= 254
    assert 40 <= codes[35] <= 200, "0.18, middle grey, is neither black nor white"


SIDE = 65  # places along an axis of a view's table


def cube(code):
    """The table of a view. code: [r, g, b], from 0 to 1, of three places along the axes."""
    return struct.pack(f"<{3 * SIDE ** 3}e", *(value for b in range(SIDE) for g in range(SIDE) for r in range(SIDE) for value in code(r, g, b)))


def place(light):
    """Where light lies along an axis of a view's table."""
    return 4 * math.log2(1 + 256 * light)


@pytest.fixture
def turned(farm):
    """A view that makes green of red, blue of green and red of blue, in proportion to their places, which interpolation keeps."""
    farm.cubes["Screen/Turned & <b>"] = cube(lambda r, g, b: (b / 64, r / 64, g / 64))
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (0.5, 0.25, 2) if x < 32 else (0, 300, math.nan) if x < 64 else (-1, 1e-5, 60000))
    return "Screen/Turned & <b>"


def test_a_view_shows_colours_by_its_table(turned, viewer):
    page = viewer(f"curve={urllib.parse.quote(turned)}")
    page.wait(f"!document.getElementById('view-curve').disabled && document.getElementById('view-curve').value === {json.dumps(turned)}")

    def shown(*lights):
        return [round(255 * min(64, place(light)) / 64) for light in lights]
    wanted = [pytest.approx(shown(2, 0.5, 0.25), abs=1), [24, 24, 27], pytest.approx(shown(60000, 0, 1e-5), abs=1)]  # half floats have 11 bits
    page.wait(f"(() => {{ const v = {VIEW}, at = v.windowPoint([10.5, 10.5]).map(Math.round); return v.querySelector('canvas').getContext('2d').getImageData(at[0], at[1], 1, 1).data[0] === {shown(2)[0]}; }})()")
    assert [colour(page, x, 10) for x in (10, 50, 80)] == wanted
    assert urllib.parse.parse_qs(query(page)) == {"curve": [turned]}


def test_a_view_follows_the_exposure(turned, viewer):
    page = viewer(f"curve={urllib.parse.quote(turned)}&ev=1")
    page.wait(f"(() => {{ const v = {VIEW}, at = v.windowPoint([10.5, 10.5]).map(Math.round); return v.querySelector('canvas').getContext('2d').getImageData(at[0], at[1], 1, 1).data[0] === {round(255 * place(4) / 64)}; }})()")


def test_the_viewer_opens_on_the_default_view_of_the_coordinator(farm, turned, viewer):
    farm.default_view = turned
    page = viewer()

    assert page.evaluate("[...document.getElementById('view-curve').options].map((o) => o.text)") == ["sRGB", "Linear", turned]
    assert page.evaluate("document.getElementById('view-curve').value") == turned
    assert query(page) == ""
    focus(page)
    press(page, "c")
    assert query(page) == "curve=srgb", "the next one, after the last the first"


def test_of_two_views_the_one_chosen_later_holds(farm, turned, viewer):
    """The table of the first comes after that of the second."""
    farm.cubes["Screen/Green"] = cube(lambda r, g, b: (0, 1, 0))
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (0.5, 0.25, 2))
    page = viewer()
    page.evaluate("""(() => {
      const fetched = window.fetch, late = new Promise((go) => { window.letGo = go; });
      window.fetch = async (address, ...more) => {
        const answer = await fetched(address, ...more);
        if (String(address).includes("Turned")) { await late; window.cameLate = true; }
        return answer;
      };
    })()""")

    for name in (turned, "Screen/Green"):
        page.evaluate(f"(() => {{ const s = document.getElementById('view-curve'); s.value = {json.dumps(name)}; s.dispatchEvent(new Event('change')); }})()")
    green = f"(() => {{ const v = {VIEW}, at = v.windowPoint([10.5, 10.5]).map(Math.round); return String([...v.querySelector('canvas').getContext('2d').getImageData(at[0], at[1], 1, 1).data]) === '0,255,0,255'; }})()"
    page.wait(green)
    pictures = page.evaluate(f"{VIEW}.dataset.pictures")
    page.evaluate("letGo()")
    page.wait("window.cameLate")
    page.evaluate(f"{VIEW}.press('e')")
    page.wait(f"{VIEW}.dataset.pictures !== '{pictures}'")
    assert page.evaluate(green)


def test_a_view_that_cannot_be_had_leaves_the_picture(farm, turned, viewer):
    farm.cubes[turned] = None
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (0.5, 0.5, 0.5))
    page = viewer(f"curve={urllib.parse.quote(turned)}")

    page.wait("document.querySelector('.toast')?.innerText.includes('there is no view')")
    assert colour(page, 10, 10) == [SRGB_HALF] * 3


@pytest.fixture
def modules_page(farm, open_page):
    return open_page(f"{farm.url}/demo.html")


def test_half_floats_are_read_and_written_as_python_does(modules_page):
    """Every 7th of the 65,536 patterns, and the pattern nearest to values between them."""
    patterns = [p for p in range(0, 65536, 7) if (p >> 10) & 31 != 31]
    values = [struct.unpack("<e", struct.pack("<H", p))[0] for p in patterns]
    found = modules_page.evaluate(f"import('/js/viewer/half.js').then(({{ halfValues }}) => {patterns}.map((p) => halfValues()[p]))")
    assert found == values

    between = [v * 1.0003 for v in values if 1e-4 < abs(v) < 60000]
    wanted = [struct.unpack("<H", struct.pack("<e", struct.unpack("<f", struct.pack("<f", v))[0]))[0] for v in between]
    assert modules_page.evaluate(f"import('/js/viewer/half.js').then(({{ halfBits }}) => {between}.map(halfBits))") == wanted
    edges = [*between, *(-v for v in between), 0, 65519, 65520, 1e9, 6.1e-5, 6.2e-5, 1e-9]
    agree = modules_page.evaluate(f"import('/js/viewer/half.js').then(({{ halfBits, halvesOf }}) => {{ const v = Float32Array.from({edges}.concat(NaN, Infinity, -Infinity)); return halvesOf(v).every((half, i) => half === halfBits(v[i])); }})")
    assert agree


def test_the_pixel_under_the_pointer_is_read_with_its_standard_error(viewer):
    page = viewer()
    at = page.evaluate(f"(() => {{ const box = {VIEW}.getBoundingClientRect(); const [x, y] = {VIEW}.windowPoint([48.5, 32.5]); return [box.left + x, box.top + y]; }})()")

    page.call("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": at[0], "y": at[1]})

    page.wait("document.querySelector('.viewer-reading').innerText.includes('±')")
    assert " ".join(page.text(".viewer-reading").split()) == "Pixel 48, 32 R 0.7500 ± 0.25 G 0.5000 ± 0.13 B 0.5000 ± 0.063 64 samples"


def test_the_keyboard_alone_moves_zooms_and_reads(farm, viewer):
    farm.layers["depth"] = Layer(["Z"], lambda x, y: (x,))
    page = viewer()
    focus(page)

    press(page, "z")
    assert query(page) == "zoom=1&x=48&y=32"
    press(page, "+")
    assert query(page).startswith("zoom=2&")
    page.call("Input.dispatchKeyEvent", {"type": "keyDown", "key": "ArrowRight", "code": "ArrowRight", "modifiers": 8})
    page.wait("document.querySelector('.viewer-reading').innerText.startsWith('Pixel 49, 32')")
    press(page, "e")
    press(page, "c")
    assert "ev=0.5" in query(page) and "curve=linear" in query(page)
    press(page, "l")
    assert "layer=stderr" in query(page)
    page.key("L")
    page.wait("!location.hash.includes('layer')")
    page.key("L")
    page.wait("location.hash.includes('layer=depth')")
    page.key("0")
    page.wait("!location.hash.includes('zoom')")


def test_keys_that_come_faster_than_frames_all_count(viewer):
    page = viewer("zoom=1&x=48&y=32")
    page.evaluate(f"""void (() => {{
      for (let i = 0; i < 5; i += 1) {VIEW}.dispatchEvent(new KeyboardEvent("keydown", {{ key: "ArrowRight", shiftKey: true }}));
    }})()""")
    assert query(page) == "zoom=1&x=53&y=32"


def test_a_wheel_zooms_about_the_pointer_and_dragging_moves(viewer):
    page = viewer()
    box = page.evaluate(f"(() => {{ const b = {VIEW}.getBoundingClientRect(); return [b.left, b.top]; }})()")
    point = [box[0] + 300, box[1] + 120]
    before = page.evaluate(f"{VIEW}.imagePoint([300, 120])")

    page.call("Input.dispatchMouseEvent", {"type": "mouseWheel", "x": point[0], "y": point[1], "deltaX": 0, "deltaY": -400})
    page.wait("location.hash.includes('zoom=')")

    after = page.evaluate(f"{VIEW}.imagePoint([300, 120])")
    # A mouse event has whole pixels of the window, of which at most one is lost; the window fits at 7 to one.
    assert after == pytest.approx(before, abs=1 / 7)
    for kind, x in (("mousePressed", 0), ("mouseMoved", -60), ("mouseReleased", -60)):
        page.call("Input.dispatchMouseEvent", {"type": kind, "x": point[0] + x, "y": point[1], "button": "left", "buttons": 1, "clickCount": 1})
    page.wait(f"Math.abs({VIEW}.imagePoint([240, 120])[0] - {after[0]}) < 1e-6")


def test_two_fingers_zoom(viewer):
    page = viewer("zoom=4&x=48&y=32", width=390, height=800, phone=True)
    page.call("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})
    x, y = page.evaluate(f"(() => {{ const b = {VIEW}.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; }})()")
    def touch(kind, apart):
        points = [] if apart is None else [{"x": x - apart, "y": y, "id": 0}, {"x": x + apart, "y": y, "id": 1}]
        page.call("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    touch("touchStart", 40)
    touch("touchMove", 80)
    page.wait("location.hash.includes('zoom=8')")
    touch("touchEnd", None)

    assert page.evaluate(f"{VIEW}.imagePoint([{VIEW}.clientWidth / 2, {VIEW}.clientHeight / 2])") == pytest.approx([48, 32], abs=0.5)


def test_what_is_folded_while_the_job_renders_is_fetched_again(farm, viewer):
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (float("nan"),) * 3)
    page = viewer()
    assert colour(page, 40, 20) == [24, 24, 27]

    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (0.5, 0.5, 0.5))
    farm.emit("tile", {"job": "j-1", "tile": 0, "rect": [0, 0, 96, 64], "state": "folded", "spp": 8, "worker": "w-1"})

    page.wait(f"(() => {{ const v = {VIEW}, at = v.windowPoint([40.5, 20.5]).map(Math.round); return v.querySelector('canvas').getContext('2d').getImageData(at[0], at[1], 1, 1).data[0] === {SRGB_HALF}; }})()")


def test_a_large_picture_is_fetched_at_the_level_and_in_the_place_that_is_seen(farm, viewer):
    farm.size = [4096, 2048]
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (x / 4096, 0, 0))
    page = viewer("zoom=1&x=2048&y=1024")
    asked = [path for method, path in farm.requests if "/pixels?" in path]
    assert asked and all("level=0" in path for path in asked)
    around = {f"rect={x},{y},{x + 256},{y + 256}" for x in (1792, 2048) for y in (768, 1024)}
    assert {path.split("&")[-1] for path in asked[:4]} == around, "the middle first"
    assert not any("rect=0,0," in path for path in asked)

    focus(page)
    press(page, "0")

    assert page.evaluate(f"{VIEW}.dataset.level") == "1"


def test_errors_and_samples_lie_over_the_picture(farm, viewer):
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (0, 0, 0))
    farm.layers["error"] = Layer(["Y"], lambda x, y: (1,))
    page = viewer("over=error")
    assert colour(page, 20, 20) == [150, 138, 30], "60 % of the brightest colour of the map"


def bits_of(number):
    return struct.unpack("<f", struct.pack("<I", number))[0]


def test_objects_are_picked_by_their_cryptomatte_and_the_link_names_them(farm, viewer):
    lamp, wall = 0x3F000001, 0x40000002
    farm.layers["crypto_object"] = Layer(["id0", "coverage0", "id1", "coverage1"], lambda x, y: (bits_of(lamp), 0.75, bits_of(wall), 0.25) if x < 48 else (bits_of(wall), 1, 0, 0),
                                         "float", "first", {"lamp": f"{lamp:08x}", "wall": f"{wall:08x}"})
    page = viewer("layer=crypto_object&zoom=4&x=20&y=20")
    bright = colour(page, 60, 20)
    focus(page)
    page.key("Enter")

    page.wait("location.hash.includes('matte=lamp')")
    page.wait("document.querySelector('.viewer-reading').innerText.includes('Selected: lamp')")
    page.wait(f"(() => {{ const v = {VIEW}, at = v.windowPoint([60.5, 20.5]).map(Math.round); return v.querySelector('canvas').getContext('2d').getImageData(at[0], at[1], 1, 1).data[1] < {max(bright)} / 2; }})()")


def test_a_region_has_its_mean_and_the_error_of_that_mean(farm, viewer):
    farm.layers["rgb"] = Layer(["R", "G", "B"], lambda x, y: (1 if x < 40 else 3, 0.5, 0.25))
    page = viewer("region=36,10,44,18")

    page.wait("document.querySelector('.viewer-reading').innerText.includes('mean')")
    # 64 pixels with the standard errors 1/4, 1/8, 1/16: those of the mean are an eighth of them.
    assert " ".join(page.text(".viewer-reading").split()).endswith("Region 36, 10 to 44, 18: mean R 2.000 ± 0.031 G 0.5000 ± 0.016 B 0.2500 ± 0.0078")
    focus(page)
    page.key("r")
    page.wait("!location.hash.includes('region')")


@pytest.fixture
def compared(farm, viewer):
    """j-1 is 0.5 everywhere; j-2 has a bright square."""
    farm.jobs["j-2"] = job("j-2", "other.xml", "done", size=farm.size)
    farm.layers = {**farm.layers, "rgb": Layer(["R", "G", "B"], lambda x, y: (0.5, 0.5, 0.5))}
    farm.layers_of["j-2"] = {**farm.layers, "rgb": Layer(["R", "G", "B"], lambda x, y: (2, 2, 2) if 48 <= x < 64 else (0.5, 0.5, 0.5))}
    return viewer


@pytest.mark.parametrize("by, same, other", [
    ("a", [SRGB_HALF] * 3, [SRGB_HALF] * 3), ("b", [SRGB_HALF] * 3, [255, 255, 255]),
    ("difference", [0, 0, 0], [255, 255, 255]),
    ("relmse", [13, 8, 70], None),  # (1.5^2) / (4 + 0.01) is above 0.5: within a tenth of the end of six decades
])
def test_two_jobs_are_compared_pixel_by_pixel(compared, by, same, other):
    page = compared(f"with=j-2&by={by}")
    page.wait(f"{VIEW}.dataset.painted === 'rgb {by}'")

    assert colour(page, 20, 20) == same
    found = colour(page, 56, 20)
    assert found == other if other else found[0] > 200 and found[2] < 60


def test_a_wipe_follows_the_mouse_and_the_keys(compared):
    page = compared("with=j-2&by=wipe&split=0.5")
    page.wait(f"{VIEW}.dataset.painted === 'rgb wipe'")
    assert colour(page, 20, 20) == [SRGB_HALF] * 3 and colour(page, 60, 20) == [255] * 3
    x, y, width = page.evaluate(f"(() => {{ const b = {VIEW}.getBoundingClientRect(); return [b.left + b.width / 2, b.top + 60, b.width]; }})()")

    for kind, dx in (("mousePressed", 0), ("mouseMoved", 0.25 * width), ("mouseReleased", 0.25 * width)):
        page.call("Input.dispatchMouseEvent", {"type": kind, "x": x + dx, "y": y, "button": "left", "buttons": 1, "clickCount": 1})

    page.wait("location.hash.includes('split=0.75')")
    focus(page)
    page.key("]")
    page.wait("location.hash.includes('split=0.8')")
    page.key("x")
    page.wait("location.hash.includes('by=a')")
    page.key("x")
    page.wait("location.hash.includes('by=b')")


def test_flip_of_what_is_seen_marks_the_difference(compared):
    page = compared("with=j-2&by=flip")
    page.wait(f"{VIEW}.dataset.painted === 'rgb flip'")

    dark, bright = colour(page, 10, 20), colour(page, 56, 20)
    page.wait("/FLIP 0[.]\\d+ of what is seen/.test(document.querySelector('.viewer-reading').innerText)")

    assert dark == [13, 8, 70]
    assert bright[1] > 60


def test_flip_gives_the_value_of_the_authors_program(modules_page):
    """Of the waves of tests/unit/image/reference/flip_test.cpp, by flip-evaluator 1.7: single precision, other roundings."""
    mean = modules_page.evaluate("""(async () => {
      const { flip } = await import("/js/viewer/flip.js");
      const [width, height] = [40, 24];
      const waves = (other) => {
        const rgb = new Float32Array(3 * width * height);
        for (let y = 0; y < height; y += 1) for (let x = 0; x < width; x += 1) {
          const more = other ? 1 + 0.25 * (((x * 7 + y * 13) % 11) / 11) : 1;
          [0.5 + 0.4 * Math.sin(x / 9), 0.4 + 0.3 * Math.cos(y / 7), 0.3 + 0.2 * Math.sin((x + y) / 5)].forEach((v, c) => { rgb[3 * (y * width + x) + c] = v * more; });
        }
        return rgb;
      };
      const errors = flip(waves(false), waves(true), width, height);
      return errors.reduce((sum, v) => sum + v, 0) / errors.length;
    })()""")
    assert mean == pytest.approx(0.2094682, abs=1e-5)


def test_pictures_of_other_sizes_are_not_compared(farm, viewer, compared):
    page = compared("with=j-2")
    farm.size = [32, 32]
    farm.jobs["j-3"] = job("j-3", size=farm.size)
    page.evaluate("void (location.hash = '#/view/j-1?with=j-3')")

    page.wait("document.querySelector('.field-error')?.innerText.includes('32 × 32')")


REC709 = (.64, .33, .3, .6, .15, .06, .3127, .329)
REC2020 = (.708, .292, .17, .797, .131, .046, .3127, .329)


def exr(width, height, value, primaries=REC709):
    """A picture of one colour as an OpenEXR file with ZIP compression, as the specification lays it out."""
    def attribute(name, kind, body):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(body)) + body
    channels = b"".join(name + b"\0" + struct.pack("<iiii", 1, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    box = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    head = (struct.pack("<ii", 20000630, 2) + attribute("channels", "chlist", channels)
            + attribute("chromaticities", "chromaticities", struct.pack("<8f", *primaries)) + attribute("compression", "compression", b"\3")
            + attribute("dataWindow", "box2i", box) + attribute("displayWindow", "box2i", box) + attribute("lineOrder", "lineOrder", b"\0")
            + attribute("pixelAspectRatio", "float", struct.pack("<f", 1)) + attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
            + attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0")
    chunks = []
    for y in range(0, height, 16):
        rows = min(16, height - y)
        raw = b"".join(struct.pack("<e", v) * width for _ in range(rows) for v in reversed(value))
        split = raw[0::2] + raw[1::2]
        coded = bytes([split[0]] + [(b - a + 128) & 255 for a, b in zip(split, split[1:])])
        packed = zlib.compress(coded)
        chunks.append(struct.pack("<ii", y, len(packed)) + packed)
    at = len(head) + 8 * len(chunks)
    table = b""
    for chunk in chunks:
        table += struct.pack("<Q", at)
        at += len(chunk)
    return head + table + b"".join(chunks)


def test_a_job_is_compared_with_a_file_that_stays_on_this_machine(farm, viewer, tmp_path):
    farm.layers["rgb"] = Layer(["R", "G", "B"], gradient)
    file = tmp_path / "reference.exr"
    file.write_bytes(exr(96, 64, (0.5, 0.25, 2)))
    page = viewer("by=b")

    page.set_files("#reference", [file])

    page.wait(f"{VIEW}.dataset.painted === 'rgb b'")
    assert colour(page, 70, 50) == [SRGB_HALF, 137, 255]
    assert not any(method in ("POST", "PUT") and "session" not in path for method, path in farm.requests)


@pytest.mark.parametrize("broken, words", [(b"\x89PNG", "no OpenEXR file"), (exr(96, 64, (1, 1, 1))[:400], "damaged"), (b"\x76\x2f\x31\x01", "damaged"),
                                           (exr(96, 64, (1, 1, 1), REC2020), "not those of Rec. 709")])
def test_a_file_that_is_no_picture_is_refused_with_words(viewer, tmp_path, broken, words):
    file = tmp_path / "broken.exr"
    file.write_bytes(broken)
    page = viewer()

    page.set_files("#reference", [file])

    page.wait(f"document.querySelector('.toast')?.innerText.includes({json.dumps(words)})")


def test_a_link_opens_the_same_view(compared):
    page = compared("layer=rgb&ev=1.5&curve=linear&over=spp&zoom=3&x=40&y=20&with=j-2&by=difference&region=1%2C2%2C30%2C40")
    page.wait(f"{VIEW}.dataset.painted === 'rgb difference'")
    focus(page)
    press(page, "e")

    assert query(page) == "ev=2&curve=linear&over=spp&zoom=3&x=40&y=20&with=j-2&by=difference&region=1%2C2%2C30%2C40"
    assert page.evaluate(f"{VIEW}.imagePoint([{VIEW}.clientWidth / 2, {VIEW}.clientHeight / 2])") == pytest.approx([40, 20])


@pytest.mark.parametrize("nonsense", ["zoom=NaN&x=-5&ev=1e99&curve=%3Cb%3E&by=x&over=y&region=5,5,1,1", "layer=nothing", "zoom=%", "with="])
def test_a_link_that_makes_no_sense_opens_what_does(viewer, nonsense):
    page = viewer(nonsense)
    assert page.count("float-view b") == 0


def test_a_viewer_of_no_job_says_so(dashboard):
    page = dashboard("#/view/nope")
    page.wait("document.querySelector('main').innerText.includes('There is no job \"nope\".')")


def test_names_of_layers_and_objects_are_shown_as_text(farm, viewer):
    markup = "<img src=x onerror=\"document.title='stolen'\">"
    farm.layers[markup] = Layer(["Y"], lambda x, y: (1,))
    farm.jobs["j-1"] = job(name=markup, size=farm.size)
    page = viewer()
    assert markup in page.text("h1") and page.count("#app img") == 0


@pytest.mark.parametrize("width", [1280, 768, 375])
def test_the_viewer_fits_the_screen_and_every_control_is_reached_by_tab(compared, width):
    page = compared("with=j-2", width=width, height=800, phone=width < 500)
    page.wait("document.querySelector('[name=by]')")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    wanted = page.evaluate("[...document.querySelectorAll('a[href], button, input, select, summary, [tabindex=\"0\"]')].filter(e => !e.disabled && !(e.type === 'radio' && !e.checked)).length")
    seen = set()
    page.evaluate("document.activeElement.blur()")
    for _ in range(wanted):
        page.key("Tab", virtual=9)
        seen.add(page.evaluate("[...document.querySelectorAll('*')].indexOf(document.activeElement)"))
    assert len(seen) == wanted


def frame_region(page):
    focus(page)
    press(page, "z")
    page.key("r")
    page.wait("location.hash.includes('region=')")
    return [int(v) for v in page.evaluate("new URLSearchParams(location.hash.split('?')[1]).get('region')").split(",")]


def test_a_region_is_rendered_first_and_all_alike_again_by_keys(farm, viewer):
    page = viewer()
    assert page.count(".viewer-focus") == 0
    region = frame_region(page)

    page.key("p")
    page.wait("document.querySelector('.viewer-focus')?.innerText.includes('Rendered first')")
    assert farm.jobs["j-1"]["focus"] == region
    assert ", ".join(str(v) for v in region[:2]) in page.text(".viewer-focus")
    page.key("p")
    page.wait("!document.querySelector('.viewer-focus').innerText.includes('Rendered first')")
    assert farm.jobs["j-1"]["focus"] is None


def test_a_region_is_rendered_first_by_the_mouse_and_its_box_is_drawn(farm, viewer):
    page = viewer()
    frame_region(page)
    page.click(".viewer-focus button")
    page.wait("document.querySelector('.viewer-focus').innerText.includes('Rendered first')")
    focus(page)
    page.key("r")  # the region goes, the focus stays
    page.wait("!location.hash.includes('region=')")

    farm.change("j-1", focus=[8, 8, 40, 32])  # by somebody else

    page.wait("document.querySelector('.viewer-focus').innerText.includes('8, 8 to 40, 32')")
    page.wait(f"""(() => {{
      const v = {VIEW}, c = v.querySelector('canvas'), [x0, y0] = v.windowPoint([8, 8]).map(Math.round), [x1] = v.windowPoint([40, 8]).map(Math.round);
      const row = c.getContext('2d').getImageData(x0, y0, x1 - x0, 1).data;
      for (let i = 0; i < row.length; i += 4) if (row[i] === 0x6f && row[i + 1] === 0xd3 && row[i + 2] === 0xff) return true;
      return false;
    }})()""")
    page.click(".viewer-focus button")
    page.wait("!document.querySelector('.viewer-focus')")
    assert farm.jobs["j-1"]["focus"] is None


@pytest.mark.parametrize("method", ("GET", "PATCH"))
def test_a_slow_reply_does_not_undo_what_an_event_said_of_the_region(farm, viewer, method):
    page = viewer()
    region = frame_region(page)
    page.hold_reply(f"url.endsWith('/jobs/j-1') && method === '{method}'")

    if method == "GET":  # the job is fetched when its viewer is opened
        here = page.evaluate("location.hash")
        page.evaluate("void (location.hash = '#/jobs')")
        page.wait("document.querySelector('[data-job]')")
        page.evaluate(f"void (location.hash = {json.dumps(here)})")
        page.wait("window.held && document.querySelector('float-view')")
    else:
        page.click(".viewer-focus button")
        page.wait("window.held")
    assert region != [8, 8, 40, 32]
    farm.change("j-1", focus=[8, 8, 40, 32])
    page.wait("document.querySelector('.viewer-focus').innerText.includes('8, 8 to 40, 32')")
    page.release_reply()

    assert "8, 8 to 40, 32" in page.text(".viewer-focus")


def test_a_job_that_is_over_and_a_reader_have_nothing_to_render_first(farm, viewer):
    farm.role = "read"
    page = viewer()
    frame_region(page)
    page.wait("document.querySelector('.viewer-reading').innerText.includes('Region')")
    assert page.count(".viewer-focus") == 0
    farm.change("j-1", focus=[8, 8, 40, 32])
    page.wait("document.querySelector('.viewer-focus').innerText.includes('8, 8 to 40, 32')")
    assert page.count(".viewer-focus button") == 0
    farm.change("j-1", state="done")
    page.wait("!document.querySelector('.viewer-focus')")


def test_a_denoised_layer_is_a_picture_with_exposure(farm, viewer):
    farm.layers["denoised"] = Layer(["R", "G", "B"], lambda x, y: (0.5, 0.5, 0.5))
    page = viewer("layer=denoised")
    assert colour(page, 10, 10) == [SRGB_HALF] * 3
    assert page.evaluate("document.querySelector('#view-layer').selectedOptions[0].text") == "Denoised"
    assert not page.evaluate("document.getElementById('ev').disabled")
