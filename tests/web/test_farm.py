"""The dashboard on a real farm: coordinator and fake workers as processes, Chromium in front."""
import json
import struct
import urllib.parse

import pytest
from local_farm import SCENE, LocalFarm

QUAD = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n"
WITH_MESH = SCENE.replace('<shape type="sphere">', '<shape type="obj"><string name="filename" value="meshes/quad.obj"/>')
SLOW = ("--fake-delay", 150)  # milliseconds a unit: long enough to be seen in flight


@pytest.fixture
def real_farm(tmp_path, programs):
    folder = tmp_path / "farm"
    folder.mkdir()
    stand_in = programs.parent / "fake_oidn" / "blurs.so"  # for Open Image Denoise
    with LocalFarm(folder, programs, environment={"LIGHTSHAFT_OIDN": str(stand_in)}) as farm:
        yield farm


@pytest.fixture
def page(real_farm, open_page):
    """Signed in as a person does it: with the token from the data folder."""
    page = open_page(f"http://127.0.0.1:{real_farm.http}/")
    page.click("#token")
    page.type(real_farm.token)
    page.key("Enter", virtual=13, text="\r")
    page.wait("document.querySelector('.link.live')")
    return page


def submit_files(page, tmp_path, files):
    paths = []
    for name, text in files.items():
        (tmp_path / name).write_text(text)
        paths.append(tmp_path / name)
    page.evaluate("void (location.hash = '#/submit')")
    page.wait("document.getElementById('files')")
    page.set_files("#files", paths)


def test_from_dropped_files_to_a_finished_image(real_farm, page, tmp_path):
    real_farm.add_workers(2, *SLOW)
    real_farm.wait_for_workers(2)
    submit_files(page, tmp_path, {"bath.xml": WITH_MESH, "quad.obj": QUAD})
    # The list of files pushes the form down once it is there, and "Start over" to where the form was.
    page.wait("document.querySelector('.settings button:not([disabled])')")
    page.click("#set-spp")
    page.type("64")
    page.click(".settings button")

    page.wait("document.querySelector('.job h1')?.innerText === 'bath.xml'")
    page.wait("document.querySelector('.mark-tile')")
    page.wait("document.querySelector('.flash')")
    page.wait("document.querySelector('.stage live-image').dataset.painted")
    page.wait("document.querySelector('.job .pill').innerText === 'done'")

    page.wait("document.querySelectorAll('.plot-point').length >= 3")
    assert "64 of 64" in page.text(".figures")
    assert page.count(".mark-tile") == 0
    assert page.wait("""(() => {
      const canvas = document.querySelector('.stage live-image canvas');
      const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
      return canvas.width === 96 && canvas.height === 64 && new Set(data).size > 16;
    })()""")


def test_downloads_are_what_the_coordinator_gives(real_farm, page):
    real_farm.add_worker()
    job = real_farm.submit(SCENE, spp=4)
    real_farm.wait_for_job(job)
    page.evaluate(f"void (location.hash = '#/jobs/{job}')")
    page.wait("document.querySelector('.downloads a')")

    sizes = page.evaluate("""Promise.all([...document.querySelectorAll('.downloads a')].map(async (link) => {
      const response = await fetch(link.href);
      const bytes = new Uint8Array(await response.arrayBuffer());
      return [link.download.split('.').pop(), response.status, bytes.length, [...bytes.slice(0, 4)]];
    }))""")

    assert [kind for kind, *_ in sizes] == ["exr", "png", "", "json", "csv", "log"], "the page is opened, not saved"
    assert all(status == 200 and size > 0 for _, status, size, _ in sizes), sizes
    assert sizes[0][3] == [0x76, 0x2F, 0x31, 0x01]  # OpenEXR's magic number


def test_cancel_and_pause_reach_the_farm(real_farm, page):
    real_farm.add_worker(*SLOW)
    job = real_farm.submit(SCENE, spp=4096, name="long.xml")
    page.wait("document.querySelector('[data-job] .pill')?.innerText === 'rendering'")

    page.click("[aria-label^='Pause: long.xml']")
    page.wait("document.querySelector('[data-job] .pill').innerText === 'paused'")
    assert real_farm.job(job)["state"] == "paused"
    page.click("[aria-label^='Resume: long.xml']")
    page.wait("document.querySelector('[data-job] .pill').innerText === 'rendering'")
    page.click("[aria-label^='Cancel: long.xml']")
    page.click("button.danger")

    page.wait("document.querySelector('[data-job] .pill').innerText === 'cancelled'")
    assert real_farm.job(job)["state"] == "cancelled"


def test_workers_are_listed_with_what_they_do_and_leave_when_they_die(real_farm, page):
    first, second = real_farm.add_workers(2, *SLOW)
    real_farm.wait_for_workers(2)
    real_farm.submit(SCENE, spp=4096, name="long.xml")
    page.evaluate("void (location.hash = '#/workers')")

    page.wait("document.querySelectorAll('[data-worker].is-connected').length === 2")
    page.wait("[...document.querySelectorAll('.doing')].every(doing => doing.innerText.includes('long.xml'))")
    second.kill()

    page.wait("document.querySelectorAll('[data-worker].is-connected').length === 1")


def test_a_broken_scene_is_shown_with_its_place(real_farm, page, tmp_path):
    submit_files(page, tmp_path, {"bath.xml": SCENE.replace('name="fov"', 'name="fow"')})
    page.click(".settings button")

    text = page.text(".diagnostics")

    line = 1 + SCENE.split('name="fov"')[0].count("\n")
    assert f"bath.xml:{line}:" in text and "fow" in text and "^~" in text


def test_a_restarted_coordinator_is_found_again(real_farm, page):
    job = real_farm.submit(SCENE, spp=4, name="patient.xml")
    page.wait("document.querySelector('[data-job]')")

    real_farm.restart_coordinator()
    page.wait("document.querySelector('.link.live')")
    real_farm.add_worker()

    page.wait("document.querySelector('[data-job] .pill').innerText === 'done'")
    assert real_farm.job(job)["state"] == "done"


def test_names_from_outside_are_shown_as_text(real_farm, page):
    markup = "<img src=x onerror=document.title='stolen'>"
    real_farm.add_worker("--tags", markup)
    real_farm.wait_for_workers(1)
    real_farm.submit(SCENE, spp=2, name=urllib.parse.quote(markup))

    page.wait(f"document.querySelector('[data-job] a')?.innerText === {json.dumps(markup)}")
    page.evaluate("void (location.hash = '#/workers')")
    page.wait(f"document.querySelector('.tag')?.innerText === {json.dumps(markup)}")

    assert page.count("main img") == 0 and "stolen" not in page.evaluate("document.title")


def test_a_job_that_somebody_removes_leaves_the_page(real_farm, page):
    real_farm.add_worker()
    job = real_farm.submit(SCENE, spp=2)
    real_farm.wait_for_job(job)
    page.wait("document.querySelector('[data-job] .pill')?.innerText === 'done'")

    real_farm.request("DELETE", f"/api/v1/jobs/{job}")

    page.wait("!document.querySelector('[data-job]')")


def test_the_maps_come_from_the_farm(real_farm, page):
    real_farm.add_worker()
    job = real_farm.submit(SCENE, spp=16)
    real_farm.wait_for_job(job)
    page.evaluate(f"void (location.hash = '#/jobs/{job}')")
    page.wait("document.querySelector('.stage live-image')?.dataset.painted")
    colours = """(() => {
      const canvas = document.querySelector('.stage live-image canvas');
      const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
      return [canvas.width, new Set(Array.from({ length: data.length / 4 }, (_, i) => data.slice(4 * i, 4 * i + 3).join())).size];
    })()"""

    found = {}
    for kind in ("error", "samples"):
        painted = int(page.evaluate("document.querySelector('.stage live-image').dataset.painted"))
        page.click(f".image-tools [value={kind}]")
        page.wait(f"Number(document.querySelector('.stage live-image').dataset.painted) > {painted}")
        found[kind] = page.evaluate(colours)

    assert found["error"][0] == 96 and found["error"][1] > 16, "noise differs from pixel to pixel"
    assert found["samples"] == [96, 1], "every pixel has 16 samples"


def test_the_denoised_picture_is_offered_where_there_is_one(real_farm, page):
    real_farm.add_worker()
    jobs = {asked: real_farm.submit(SCENE, spp=16, denoise=asked) for asked in ("true", "false")}
    for job in jobs.values():
        real_farm.wait_for_job(job)
    picture = "document.querySelector('.stage live-image canvas').toDataURL()"
    page.evaluate(f"void (location.hash = '#/jobs/{jobs['true']}')")
    page.wait("document.querySelector('.stage live-image')?.dataset.painted")
    assert page.evaluate("document.querySelector('.image-tools [value=denoised]').checked"), "of a job that is done it is what is shown first"
    denoised = page.evaluate(picture)

    page.click(".image-tools [value=picture]")
    page.wait(f"{picture} !== {json.dumps(denoised)}")
    assert page.evaluate("document.querySelector('.image-tools input[type=range]') !== null"), "with its exposure"

    page.evaluate(f"void (location.hash = '#/jobs/{jobs['false']}')")
    page.wait("document.querySelector('.image-tools') && !document.querySelector('.image-tools [value=denoised]')")


@pytest.mark.parametrize("width", [1280, 768, 375])
def test_the_report_page_stands_alone(real_farm, page, width):
    """Its own policy is in force: a style or picture that it forbids would be a complaint, and so would any address."""
    markup = "<img src=x onerror=document.title='stolen'>"
    real_farm.add_worker()
    job = real_farm.submit(SCENE, spp=64, name=urllib.parse.quote(markup))
    real_farm.wait_for_job(job)
    page.call("Emulation.setDeviceMetricsOverride", {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": width < 500})

    page.go(f"http://127.0.0.1:{real_farm.http}/api/v1/jobs/{job}/report.html")

    assert page.text("h1") == markup and page.evaluate("document.title") == f"{markup} · Lightshaft report"
    assert page.evaluate("[...document.images].map(image => image.naturalWidth)") == [96, 96, 96], "the image and both maps"
    assert page.evaluate("[...document.images].every(image => image.alt)")
    assert page.count("svg.plot polyline") == 2 and page.count("script") == 0
    assert page.evaluate("getComputedStyle(document.body).marginTop") == "0px", "the style is in force"
    assert page.evaluate("performance.getEntriesByType('resource').filter(entry => !entry.name.startsWith('data:')).length") == 0
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.click("details summary")
    assert page.wait("document.querySelectorAll('details tbody tr').length") >= 3


def test_a_sequence_shows_its_frames_and_each_ones_image(real_farm, page):
    job = real_farm.submit(SCENE, spp=16, frames="5-8", name="turn.xml")
    page.wait("document.querySelector('[data-job]')?.innerText.includes('0 of 4 frames')")
    page.evaluate(f"void (location.hash = '#/jobs/{job}')")
    page.wait("document.querySelectorAll('.frame').length === 4")
    assert page.text(".frame[aria-current]") == "5"

    real_farm.add_workers(2, *SLOW)

    page.wait("document.querySelector('.stage live-image')?.dataset.painted")
    page.wait("document.querySelectorAll('.frame.is-done').length === 4")
    page.wait("document.querySelector('.job .pill').innerText === 'done'")
    page.click("[data-frame='6']")
    page.wait("document.querySelector('.frame[aria-current]').dataset.frame === '6'")
    page.wait("""(() => {
      const canvas = document.querySelector('.stage live-image canvas');
      const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
      return canvas.width === 96 && new Set(data).size > 16;
    })()""")
    page.wait("document.querySelectorAll('.plot-point').length >= 3")
    assert "16 of 16" in page.text(".figures")


def test_the_viewer_reads_the_pixels_of_the_image_file(real_farm, page):
    """While the job is in memory, and once it is on the disk only."""
    real_farm.add_worker()
    job = real_farm.submit(SCENE, spp=16, aov="depth,shape_id")
    real_farm.wait_for_job(job)
    red, green, blue = struct.unpack("<3e", real_farm.request("GET", f"/api/v1/jobs/{job}/pixels?rect=48,32,49,33"))
    for _ in range(2):
        page.evaluate(f"void (location.hash = '#/view/{job}?zoom=1&x=48&y=32')")
        page.wait("document.querySelector('float-view')?.dataset.painted === 'rgb a'")
        page.evaluate("document.querySelector('float-view').focus()")
        page.call("Input.dispatchKeyEvent", {"type": "keyDown", "key": "ArrowRight", "code": "ArrowRight", "modifiers": 8})
        page.call("Input.dispatchKeyEvent", {"type": "keyDown", "key": "ArrowLeft", "code": "ArrowLeft", "modifiers": 8})
        page.wait("document.querySelector('.viewer-reading').innerText.startsWith('Pixel 48, 32') && document.querySelectorAll('.viewer-value b').length === 3")
        shown = page.evaluate("[...document.querySelectorAll('.viewer-value b')].map(b => Number(b.innerText.replace(' × 10', 'e').replace('⁻', '-')))")
        assert shown == pytest.approx([red, green, blue], rel=1e-3), "four digits are shown"
        assert page.evaluate("[...document.getElementById('view-layer').options].map(o => o.value)") == ["rgb", "stderr", "error", "spp", "depth", "crypto_object"]
        page.evaluate("void (location.hash = '#/jobs')")
        page.wait("document.querySelector('[data-job] live-image')?.dataset.painted")
        real_farm.restart_coordinator()
        page.wait("document.querySelector('.link.live')")
