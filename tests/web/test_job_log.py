"""The page of a job's log."""
import pytest
from stub_farm import job

LINES = "document.querySelector('.log-page pre')"
AT_END = f"{LINES}?.scrollTop > 0 && {LINES}.scrollHeight - {LINES}.scrollTop - {LINES}.clientHeight < 2"


@pytest.fixture
def logged(farm):
    farm.jobs["j-1"] = job()
    farm.log = "".join(f"12:00:01 tile {n} is done\n" for n in range(300))
    return farm


def test_the_log_opens_as_a_page_and_back_leads_to_the_job(logged, dashboard):
    page = dashboard("#/jobs/j-1")
    page.click(".job-log summary")
    page.wait("document.querySelector('.job-log pre')")  # which moves the link
    page.click(".job-log a")
    page.wait(AT_END)
    assert page.evaluate("location.hash") == "#/jobs/j-1/log"
    assert page.evaluate("document.title") == "Log of steam.xml · Lightshaft"

    page.evaluate("history.back()")
    page.wait("document.querySelector('.job .figures') && location.hash === '#/jobs/j-1'")
    assert not page.evaluate("document.querySelector('.job-log').open")
    page.evaluate("history.forward()")
    page.wait(AT_END)


def test_a_log_that_comes_before_its_page_is_drawn_opens_at_its_end(logged, dashboard):
    page = dashboard("#/jobs/j-1")
    page.click(".job-log summary")
    page.wait("document.querySelector('.job-log pre')")
    # A page that draws so late has its answer first.
    page.evaluate("(draw => { window.requestAnimationFrame = (f) => setTimeout(() => draw(f), 500); })(window.requestAnimationFrame)")
    page.evaluate("document.querySelector('.job-log pre').scrollTop = 40")
    page.click(".job-log a")
    page.wait(AT_END)


@pytest.mark.parametrize("width, height", [(1280, 900), (375, 700), (900, 400)])
def test_the_lines_fill_the_window(logged, dashboard, width, height):
    page = dashboard("#/jobs/j-1/log", width=width, height=height, phone=width < 500)
    page.wait(AT_END)

    room = page.evaluate(f"{LINES}.getBoundingClientRect().bottom"), page.evaluate("document.documentElement.scrollHeight")

    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate(f"{LINES}.clientHeight") > min(height, 450) / 3
    if height > 450:
        assert height - 40 < room[0] < height and room[1] <= height


def test_the_page_follows_its_job_to_the_end_and_keeps_the_readers_place(logged, dashboard):
    page = dashboard("#/jobs/j-1/log")
    page.wait(AT_END)

    logged.log += 50 * "12:00:09 lab-01 was lost\n"
    logged.change("j-1", progress=0.5)
    page.wait(f"{LINES}.textContent.includes('lab-01 was lost') && {AT_END}")
    page.evaluate(f"{LINES}.scrollTop = 40")
    logged.log += "12:00:20 done\n"
    logged.change("j-1", state="done", progress=1)
    page.wait(f"{LINES}.textContent.endsWith('12:00:20 done\\n')")

    assert page.evaluate(f"{LINES}.scrollTop") == 40
    assert page.text(".heading .pill") == "done"
    assert logged.asked("GET", "/api/v1/jobs/j-1/report") == 0, "what the page does not show is not fetched"


def test_an_older_answer_does_not_replace_a_newer_log(logged, dashboard):
    page = dashboard("#/jobs/j-1/log")
    page.wait(AT_END)
    page.hold_reply("url.endsWith('/log')")
    page.click(".heading button")
    page.wait("window.held")
    logged.log += "12:00:20 done\n"
    page.click(".heading button")
    page.wait(f"{LINES}.textContent.endsWith('12:00:20 done\\n')")

    page.release_reply()

    assert page.evaluate(f"{LINES}.textContent.endsWith('12:00:20 done\\n')")


def test_keys_scroll_the_log_at_once(logged, dashboard):
    page = dashboard("#/jobs/j-1/log")
    page.wait(f"document.activeElement === {LINES} && {AT_END}")
    page.key("Home", virtual=36)
    page.wait(f"{LINES}.scrollTop === 0")


def test_a_log_that_is_closed_while_it_is_fetched_stays_closed(logged, dashboard):
    page = dashboard("#/jobs/j-1")
    page.wait("document.querySelector('.job-log')")
    page.hold_reply("url.endsWith('/log')")
    page.click(".job-log summary")
    page.wait("window.held")
    page.click(".job-log summary")
    page.wait("!document.querySelector('.job-log').open")

    page.release_reply()

    assert page.count(".job-log pre") == 0


@pytest.mark.parametrize("id", ["NOPE", "j-7"])
def test_the_log_of_no_job_ends_in_an_error(logged, dashboard, id):
    page = dashboard(f"#/jobs/{id}/log")
    page.wait(f"document.querySelector('.notice.bad')?.innerText.includes('There is no job \"{id}\"')")
    assert page.count(".toast") == 0


def test_a_job_that_is_removed_takes_the_page_of_its_log_along(logged, dashboard):
    page = dashboard("#/jobs/j-1/log")
    page.wait(AT_END)
    logged.remove("j-1")
    page.wait("document.querySelector('.notice.bad')?.innerText.includes('Somebody has removed this job')")
    assert page.count(".toast") == 0


def test_a_frame_has_a_log_of_its_own(logged, dashboard):
    frame = {"frame": 2, "id": "j-2-frame2", "state": "running", "progress": 0.5, "spp_done": 8, "relmse": 0.1, "error": None}
    frames = {"range": "2", "total": 1, "done": 0, "running": 1, "failed": 0, "cancelled": 0, "current": 2, "list": [frame]}
    logged.jobs["j-2"] = job("j-2", frames=frames)
    logged.jobs["j-2-frame2"] = job("j-2-frame2", sequence="j-2", frame=2)
    page = dashboard("#/jobs/j-2")
    page.click(".job-log summary")
    page.wait("document.querySelector('.job-log pre')")  # which moves the link
    page.click(".job-log a")
    page.wait(AT_END)
    assert page.evaluate("location.hash") == "#/jobs/j-2-frame2/log"

    page.click(".crumb a:nth-of-type(2)")
    page.wait("location.hash === '#/jobs/j-2/2' && document.querySelector('.job .figures')")
