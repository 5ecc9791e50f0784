"""What the page of a job says first and offers next: the best picture, rendering on, the cause of a failure."""
import json

import pytest

from local_farm import wait_until
from stub_farm import attempt, failure, job, png

HEAVY = {"kind": "heavy_tail", "words": "don't trust yet: few pixels carry the error", "trusted": False}
PIXEL = "(() => { const c = document.querySelector('.stage live-image canvas'); return [...c.getContext('2d').getImageData(3, 3, 1, 1).data.slice(0, 3)]; })()"


def button(page, name):
    """Presses the button of this name in the page's content."""
    page.wait(f"[...document.querySelectorAll('main button')].some(b => b.innerText === {json.dumps(name)})")
    page.evaluate(f"[...document.querySelectorAll('main button')].find(b => b.innerText === {json.dumps(name)}).click()")


def test_a_finished_denoised_job_opens_on_the_denoised_picture_with_its_error(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", denoise=True, progress=1)
    farm.denoised = png(64, 48, (10, 220, 10))
    farm.report = {"convergence": [], "denoised": {"by": "OIDN", "relmse": 0.00175, "relmse_ci95": [0.00117, 0.00234]}}
    page = dashboard("#/jobs/j-1")

    page.wait(f"JSON.stringify({PIXEL}) === '[10,220,10]'")

    assert page.evaluate("document.querySelector('.image-tools [value=denoised]').checked")
    page.wait("document.querySelector('.figures').innerText.includes('0.00117')")
    assert "relMSE, denoised 0.00175 95 %: 0.00117 – 0.00234" in page.text(".figures")
    assert "layer=denoised" in page.evaluate("[...document.querySelectorAll('.downloads a')].find(a => a.innerText.startsWith('PNG')).href")
    page.click(".image-tools [value=picture]")
    page.wait(f"JSON.stringify({PIXEL}) === '[200,120,40]'")


def test_where_denoising_failed_the_picture_is_shown_and_the_reason(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", denoise=True)
    farm.report = {"convergence": [], "denoised": {"error": "the denoiser ran out of memory"}}
    page = dashboard("#/jobs/j-1")

    page.wait("document.querySelector('.figures')?.innerText.includes('ran out of memory')")
    page.wait("document.querySelector('.image-tools [value=picture]').checked")


@pytest.mark.parametrize("fields, label, changes", [
    ({"spp_asked": 64}, "Render on (256 samples)", {"spp": 256}),
    ({"spp_asked": 16, "spp": 16, "spp_done": 16}, "Render on (64 samples)", {"spp": 64}),
    ({"spp_asked": 4, "spp": 4, "spp_done": 4}, "Render on (64 samples)", {"spp": 64}),
    ({"spp_asked": None, "spp": 65536, "spp_done": 36.4, "stopped": "time"}, "Render on (148 samples)", {"spp": 148}),
    ({"spp_asked": None, "spp": 65536, "target_error": 0.001, "stopped": "error"}, "Render on (to relMSE 0.0005)", {"target_error": 0.0005})])
def test_a_noisy_job_says_so_plainly_and_renders_on(farm, dashboard, fields, label, changes):
    farm.jobs["j-1"] = job(**{"state": "done", "spp": 64, "spp_done": 64, "verdict": HEAVY, **fields})
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.noisy b')")
    assert page.text(".noisy b") == "Still noisy: a few bright pixels carry the error"

    button(page, label)

    wait_until(lambda: farm.changes, "the farm is asked")
    assert farm.changes == [("j-1", changes)]


def test_the_coordinators_own_advice_comes_before_the_pages(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", verdict={**HEAVY, "advice": "render it with four times the samples."})
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.noisy')?.innerText.includes('. Render it with four times the samples')")


def test_a_job_that_waits_for_others_says_for_which(farm, dashboard):
    why = "It waits for j-7, which is rendering."
    farm.jobs["j-1"] = job(state="queued", units_done=0, waits_for=why, after=[{"id": "j-7", "state": "running"}, {"id": "j-8", "state": None}])
    page = dashboard()
    assert page.text("[data-job=j-1] .reason") == why and page.text("[data-job=j-1] .pill") == "held"
    page.evaluate("void (location.hash = '#/jobs/j-1')")
    assert page.text(".job-head .sub") == why
    assert "After j-7 (rendering), j-8 (removed)" in " ".join(page.text(".job-facts").split())
    assert page.evaluate("document.querySelector('.job-facts a').getAttribute('href')") == "#/jobs/j-7"


def test_the_error_of_the_denoised_picture_comes_with_the_job(farm, dashboard):
    farm.jobs["j-1"] = job(denoise=True, denoised={"relmse": 0.002, "relmse_ci95": None})
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.figures')")
    assert "relMSE, denoised 0.00200 no interval" in page.text(".figures")


def test_who_may_only_look_is_not_offered_to_render_on(farm, dashboard):
    farm.role = "read"
    farm.jobs["j-1"] = job(state="done", verdict=HEAVY)
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.noisy b')")
    assert page.count(".go-on button") == 0 and page.count("#priority") == 0


def test_the_cause_of_a_failure_comes_first_and_once(farm, dashboard):
    cut = "shape 12: 'leaf.ply': the file is cut short"
    farm.jobs["j-1"] = job(state="failed", units_done=0, spp_done=0, relmse=None, error="in words",
                           failure=failure(attempt("demo-2", cut), attempt("demo-1", cut), tile=0, rect=[0, 0, 32, 32], round=0, samples=[0, 4]))
    page = dashboard("#/jobs/j-1")

    assert page.text(".notice.bad pre") == "shape 12: 'leaf.ply': the file is cut short"
    assert page.text(".failure-where") == "tile 0 (pixels 0,0 to 32,32), round 0 (samples 0 to 4) failed in 2 attempts on demo-2, demo-1."
    assert page.text("main").count("cut short") == 1
    assert page.count(".figures") == 0 and page.count(".plot") == 0, "there are no figures of a job that failed at once"


@pytest.mark.parametrize("told, cause, where", [
    (None, "in words", ""),
    (failure(attempt("a", "crash", signal=11, pixel=[1, 2], sample=5), kind="scene", replay="lightshaft render x.xml"), "crash (signal 11) at pixel 1,2 sample 5",
     "the scene cannot be rendered: tile 3 (pixels 0,0 to 8,8), round 1 (samples 4 to 8) failed in 1 attempt on a.\nSee it again: lightshaft render x.xml"),
    (failure(attempt("a", "this"), attempt("b", None), kind="no_worker", frame=7), "this (on a)\nno reason given (on b)",
     "frame 7: no worker is left that may try: tile 3 (pixels 0,0 to 8,8), round 1 (samples 4 to 8) failed in 2 attempts on a, b.")])
def test_the_causes_of_a_failure_are_told_apart(open_page, farm, told, cause, where):
    page = open_page(f"{farm.url}/demo.html")
    said = json.dumps({"error": "in words", "failure": told})
    assert page.evaluate(f"import('/js/failure.js').then(({{ causeFirst }}) => causeFirst({said}))") == {"cause": cause, "where": where}


def test_a_job_gets_another_name(farm, dashboard):
    farm.jobs["j-1"] = job(name="steam.xml")
    page = dashboard("#/jobs/j-1")
    page.click("[aria-label='Rename: steam.xml']")
    page.wait("document.activeElement.id === 'new-name'")
    page.type("Steam, take 2")
    page.click(".rename button[type=submit]")
    page.wait("document.querySelector('h1').innerText === 'Steam, take 2' && !document.querySelector('.rename')")
    assert farm.changes == [("j-1", {"name": "Steam, take 2"})]
    page.wait("document.activeElement.id === 'rename'")


def test_the_form_for_a_name_stays_while_it_is_refused_and_closes_by_escape(farm, dashboard):
    farm.jobs["j-1"] = job(name="steam.xml")
    page = dashboard("#/jobs/j-1")
    page.click("#rename")
    page.wait("document.activeElement.id === 'new-name'")
    page.type("Steam, take 2")
    farm.broken.add("jobs")
    page.click(".rename button[type=submit]")
    page.wait("document.querySelector('.toast')?.innerText.includes('The store is away.')")
    assert page.count(".rename") == 1

    farm.broken.discard("jobs")
    page.click(".rename button[type=submit]")
    page.wait("document.querySelector('h1').innerText === 'Steam, take 2' && !document.querySelector('.rename') && !document.querySelector('.toast')")

    page.click("#rename")
    page.wait("document.activeElement.id === 'new-name'")
    page.key("Escape")
    page.wait("!document.querySelector('.rename') && document.activeElement.id === 'rename'")


def test_a_finished_job_is_denoised_as_a_new_job_with_its_samples(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", stopped="spp", progress=1, spp_done=64, spp_asked=64)
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.go-on button')")
    page.evaluate("[...document.querySelectorAll('.go-on button')].find(b => b.innerText === 'Denoise …').click()")
    page.wait("document.getElementById('again-denoise').checked")
    page.click(".again button[type=submit]")
    page.wait("location.hash === '#/jobs/j-again'")
    assert farm.submitted == [("j-1", {"denoise": True})]


@pytest.mark.parametrize("state, words", [("paused", "Paused before the first tile"), ("cancelled", "No sample was taken."), ("running", "The first tiles are being rendered")])
def test_an_empty_picture_says_why_it_is_empty(farm, dashboard, state, words):
    farm.jobs["j-1"] = job(state=state, units_done=0, spp_done=0)
    page = dashboard("#/jobs/j-1")
    assert page.text(".stage-text") == words


def test_the_log_is_read_on_the_page(farm, dashboard):
    farm.jobs["j-1"] = job()
    farm.log = "12:00:01 submitted\n12:00:02 <b>lab-01</b> took it\n"
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.job-log')")
    assert farm.asked("GET", "/api/v1/jobs/j-1/log") == 0

    page.click(".job-log summary")

    page.wait("document.querySelector('.job-log pre')?.textContent.endsWith('<b>lab-01</b> took it\\n')")
    farm.log += "12:00:09 done\n"
    page.click(".job-log button")
    page.wait("document.querySelector('.job-log pre').textContent.includes('12:00:09 done')")


def test_an_open_log_follows_its_job_and_shows_its_end(farm, dashboard):
    farm.jobs["j-1"] = job()
    farm.log = "".join(f"12:00:01 tile {n} is done\n" for n in range(100))
    page = dashboard("#/jobs/j-1")
    page.click(".job-log summary")
    lines = "document.querySelector('.job-log pre')"
    at_end = f"{lines}.scrollTop > 0 && {lines}.scrollHeight - {lines}.scrollTop - {lines}.clientHeight < 2"
    page.wait(at_end)

    farm.log += 50 * "12:00:09 lab-01 was lost\n"
    farm.change("j-1", progress=0.5)
    page.wait(f"{lines}.textContent.includes('lab-01 was lost') && {at_end}")
    # The log does not scroll to its end while somebody reads further up.
    page.evaluate(f"{lines}.scrollTop = 40")
    farm.log += "12:00:20 done\n"
    farm.change("j-1", state="done", progress=1)
    page.wait(f"{lines}.textContent.endsWith('12:00:20 done\\n')")
    assert page.evaluate(f"{lines}.scrollTop") == 40

    page.click(".job-log summary")
    page.wait("!document.querySelector('.job-log').open && document.querySelector('.job-log .help')")


def test_who_scrolls_up_while_new_lines_of_a_log_come_stays_there(farm, dashboard):
    farm.jobs["j-1"] = job()
    farm.log = "".join(f"12:00:01 tile {n} is done\n" for n in range(100))
    page = dashboard("#/jobs/j-1")
    page.click(".job-log summary")
    lines = "document.querySelector('.job-log pre')"
    page.wait(f"{lines}.scrollTop > 0")
    # The reader scrolls between the drawing of the new lines and what the page does next in that frame.
    page.evaluate(f"new MutationObserver(() => {{ {lines}.scrollTop = 40; }}).observe({lines}, {{ childList: true, characterData: true, subtree: true }})")

    farm.log += "12:00:20 done\n"
    page.click(".job-log button")

    page.wait(f"{lines}.textContent.endsWith('12:00:20 done\\n')")
    page.evaluate("new Promise(requestAnimationFrame).then(() => new Promise(requestAnimationFrame))")
    assert page.evaluate(f"{lines}.scrollTop") == 40


def test_a_log_that_could_not_be_fetched_is_read_again(farm, dashboard):
    farm.jobs["j-1"] = job()
    farm.log = "12:00:01 submitted\n"
    page = dashboard("#/jobs/j-1")
    page.evaluate("""void (() => {
      const real = fetch;
      window.away = true;
      window.fetch = (url, options) => (window.away && url.endsWith("/log") ? Promise.reject(new TypeError("away")) : real(url, options));
    })()""")
    page.evaluate("location.hash = '#/jobs/j-1/log'")
    page.wait("document.querySelector('.log-page .help')?.innerText === 'The log could not be fetched.'")

    page.evaluate("window.away = false")
    page.evaluate("[...document.querySelectorAll('.log-page button')].find((b) => b.innerText === 'Read it again').click()")

    page.wait("document.querySelector('.log-page pre')?.textContent.includes('submitted')")


def test_what_has_no_sample_is_not_offered_as_a_picture(farm, dashboard):
    farm.jobs["j-1"] = job(state="failed", units_done=0, error="no")
    page = dashboard("#/jobs/j-1")
    assert "EXR" not in page.text(".downloads") and "Report" in page.text(".downloads")


def test_priority_is_set_on_the_page_of_a_job(farm, dashboard):
    farm.jobs["j-1"] = job(priority=2)
    page = dashboard("#/jobs/j-1")
    page.wait("document.getElementById('priority')?.value === '2'")

    page.click("#priority")
    page.evaluate("document.getElementById('priority').select()")
    page.type("7")
    page.key("Enter", virtual=13, text="\r")

    wait_until(lambda: farm.changes, "the farm is asked")
    assert farm.changes == [("j-1", {"priority": 7})]


def test_a_job_that_has_ended_is_removed_from_its_page_after_one_more_question(farm, dashboard):
    farm.jobs["j-1"] = job(state="done")
    page = dashboard("#/jobs/j-1")
    button(page, "Remove")
    button(page, "Really remove, with its images")

    page.wait("location.hash === '#/jobs'")
    assert farm.jobs == {}


def test_a_job_that_measures_shows_its_values_instead_of_a_picture(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", progress=1, meters=2)
    meter = {"type": "irradiancemeter", "unit": "W/m^2", "ci95": None, "samples": 1024, "value": [1.5, 2.5, 0.125]}
    farm.report = {"convergence": [], "meters": [
        {**meter, "name": "hall[1]", "luminance": 2.25, "luminance_ci95": [2.2, 2.3], "trusted": True},
        {**meter, "name": "<b>dark</b>", "luminance": 0, "luminance_ci95": None, "trusted": False}]}
    page = dashboard("#/jobs/j-1")

    page.wait("document.querySelector('.meters table')")

    text = page.text(".meters")
    assert "hall[1] 1.5000 2.5000 0.12500 2.2500 2.2000 to 2.3000 W/m^2" in " ".join(text.split())
    assert "<b>dark</b>" in text and "no sample has found light" in text
    assert not page.evaluate("document.querySelector('live-image') !== null")
    assert page.evaluate("[...document.querySelectorAll('.downloads a')].some(a => a.href.endsWith('/jobs/j-1/meters'))")


def test_a_job_is_shown_in_the_chosen_view(farm, dashboard):
    farm.cubes["Screen/Warm & <b>"] = b""
    farm.jobs["j-1"] = job(state="done")
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.stage live-image').dataset.painted")
    assert page.evaluate("document.getElementById('display').value") == "sRGB"

    page.evaluate("(() => { const s = document.getElementById('display'); s.value = 'Screen/Warm & <b>'; s.dispatchEvent(new Event('change')); })()")

    page.wait("Number(document.querySelector('.stage live-image').dataset.painted) >= 2")
    wanted = "image.png?exposure=0&view=Screen%2FWarm%20%26%20%3Cb%3E"
    assert ("GET", f"/api/v1/jobs/j-1/{wanted}") in farm.requests
    assert page.evaluate("document.querySelector('.downloads a[download$=\".png\"]').href").endswith(wanted)


def test_a_job_opens_in_the_default_view_of_the_coordinator(farm, dashboard):
    farm.cubes["Screen/Warm"], farm.default_view = b"", "Screen/Warm"
    farm.jobs["j-1"] = job(state="done")
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.stage live-image').dataset.painted")

    assert page.evaluate("document.getElementById('display').value") == "Screen/Warm"
    assert ("GET", "/api/v1/jobs/j-1/image.png?exposure=0&view=Screen%2FWarm") in farm.requests


def test_a_coordinator_without_views_shows_the_curve_of_srgb(farm, dashboard):
    farm.broken.add("views")
    farm.jobs["j-1"] = job(state="done")
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.stage live-image').dataset.painted")

    assert page.evaluate("[...document.getElementById('display').options].map((o) => o.value)") == ["sRGB"]


def test_a_view_that_cannot_be_shown_gives_way_to_srgb(farm, dashboard):
    farm.cubes["Screen/Broken"], farm.default_view, farm.broken_view = b"", "Screen/Broken", "Screen/Broken"
    farm.jobs["j-1"] = job(state="done")
    page = dashboard("#/jobs/j-1")

    page.wait("document.querySelector('.stage live-image').dataset.painted")
    assert page.evaluate("document.getElementById('display').value") == "sRGB"
    assert "Screen/Broken" in page.text(".toast")
