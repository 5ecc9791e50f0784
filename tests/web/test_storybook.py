"""Every view from fixed data, in a real browser: no complaints, and what a reader must find there."""
import pytest

FACTS = {
    "signin": ["Token", "Sign in"],
    "signin-refused": ["This token is not known here."],
    "jobs-empty": ["Nothing is rendering yet", "curl -H", "application/xml"],
    "jobs": ["7 jobs", "steam-bath.xml", "43 %", "215 / 512", "0.00418", "4.2 min", "1 h 12 min", "7.20 × 10⁻⁵", "failed",
             "still noisy", "at least 1 h 12 min", "36 until the target"],
    "jobs-confirm": ["Really cancel", "Keep"],
    "jobs-page": ["3,214 jobs · 12 rendering · 80 waiting (9 held)", "held 9", "2 jobs selected", "Select none", "101 – 107 of 3,214", "everybody", "done 3,080"],
    "jobs-lost": ["connection lost", "The coordinator does not answer."],
    "job": ["steam-bath.xml", "0.00390 – 0.00448", "4.2 min left", "Error against time", "target 0.001", "Broken numbers none", "tile 104", "lab-03", "EXR",
            "3.1 min to 5.5 min", "with 8 more: 66 s", "slope −0.98 (−1.06 to −0.90)", "converging as expected", "target 0.001 at 7.3 min (6.2 min to 8.6 min)",
            "Where the threads' time went", "transfer 6.2 s 1 %", "RMSE 0.0312 95 %: 0.0302 – 0.0322", "Efficiency 0.322 1 / (relMSE × core s)"],
    "job-untrusted": ["Can take it 11 % 1 of 4 workers: the others' processors or builds round differently", "relMSE 0.0386 still noisy target 0.005", "Still noisy: a few bright pixels carry the error", "Time left, at least 1 h 12 min", "at least 1 h 12 min left", "RMSE 0.0921 still noisy", "Samples per pixel 36 until the target at most 65,536",
                      "don't trust yet: few pixels carry the error (like 16 of 230400; the worst one 25 %)", "target 0.005 not before"],
    "job-stopped": ["Cancelled at 55 %, after 99 s: someone stopped it."],
    "job-reference": ["True relMSE 0.00443 against the reference", "FLIP 0.0271", "12 pixels have too few samples that found light", "against the reference 0.00443, FLIP 0.0273"],
    "job-map": ["0.1 %", "100 %", "12 min of core time", "target 0.001 at 29 min (25 min to 34 min)"],
    "job-removed": ["Somebody has removed this job"],
    "job-sequence": ["smoke.xml", "Frame 5", "4 of 10 done, 1 failed", "following what is rendered", "Whole sequence: relMSE 0.00418 on average", "smoke.0009.vdb has no grid", "0.00390 – 0.00448"],
    "job-queued": ["Waiting for a worker", "The first point appears"],
    "job-done": ["Done after 7 min: the target error is reached."],
    "job-failed": ["The job failed", "SIGSEGV on 3 workers", "lightshaft render forge-v12.xml --pixel 412,96 --sample 11"],
    "job-unhealthy": ["The numbers of this image are not clean", "3 samples were not a number (NaN); they count as zero; first at pixel 412,96, sample 11.", "lightshaft render steam-bath.xml --size 640x360 -D density=2.5 --pixel 412,96 --sample 11", "1,204 times a medium was denser", "37 negative values of volumes of the scene were made 0.", "2 warnings about the scene", "Don't trust this estimate yet"],
    "job-log": ["Jobs / j-7f3a91c2 / Log", "Log of steam-bath.xml", "rendering", "12:00:00 submitted", "out of memory while rendering", "Download"],
    "job-unknown": ["There is no job \"nope\"."],
    "viewer": ["fogbox.xml", "640 × 360", "Exposure", "Pixel 233, 120", "R 0.7341 ± 0.018", "512 samples", "Region 300, 250 to 420, 330: mean R 0.2113 ± 4.0"],
    "viewer-compare": ["Compare with", "Wipe", "Difference", "relMSE", "FLIP"],
    "viewer-error": ["relative standard error of a pixel, from 0.1 % to 100 % or more", "Relative error", "Point at a pixel"],
    "viewer-mix": ["Light groups", "relMSE 0.00231 (95 %: 0.00210 – 0.00254)", "lamp", "Media apart", "Download EXR"],
    "viewer-objects": ["Selected: lamp"],
    "workers": ["5 workers", "36 threads", "lab-01", "fetching steam.vdb", "2 different ways", "lost", "6.2 min ago"],
    "workers-empty": ["No worker is connected", "lightshaft-worker --coordinator"],
    "submit": ["Drop a scene here", "Choose a folder"],
    "submit-ready": ["bath.xml", "meshes/tub.obj", "61.4 MiB", "not named by the scene", "Render"],
    "submit-missing": ["textures/tiles.png", "missing: add this file"],
    "submit-sending": ["Sending steam.vdb"],
    "submit-refused": ["bath.xml:14:16 error medium \"grid\" has no parameter 'sigmat'; did you mean 'sigma_t'?", "^~~~~~~~~~~~~"],
}


@pytest.mark.parametrize("view", FACTS)
@pytest.mark.parametrize("width", [1280, 768, 375])
def test_view_shows_its_facts_and_fits_the_screen(open_page, farm, view, width):
    page = open_page(f"{farm.url}/demo.html?view={view}", width=width, height=800, phone=width < 500)

    text = page.text("#app")

    for fact in FACTS[view]:
        assert fact in " ".join(text.split()), f"{fact!r} is not on the page:\n{text}"
    assert page.evaluate("document.documentElement.scrollWidth") <= width, "the page scrolls sideways"


def test_storybook_lists_every_story(open_page, farm):
    page = open_page(f"{farm.url}/demo.html")

    names = page.evaluate("[...document.querySelectorAll('li a')].map(a => a.innerText)")

    assert set(FACTS) <= set(names)


MARKUP = "<img src=x onerror=\"document.title='stolen'\"><b>bold</b>"


@pytest.mark.parametrize("view, places", [("jobs", 1), ("job", 3), ("workers", 3), ("submit", 3)])
def test_markup_in_names_and_messages_is_shown_as_text(open_page, farm, view, places):
    page = open_page(f"{farm.url}/demo.html?view=hostile-{view}")
    page.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")

    shown = page.evaluate("document.getElementById('app').innerText")

    assert shown.count(MARKUP) >= places
    assert page.count("#app img, #app script, #app iframe, #app [onclick], #app [onerror]") == 0
    assert "stolen" not in page.evaluate("document.title")


def test_live_image_is_painted_and_tiles_in_flight_are_marked_in_their_workers_colour(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=job")
    page.wait("document.querySelector('.stage live-image').dataset.painted")

    colours = page.evaluate("[...document.querySelectorAll('.mark-tile')].map(mark => getComputedStyle(mark).stroke)")
    bright = page.evaluate("""(() => {
      const canvas = document.querySelector('.stage live-image canvas');
      const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
      return data.filter((value, i) => i % 4 < 3 && value > 120).length;
    })()""")

    assert bright > 10000
    assert len(colours) == 6 and len(set(colours)) == 4, colours
    assert page.count(".flash") == 2


def test_exposure_repaints_the_image_brighter(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=job")
    page.wait("document.querySelector('.stage live-image').dataset.painted === '1'")
    mean = "(() => { const c = document.querySelector('.stage live-image canvas'); return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.reduce((a, b) => a + b, 0); })()"
    before = page.evaluate(mean)

    page.evaluate("document.getElementById('exposure').focus()")
    page.key("PageUp", virtual=33)
    page.wait("document.querySelector('.stage live-image').dataset.painted === '2'")

    assert page.evaluate(mean) > before
    assert page.text("output").startswith("+")


def test_plot_is_logarithmic_on_both_axes(open_page, farm):
    """Error falls as 1/time, so its points must lie on a straight line whose ends differ by 1 in both logarithms."""
    page = open_page(f"{farm.url}/demo.html?view=job")

    points = page.wait("[...document.querySelectorAll('.plot-point')].map(p => [+p.getAttribute('cx'), +p.getAttribute('cy')])")
    labels = page.evaluate("[...document.querySelectorAll('.plot-grid text')].map(t => t.textContent)")
    step_x = (points[-2][0] - points[1][0]) / 6.0  # seconds double from point to point
    drift = max(abs((b[0] - a[0]) - step_x) for a, b in zip(points[1:-2], points[2:-1]))

    assert drift < 0.05 * step_x, points
    assert points == sorted(points), "time runs to the right"
    assert [y for _, y in points] == sorted(y for _, y in points), "and error falls"
    assert {"1 s", "10 s", "1 min", "0.1", "0.01"} <= set(labels)
    assert page.count(".plot-band") == 1 and page.count(".plot-target") == 1 and page.count(".plot-ahead") == 1


def test_pointing_at_the_plot_names_the_nearest_point(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=job")
    assert "3.1 min" in page.text(".plot-reading")

    page.evaluate("document.querySelector('.plot').scrollIntoView({ behavior: 'instant' })")
    box = page.wait("(() => { const b = document.querySelectorAll('.plot-point')[1].getBoundingClientRect(); return [b.left + 2, b.top + 2]; })()")
    page.call("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": box[0], "y": box[1] + 20})

    page.wait("document.querySelector('.plot-reading').innerText.includes('1.8 s')")


def test_the_arrow_keys_walk_along_the_plot(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=job")
    page.wait("document.querySelector('.plot svg')")

    page.evaluate("document.querySelector('.plot svg').focus()")
    page.key("ArrowLeft", virtual=37)

    page.wait("document.querySelector('.plot-reading').innerText.startsWith('1.9 min')")
    assert "1.9 min" in page.evaluate("document.querySelector('.plot svg').getAttribute('aria-valuetext')")


def test_everything_can_be_reached_with_the_tab_key(open_page, farm):
    """Of radio buttons the one that is chosen; the arrow keys go to the others."""
    page = open_page(f"{farm.url}/demo.html?view=job")
    page.wait("document.querySelector('.plot')")
    wanted = page.evaluate("[...document.querySelectorAll('a[href], button, input, summary, [tabindex=\"0\"]')]"
                           ".filter(e => !(e.type === 'radio' && !e.checked) && !(e.closest('details:not([open])') && e.localName !== 'summary')).length")

    seen = set()
    for _ in range(wanted):
        page.key("Tab", virtual=9)
        seen.add(page.evaluate("(() => { const e = document.activeElement; return e.outerHTML.slice(0, 80) + [...document.querySelectorAll('*')].indexOf(e); })()"))
        assert page.evaluate("document.activeElement.matches(':focus-visible')")

    assert len(seen) == wanted
