"""Keys and clicks that are faster than the page is drawn, and answers that come late or overtake each other."""
import json

import pytest
from stub_farm import TOKEN, job, worker

POINTS = [{"seconds": n, "core_seconds": 2 * n, "spp": 4 * n, "rmse": 0.1 / n, "relmse": 0.01 / n, "relmse_ci95": [0.009 / n, 0.011 / n]} for n in (1, 2, 4, 8, 16)]


def keys(page, selector, *names):
    """Presses them within one frame."""
    page.evaluate(f"{json.dumps(names)}.forEach((key) => document.querySelector({selector!r}).dispatchEvent(new KeyboardEvent('keydown', {{ key, bubbles: true, cancelable: true }})))")


def clicks(page, selector, times=2):
    page.evaluate(f"(() => {{ const e = document.querySelector({json.dumps(selector)}); for (let i = 0; i < {times}; i += 1) e.click(); }})()")


def drawn(page):
    page.evaluate("new Promise(requestAnimationFrame).then(() => new Promise(requestAnimationFrame))")


def test_no_two_actions_have_the_same_name(modules_page):
    """They are one object: of two with a name the later would be called for both."""
    twice = modules_page.evaluate("""(async () => {
      const makers = await Promise.all(["job", "list", "again", "worker", "submit", "viewer"].map((name) => import(`/js/${name}_actions.js`)));
      const names = makers.flatMap((module) => Object.entries(module).filter(([name]) => /^make.*Actions$/.test(name)).flatMap(([, make]) => Object.keys(make({}))));
      return [names.length, names.filter((name, i) => names.indexOf(name) !== i)];
    })()""")
    assert twice[0] > 50 and twice[1] == []


@pytest.fixture
def modules_page(open_page, farm):
    return open_page(f"{farm.url}/demo.html")


def test_points_of_the_plot_are_read_by_pointer_and_by_quick_keys(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", stopped="spp", progress=1)
    farm.report = {"convergence": POINTS}
    page = dashboard("#/jobs/j-1", height=2000)
    page.wait("document.querySelectorAll('.plot-point').length === 5")
    chosen = "document.querySelector('.plot svg').getAttribute('aria-valuenow')"
    assert page.evaluate(chosen) == "5"

    keys(page, ".plot svg", "ArrowLeft", "ArrowLeft", "ArrowLeft")
    page.wait(f"{chosen} === '2'")
    keys(page, ".plot svg", "Home", "ArrowLeft", "ArrowRight")
    page.wait(f"{chosen} === '2'")
    keys(page, ".plot svg", "End", "ArrowRight")
    page.wait(f"{chosen} === '5'")

    where = page.evaluate("(({ left, top }) => [left, top])(document.querySelector('.plot-point').getBoundingClientRect())")
    page.call("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": where[0], "y": where[1]})
    page.wait(f"{chosen} === '1'")


def test_a_box_that_is_pressed_twice_is_as_before(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", size=farm.size)
    page = dashboard("#/view/j-1")
    page.wait("document.getElementById('false')")

    clicks(page, "#false")
    drawn(page)

    assert not page.evaluate("document.getElementById('false').checked") and "false" not in page.evaluate("location.hash")
    clicks(page, "#false", 3)
    page.wait("document.getElementById('false').checked && location.hash.includes('false')")


def test_a_column_that_is_pressed_twice_is_in_the_other_order(farm, dashboard):
    farm.workers = {f"w-{n}": worker(f"w-{n}", f"lab-{n}") for n in range(3)}
    page = dashboard("#/workers")
    page.wait("document.querySelector('[data-worker]')")
    clicks(page, "th:nth-child(3) button")
    page.wait("document.querySelector('th:nth-child(3)').getAttribute('aria-sort') === 'ascending'")


def test_a_form_that_is_sent_twice_makes_one_job(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", stopped="spp", progress=1, spp_done=64, spp_asked=64)
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.heading [aria-expanded]')")
    page.click(".heading [aria-expanded]")
    page.wait("document.querySelector('.again')")

    clicks(page, ".again [type=submit]")

    page.wait("location.hash === '#/jobs/j-again'")
    assert len(farm.submitted) == 1


def test_arrows_step_through_frames_however_quick_they_are(farm, dashboard):
    listed = [{"frame": n, "id": f"j-1-frame{n}", "state": "done", "progress": 1, "spp_done": 8, "relmse": 0.1, "error": None} for n in (1, 2, 3, 4)]
    frames = {"range": "1-4", "total": 4, "done": 4, "running": 0, "failed": 0, "cancelled": 0, "current": 1, "list": listed}
    farm.jobs["j-1"] = job("j-1", state="done", frames=frames)
    for n in (1, 2, 3, 4):
        farm.jobs[f"j-1-frame{n}"] = job(f"j-1-frame{n}", state="done", sequence="j-1", frame=n)
    page = dashboard("#/jobs/j-1/1")
    page.wait("document.querySelector('.frames b')?.innerText === 'Frame 1'")
    keys(page, ".frames", "ArrowRight", "ArrowRight", "ArrowLeft", "ArrowRight")
    page.wait("document.querySelector('.frames b').innerText === 'Frame 3' && location.hash === '#/jobs/j-1/3'")


def test_the_picture_that_was_chosen_last_is_compared(farm, dashboard):
    farm.jobs = {id: job(id, id, state="done", size=farm.size) for id in ("j-1", "j-2", "j-3")}
    page = dashboard("#/view/j-1")
    page.wait("document.querySelectorAll('#view-with option').length === 3")
    choose = "(id => { const s = document.getElementById('view-with'); s.value = id; s.dispatchEvent(new Event('change')); })"
    page.hold_reply("url.includes('j-2/layers')")
    page.evaluate(f"{choose}('j-2')")
    page.wait("window.held")
    page.evaluate(f"{choose}('j-3')")
    page.wait("document.querySelector('float-view').dataset.painted?.includes('wipe') || document.querySelector('[name=by]')")
    asked = farm.asked("GET", "/api/v1/jobs/j-2/pixels")

    page.release_reply()

    assert page.evaluate("document.getElementById('view-with').value") == "j-3"
    assert farm.asked("GET", "/api/v1/jobs/j-2/pixels") == asked == 0
    page.evaluate("document.querySelector('[name=by][value=b]').click()")
    page.wait("document.querySelector('float-view').dataset.painted?.endsWith(' b')")
    assert farm.asked("GET", "/api/v1/jobs/j-2/pixels") == 0


def test_a_histogram_is_that_of_the_layer_that_was_chosen_last(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", size=farm.size)
    page = dashboard("#/view/j-1")
    page.wait("document.querySelector('float-view')?.dataset.painted")
    page.hold_reply("url.includes('layer=rgb&level=0&rect=0,0,')")
    page.click("#histogram")
    page.wait("window.held")
    page.evaluate("(s => { s.value = 'spp'; s.dispatchEvent(new Event('change')); })(document.getElementById('view-layer'))")
    page.wait("document.querySelector('.viewer-histogram svg')")

    page.release_reply()

    assert page.count(".viewer-histogram svg") == 1


def test_an_older_report_does_not_replace_a_newer_one(farm, dashboard):
    farm.jobs["j-1"] = job()
    farm.report = {"convergence": POINTS[:2]}
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelectorAll('.plot-point').length === 2")
    page.hold_reply("url.endsWith('/report')")
    farm.change("j-1", progress=0.5)
    page.wait("window.held")
    farm.report = {"convergence": POINTS}
    farm.change("j-1", progress=0.6)
    page.wait("document.querySelectorAll('.plot-point').length === 5")

    page.release_reply()

    assert page.count(".plot-point") == 5


def test_a_refusal_of_an_earlier_session_does_not_end_the_next(farm, dashboard):
    page = dashboard()
    page.hold_reply("method === 'GET' && url.includes('/workers')")
    farm.signed_in = False
    farm.drop_streams()
    page.wait("window.held && document.querySelector('#token')")
    page.click("#token")
    page.type(TOKEN)
    page.click("[type=submit]")
    page.wait("document.querySelector('.link.live')")

    page.release_reply()

    assert page.count(".link.live") == 1 and page.count(".field-error") == 0
