"""The list of jobs: pages, what narrows it, and what is done to several jobs at once."""
import json

import pytest

from stub_farm import attempt, failure, job

NAMES = "[...document.querySelectorAll('[data-job]')].map(row => row.dataset.job)"


@pytest.fixture
def many(farm):
    """10,000 jobs: every tenth renders, one failed; the newest has the highest number."""
    for n in range(10000):
        state = "failed" if n == 7 else "running" if n % 10 == 0 else "done"
        farm.jobs[f"j-{n:04}"] = job(f"j-{n:04}", f"scene-{n}.xml", state, submitted_unix=1765000000 + n, owner="anna" if n % 2 else "bert")
    return farm


def shows(page, ids):
    page.wait(f"JSON.stringify({NAMES}) === {json.dumps(json.dumps(ids, separators=(',', ':')))}")


def test_of_thousands_of_jobs_one_page_is_fetched_and_drawn(many, dashboard):
    page = dashboard()
    page.wait("document.querySelectorAll('[data-job]').length === 50")

    assert page.text(".heading .sub") == "10,000 jobs · 1,000 rendering · 1 failed"
    assert page.text(".pager .number") == "1 – 50 of 10,000"
    assert all("limit=50" in path for method, path in many.requests if path.startswith("/api/v1/jobs?"))
    page.click(".pager button:nth-of-type(3)")
    page.wait("document.querySelector('.pager .number').innerText === '51 – 100 of 10,000'")
    assert page.evaluate("location.hash") == "#/jobs?page=2"
    page.click(".pager button:nth-of-type(4)")
    page.wait("document.querySelector('.pager .number').innerText === '9,951 – 10,000 of 10,000'")
    assert page.evaluate("document.querySelectorAll('[data-job]').length") == 50


def test_search_state_owner_age_and_order_narrow_the_list_and_stand_in_the_address(many, dashboard):
    page = dashboard()
    page.wait("document.querySelector('#list-search')")
    page.click("#list-search")
    page.type("scene-320")
    page.wait("document.querySelectorAll('[data-job]').length === 11")
    page.click("[name=state][value=done]")
    page.wait("document.querySelectorAll('[data-job]').length === 9")

    page.evaluate("(() => { const s = document.getElementById('list-owner'); s.value = '=anna'; s.dispatchEvent(new Event('change')); })()")
    page.wait("document.querySelectorAll('[data-job]').length === 5")
    page.evaluate("(() => { const s = document.getElementById('list-sort'); s.value = 'submitted'; s.dispatchEvent(new Event('change')); })()")
    shows(page, ["j-3201", "j-3203", "j-3205", "j-3207", "j-3209"])

    assert page.evaluate("location.hash") == "#/jobs?search=scene-320&state=done&owner=anna&sort=submitted"
    page.evaluate("(() => { const s = document.getElementById('list-days'); s.value = '1'; s.dispatchEvent(new Event('change')); })()")
    page.wait("document.querySelector('main').innerText.includes('No job is like this.')")


def test_jobs_that_wait_for_files_are_shown(farm, dashboard):
    farm.announced = [{"id": "x1", "name": "shot.xml", "owner": "ada", "machine": "render-3", "frames": "1-48", "files": ["/scratch/smoke.0007.vdb"], "count": 12, "since_unix": 1765000000},
                      {"id": "x2", "name": "<i>still</i>.xml", "owner": "", "machine": "", "frames": None, "files": ["sky.exr"], "count": 1, "since_unix": 1765000000}]
    page = dashboard()
    page.wait("document.querySelectorAll('.announced li').length === 2")

    first, second = page.evaluate("[...document.querySelectorAll('.announced li')].map(one => one.innerText)")
    assert first.startswith("shot.xml · frames 1-48 · ada") and "needs /scratch/smoke.0007.vdb and 11 other files, on render-3 · since " in first
    assert second.startswith("<i>still</i>.xml") and "needs sky.exr · since " in second

    farm.announced = []
    page.evaluate("location.hash = '#/workers'")
    page.wait("!document.querySelector('.announced')")
    page.evaluate("location.hash = '#/jobs'")
    page.wait("document.querySelector('main').innerText.includes('Nothing is rendering yet')")


def test_a_link_opens_the_same_list(many, dashboard):
    page = dashboard("#/jobs?search=scene-7&state=failed")
    shows(page, ["j-0007"])
    assert page.evaluate("document.getElementById('list-search').value") == "scene-7"
    assert page.evaluate("document.querySelector('[name=state][value=failed]').checked")


def test_jobs_that_come_go_and_change_are_fetched_in_their_place(farm, dashboard):
    farm.jobs = {f"j-{n}": job(f"j-{n}", state="done", submitted_unix=1765000000 + n) for n in range(3)}
    page = dashboard()
    shows(page, ["j-2", "j-1", "j-0"])

    farm.jobs["j-9"] = job("j-9", state="queued", submitted_unix=1765000009, units_done=0)
    farm.emit("job", farm.jobs["j-9"])
    shows(page, ["j-9", "j-2", "j-1", "j-0"])
    farm.change("j-0", state="running")
    shows(page, ["j-0", "j-9", "j-2", "j-1"])
    farm.remove("j-2")
    shows(page, ["j-0", "j-9", "j-1"])


def test_held_jobs_are_selected_and_counted(farm, dashboard):
    waits = {"state": "queued", "units_done": 0, "after": [{"id": "j-9", "state": "running"}]}
    farm.jobs = {f"j-{n}": job(f"j-{n}", submitted_unix=1765000000 + n, **more) for n, more in enumerate([waits, waits, {"state": "queued"}, {}])}
    page = dashboard()
    shows(page, ["j-3", "j-2", "j-1", "j-0"])
    assert page.text(".heading .sub") == "4 jobs · 1 rendering · 3 waiting (2 held)"
    assert page.text("label:has([value=held])") == "held 2"

    page.click("[name=state][value=held]")
    shows(page, ["j-1", "j-0"])
    assert page.evaluate("location.hash") == "#/jobs?state=held"
    farm.change("j-1", after=[])  # what it waited for is done
    shows(page, ["j-0"])
    assert page.text("label:has([value=held])") == "held 1"

    page.click("[name=state][value=running]")
    shows(page, ["j-3", "j-0"])


def test_several_jobs_are_cancelled_at_once_after_one_more_question(farm, dashboard):
    farm.jobs = {f"j-{n}": job(f"j-{n}", state="running", submitted_unix=1765000000 + n) for n in range(3)}
    page = dashboard()
    shows(page, ["j-2", "j-1", "j-0"])
    page.evaluate("document.querySelector('[data-job=j-2] input').focus()")
    page.key(" ", "Space", 32, " ")
    page.click("[data-job=j-1] input")
    page.wait("document.querySelector('.list-picked b')?.innerText === '2 jobs selected'")

    page.click(".list-picked button:nth-of-type(1)")
    page.wait("document.querySelector('.list-picked .danger')?.innerText === 'Really cancel'")
    page.click(".list-picked .danger")

    page.wait("document.querySelectorAll('.is-cancelled').length === 2 && document.querySelector('.list-picked.none')")
    assert farm.jobs["j-0"]["state"] == "running"


def test_what_cannot_be_removed_stays_picked_and_says_why(farm, dashboard):
    farm.jobs = {"j-0": job("j-0", state="running"), "j-1": job("j-1", state="done", submitted_unix=1)}
    page = dashboard()
    page.wait("document.querySelector('thead input')")
    page.click("thead input")
    page.click(".list-picked button:nth-of-type(2)")
    page.click(".list-picked .danger")

    page.wait("document.querySelector('.toast')?.innerText.includes('A job that renders is cancelled first.')")
    shows(page, ["j-0"])
    page.wait("document.querySelector('.list-picked b')?.innerText === '1 job selected'")


def three(farm):
    farm.jobs = {f"j-{n}": job(f"j-{n}", f"shot v00{n}.xml", submitted_unix=1765000000 + n, relmse=0.1 / (n + 1)) for n in range(3)}


def test_back_undoes_each_change_of_the_list(many, dashboard):
    page = dashboard()
    page.wait("document.querySelectorAll('[data-job]').length === 50")
    page.click(".pager button:nth-of-type(3)")
    page.wait("location.hash === '#/jobs?page=2'")
    page.click("[name=state][value=running]")
    page.wait("location.hash === '#/jobs?state=running'")
    page.click("#list-search")
    for letter in "3200":
        page.type(letter)
    page.wait("document.querySelectorAll('[data-job]').length === 1")

    for hash, number in (("#/jobs?state=running", "1 – 50 of 1,000"), ("#/jobs?page=2", "51 – 100 of 10,000"), ("#/jobs", "1 – 50 of 10,000")):
        page.evaluate("history.back()")
        page.wait(f"location.hash === {json.dumps(hash)} && document.querySelector('.pager .number')?.innerText === {json.dumps(number)}")


def test_a_search_needs_all_its_words(farm, dashboard):
    three(farm)
    page = dashboard()
    page.click("#list-search")
    page.type("v002 SHOT")
    shows(page, ["j-2"])


def test_the_heads_of_columns_order_the_list(farm, dashboard):
    three(farm)
    page = dashboard()
    shows(page, ["j-2", "j-1", "j-0"])
    for sort, ids, way in (("name", ["j-0", "j-1", "j-2"], "ascending"), ("-name", ["j-2", "j-1", "j-0"], "descending")):
        page.evaluate("[...document.querySelectorAll('.sort')].find(b => b.innerText.startsWith('Scene')).click()")
        page.wait(f"location.hash === '#/jobs?sort={sort}'")
        shows(page, ids)
        assert page.evaluate("document.querySelector('[aria-sort]').getAttribute('aria-sort')") == way
    assert page.evaluate("document.getElementById('list-sort').value") == "-name"


def test_shift_selects_a_range(many, dashboard):
    page = dashboard()
    page.wait("document.querySelectorAll('[data-job]').length === 50")
    page.click("[data-job]:nth-child(2) input")
    page.evaluate("document.querySelector('[data-job]:nth-child(6) input').dispatchEvent(new MouseEvent('click', { shiftKey: true, bubbles: true }))")
    page.wait("document.querySelector('.list-picked b')?.innerText === '5 jobs selected'")
    assert page.evaluate("[...document.querySelectorAll('td.pick input')].map((e, i) => e.checked ? i : -1).filter(i => i >= 0)") == [1, 2, 3, 4, 5]


def press(page, name):
    page.wait(f"[...document.querySelectorAll('.list-picked button')].some(b => b.innerText === {json.dumps(name)} && !b.disabled)")
    page.evaluate(f"[...document.querySelectorAll('.list-picked button')].find(b => b.innerText === {json.dumps(name)}).click()")


def test_all_that_match_are_selected_over_all_pages_and_changed(farm, dashboard):
    farm.jobs = {f"j-{n:03}": job(f"j-{n:03}", state="running" if n % 2 else "done", submitted_unix=n) for n in range(120)}
    page = dashboard("#/jobs?state=running")
    page.wait("document.querySelector('.pager .number')?.innerText === '1 – 50 of 60'")
    page.click("thead input")
    press(page, "Select all 60 that match")
    page.wait("document.querySelector('.list-picked b').innerText === '60 jobs selected'")

    press(page, "Pause")

    page.wait("document.querySelector('.list-picked.none')")
    assert [one["state"] for one in farm.jobs.values()].count("paused") == 60


def test_priority_of_several_jobs_is_set_at_once(farm, dashboard):
    three(farm)
    page = dashboard()
    shows(page, ["j-2", "j-1", "j-0"])
    page.click("[data-job=j-2] input")
    page.click("[data-job=j-0] input")
    page.click("#picked-priority")
    page.type("40")
    press(page, "Set")
    page.wait("document.querySelector('.list-picked.none')")
    assert sorted(farm.changes) == [("j-0", {"priority": 40}), ("j-2", {"priority": 40})]


def test_a_row_says_why_its_job_does_not_go_on(farm, dashboard):
    why = "no connected worker may take it: lab-01 lacks a tag that the job asks for"
    farm.jobs = {"j-0": job("j-0", state="queued", error=why), "j-1": job("j-1", state="failed", error="in words", failure=failure(attempt("a", "the disk is full"))),
                 "j-2": job("j-2", state="done", error=""), "j-3": job("j-3", state="paused", error="the disk is full: make room in /srv/farm")}
    page = dashboard()
    assert page.text("[data-job=j-0] .reason") == why
    assert page.text("[data-job=j-1] .reason.bad") == "the disk is full"
    assert page.text("[data-job=j-3] .reason") == "the disk is full: make room in /srv/farm"
    assert page.count("[data-job=j-2] .reason") == 0


@pytest.mark.parametrize("role, user, shown", [("admin", "", "admin"), ("submit", "anna", "anna")])
def test_whose_session_it_is_is_shown(farm, dashboard, role, user, shown):
    farm.role, farm.user = role, user
    page = dashboard()
    assert page.text("header .me") == shown


def test_a_sequence_that_is_done_follows_nothing_and_has_figures_of_its_own(farm, dashboard):
    frames = [{"frame": n, "id": f"j-1-frame{n}", "state": "done", "progress": 1, "spp_done": 64, "relmse": 0.01, "error": None} for n in (1, 2)]
    farm.jobs["j-1"] = job(state="done", relmse=0.0123, core_seconds=120, elapsed_seconds=70, spp_done=64, frames={"range": "1-2", "total": 2, "done": 2, "running": 0, "failed": 0, "cancelled": 0, "current": 2, "list": frames})
    for n in (1, 2):
        farm.jobs[f"j-1-frame{n}"] = job(f"j-1-frame{n}", state="done", sequence="j-1", frame=n)
    page = dashboard("#/jobs/j-1")
    assert page.text(".frames-whole") == "Whole sequence: relMSE 0.0123 on average · 64 samples per pixel · 2 min of core time · took 70 s"
    assert "following" not in page.text(".frames")


def test_every_row_has_a_small_picture_of_its_job(farm, dashboard):
    farm.jobs = {"j-0": job("j-0"), "j-1": job("j-1", state="queued", units_done=0)}
    page = dashboard()

    page.wait("document.querySelector('[data-job=j-0] live-image').dataset.painted === '1'")

    assert page.evaluate("(() => { const c = document.querySelector('[data-job=j-0] live-image canvas'); return [...c.getContext('2d').getImageData(3, 3, 1, 1).data]; })()") == [40, 160, 90, 255]
    assert farm.asked("GET", "/api/v1/jobs/j-1/thumbnail.png") == 0, "nothing is rendered yet"


def test_who_may_only_look_is_offered_no_picking(farm, dashboard):
    farm.role = "read"
    farm.jobs = {"j-0": job("j-0")}
    page = dashboard()
    page.wait("document.querySelector('[data-job]')")
    assert page.count("[data-job] input") == 0 and page.count("thead input") == 0


def test_the_same_scene_is_rendered_again_with_more_samples(farm, dashboard):
    farm.jobs["j-1"] = job(state="done", spp=64)
    page = dashboard("#/jobs/j-1")
    page.wait("[...document.querySelectorAll('button')].some(b => b.innerText === 'Render again …')")
    page.evaluate("[...document.querySelectorAll('button')].find(b => b.innerText === 'Render again …').click()")
    assert page.wait("document.getElementById('again-spp').value") == "128"
    page.click("#again-seed")
    page.type("x")
    page.click(".again button[type=submit]")
    assert "“x” is no whole number" in page.text(".again .field-error")
    page.evaluate("document.getElementById('again-seed').select()")
    page.type("5")
    page.key("Enter", virtual=13, text="\r")

    page.wait("location.hash === '#/jobs/j-again'")
    assert farm.submitted == [("j-1", {"spp": 128, "seed": 5})]


@pytest.mark.parametrize("width", [1280, 1000, 768, 375])
def test_the_list_fits_its_place(many, dashboard, width):
    many.change("j-9990", relmse=5.55e-5, spp=4096, spp_done=2012)  # long figures
    page = dashboard(width=width, height=800, phone=width < 500)
    page.wait("document.querySelectorAll('[data-job]').length === 50")
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("document.querySelector('.list').getBoundingClientRect().right - document.getElementById('main').getBoundingClientRect().right") < 1


def test_what_is_not_known_takes_no_room_on_a_phone(farm, dashboard):
    farm.jobs = {"j-0": job("j-0", state="done"), "j-1": job("j-1", state="done")}
    page = dashboard(width=375, height=800, phone=True)
    page.wait("document.querySelectorAll('.list td.absent').length === 2")
    assert page.evaluate("[...document.querySelectorAll('.list td.absent')].every(cell => cell.offsetParent === null)")
