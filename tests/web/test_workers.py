"""The list of workers: order, search, how to add one, and sending one away."""
import json
import os
import pathlib
import signal

import pytest

from local_farm import SCENE, LocalFarm, wait_until
from stub_farm import worker

NAMES = "[...document.querySelectorAll('.worker-list .worker-name')].map(e => e.innerText)"


@pytest.fixture
def some(farm):
    farm.workers = {f"w-{n}": worker(f"w-{n}", f"lab-{n}", threads=n % 4 + 1, tags=["gpu"] if n % 3 == 0 else [], units_done=100 - n) for n in range(1, 13)}
    return farm


def shows(page, names):
    page.wait(f"JSON.stringify({NAMES}) === {json.dumps(json.dumps(names, separators=(',', ':')))}")


def head(page, name):
    page.evaluate(f"[...document.querySelectorAll('.worker-list .sort')].find(b => b.innerText.startsWith({json.dumps(name)})).click()")


def test_workers_are_ordered_by_their_columns(some, dashboard):
    page = dashboard("#/workers")
    shows(page, [f"lab-{n}" for n in range(1, 13)])
    head(page, "Threads")
    shows(page, [f"lab-{n}" for n in (3, 7, 11, 2, 6, 10, 1, 5, 9, 4, 8, 12)])
    head(page, "Done")
    shows(page, [f"lab-{n}" for n in range(1, 13)])
    head(page, "Done")
    shows(page, [f"lab-{n}" for n in range(12, 0, -1)])


def test_workers_are_searched_by_all_words(some, dashboard):
    page = dashboard("#/workers")
    page.click("#worker-search")
    page.type("GPU lab-1")
    shows(page, ["lab-12"])
    page.type("x")
    page.wait("document.querySelector('main').innerText.includes('No worker matches.')")


def test_the_list_of_workers_stands_in_the_address(some, dashboard):
    page = dashboard("#/workers?search=lab-1&sort=-Threads")
    shows(page, [f"lab-{n}" for n in (11, 10, 1, 12)])
    page.click("#worker-search")
    page.type("2")
    shows(page, ["lab-12"])
    head(page, "Done")
    page.wait("location.hash === '#/workers?search=lab-12&sort=-Done'")
    page.evaluate("history.back()")
    page.wait("location.hash === '#/workers?search=lab-12&sort=-Threads'")
    page.evaluate("history.back()")
    shows(page, [f"lab-{n}" for n in (11, 10, 1, 12)])
    assert page.evaluate("document.getElementById('worker-search').value") == "lab-1"


def test_a_wrong_order_in_the_address_of_workers_is_that_by_name(some, dashboard):
    page = dashboard("#/workers?sort=-nonsense&tag=gpu")
    shows(page, [f"lab-{n}" for n in (12, 9, 6, 3)])


def test_the_search_has_a_line_for_itself_on_a_phone(some, dashboard):
    page = dashboard("#/workers", width=375, height=800, phone=True)
    page.wait("document.getElementById('worker-search')")
    assert page.evaluate("document.getElementById('worker-search').offsetWidth >= document.querySelector('.list-tools').clientWidth")


def test_workers_are_chosen_by_a_tag(some, dashboard):
    some.workers["w-1"]["tags"] = ["gpu-room"]
    page = dashboard("#/workers")
    page.wait("document.getElementById('worker-tag')")
    assert page.evaluate("[...document.getElementById('worker-tag').options].map(o => o.text)") == ["any", "gpu", "gpu-room"]
    page.evaluate("(e => { e.value = 'gpu'; e.dispatchEvent(new Event('change')); })(document.getElementById('worker-tag'))")
    shows(page, ["lab-3", "lab-6", "lab-9", "lab-12"])


def test_a_worker_is_sent_away_after_one_more_question(some, dashboard):
    page = dashboard("#/workers")
    page.click("[data-worker=w-3] .acts button")
    page.click("[data-worker=w-3] .acts .danger")
    page.wait("document.querySelector('[data-worker=w-3] .pill')?.innerText === 'draining'")
    assert some.changes == [("w-3", {"state": "draining"})]

    assert page.text("[data-worker=w-3] .acts button") == "Keep after all"
    page.click("[data-worker=w-3] .acts button")
    page.wait("!document.querySelector('[data-worker=w-3] .pill')")
    assert some.changes[1:] == [("w-3", {"state": "connected"})]


def test_a_worker_is_restarted_and_can_be_kept_until_then(some, dashboard):
    some.workers["w-4"] = {**some.workers["w-4"], "state": "sick", "activity": "failed in 2 jobs"}
    page = dashboard("#/workers")
    page.click("[data-worker=w-3] [aria-label='Restart: lab-3']")
    page.wait("document.querySelector('[data-worker=w-3] .pill')?.innerText === 'restarting'")
    assert page.text("[data-worker=w-3] .acts") == "Keep after all"
    page.click("[data-worker=w-3] .acts button")
    page.wait("!document.querySelector('[data-worker=w-3] .pill')")
    assert some.changes == [("w-3", {"state": "restarting"}), ("w-3", {"state": "connected"})]

    assert page.text("[data-worker=w-4] .acts") == "Restart" and "failed in 2 jobs" in page.text("[data-worker=w-4] .doing")
    page.click("[data-worker=w-4] .acts button")
    page.wait("document.querySelector('[data-worker=w-4] .pill')?.innerText === 'restarting'")


@pytest.mark.parametrize("role", ["submit", "read"])
def test_only_an_admin_sends_workers_away(some, dashboard, role):
    some.role = role
    page = dashboard("#/workers")
    page.wait("document.querySelector('[data-worker]')")
    assert page.count(".acts") == 0
    assert (page.count(".add-worker") == 1) == (role == "submit")


def test_the_log_of_a_worker_is_below_its_row(some, dashboard):
    some.worker_logs = {"w-3": "2026-01-01T00:00:00Z connected: joined\n<b>unhealthy</b>: 3 failures\n"}
    page = dashboard("#/workers")
    page.click("[data-worker=w-3] .open-log")
    page.wait("document.querySelector('[data-worker=w-3] + .worker-log pre')")
    assert page.text(".worker-log pre") == "2026-01-01T00:00:00Z connected: joined <b>unhealthy</b>: 3 failures"
    assert page.evaluate("document.querySelector('[data-worker=w-3] .open-log').getAttribute('aria-expanded')") == "true"

    page.click("[data-worker=w-3] .open-log")
    page.wait("!document.querySelector('.worker-log')")


def test_the_log_of_a_worker_that_is_gone_ends_in_an_error(some, dashboard):
    page = dashboard("#/workers")
    page.click("[data-worker=w-5] .open-log")
    page.wait("document.body.innerText.includes('there is no such worker')")
    assert page.count(".worker-log") == 0


@pytest.mark.parametrize("role, seen", [("submit", 0), ("read", 12), ("admin", 12)])
def test_logs_of_workers_are_for_those_who_see_all_jobs(some, dashboard, role, seen):
    some.role = role
    page = dashboard("#/workers")
    page.wait("document.querySelector('[data-worker]')")
    assert page.count(".open-log") == seen


TLS = " --tls-ca ca.pem --tls-cert worker.pem --tls-key worker.key"


@pytest.mark.parametrize("join, command, more", [
    ({"address": "0.0.0.0:15151", "tls": False, "token_file": "/srv/join-token"}, "lightshaft-worker --coordinator HOST:15151 --token-file join-token", "/srv/join-token"),
    ({"address": "farm.example:6000", "tls": True}, f"lightshaft-worker --coordinator farm.example:6000{TLS} --token-file join-token", "worker.key"),
    ({"address": "0.0.0.0:50051", "tls": True}, f"lightshaft-worker --coordinator HOST:50051{TLS} --token-file join-token", "HOST is the name or address of the coordinator's machine."),
    ({"address": "127.0.0.1:15151", "tls": False}, "lightshaft-worker --coordinator 127.0.0.1:15151 --token-file join-token", "--grpc 0.0.0.0:15151")])
def test_the_command_that_adds_a_worker_has_this_coordinators_address(farm, dashboard, join, command, more):
    farm.join = join
    page = dashboard("#/workers")
    page.wait("document.querySelector('.empty h1')?.innerText === 'No worker is connected'")
    assert page.text(".empty pre") == command
    assert more in page.text(".empty")


@pytest.mark.parametrize("join", [{"address": "0.0.0.0:50051", "tls": True}, {"address": "127.0.0.1:50051", "tls": False}])
def test_the_short_way_to_add_a_machine_comes_before_the_long_one(farm, dashboard, join):
    """Both kinds of `lightshaft up`: with --lan, and on one machine."""
    farm.join = join
    page = dashboard("#/workers")
    page.wait("document.querySelector('.empty h1')?.innerText === 'No worker is connected'")
    short = page.text(".empty").split("lightshaft-worker")[0]
    assert "lightshaft up --lan" in short and "lightshaft join HOST --code CODE" in short


def test_the_address_by_which_a_page_was_opened_is_the_workers_too(farm, open_page):
    page = open_page(f"{farm.url}/demo.html")
    command = page.evaluate("""import("/js/views/workers.js").then(({ joinCommand }) => joinCommand({ address: "[::]:50051", tls: false }, "farm.example"))""")
    assert command == "lightshaft-worker --coordinator farm.example:50051 --token-file join-token"


def test_a_real_worker_ends_when_it_is_sent_away_and_the_command_is_right(tmp_path, open_page, programs):
    with LocalFarm(tmp_path, programs) as farm:
        page = open_page(f"{farm.url()}/#token={farm.token}")
        page.wait("document.querySelector('.link.live')")
        page.evaluate("void (location.hash = '#/workers')")
        page.wait("document.querySelector('.empty h1')?.innerText === 'No worker is connected'")
        command = page.text(".empty pre")
        assert f"--coordinator 127.0.0.1:{farm.grpc} " in command

        one = farm.add_worker()
        page.click("[data-worker].is-connected .acts button")
        page.click("[data-worker] .acts .danger")

        wait_until(lambda: one.popen.poll() is not None, "the worker ends")
        assert one.popen.returncode == 0
        page.wait("!document.querySelector('[data-worker].is-connected')")


def test_a_real_worker_that_drains_is_kept_and_renders_on(tmp_path, open_page, programs):
    with LocalFarm(tmp_path, programs) as farm:
        worker = farm.add_worker(fake=False)
        job = farm.submit(SCENE, spp=4096)
        wait_until(lambda: farm.job(job)["units_done"] > 0, "it renders")
        renderers = [int(pid) for pid in pathlib.Path(f"/proc/{worker.popen.pid}/task/{worker.popen.pid}/children").read_text().split()]
        for pid in renderers:
            os.kill(pid, signal.SIGSTOP)  # so that its units, and the drain, take longer than the test
        page = open_page(f"{farm.url()}/#token={farm.token}")
        page.wait("document.querySelector('.link.live')")
        page.evaluate("void (location.hash = '#/workers')")

        page.click("[data-worker].is-connected .acts button")
        page.click("[data-worker] .acts .danger")
        page.wait("document.querySelector('[data-worker].is-draining .acts button')?.innerText === 'Keep after all'")
        page.click("[data-worker].is-draining .acts button")
        page.wait("document.querySelector('[data-worker].is-connected')")
        for pid in renderers:
            os.kill(pid, signal.SIGCONT)

        before = farm.job(job)["units_done"]
        wait_until(lambda: farm.job(job)["units_done"] > before + 4, "it gets further units")
        assert worker.alive()
