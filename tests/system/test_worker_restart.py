"""Workers that restart their program when an admin asks for it: after an upgrade, say, or to get memory back."""

import json
import os
import pathlib
import re
import shutil
import signal
import stat

import pytest
from cli_kit import lightshaft
from local_farm import SCENE, HttpError, wait_until
from test_replaced_worker import render_children

SPEC = {"spp": 64, "size": "192x128"}
DELAY = ("--fake-delay", 10)


def workers(farm):
    return farm.get("/api/v1/workers")["workers"]


def id_of(farm, worker):
    """The id under which this worker is connected now."""
    return wait_until(lambda: next((w["id"] for w in workers(farm) if w["name"] == worker.name and w["state"] in ("connected", "draining", "restarting")), None), f"{worker.name} is connected")


def state_of(farm, id):
    return next((w["state"] for w in workers(farm) if w["id"] == id), "gone")


def ask(farm, id, state="restarting"):
    farm.request("PATCH", f"/api/v1/workers/{id}", json.dumps({"state": state}).encode())


def log_of(farm, id):
    return farm.request("GET", f"/api/v1/workers/{id}/log").decode()


def joined_again(farm, worker, before):
    return wait_until(lambda: (now := id_of(farm, worker)) != before and now, f"{worker.name} has joined again")


@pytest.fixture
def own_program(farm, tmp_path):
    """Workers of the farm run a copy of the program, which a test may replace."""
    programs = tmp_path / "bin"
    programs.mkdir()
    shutil.copy(farm.bin / "lightshaft-worker", programs)
    farm.bin = programs
    return programs / "lightshaft-worker"


def replace(program, text):
    new = program.with_name("new")
    new.write_text(text)
    new.chmod(0o755)
    os.replace(new, program)


def test_a_job_renders_across_restarts_to_the_same_pixels(farm, expected):
    worker = farm.add_worker(*DELAY, threads=2)
    first = id_of(farm, worker)
    job = farm.submit(SCENE, **SPEC)
    farm.wait_for_progress(job, 3)
    pid, children = worker.popen.pid, render_children(worker)
    assert len(children) == 1
    files = len(os.listdir(f"/proc/{pid}/fd"))

    ask(farm, first)
    ask(farm, first)  # asked twice, it restarts once
    second = joined_again(farm, worker, first)

    assert worker.alive() and worker.popen.pid == pid, "a supervisor sees no end of the process"
    assert not any(pathlib.Path(f"/proc/{child}").exists() for child in children), "the renderer of before has ended"
    assert "drains, and then restarts its program" in log_of(farm, first)
    assert " connected: joined" in log_of(farm, second)
    assert worker.output().count("starting the program again") == 1
    assert farm.job(job)["state"] == "running"
    farm.wait_for_progress(job, farm.job(job)["units_done"] + 3)
    third = ask(farm, second) or joined_again(farm, worker, second)
    assert farm.pixels(job) == expected
    assert state_of(farm, third) == "connected"
    assert len(os.listdir(f"/proc/{pid}/fd")) <= files + 2, "no file of an earlier run stays open"
    lost = sum(w["units_done"] for w in workers(farm)) - farm.job(job)["units_total"]
    assert lost == 0, "every unit was rendered once"


def test_a_restarted_worker_runs_the_program_that_is_there_then(farm, own_program):
    worker = farm.add_worker()
    first = id_of(farm, worker)
    old = os.stat(f"/proc/{worker.popen.pid}/exe").st_ino
    copy = own_program.with_name("new")
    shutil.copy(own_program, copy)
    os.replace(copy, own_program)

    out = lightshaft("workers", "--to", farm.url(), "--restart", worker.name, env=dict(os.environ, LIGHTSHAFT_TOKEN=farm.token))

    assert f"{worker.name} ({first}) finishes its units and restarts its program" in out.stdout
    joined_again(farm, worker, first)
    now = os.stat(f"/proc/{worker.popen.pid}/exe").st_ino
    assert now != old and now == own_program.stat().st_ino
    arguments = pathlib.Path(f"/proc/{worker.popen.pid}/cmdline").read_bytes().decode().split("\0")[:-1]
    assert arguments == worker.args
    assert worker.terminate() == 0


BROKEN = {
    "is gone": lambda program: program.unlink(),
    "cannot be executed (Permission denied)": lambda program: replace(program, "#!/bin/sh\n") or program.chmod(stat.S_IRUSR),
    "cannot be run": lambda program: replace(program, "neither a program nor a script"),
    "cannot be run: with --version it ended with 127: no such library": lambda program: replace(program, "#!/bin/sh\necho no such library\nexit 127\n"),
}


@pytest.mark.parametrize("why", BROKEN)
def test_a_worker_whose_program_cannot_be_run_works_on_and_says_so(farm, own_program, why):
    worker = farm.add_worker()
    id = id_of(farm, worker)
    BROKEN[why](own_program)

    ask(farm, id)

    wait_until(lambda: why in log_of(farm, id), "the worker's log says why")
    assert f"does not restart: {own_program} {why}" in log_of(farm, id)
    assert "works on" in worker.output()
    wait_until(lambda: next(w["activity"] for w in workers(farm) if w["id"] == id).startswith("does not restart: "), "the list of workers says so")
    assert state_of(farm, id) == "connected"
    farm.pixels(farm.submit(SCENE, spp=4))


def test_a_program_that_breaks_after_the_check_ends_with_a_message(farm, own_program):
    worker = farm.add_worker(*DELAY)
    job = farm.submit(SCENE, spp=1 << 12)
    farm.wait_for_progress(job, 1)
    id = id_of(farm, worker)
    [child] = render_children(worker)
    os.kill(child, signal.SIGSTOP)  # so that the drain lasts until the program is broken
    ask(farm, id)
    wait_until(lambda: state_of(farm, id) == "restarting", "the worker drains")
    replace(own_program, "neither a program nor a script")
    os.kill(child, signal.SIGCONT)

    assert worker.wait() == 1
    assert re.search(rf"cannot start {own_program} again: .*; start the worker", worker.output())


def test_a_restart_is_withdrawn_or_gives_way_to_the_end(farm):
    worker = farm.add_worker(*DELAY)
    job = farm.submit(SCENE, spp=1 << 12)
    farm.wait_for_progress(job, 1)
    id = id_of(farm, worker)
    [child] = render_children(worker)
    os.kill(child, signal.SIGSTOP)
    for state, then in [("draining", "draining"), ("restarting", "restarting"), ("connected", "connected"), ("restarting", "restarting")]:
        ask(farm, id, state)
        wait_until(lambda: state_of(farm, id) == then, then)
    worker.signal(signal.SIGTERM)
    wait_until(lambda: state_of(farm, id) == "draining", "the signal holds")
    os.kill(child, signal.SIGCONT)

    assert worker.wait() == 0
    assert "starting the program again" not in worker.output()


def test_a_worker_that_vanishes_while_it_drains_is_lost_and_one_that_is_not_there_is_refused(farm, expected):
    worker = farm.add_worker(*DELAY)
    job = farm.submit(SCENE, **SPEC)
    farm.wait_for_progress(job, 1)
    id = id_of(farm, worker)
    [child] = render_children(worker)
    os.kill(child, signal.SIGSTOP)
    ask(farm, id)
    wait_until(lambda: state_of(farm, id) == "restarting", "the worker drains")
    worker.kill()
    wait_until(lambda: state_of(farm, id) == "lost", "it is lost")

    with pytest.raises(HttpError) as refused:
        ask(farm, id)
    assert refused.value.status == 409 and "is not connected" in refused.value.body
    farm.add_worker()
    assert farm.pixels(job) == expected
