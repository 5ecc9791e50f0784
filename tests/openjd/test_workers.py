"""The template of workers, run by the real `openjd` for a real farm."""

import subprocess

import pytest
from cli_kit import digest, lightshaft
from engine_kit import calm_pixels, connected
from local_farm import SCENE, bin_dir, wait_until
from openjd_job import OPENJD, template_file

LONG = {"spp": 100}


@pytest.fixture
def work(farm, run):
    """Starts a task of workers. Fake ones, unless told otherwise, whose units take `delay` milliseconds."""
    def work(*options, fake=True, delay=30, idle=1, **parameters):
        more = f"--fake --fake-delay={delay}" if fake else ""
        return run("workers", *options, **{
            "Coordinator": f"127.0.0.1:{farm.grpc}", "TokenFile": farm.secrets / "join-token", "IdleSeconds": idle, "Threads": 1,
            "CacheFolder": farm.folder / "cache", "Program": bin_dir() / "lightshaft-worker", "MoreOptions": more, **parameters})

    return work


def freed_units(farm):
    """Units that the farm took from workers that it had lost."""
    line = next(line for line in farm.request("GET", "/metrics").decode().splitlines()
                if line.startswith('lightshaft_units_freed_total{cause="worker lost"}'))
    return int(line.split()[-1])


def test_openjd_finds_the_template_valid():
    checked = subprocess.run([OPENJD, "check", template_file("workers")], capture_output=True, text=True)

    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_two_tasks_render_the_pixels_of_render_and_end_when_idle(farm, fog, work, tmp_path):
    alone = digest(lightshaft("render", fog, "-o", tmp_path / "alone.exr", "--spp", 16))
    sent = lightshaft("submit", fog, "--to", farm.url(), "--token-file", farm.data / "token", "--spp", 16)

    tasks = [work("--task-param", f"Worker={number}", fake=False, Workers=2, Name="night") for number in (1, 2)]

    assert farm.pixels(sent.stdout.split()[0]) == alone
    for task in tasks:
        assert task.wait() == 0, task.output()
        assert task.said("status") == ["the worker has joined the farm", "the worker hands in its work"]
    assert {w["name"] for w in farm.get("/api/v1/workers")["workers"]} == {"night-1", "night-2"}


def test_a_cancelled_task_hands_in_its_work(farm, work):
    pixels = calm_pixels(farm, SCENE, **LONG)
    job = farm.submit(SCENE, **LONG)
    first = work(delay=200)
    farm.wait_for_progress(job, 2)

    first.cancel()

    assert "the worker hands in its work" in first.said("status"), first.output()
    assert freed_units(farm) == 0 and connected(farm) == []
    assert farm.job(job)["state"] != "done"
    second = work(delay=1)
    assert farm.pixels(job) == pixels
    assert second.wait() == 0 and freed_units(farm) == 0


def test_a_worker_that_cannot_join_fails_its_task_and_says_why(farm, work, tmp_path):
    wrong = tmp_path / "wrong-token"
    wrong.write_text("not the token\n")

    for parameters, words in (({"Coordinator": "127.0.0.1:1"}, "did not join the coordinator within 1 s"), ({"TokenFile": wrong}, "token"),
                              ({"TokenFile": tmp_path / "none"}, "--token-file")):
        task = work(**parameters)

        assert task.wait() != 0, task.output()
        assert any(words in failure for failure in task.said("fail")), task.output()


def test_the_token_is_in_no_argument_and_no_log(farm, work):
    farm.submit(SCENE, **LONG)
    task = work(delay=200)
    wait_until(lambda: connected(farm), "a worker has joined")
    lines = subprocess.run(["ps", "axww", "-o", "args"], capture_output=True, text=True, check=True).stdout

    assert str(farm.secrets / "join-token") in lines and farm.join_token not in lines
    task.cancel()
    assert farm.join_token not in task.output()
