"""Making a job on the page: what kinds of scene it takes, drops anywhere, frames of numbered files, settings, reasons."""
import hashlib
import io
import json
import struct
import zipfile

import pytest

from stub_farm import job

SMOKE = '<scene version="3.0.0"><medium type="heterogeneous"><string name="filename" value="smoke.####.vdb"/></medium></scene>'


def fill(page, selector, text):
    page.evaluate(f"(() => {{ const e = document.querySelector({json.dumps(selector)}); e.value = {json.dumps(text)}; e.dispatchEvent(new Event('input')); }})()")


def drop(page, names, at):
    """Drops files of these names and texts on an element; whether the page took them from the browser."""
    return page.evaluate(f"""(() => {{
      const transfer = new DataTransfer();
      for (const [name, text] of Object.entries({json.dumps(names)})) transfer.items.add(new File([text], name));
      const target = document.querySelector({json.dumps(at)});
      const over = new DragEvent("dragover", {{ dataTransfer: transfer, bubbles: true, cancelable: true }});
      const drop = new DragEvent("drop", {{ dataTransfer: transfer, bubbles: true, cancelable: true }});
      target.dispatchEvent(over);
      target.dispatchEvent(drop);
      return over.defaultPrevented && drop.defaultPrevented;
    }})()""")


def drop_from_the_desktop(page, path, at):
    """As a browser gets it of a file manager: with folders, which a script cannot make."""
    x, y = page.wait(f"(() => {{ const b = document.querySelector({json.dumps(at)}).getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; }})()")
    for kind in ("dragEnter", "dragOver", "drop"):
        page.call("Input.dispatchDragEvent", {"type": kind, "x": x, "y": y, "data": {"items": [], "files": [str(path)], "dragOperationsMask": 1}})


def test_a_dropped_folder_is_walked_and_sent_with_what_its_scene_names(farm, dashboard, tmp_path):
    meshes = tmp_path / "shot" / "meshes"
    meshes.mkdir(parents=True)
    (meshes / "ball.obj").write_text("v 0 0 0\n")
    for n in range(120):  # a browser lists 100 files of a folder at a time
        (meshes / f"old{n}.obj").touch()
    (tmp_path / "shot" / "scene.xml").write_text('<scene version="3.0.0"><shape type="obj"><string name="filename" value="meshes/ball.obj"/></shape></scene>')
    page = dashboard()
    page.wait("document.querySelector('main h1')")

    drop_from_the_desktop(page, tmp_path / "shot", "main h1")

    page.wait("location.hash === '#/submit' && document.querySelector('.bundle h2')?.innerText === 'scene.xml'")
    page.wait("document.querySelector('.bundle').innerText.includes('meshes/ball.obj')")
    assert "old119.obj" in page.evaluate("document.querySelector('.bundle').textContent")
    page.click("form.settings button.primary")
    page.wait("location.hash === '#/jobs/j-new'")
    (sent,) = farm.submitted
    assert list(sent["assets"]) == ["meshes/ball.obj"] and farm.blobs[sent["assets"]["meshes/ball.obj"]] == b"v 0 0 0\n"


@pytest.mark.parametrize("route, at", [("#/jobs", "header"), ("#/jobs/j-1", "h1"), ("#/workers", "main"), ("#/submit", "header"), ("#/view/j-1", "float-view")])
def test_files_dropped_anywhere_make_a_job(farm, dashboard, route, at):
    farm.jobs["j-1"] = job(size=farm.size)
    page = dashboard(route)
    page.wait(f"document.querySelector('main {at}, {at}')")

    assert drop(page, {"drop.xml": "<scene version='3.0.0'/>"}, at)

    page.wait("location.hash === '#/submit'")
    page.wait("document.querySelector('.bundle h2')?.innerText === 'drop.xml'")


def test_a_drop_on_the_sign_in_page_does_not_leave_it(farm, open_page):
    page = open_page(farm.url)
    page.wait("document.querySelector('.signin')")
    assert drop(page, {"drop.xml": "<scene/>"}, "h1")


def test_who_may_only_look_is_told_so_by_a_drop(farm, dashboard):
    farm.role = "read"
    page = dashboard()
    drop(page, {"drop.xml": "<scene/>"}, "main")
    page.wait("document.querySelector('.toast')?.innerText.includes('Your token lets you look')")


def test_a_picture_dropped_on_the_viewer_is_compared(farm, dashboard):
    farm.jobs["j-1"] = job(size=farm.size)
    page = dashboard("#/view/j-1")
    page.wait("document.querySelector('float-view') && document.body.innerText.includes('relMSE 0.0100')")  # it is open
    drop(page, {"other.exr": "no picture"}, "float-view")
    page.wait("document.querySelector('.toast')?.innerText.includes('other.exr')")


def choose(page, folder, files):
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    page.wait("document.getElementById('files')")
    page.set_files("#files", [folder / name for name in files])


def test_frames_are_prefilled_from_the_numbered_files_and_files_are_sorted(farm, dashboard, tmp_path):
    page = dashboard("#/submit")
    choose(page, tmp_path, {"smoke.xml": SMOKE, **{f"smoke.{n:04}.vdb": "v" for n in (10, 2, 1, 3, 4, 5, 6, 7, 8, 9)}})

    page.wait("document.getElementById('set-frames')?.value === '1-10'")
    names = page.evaluate("[...document.querySelectorAll('.files li:not(.missing) code')].map(e => e.innerText)")
    assert names == [f"smoke.{n:04}.vdb" for n in range(1, 11)]
    page.click(".settings button[type=submit]")
    page.wait("location.hash === '#/jobs/j-new'")
    assert farm.submitted[0]["spec"] == {"frames": "1-10"}


@pytest.mark.parametrize("numbers, text", [([], ""), ([7], "7"), ([3, 1, 2], "1-3"), ([1, 3, 5], "1-5x2"), ([1, 2, 4], "1-4"), ([0, 10, 25], "0-25")])
def test_numbers_of_frames_become_a_range(open_page, farm, numbers, text):
    page = open_page(f"{farm.url}/demo.html")
    assert page.evaluate(f"import('/js/bundle.js').then(({{ framesOf }}) => framesOf({numbers}))") == text


def test_what_is_missing_comes_first_and_beside_the_button(farm, dashboard, tmp_path):
    page = dashboard("#/submit")
    shapes = "".join(f'<shape type="obj"><string name="filename" value="{name}.obj"/></shape>' for name in "abz")
    choose(page, tmp_path, {"s.xml": f'<scene version="3.0.0">{shapes}</scene>', "a.obj": "v", "b.obj": "v"})

    page.wait("document.querySelector('.files li:first-child.missing code')?.innerText === 'z.obj'")
    assert page.text("#why-not") == "1 file is missing: add it."
    assert page.evaluate("document.querySelector('.go button').disabled")


def test_all_settings_of_the_form_reach_the_farm(farm, dashboard, tmp_path):
    page = dashboard("#/submit")
    choose(page, tmp_path, {"s.xml": '<scene version="3.0.0"/>'})
    page.wait("document.querySelector('.go button:not([disabled])')")
    page.click("#set-denoise")
    page.click(".more-settings summary")
    for name, text in {"name": "Chapel v003", "aov": "depth, normal", "seed": "7", "priority": "-3", "tags": "gpu big"}.items():
        fill(page, f"#set-{name}", text)
    page.click(".go button")

    page.wait("location.hash === '#/jobs/j-new'")
    request = farm.submitted[0]
    assert request["name"] == "Chapel v003.xml", "the ending tells the kind of the scene"
    assert request["spec"] == {"denoise": True, "aov": ["depth", "normal"], "tags": ["gpu", "big"], "seed": 7, "priority": -3}


def test_an_archive_is_sent_as_it_is(farm, dashboard, tmp_path):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("s.xml", '<scene version="3.0.0"/>')
    page = dashboard("#/submit")
    choose(page, tmp_path, {"shot.zip": packed.getvalue()})
    page.wait("document.querySelector('.go button:not([disabled])')")
    fill(page, "#set-spp", "32")
    fill(page, "#set-width", "64")
    fill(page, "#set-height", "48")
    fill(page, "#set-name", "Chapel v003")
    page.click(".go button")

    page.wait("location.hash === '#/jobs/j-new'")
    assert farm.submitted == [("application/zip", {"name": "Chapel v003", "spp": "32", "size": "64x48"}, hashlib.sha256(packed.getvalue()).hexdigest())]


def glb(described):
    text = json.dumps(described).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


@pytest.mark.parametrize("name, pack", [("ship.gltf", lambda described: json.dumps(described).encode()), ("ship.glb", glb)])
def test_a_gltf_takes_the_files_that_it_names(farm, dashboard, tmp_path, name, pack):
    described = {"buffers": [{"uri": "ship%20hull.bin"}, {"uri": "data:x;base64,AA=="}], "images": [{"uri": "sail.png"}, {"bufferView": 1}]}
    page = dashboard("#/submit")
    choose(page, tmp_path, {name: pack(described), "ship hull.bin": "b", "diary.txt": "private"})

    page.wait("document.querySelector('.files .missing code')?.innerText === 'sail.png'")
    choose(page, tmp_path, {"sail.png": "p"})
    page.wait("document.querySelector('.go button:not([disabled])')")
    page.click(".go button")
    page.wait("location.hash === '#/jobs/j-new'")
    assert farm.submitted[0]["name"] == name and sorted(farm.submitted[0]["assets"]) == ["sail.png", "ship hull.bin"]


ALL_SENT = "This page can't tell which of these files the scene names, so all of them are sent."


@pytest.mark.parametrize("name, text, all_sent", [
    ("s.pbrt", "WorldBegin", True), ("s.usda", "#usda 1.0", True), ("s.usdz", "PK", True), ("s.gltf", "no JSON", True), ("s.xml", SMOKE.replace("smoke", "$what"), True), ("s.gltf", "{}", False), ("s.xml", "<scene version='3.0.0'/>", False)])
def test_where_all_dropped_files_are_sent_the_page_says_so(farm, dashboard, tmp_path, name, text, all_sent):
    page = dashboard("#/submit")
    page.wait("document.querySelector('.drop .help')?.innerText.includes('beside a .pbrt or a stage of USD all of them')")
    choose(page, tmp_path, {name: text, "diary.txt": "private"})
    page.wait("document.querySelector('.go button:not([disabled])')")

    assert (ALL_SENT in page.text(".bundle")) == all_sent
    assert ("stays here" in page.text(".files")) != all_sent
    page.click(".go button")
    page.wait("location.hash === '#/jobs/j-new'")
    assert list(farm.submitted[0]["assets"]) == (["diary.txt"] if all_sent else [])


def test_a_scene_alone_says_nothing_of_other_files(farm, dashboard, tmp_path):
    page = dashboard("#/submit")
    choose(page, tmp_path, {"s.pbrt": "WorldBegin"})
    page.wait("document.querySelector('.go button:not([disabled])')")
    assert ALL_SENT not in page.text(".bundle")


def test_files_without_a_scene_say_what_to_add(farm, dashboard, tmp_path):
    page = dashboard("#/submit")
    choose(page, tmp_path, {"a.png": "p"})
    assert "There is no scene among these files." in page.text(".bundle .field-error")
    assert page.text("#why-not") == "A scene is missing."


def test_a_file_that_the_coordinator_misses_is_asked_for_in_plain_words(farm, dashboard, tmp_path):
    farm.refusal = {"title": "bad scene", "status": 400, "detail": 'frame 7: "smoke.0007.vdb" was not sent along: name it among the assets, with its SHA-256; named were "smoke.0001.vdb"'}
    page = dashboard("#/submit")
    choose(page, tmp_path, {"s.xml": '<scene version="3.0.0"/>'})
    page.wait("document.querySelector('.go button:not([disabled])')")
    page.click(".go button")
    assert page.text(".notice pre") == 'frame 7: "smoke.0007.vdb" is missing: add this file'
