"""How wrong an image is and where its time went, on the page of a job: clocks, maps, tables, colours, and that nothing jumps."""
import pytest

from stub_farm import job

WITH_TARGET = {"target_error": 0.001, "eta_seconds": 60, "eta_ci95": [45, 80], "eta_with_more": {"workers": 8, "seconds": 12, "ci95": None}}
TIME = {"load": 1, "build": 2, "render": 90, "transfer": 3, "merge": 1, "idle": 3}


def point(seconds, **more):
    error = 0.1 / seconds
    return {"seconds": seconds, "core_seconds": 3 * seconds, "spp": 8 * seconds, "rmse": 0.1, "relmse": error, "relmse_ci95": [0.8 * error, 1.2 * error], **more}


def report(*seconds, **more):
    return {"convergence": [point(s) for s in seconds], "slope": -1.01, "slope_ci95": [-1.1, -0.9], "trend": "converging as expected", "trusted": True,
            "verdict": "", "forecast": {"target": 0.001, "asked": True, "spp": 800, "core_seconds": 270, "core_seconds_ci95": [240, 330]}, **more}


def places(page):
    page.wait("document.querySelector('.plot-point')")
    return page.evaluate("[...document.querySelectorAll('.plot-point')].map(p => [+p.getAttribute('cx'), +p.getAttribute('cy')])")


# ---- the plot ----

def test_the_clock_is_chosen_by_keyboard(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=job")
    assert "3.1 min after the first ray" in page.text(".plot-reading")

    page.evaluate("document.querySelector('[name=clock]:checked').focus()")
    page.key("ArrowRight", virtual=39)

    page.wait("document.querySelector('.plot-reading').innerText.includes('12 min of core time')")
    assert page.evaluate("document.activeElement.value") == "core_seconds"
    assert "29 min (25 min to 34 min)" in page.text(".plot-reading"), "the forecast is on the same clock"
    assert page.evaluate("document.querySelector('.choice legend').textContent")


def test_the_forecast_meets_the_target_within_its_interval(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=job")
    target = page.wait("+document.querySelector('.plot-target line').getAttribute('y1')")

    middle, more = page.evaluate("['.plot-meets', '.plot-more'].map(c => document.querySelector(c).getAttribute('d').match(/[\\d.]+/g).map(Number))")
    span = page.evaluate("document.querySelector('.plot-span').getAttribute('d').match(/[\\d.]+/g).map(Number)")
    last = places(page)[-1]

    assert middle[1] + 5 == pytest.approx(target) and more[1] + 5 == pytest.approx(target)
    assert last[0] < more[0] < span[0] < middle[0] < span[5], "eight more workers are sooner; the interval holds the forecast"


def test_a_forecast_that_is_far_away_does_not_squeeze_the_curve(open_page, farm, dashboard):
    farm.jobs["j-1"] = job(**{**WITH_TARGET, "eta_seconds": 1e9, "eta_ci95": [1e8, 1e10]})
    farm.report = report(1, 2, 4, 8)
    page = dashboard("#/jobs/j-1")

    points = places(page)

    assert page.count(".plot-ahead") == 0
    assert points[-1][0] - points[0][0] > 300, "the points use the width"


def test_the_table_says_what_the_plot_shows(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=job-reference")
    page.wait("document.querySelector('.plot-table summary')")

    page.click(".plot-table summary")

    rows = page.evaluate("[...document.querySelectorAll('.plot-table tbody tr')].map(r => [...r.cells].map(c => c.innerText))")
    assert len(rows) == page.count(".plot-point")
    assert rows[-1] == ["3.1 min", "12 min", "214", "0.00418", "0.00382 – 0.00458", "0.00443"]
    assert page.evaluate("[...document.querySelectorAll('.plot-table th')].every(th => th.scope === 'col')")


def test_the_true_error_has_a_curve_of_its_own(open_page, farm):
    page = open_page(f"{farm.url}/demo.html?view=job-reference")

    dashes = page.wait("getComputedStyle(document.querySelector('.plot-true')).strokeDasharray")

    assert dashes != "none", "told apart without colours"
    assert open_page(f"{farm.url}/demo.html?view=job").count(".plot-true") == 0


def test_what_a_reference_cannot_tell_is_neither_drawn_nor_nought(dashboard, farm):
    farm.jobs["j-1"] = job()
    farm.report = {**report(), "convergence": [point(s, true_relmse=0.12 / s, true_relmse_below_noise=s == 8) for s in (1, 2, 4, 8)]}

    page = dashboard("#/jobs/j-1")

    line = page.wait("document.querySelector('.plot-true')?.getAttribute('points')")
    assert len(line.split()) == 3
    assert "true error below the reference's noise" in page.text(".plot-reading")


@pytest.mark.parametrize("points", [
    "null", "'x'", "[null, 1, {}]", "[{seconds: -1, core_seconds: 1, relmse: 1}]", "[{seconds: 1, core_seconds: 1, relmse: NaN}]"])
def test_what_has_no_logarithm_is_left_out(open_page, farm, points):
    page = open_page(f"{farm.url}/demo.html")
    assert page.evaluate(f"import('/js/plot_scale.js').then(({{ drawable }}) => drawable({points}, 'seconds').length)") == 0


# ---- what is not to be trusted ----

HEAVY = {"kind": "heavy_tail", "words": "don't trust yet: few pixels carry the error", "trusted": False}
EARLY = {"kind": "early", "words": "no sample has found light", "trusted": False}


@pytest.mark.parametrize("verdict", [HEAVY, EARLY, {"kind": "bias_floor", "words": "bias floor"}, {"kind": "of a newer coordinator", "words": "odd", "trusted": False}])
def test_a_job_in_doubt_shows_no_interval(farm, dashboard, verdict):
    farm.jobs["j-1"] = job(**WITH_TARGET, verdict=verdict, rmse_ci95=[0.04, 0.06])
    farm.report = report(1, 2, 4, 8)
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.plot-point')")

    facts, plot = page.text(".figures"), page.text(".plot figure") + page.text(".plot-verdict")

    word = {"heavy_tail": "still noisy", "early": "too early to tell", "bias_floor": "not falling as it should"}.get(verdict["kind"], "not known well yet")
    assert "don't trust" not in facts + page.text(".plot figure") and page.count(".figures .doubt") == 2
    assert f"({word})" in page.text(".plot-reading")
    assert facts.count(word) == 2 and "95 %" not in facts and "0.0400" not in facts
    assert "Time left, at least" in facts and "at least 60 s left" in page.text(".job-head .sub")
    assert "95 %" not in plot and "not before" in plot and page.count(".plot-fan") == 0
    assert page.text(".plot-verdict .doubt") == verdict["words"]
    assert page.count(".plot-band") == 0 and "−1.10 to −0.90" not in plot
    page.click(".plot-table summary")
    table = page.text(".plot-table")
    assert "95 %" not in table and "0.0800" not in table and "No intervals" in table
    assert page.evaluate("[...document.querySelectorAll('.plot-table tr')].map(r => r.cells.length)") == [4] * 5


def test_bands_that_are_not_shown_take_no_room(farm, dashboard):
    """The axis of errors ends with the points."""
    wide = [{**point(s), "relmse_ci95": [1e-6, 1e3]} for s in (1, 2, 4, 8)]
    farm.jobs["j-1"] = job(verdict=HEAVY, target_error=None)
    farm.report = {**report(), "convergence": wide}
    page = dashboard("#/jobs/j-1")

    heights = [y for _, y in places(page)]

    assert max(heights) - min(heights) > 200, "eight times the error over the height of the drawing"


@pytest.mark.parametrize("verdict, words", [(HEAVY, "still noisy"), (EARLY, "too early to tell"), ({"kind": "bias_floor", "words": "bias floor"}, "not falling as it should")])
def test_a_target_reached_by_an_estimate_in_doubt_is_not_said_to_be_reached(farm, dashboard, verdict, words):
    farm.jobs["j-1"] = job(state="done", stopped="error", verdict=verdict, target_error=0.001)
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.job-head .sub')")

    assert f"the target error is reached by its own estimate: {words}." in page.text(".job-head .sub")


def test_under_the_plot_a_verdict_without_words_gets_the_pages_own(farm, dashboard):
    farm.jobs["j-1"] = job(verdict={**HEAVY, "words": ""})
    farm.report = report(1, 2)
    page = dashboard("#/jobs/j-1")

    assert page.wait("document.querySelector('.plot-verdict .doubt')?.innerText") == "Still noisy: a few bright pixels carry the error"


def test_samples_that_are_counted_take_what_they_take(farm, dashboard):
    """However doubtful the error is: only the time to a target depends on it."""
    farm.jobs["j-1"] = job(verdict=HEAVY)
    page = dashboard()
    page.wait("document.querySelector('[data-job] .doubt')")
    assert "at least" not in page.text("[data-job]")
    page.evaluate("void (location.hash = '#/jobs/j-1')")
    page.wait("document.querySelector('.figures .doubt')")
    assert "at least" not in page.text(".job")


def test_a_job_that_is_trusted_again_gets_its_interval_back(farm, dashboard):
    farm.jobs["j-1"] = job(target_error=0.001, verdict=EARLY)
    page = dashboard()
    page.wait("document.querySelector('[data-job] .doubt')")
    assert "at least 42 s" in " ".join(page.text("[data-job]").split())

    farm.change("j-1", verdict={"kind": "converging", "words": "converging as expected", "trusted": True})

    page.wait("!document.querySelector('[data-job] .doubt')")
    assert "at least" not in page.text("[data-job]")


def test_an_early_report_that_is_not_trusted_is_marked(farm, dashboard):
    """Also by a coordinator whose jobs have no verdict."""
    farm.jobs["j-1"] = job()
    farm.report = report(1, 2, verdict_kind="early", trusted=False, verdict="no sample has found light")
    page = dashboard("#/jobs/j-1")

    assert page.wait("document.querySelector('.plot-verdict .doubt')?.innerText") == "no sample has found light"


def test_a_part_of_the_image_says_that_it_is_one(farm, dashboard):
    farm.jobs["j-1"] = job(pixels_without_samples=2048)
    page = dashboard("#/jobs/j-1")

    page.wait("document.querySelector('.figures')?.innerText.includes('of the part rendered so far')")
    assert "95 %" not in page.text(".figures")


@pytest.mark.parametrize("fields, shown", [
    ({"spp_asked": None, "target_error": 0.001}, "until the target at most 65,536"), ({"spp_asked": None}, "until its time is up at most 65,536"),
    ({"spp_asked": None, "target_error": 0.001, "state": "done", "stopped": "error"}, "for the target at most 65,536"),
    ({"spp_asked": 65536, "target_error": 0.001}, "of 65,536"), ({}, "of 65,536")])
def test_samples_that_nobody_asked_for_are_no_goal(farm, dashboard, fields, shown):
    farm.jobs["j-1"] = job(spp=65536, spp_done=88, **fields)
    page = dashboard("#/jobs/j-1")

    page.wait("document.querySelector('.figures')")

    assert f"Samples per pixel 88 {shown} RMSE" in " ".join(page.text(".figures").split())


# ---- maps ----

def middle_pixel(page):
    return page.evaluate("(() => { const c = document.querySelector('.stage live-image canvas'); return [...c.getContext('2d').getImageData(c.width / 2, c.height / 2, 1, 1).data.slice(0, 3)]; })()")


def test_the_maps_are_shown_over_the_image_and_follow_what_is_folded(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.stage live-image')?.dataset.painted")
    assert middle_pixel(page) == [200, 120, 40]

    page.click(".image-tools [value=error]")
    page.wait("document.querySelector('.stage live-image').dataset.painted === '2'")

    assert middle_pixel(page) == [150, 30, 110]
    assert "100 %" in page.text(".legend") and page.evaluate("document.querySelector('.stage live-image').getAttribute('aria-label')") == "steam.xml, error of each pixel"
    farm.emit("tile", {"job": "j-1", "tile": 0, "rect": [0, 0, 32, 32], "state": "folded", "spp": 8, "worker": "w-1"})
    page.wait("Number(document.querySelector('.stage live-image').dataset.painted) >= 3")
    assert farm.asked("GET", "/api/v1/jobs/j-1/error.png") >= 2

    page.click(".image-tools [value=samples]")
    page.wait("document.querySelector('.legend').innerText.includes('16,384 or more')")
    page.click(".image-tools [value=picture]")
    page.wait("document.querySelector('#exposure')")


# ---- where the time went ----

def test_the_parts_of_the_time_fill_the_bar(farm, dashboard):
    farm.jobs["j-1"] = job(time=TIME)
    page = dashboard("#/jobs/j-1")

    page.wait("document.querySelector('.time-parts')")
    parts = page.evaluate("[...document.querySelectorAll('.time-parts li')].map(li => li.innerText.replace(/\\s+/g, ' ').trim())")
    widths = page.evaluate("(() => { const bar = document.querySelector('.time-bar'); return [...bar.children].map(i => +getComputedStyle(i).getPropertyValue('--part')); })()")

    assert parts == ["load 1 s 1 %", "build 2 s 2 %", "render 90 s 90 %", "transfer 3 s 3 %", "merge 1 s 1 %", "idle 3 s 3 %"]
    assert sum(widths) == pytest.approx(1) and widths[2] == pytest.approx(0.9)


def test_parts_that_are_too_small_to_count_are_less_than_one_percent(farm, dashboard):
    farm.jobs["j-1"] = job(time={"load": 1e-4, "build": 0, "render": 100, "transfer": 1e-4, "merge": 0.4, "idle": 0})
    page = dashboard("#/jobs/j-1")

    page.wait("document.querySelector('.time-parts')")

    assert page.evaluate("[...document.querySelectorAll('.time-parts small')].map(e => e.innerText)") == ["< 1 %", "0 %", "> 99 %", "< 1 %", "< 1 %", "0 %"]


# ---- what changes must not make the page jump ----

def test_nothing_jumps_from_the_first_sample_to_the_last(farm, dashboard):
    nothing = {"merge": 0, "load": 0, "build": 0, "render": 0, "transfer": 0, "idle": 0}
    farm.jobs["j-1"] = job(progress=0, units_done=0, spp_done=0, relmse=None, rmse=None, relmse_ci95=None, eta_seconds=None, target_error=0.001, time=nothing)
    page = dashboard("#/jobs/j-1", width=1280, height=2000)
    page.wait("document.querySelector('.plot-empty')")
    page.evaluate("""void (() => {
      window.jumps = [];
      const named = ({ node, previousRect, currentRect }) => `${node?.parentElement?.className ?? ""} ${node?.nodeName} ${node?.textContent?.slice(0, 40)}: ${previousRect.y} to ${currentRect.y}`;
      const moved = ({ previousRect, currentRect }) => Math.abs(currentRect.y - previousRect.y) > 0.5; // a figure that has become longer may reach further to the left
      new PerformanceObserver((list) => list.getEntries().forEach((entry) => window.jumps.push(...entry.sources.filter(moved).map(named))))
        .observe({ type: "layout-shift", buffered: false });
    })()""")

    farm.report = report(1)
    farm.change("j-1", progress=0.1, units_done=2, spp_done=4, relmse=0.1, rmse=0.1, relmse_ci95=[0.08, 0.12], eta_seconds=20000, time=TIME)
    page.wait("document.querySelector('.plot-point')")
    farm.report = report(1, 2, 4, 8, trusted=False, verdict="don't trust yet: few pixels carry the error (like 16 of 76800; the worst one 25 %); bright outliers may still be missing")
    farm.change("j-1", progress=0.4, **WITH_TARGET)
    page.wait("document.querySelectorAll('.plot-point').length === 4 && document.querySelector('.plot-meets')")
    farm.report = report(1, 2, 4, 8, 100)
    farm.change("j-1", state="done", stopped="error", progress=1, relmse=0.00099, eta_seconds=None, eta_ci95=None, eta_with_more=None)
    page.wait("document.querySelectorAll('.plot-point').length === 5 && document.querySelector('.state-done')")
    page.evaluate("new Promise(requestAnimationFrame).then(() => new Promise(requestAnimationFrame))")

    assert page.evaluate("window.jumps") == []


# ---- removed jobs ----

def test_a_removed_job_leaves_the_list(farm, dashboard):
    farm.jobs.update({"j-1": job(), "j-2": job("j-2", "cloud.xml")})
    page = dashboard()
    page.wait("document.querySelectorAll('[data-job]').length === 2")

    farm.remove("j-1")

    page.wait("document.querySelectorAll('[data-job]').length === 1")
    assert page.evaluate("document.querySelector('[data-job]').dataset.job") == "j-2"


def test_the_page_of_a_removed_job_says_so(farm, dashboard):
    farm.jobs["j-1"] = job()
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.job')")

    farm.remove("j-1")

    page.wait("document.querySelector('[role=alert]')?.innerText.includes('Somebody has removed this job')")
    assert page.count("live-image") == 0


# ---- colours ----

CONTRAST = """(() => {
  const rgba = (text) => { const n = text.match(/[\\d.]+/g).map(Number); return text.startsWith("color(srgb") ? [...n.slice(0, 3).map((v) => 255 * v), n[3] ?? 1] : [...n.slice(0, 3), n[3] ?? 1]; };
  const over = ([r, g, b, a], under) => [r, g, b].map((v, i) => v * a + under[i] * (1 - a));
  const light = (colour) => { const [r, g, b] = colour.map((v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
  const ground = (element) => element ? over(rgba(getComputedStyle(element).backgroundColor), ground(element.parentElement)) : [255, 255, 255];
  const faint = [];
  let seen = 0;
  for (const element of document.querySelectorAll("#app *")) {
    if (![...element.childNodes].some((node) => node.nodeType === 3 && node.data.trim()) || element.closest(".unseen, .skip, .stage") || !element.getClientRects().length) continue;
    const inSvg = element instanceof SVGElement;
    const under = ground(inSvg ? element.closest("svg").parentElement : element);
    const style = getComputedStyle(element);
    const [bright, dark] = [light(over(rgba(inSvg ? style.fill : style.color), under)), light(under)].sort((a, b) => b - a);
    seen += 1;
    if ((bright + 0.05) / (dark + 0.05) < 4.5) faint.push([element.textContent.slice(0, 30), ((bright + 0.05) / (dark + 0.05)).toFixed(2)]);
  }
  return [seen, faint];
})()"""


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("view", ["job-reference", "job-unhealthy", "job-failed", "jobs", "jobs-page", "viewer", "viewer-compare", "viewer-objects", "workers", "submit-refused", "signin-refused"])
def test_every_text_has_the_contrast_that_wcag_asks_for(open_page, farm, view, theme):
    """Level AA: at least 4.5 to 1, by day and by night."""
    page = open_page("about:blank")
    page.call("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]})
    page.go(f"{farm.url}/demo.html?view={view}")

    page.wait("document.querySelector('#app *')")
    seen, faint = page.evaluate(CONTRAST)

    assert seen > 3 and faint == []


def test_by_day_the_page_is_light(open_page, farm):
    grounds = {}
    for theme in ("dark", "light"):
        page = open_page("about:blank")
        page.call("Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]})
        page.go(f"{farm.url}/demo.html?view=jobs")
        grounds[theme] = page.wait("getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)")

    assert min(grounds["light"]) > 230 and max(grounds["dark"]) < 30
