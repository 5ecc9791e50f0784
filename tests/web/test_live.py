"""The dashboard against a stand-in coordinator: session, events, images, actions, submission."""
import hashlib

import pytest

from stub_farm import TOKEN, job, png, worker

TILE = {"tile": 1, "rect": [32, 0, 64, 32], "rounds": 1, "spp": 4, "workers": ["lab-01"]}


# ---- session ----

def test_asks_for_a_token_and_says_when_it_is_wrong(farm, open_page):
    page = open_page(farm.url)
    page.click("#token")
    page.type("a guess")
    page.key("Enter", virtual=13, text="\r")
    page.wait("document.querySelector('.field-error')?.innerText.includes('not known')")

    page.evaluate("document.getElementById('token').select()")
    page.type(TOKEN)
    page.click("button[type=submit]")

    page.wait("document.querySelector('.link.live')")
    assert page.evaluate("document.getElementById('token')") is None


def test_a_farm_that_fails_after_the_sign_in_says_so(farm, open_page):
    farm.broken.add("jobs")
    page = open_page(farm.url)
    page.wait("document.getElementById('token')")
    page.click("#token")
    page.type(TOKEN)

    page.key("Enter", virtual=13, text="\r")
    page.wait("document.querySelector('.field-error')?.innerText.includes('The store is away.')")

    farm.broken.clear()
    page.evaluate("document.getElementById('token').select()")
    page.type(TOKEN)
    page.click("button[type=submit]")
    page.wait("document.querySelector('.link.live')")


def test_token_in_the_fragment_signs_in_and_leaves_the_address_bar(farm, open_page):
    page = open_page(f"{farm.url}/#token={TOKEN}")

    page.wait("document.querySelector('.link.live')")

    assert TOKEN not in page.evaluate("location.href")
    assert page.evaluate("history.length") == 2  # about:blank and this page: no entry of its own holds the token


def test_signing_out_forgets_what_was_shown(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()
    page.wait("document.querySelector('[data-job]')")

    page.evaluate("[...document.querySelectorAll('header button')].at(-1).click()")

    page.wait("document.getElementById('token')")
    assert page.count(".field-error") == 0
    assert not farm.signed_in and page.count("[data-job]") == 0


def test_a_session_that_ends_leads_back_to_the_sign_in(farm, dashboard):
    page = dashboard()

    farm.signed_in = False
    farm.drop_streams()

    page.wait("document.getElementById('token')")
    assert page.text(".field-error").startswith("Your session has ended")


def test_a_late_answer_to_an_ended_session_leaves_the_reason(farm, dashboard):
    page = dashboard()
    page.hold_reply("method === 'GET' && url.includes('/workers')")
    farm.signed_in = False
    farm.drop_streams()
    page.wait("window.held && document.querySelector('.field-error')?.innerText.startsWith('Your session has ended')")

    page.release_reply()

    assert page.text(".field-error").startswith("Your session has ended")


# ---- jobs ----

def test_jobs_follow_the_event_stream(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()
    assert "25 %" in page.text("[data-job='j-1']")

    farm.change("j-1", progress=0.5, relmse=0.005)
    page.wait("document.querySelector('[data-job=\"j-1\"]').innerText.includes('50 %')")
    farm.jobs["j-2"] = job("j-2", "cloud.xml", "queued")
    farm.emit("job", farm.jobs["j-2"])

    page.wait("document.querySelector('[data-job=\"j-2\"]')?.innerText.includes('cloud.xml')")


def test_what_was_missed_while_the_stream_was_down_is_there_afterwards(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()
    page.wait("document.querySelector('[data-job]')")

    farm.jobs["j-1"] = job(progress=0.9)  # no event says so
    farm.drop_streams()

    page.wait("document.querySelector('[data-job]').innerText.includes('90 %')")
    assert farm.asked("GET", "/api/v1/events") == 2


def test_a_slow_list_does_not_undo_what_an_event_said_meanwhile(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()
    page.wait("document.querySelector('[data-job]')")
    page.hold_reply("url.includes('/jobs?')")

    farm.emit("reset", {"missed_from": 1, "missed_to": 2})
    page.wait("window.held")
    farm.change("j-1", state="done", progress=1)
    page.wait("document.querySelector('[data-job] .pill').innerText === 'done'")
    page.release_reply()

    assert page.text("[data-job] .pill") == "done"


def test_of_two_lists_the_one_asked_for_later_holds(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()
    page.wait("document.querySelector('[data-job]')")
    page.hold_reply("url.includes('/jobs?')")

    farm.emit("reset", {"missed_from": 1, "missed_to": 2})
    page.wait("window.held")
    farm.jobs["j-1"] = job(progress=0.75)
    farm.emit("reset", {"missed_from": 3, "missed_to": 4})
    page.wait("document.querySelector('[data-job]').innerText.includes('75 %')")
    page.release_reply()

    assert "75 %" in page.text("[data-job]")


def test_events_that_are_kept_no_longer_lead_to_fresh_lists(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()
    page.wait("document.querySelector('[data-job]')")

    farm.jobs["j-1"] = job(progress=0.75)
    farm.emit("reset", {"missed_from": 1, "missed_to": 9})

    page.wait("document.querySelector('[data-job]').innerText.includes('75 %')")


def test_cancelling_asks_once_more(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()

    page.click("[aria-label^='Cancel: steam.xml']")
    page.wait("document.querySelector('button.danger')")
    assert farm.jobs["j-1"]["state"] == "running"
    page.click("button.danger")

    page.wait("document.querySelector('[data-job] .pill').innerText === 'cancelled'")
    assert farm.jobs["j-1"]["state"] == "cancelled"


def test_pause_and_resume(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()

    page.click("[aria-label^='Pause: steam.xml']")
    page.wait("document.querySelector('[data-job] .pill').innerText === 'paused'")
    page.click("[aria-label^='Resume: steam.xml']")

    page.wait("document.querySelector('[data-job] .pill').innerText === 'rendering'")


def test_a_slow_reply_to_a_change_does_not_undo_what_an_event_said_meanwhile(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()
    page.wait("document.querySelector('[data-job]')")
    page.hold_reply("url.endsWith('/jobs/j-1') && method === 'GET'")

    page.click("[aria-label^='Pause: steam.xml']")
    page.wait("window.held")
    farm.change("j-1", state="done", progress=1)
    page.wait("document.querySelector('[data-job] .pill').innerText === 'done'")
    page.release_reply()

    assert page.text("[data-job] .pill") == "done"


def test_a_refused_action_says_why(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard()
    page.wait("document.querySelector('[data-job]')")

    page.evaluate("fetch = () => Promise.resolve(new Response(JSON.stringify({title: 'x', detail: 'The job is over already.'}), {status: 409, headers: {'Content-Type': 'application/problem+json'}}))")
    page.click("[aria-label^='Pause: steam.xml']")

    assert "The job is over already." in page.text(".toast")


# ---- one job ----

def test_tiles_in_flight_are_marked_until_they_are_folded_and_the_image_follows(farm, dashboard):
    farm.jobs["j-1"] = job()
    farm.tiles = [TILE]
    farm.workers = {"w-1": worker("w-1", "lab-01"), "w-2": worker("w-2", "lab-02")}
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('[data-tile=\"1\"]') && document.querySelector('.stage live-image').dataset.painted")
    pixel = "[...document.querySelector('.stage live-image canvas').getContext('2d').getImageData(5, 5, 1, 1).data]"
    assert page.evaluate(pixel)[:3] == [200, 120, 40]

    farm.image = png(64, 48, (20, 40, 240))
    # The farm says the same to whoever asks from now on: the page may ask again once its stream is open.
    farm.tiles = [{"tile": 0, "rect": [0, 0, 32, 32], "rounds": 1, "spp": 4, "workers": ["lab-02"]}]
    farm.emit("tile", {"job": "j-1", "tile": 0, "rect": [0, 0, 32, 32], "state": "leased", "spp": 4, "worker": "w-2"})
    farm.emit("tile", {"job": "j-1", "tile": 1, "rect": [32, 0, 64, 32], "state": "folded", "spp": 8, "worker": "w-1"})

    page.wait("document.querySelector('[data-tile=\"0\"]') && !document.querySelector('[data-tile=\"1\"]') && document.querySelector('.flash')")
    page.wait(f"{pixel}[2] === 240")
    assert "lab-02" in page.text(".flight")


def test_the_image_is_not_asked_for_with_every_tile(farm, dashboard):
    """At most one request in 0.4 s (live_image.js), however many tiles come."""
    farm.jobs["j-1"] = job()
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.stage live-image').dataset.painted")
    before = farm.asked("GET", "/api/v1/jobs/j-1/image.png")
    began = page.evaluate("performance.now()")

    for tile in range(40):
        farm.emit("tile", {"job": "j-1", "tile": tile, "rect": [0, 0, 32, 32], "state": "folded", "spp": 8, "worker": "lab-01"})
        page.wait(f"document.querySelectorAll('.flash').length > {tile}")

    page.wait("Number(document.querySelector('.stage live-image').dataset.painted) >= 2")
    elapsed_s = (page.evaluate("performance.now()") - began) / 1000
    assert 1 <= farm.asked("GET", "/api/v1/jobs/j-1/image.png") - before <= 2 + elapsed_s / 0.4


def test_the_error_plot_grows_with_the_report(farm, dashboard):
    farm.jobs["j-1"] = job(target_error=0.001)
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.plot-empty')")

    farm.report = {"convergence": [{"seconds": s, "core_seconds": s, "spp": s, "rmse": 0.1, "relmse": 0.1 / s, "relmse_ci95": [0.09 / s, 0.11 / s]} for s in (1, 2, 4, 8)], "slope": -1.004, "slope_ci95": [-1.2, -0.8]}
    farm.change("j-1", progress=0.5)

    page.wait("document.querySelectorAll('.plot-point').length === 4")
    assert "slope −1.00 (−1.20 to −0.80)" in page.text(".plot-verdict")


def test_a_job_that_is_not_there_says_so(farm, dashboard):
    page = dashboard("#/jobs/nope")

    page.wait("document.querySelector('main').innerText.includes('There is no job \"nope\".')")


# ---- workers ----

def test_workers_come_and_go(farm, dashboard):
    farm.workers["w-1"] = worker()
    page = dashboard("#/workers")
    assert "lab-01" in page.text("[data-worker='w-1']")

    farm.emit("worker", worker("w-2", "lab-02", activity="fetching cloud.vdb"))
    page.wait("document.querySelector('[data-worker=\"w-2\"]')?.innerText.includes('fetching cloud.vdb')")
    farm.emit("worker", {"id": "w-1", "state": "gone"})

    page.wait("!document.querySelector('[data-worker=\"w-1\"]')")


@pytest.mark.parametrize("fake", (True, False))
def test_fake_workers_and_what_they_make_say_so(farm, dashboard, fake):
    farm.workers["w-1"], farm.jobs["j-1"] = worker(fake=fake), job(fake=fake)
    page = dashboard("#/workers")
    page.wait("document.querySelector('[data-worker]')")
    assert ("fake" in page.text("[data-worker='w-1']")) == fake

    page.evaluate("void (location.hash = '#/jobs/j-1')")
    page.wait("document.querySelector('article.job .figures, article.job .facts')")
    assert ("no picture of the scene" in page.text("article.job")) == fake


# ---- submission ----

SCENE = """<scene version="3.0.0">
  <include filename="parts/lamp.xml"/>
  <shape type="obj"><string name="filename" value="meshes/tub.obj"/></shape>
</scene>"""
LAMP = """<scene version="3.0.0"><shape type="ply"><string name="filename" value="bulb.ply"/></shape></scene>"""


@pytest.fixture
def scene_files(tmp_path):
    files = {"bath.xml": SCENE, "lamp.xml": LAMP, "tub.obj": "v 0 0 0\n" * 100, "bulb.ply": "ply", "holiday.txt": "private"}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    return [tmp_path / name for name in files]


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_submits_a_scene_with_the_files_it_names_and_no_others(farm, dashboard, scene_files):
    known = digest(scene_files[2])
    farm.blobs[known] = b""  # the farm has the mesh already
    page = dashboard("#/submit")
    page.wait("document.getElementById('files')")

    page.set_files("#files", scene_files)
    assert "holiday.txt not named by the scene" in page.text(".files").replace("\n", " ")
    page.click("#set-spp")
    page.type("32")
    page.click(".settings button")

    page.wait("location.hash === '#/jobs/j-new'")
    request = farm.submitted[0]
    assert request == {
        "name": "bath.xml", "scene": digest(scene_files[0]), "spec": {"spp": 32},
        "assets": {"meshes/tub.obj": known, "parts/lamp.xml": digest(scene_files[1]), "bulb.ply": digest(scene_files[3])}}
    assert farm.asked("PUT", f"/api/v1/blobs/{known}") == 0
    assert farm.asked("PUT", f"/api/v1/blobs/{digest(scene_files[4])}") == 0


def test_files_can_be_dropped(farm, dashboard):
    page = dashboard("#/submit")
    page.wait("document.querySelector('.drop')")

    page.evaluate("""void (() => {
      const transfer = new DataTransfer();
      transfer.items.add(new File(["<scene version='3.0.0'/>"], "drop.xml"));
      document.querySelector(".drop").dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
    })()""")

    assert page.text(".bundle h2") == "drop.xml"


def test_files_dropped_while_a_job_is_sent_change_nothing(farm, dashboard, scene_files):
    page = dashboard("#/submit")
    page.wait("document.getElementById('files')")
    page.set_files("#files", scene_files)
    farm.put_gate.clear()
    page.click(".settings button")
    page.wait("document.querySelector('.sending')?.innerText.includes('Sending')")

    page.evaluate("""void (() => {
      const transfer = new DataTransfer();
      transfer.items.add(new File(["<scene version='3.0.0'/>"], "aaa.xml"));
      document.querySelector(".drop").dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
    })()""")
    page.evaluate("new Promise((resolve) => setTimeout(() => requestAnimationFrame(resolve)))")  # the drop has been seen
    still_sending = page.evaluate("document.querySelector('.settings button').disabled && document.querySelector('.sending') !== null")
    listed = page.text(".bundle")
    farm.put_gate.set()

    page.wait("location.hash === '#/jobs/j-new'")
    assert still_sending and "aaa.xml" not in listed
    assert len(farm.submitted) == 1


def test_a_missing_file_is_named_before_anything_is_sent(farm, dashboard, scene_files):
    page = dashboard("#/submit")
    page.wait("document.getElementById('files')")

    page.set_files("#files", [scene_files[0], scene_files[1], scene_files[3]])

    page.wait("document.querySelector('.missing')?.innerText.includes('meshes/tub.obj')")
    assert page.evaluate("document.querySelector('.settings button').disabled")
    page.set_files("#files", [scene_files[2]])
    page.wait("!document.querySelector('.missing') && !document.querySelector('.settings button').disabled")


def test_a_refused_scene_shows_where_and_why_with_a_caret(farm, dashboard, scene_files):
    farm.refusal = {"type": "about:blank", "title": "bad scene", "status": 400, "detail": "1 error", "diagnostics": [
        {"severity": "error", "file": "bath.xml", "line": 3, "column": 10, "text": "unknown <shape> 'obi'", "source_line": "  <shape type=\"obi\"/>", "length": 10}]}
    page = dashboard("#/submit")
    page.wait("document.getElementById('files')")
    page.set_files("#files", scene_files)
    page.click(".settings button")

    assert "bath.xml:3:10 error unknown <shape> 'obi'" in page.text(".diagnostics p")
    pre = page.evaluate("document.querySelector('.diagnostics pre').textContent").split("\n")
    assert pre[1] == " " * 9 + "^~~~~~~~~~"

    page.click(".settings button")
    page.wait("location.hash === '#/jobs/j-new'")


def test_settings_that_make_no_sense_are_refused_here(farm, dashboard, scene_files):
    page = dashboard("#/submit")
    page.wait("document.getElementById('files')")
    page.set_files("#files", scene_files)
    page.wait("document.querySelector('.settings button:not([disabled])')")
    page.click("#set-spp")
    page.type("many")
    page.click(".settings button")

    assert "Samples per pixel must be a positive whole number, not “many”." in page.text(".notice")
    assert farm.submitted == []
