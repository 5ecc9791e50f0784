"""Scenes that crash, hang or eat memory in the renderer, strangers on the gRPC port, workers that may not join: each is told
clearly, and everybody else goes on."""

import os
import socket

import pytest
from local_farm import SCENE, Process, wait_until

BAD, GOOD = 13, 5  # seeds


# Half a second is short for a busy machine, on which a sound unit may be taken for hung. So the worker `steady` waits long
# before it does, and the bad job does not ask for it: a unit of the good one fails only after three workers have failed at it.
@pytest.mark.parametrize("fault, reason, hang_after", [
    ("crash", "signal 11", 100),
    ("hang", "hung", 0.5),
    ("memory", "memory", 100),
])
def test_a_unit_that_brings_the_renderer_down_fails_its_job_clearly_and_no_other(farm, fault, reason, hang_after):
    flags = ("--fake-fault", f"{fault},seed={BAD},tile=2,round=1", "--hang-after", hang_after, "--memory-limit", 400_000_000)
    farm.add_workers(2, *flags, "--tags", "hasty")
    farm.add_worker(name="steady")
    bad = farm.submit(SCENE, spp=24, seed=BAD, tags="hasty")
    good = farm.submit(SCENE, spp=24, seed=GOOD)

    error = farm.wait_for_job(bad, states=("failed",))["error"]

    assert reason in error
    assert "64" in error and "0" in error, "tile 2 begins at pixel (64, 0)"
    assert "--pixel 64,0" in error and "--sample" in error, "how to see it again"
    farm.wait_for_job(good)
    assert all(w.alive() for w in farm.workers)


def test_garbage_on_the_grpc_port_harms_nobody(farm):
    farm.add_worker("--fake-delay", 10)
    job = farm.submit(SCENE, spp=24)
    preface = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
    for sent in (os.urandom(4096), b"GET / HTTP/1.1\r\n\r\n", preface + os.urandom(4096), preface + b"\x00\xff\xff\x01" + os.urandom(64), b""):
        with socket.create_connection(("127.0.0.1", farm.grpc), timeout=10) as stranger:
            try:
                stranger.sendall(sent)
            except OSError:
                pass  # hung up on already

    farm.wait_for_job(job)
    assert farm.coordinator.alive()


def test_a_worker_with_a_wrong_join_token_is_refused_with_a_reason(farm):
    stranger = farm.add_worker(token="guess")

    assert stranger.wait() == 1
    assert "token" in stranger.output()
    assert farm.get("/api/v1/workers")["workers"] == []


def test_a_second_coordinator_on_the_port_says_so(farm, tmp_path):
    second = Process("second", [farm.bin / "lightshaft-coordinator", "--http", "127.0.0.1:0", "--grpc",
                                f"127.0.0.1:{farm.grpc}", "--data", tmp_path / "other"], tmp_path / "second.log")

    assert second.wait() == 1
    assert str(farm.grpc) in second.output()


def test_bad_usage_of_the_worker_is_named(farm, tmp_path):
    for args, word in ((["--coordinator", "nowhere"], "HOST:PORT"), (["--coordinator", "a:1", "--threads", "0"], "threads"),
                       (["--coordinator", "a:1", "--token-file", "/nonexistent"], "/nonexistent")):
        process = Process("bad", [farm.bin / "lightshaft-worker", *args], tmp_path / "bad.log")
        assert process.wait() == 2
        assert word in process.output()


def test_a_worker_whose_stream_is_cut_comes_back_as_itself(farm):
    worker = farm.add_worker("--fake-delay", 10)
    farm.wait_for_workers(1)
    farm.restart_coordinator()
    farm.wait_for_workers(1)

    assert [w["name"] for w in farm.get("/api/v1/workers")["workers"] if w["state"] == "connected"] == [worker.name]


def test_a_worker_of_another_numeric_class_gets_no_unit_of_the_job_and_is_named(farm):
    first = farm.add_worker("--fake-delay", 10)
    job = farm.submit(SCENE, spp=24, seed=GOOD)
    farm.wait_for_progress(job, 3)
    first.kill()
    other = farm.add_worker("--fake-class", "another machine")
    farm.wait_for_workers(1)

    # Until the farm has seen both the first worker's end and the other, it says that it waits for a worker.
    wait_until(lambda: f"{other.name} is of another numeric class" in (farm.job(job)["error"] or ""), "the job says what it waits for")
    farm.add_worker()
    farm.wait_for_job(job)
    workers = {w["name"]: w["units_done"] for w in farm.get("/api/v1/workers")["workers"]}
    assert workers[other.name] == 0


def test_a_job_that_is_pinned_to_a_class_says_what_share_of_the_farm_can_take_it(farm):
    farm.add_workers(2, "--fake-delay", 10, "--fake-class", "x86", threads=2)
    arm = farm.add_worker("--fake-delay", 10, "--fake-class", "arm", threads=1)
    farm.wait_for_workers(3)
    of_class = {w["platform"]: w["numeric_class"] for w in farm.get("/api/v1/workers")["workers"]}
    assert set(of_class) == {"fake:x86", "fake:arm"}

    long, short = farm.submit(SCENE, spp=100000, seed=GOOD), farm.submit(SCENE, spp=24, seed=GOOD, numeric_class="fake:arm")

    # The arm worker is alone in its class: nobody could audit it, so it begins only what asks for it.
    farm.wait_for_progress(long, 3)
    job = farm.job(long)
    assert (job["numeric_class"], job["platform"]) == (of_class["fake:x86"], "fake:x86")
    assert job["class_share"] == {"workers": 2, "of_workers": 3, "threads": 4, "of_threads": 5, "share": 0.8}
    farm.wait_for_job(short)
    report = farm.report(short)
    assert (report["numeric_class"], report["platform"]) == (of_class["fake:arm"], "fake:arm")
    assert farm.job(short)["class_share"] is None, "it has ended"
    assert f"pinned to numeric class {of_class['fake:arm'][:12]} (fake:arm): 1 of 3 workers can take it, with 1 of 5 threads" in farm.request("GET", f"/api/v1/jobs/{short}/log").decode()

    arm.terminate()
    waits = farm.submit(SCENE, spp=24, seed=GOOD, numeric_class=of_class["fake:arm"][:8])
    wait_until(lambda: f"and the job asks for '{of_class['fake:arm'][:8]}'" in (farm.job(waits)["error"] or ""), "the job says what it waits for")
    farm.add_worker("--fake-delay", 10, "--fake-class", "arm")
    farm.wait_for_job(waits)
