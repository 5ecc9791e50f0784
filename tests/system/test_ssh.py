"""`lightshaft farm up --on ssh` through a real sshd of this machine, which it knows under several names."""

import os
import pathlib
import signal

import pytest
import ssh_server
from cli_kit import lightshaft
from engine_kit import FarmUp, calm_pixels, connected, renders_as_alone
from local_farm import SCENE, bin_dir, wait_until

pytestmark = pytest.mark.skipif(bool(ssh_server.missing()), reason="no sshd or ssh is installed")

LONG = {"spp": 400}


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with ssh_server.SshServer(tmp_path_factory.mktemp("ssh"), ["one", "two"]) as server:
        yield server


@pytest.fixture
def start(farm, server):
    started = []

    def start(*flags, machines="one\ntwo\n", **options):
        listed = farm.folder / "machines"
        listed.write_text(machines)
        cache = f"--worker-option=--cache={farm.folder / 'ssh-cache'}"
        started.append(FarmUp(farm, "ssh", "--machines", listed, "--ssh-config", server.config, cache, *flags, **options))
        return started[-1]

    yield start
    for up in started:
        up.kill()
    wait_until(lambda: not workers(farm), "no worker is left")


def workers(farm):
    """The workers of a farm, as processes: {pid: arguments}."""
    found = {}
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().decode().split("\0")
        except OSError:
            continue
        if words[0] == str(bin_dir() / "lightshaft-worker") and f"127.0.0.1:{farm.grpc}" in words:
            found[int(process.name)] = words
    return found


def test_workers_render_the_pixels_of_render_and_go(farm, start, fog, tmp_path):
    up, _ = renders_as_alone(farm, start, fog, tmp_path)

    assert not workers(farm)
    assert up.report()["engine"].startswith("OpenSSH") and up.report()["spent_core_hours"] > 0


@pytest.mark.slow
def test_one_picture_while_workers_and_connections_are_killed(farm, start):
    pixels = calm_pixels(farm, SCENE, **LONG)
    job = farm.submit(SCENE, **LONG)
    up = start("--workers", 2, "--finish-in", .001, delay=300)
    wait_until(lambda: len(connected(farm)) == 2, "both machines have a worker")
    farm.wait_for_progress(job, 2)

    os.kill(next(iter(workers(farm))), signal.SIGKILL)
    wait_until(lambda: up.output().count("starts 1 workers") + 2 * up.output().count("starts 2 workers") >= 3, "another has been started")

    assert farm.pixels(job) == pixels
    up.end()
    assert up.report()["workers_started"] >= 3


def test_workers_drain_when_farm_up_is_killed(farm, start):
    farm.submit(SCENE, **LONG)
    up = start(delay=300)
    wait_until(lambda: connected(farm), "a worker has joined")

    up.kill()

    wait_until(lambda: not workers(farm), "the worker has ended")
    log = next(up.logs.glob("farm-*.log")).read_text()
    assert "drain" in log.lower()


def test_a_machine_that_is_down_does_not_keep_the_others_from_work(farm, start):
    job = farm.submit(SCENE, spp=8)
    up = start("--until-done", machines="nobody@one\ntwo\n")

    assert up.wait() == 0, up.output()
    assert farm.job(job)["state"] == "done"
    assert "Permission denied" in (up.logs / "farm-nobody@one.log").read_text()


def test_tokens_are_in_no_argument(farm, start):
    farm.submit(SCENE, **LONG)
    up = start(delay=1000)
    wait_until(lambda: connected(farm), "a worker has joined")

    lines = [pathlib.Path(f"/proc/{pid}/cmdline").read_bytes() for pid in workers(farm)]

    assert lines and all(farm.join_token.encode() not in line for line in lines)
    up.end()


def test_usage_errors_name_the_option(farm, tmp_path):
    token = farm.secrets / "join-token"
    open_token = tmp_path / "open"
    open_token.write_text("secret")
    open_token.chmod(0o644)
    flags = ["farm", "up", "--on", "ssh", "--to", farm.url(), "--coordinator", "h:1"]
    for more, words in ((["--join-token", open_token], "chmod 600"),
                        ([], "--join-token FILE is needed"),
                        (["--join-token", token], "--machines FILE is needed"),
                        (["--join-token", token, "--machines", tmp_path / "none"], "cannot be read"),
                        (["--join-token", token, "--budget", "-1"], "--budget"),
                        (["--join-token", token, "--name", "a b"], "--name 'a b'")):
        said = lightshaft(*flags, *more, code=2)
        assert words in said.stderr, said.stderr
