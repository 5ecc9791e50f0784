"""What a role may not do is not offered, and whose a job is is shown to those who see others' jobs: against a double of the
coordinator, and once against the real one."""

import json

import pytest
from local_farm import SCENE, LocalFarm, wait_until
from stub_farm import job

ACTIONS = "[...document.querySelectorAll('main button, header nav a, main a.button')].map((e) => e.innerText).filter(Boolean).join('|')"


@pytest.mark.parametrize("role, changes, owners", [("admin", True, True), ("submit", True, False), ("read", False, True)])
def test_a_role_is_offered_what_it_may_do(farm, dashboard, role, changes, owners):
    farm.role = role
    farm.jobs = {"j-1": job(), "j-2": job("j-2", "cloud.xml", "paused", owner="ann")}
    page = dashboard()
    page.wait("document.querySelector('[data-job=\"j-2\"]')")

    offered = page.evaluate(ACTIONS)
    for name in ("Pause", "Cancel", "Resume", "New job"):
        assert (name in offered) == changes, (name, offered)
    assert ("Owner" in page.text("thead")) == owners
    assert ("ann" in page.text("[data-job='j-2']")) == owners
    assert ("admin" in page.text("[data-job='j-1']")) == owners

    page.evaluate("void (location.hash = '#/jobs/j-2')")
    page.wait("document.querySelector('.job-head')")
    assert ("Resume" in page.evaluate(ACTIONS)) == changes
    assert ("of ann" in page.text(".crumb")) == owners

    page.evaluate("void (location.hash = '#/submit')")
    page.wait("!document.querySelector('.job-head')")
    assert bool(page.evaluate("!!document.getElementById('files')")) == changes
    assert ("may look" in page.text("main")) != changes


def test_a_reader_of_an_empty_farm_is_not_told_to_hand_in_jobs(farm, dashboard):
    farm.role = "read"
    page = dashboard()
    page.wait("document.querySelector('.empty')")

    assert "curl" not in page.text("main")
    assert "New job" not in page.evaluate(ACTIONS)


def test_start_over_stays_where_it_is_when_the_list_of_files_comes(farm, dashboard, tmp_path):
    (tmp_path / "bath.xml").write_text('<scene version="3.0.0"><shape type="obj"><string name="filename" value="tub.obj"/></shape></scene>')
    (tmp_path / "tub.obj").write_text("v 0 0 0\n")
    page = dashboard("#/submit")
    page.wait("document.getElementById('files')")
    # Where the button stands at every drawing of the page, the first of which knows no list yet.
    page.evaluate("""void (window.seen = [], new MutationObserver(() => {
        const button = document.querySelector('.bundle button');
        if (button) window.seen.push([!!document.querySelector('.files'), Math.round(button.getBoundingClientRect().top), Math.round(button.getBoundingClientRect().left)]);
      }).observe(document.getElementById('app'), { childList: true, subtree: true }))""")
    # The scene can be read once the page was drawn without its list: on a busy machine both could fall into one frame.
    page.evaluate("""void (() => {
        const read = Blob.prototype.text, allowed = new Promise((allow) => { window.allowReading = allow; });
        Blob.prototype.text = async function () { await allowed; return read.call(this); };
      })()""")

    page.set_files("#files", [tmp_path / "bath.xml", tmp_path / "tub.obj"])
    page.wait("document.querySelector('.bundle button')")
    page.evaluate("void window.allowReading()")
    page.wait("document.querySelector('.files')")

    seen = page.evaluate("window.seen")
    assert {listed for listed, *_ in seen} == {False, True}, "before and after the list came"
    assert len({tuple(place) for _, *place in seen}) == 1, seen


def test_a_link_with_another_users_token_asks_before_it_replaces_a_session(farm, dashboard):
    farm.other_tokens["of-mallory"] = {"role": "submit", "user": "mallory"}
    page = dashboard()

    page.evaluate("void (location.hash = '#token=of-mallory')")
    page.wait("document.querySelector('main .toast button')")
    assert "signs in as mallory (submit)" in page.text("main .toast")
    assert farm.role == "admin", "nobody has answered yet"
    assert "of-mallory" not in page.evaluate("location.href")

    page.evaluate("void [...document.querySelectorAll('main .toast button')].find((b) => b.innerText.includes('Stay')).click()")
    page.wait("!document.querySelector('main .toast')")
    assert farm.role == "admin"

    page.evaluate("void (location.hash = '#token=of-mallory')")
    page.wait("document.querySelector('main .toast button')")
    page.evaluate("void [...document.querySelectorAll('main .toast button')].find((b) => b.innerText.includes('Continue')).click()")
    wait_until(lambda: farm.user == "mallory", "the session is the other user's")


def test_a_link_with_a_wrong_token_leaves_the_session_alone(farm, dashboard):
    page = dashboard()

    page.evaluate("void (location.hash = '#token=wrong')")
    page.wait("document.querySelector('main .toast')")
    assert "still signed in" in page.text("main .toast")
    assert farm.signed_in and farm.role == "admin"


def test_dots_in_the_address_are_no_job(farm, dashboard):
    page = dashboard()
    for route in ("#/jobs/..", "#/jobs/%2e%2e", "#/view/.", "#/jobs/../1"):
        page.evaluate(f"void (location.hash = {route!r})")
        page.wait("document.querySelector('h1')")
    assert not [path for _, path in farm.requests if ".." in path or path in ("/api/v1/", "/api/v1/jobs/")]


def test_the_real_coordinator_says_who_is_signed_in(open_page):
    with LocalFarm() as farm:
        made = {role: json.loads(farm.request("POST", "/api/v1/tokens", json.dumps({"role": role, "user": "ann"}).encode())) for role in ("read", "submit")}
        mine = json.loads(farm.request("POST", "/api/v1/jobs?spp=2", SCENE.encode(), "application/xml", made["submit"]["token"]))["id"]
        for role, offered in (("read", False), ("submit", True)):
            page = open_page(f"{farm.url()}/#token={made[role]['token']}")
            page.wait(f"document.querySelector('[data-job=\"{mine}\"]')")
            assert ("Cancel" in page.evaluate(ACTIONS)) == offered
            assert ("ann" in page.text(f"[data-job='{mine}']")) == (role == "read")
            page.click("header button")
            page.wait("document.querySelector('#main.alone')")
