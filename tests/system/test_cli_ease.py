"""What a person meets at the command: mistakes and their hints, pipes that close, Ctrl-C, names and filters of jobs."""

import json
import os
import pty
import re
import signal
import subprocess

import pytest
from cli_kit import lightshaft, write_fog
from local_farm import LocalFarm, bin_dir, wait_until

HELPERS = ["lightshaft-vdb", "lightshaft-denoise", "lightshaft-exr", "lightshaft-scene"]


@pytest.fixture(scope="module")
def idle(tmp_path_factory):
    """A farm without workers: the state of every job holds."""
    with LocalFarm(tmp_path_factory.mktemp("farm")) as farm:
        yield farm


def environment(farm, **more):
    return {**os.environ, "LIGHTSHAFT_URL": farm.url(), "LIGHTSHAFT_TOKEN": farm.token, **more}


def call(farm, *arguments, code=0, **more):
    return lightshaft(*arguments, env=environment(farm, **more), code=code)


def submitted(farm, folder, *options):
    return call(farm, "submit", write_fog(folder), "--spp", 4, *options).stdout.strip()


def test_a_misspelt_command_and_a_misspelt_option_are_suggested_right():
    assert "has no command 'rendr'; did you mean 'render'?" in lightshaft("rendr", "x.xml", code=2).stderr
    assert "render has no option --sp; did you mean '--spp'?" in lightshaft("render", "x.xml", "--sp", "4", code=2).stderr


@pytest.mark.parametrize("program", ["lightshaft-coordinator", "lightshaft-worker"])
def test_the_other_programs_suggest_too(program):
    wrong = subprocess.run([bin_dir() / program, "--log-forma", "json"], capture_output=True, text=True)
    assert wrong.returncode == 2 and "did you mean '--log-format'?" in wrong.stderr


@pytest.mark.parametrize("program", ["lightshaft-coordinator", "lightshaft-worker", *HELPERS, "lightshaft-validate"])
def test_each_program_knows_its_version(program):
    version = lightshaft("--version").stdout.split()[1].rstrip(",")
    told = subprocess.run([bin_dir() / program, "--version"], capture_output=True, text=True)
    assert (told.returncode, told.stdout, told.stderr) == (0, f"{program} {version}\n", "")


@pytest.mark.parametrize("program", HELPERS)
def test_a_helper_that_a_person_starts_says_what_it_is(program):
    told = subprocess.run([bin_dir() / program], capture_output=True, text=True)
    assert told.returncode == 2 and "other programs of Lightshaft start" in told.stderr


def test_the_bare_command_shows_its_help():
    shown = lightshaft(code=2).stdout
    assert shown == lightshaft("--help").stdout and "render a scene on this machine" in shown


def test_help_has_examples_and_no_line_about_other_commands():
    for command in ("render", "submit", "fetch", "jobs"):
        assert f"lightshaft {command} " in lightshaft(command, "--help").stdout.partition("Examples:")[2]
    assert "LIGHTSHAFT_LOG" in lightshaft("render", "--help").stdout
    for command in ("completion", "jobs", "verify"):
        assert "LIGHTSHAFT_LOG" not in lightshaft(command, "--help").stdout


@pytest.mark.parametrize("command", [["completion", "bash"], ["jobs"], ["jobs", "--json"]])
def test_output_that_nobody_reads_is_no_error(idle, tmp_path, command):
    submitted(idle, tmp_path)
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([bin_dir() / "lightshaft", *command], env=environment(idle), stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("mask, mode", [(0o022, 0o644), (0o077, 0o600)])
def test_who_may_read_an_image_is_for_the_umask_to_say(tmp_path, mask, mode):
    scene = write_fog(tmp_path)
    subprocess.run([bin_dir() / "lightshaft", "render", scene, "--spp", "2", "--report", "r.json", "--quiet"], cwd=tmp_path, check=True,
                   umask=mask)
    assert [(tmp_path / name).stat().st_mode & 0o777 for name in ("fog.exr", "r.json")] == [mode] * 2


def test_verify_without_a_scene_says_which_command_is_meant():
    assert "lightshaft verify ball.exr --scene SCENE.xml" in lightshaft("verify", "ball.exr", code=2).stderr


def test_an_address_may_leave_out_its_scheme(idle):
    call(idle, "jobs", LIGHTSHAFT_URL=idle.url().removeprefix("http://"))


def test_tls_at_a_port_without_it_is_named(idle):
    wrong = call(idle, "jobs", LIGHTSHAFT_URL=idle.url().replace("http://", "https://"), code=1)
    assert "answers without TLS: its address begins with http://" in wrong.stderr


def test_a_worker_is_told_of_a_url_and_of_the_wrong_port(idle, tmp_path):
    worker = [bin_dir() / "lightshaft-worker", "--fake", "--cache", tmp_path / "cache"]
    given = subprocess.run([*worker, "--coordinator", "http://farm.example:8080"], capture_output=True, text=True)
    assert given.returncode == 2 and "without http://, for example farm.example:50051" in given.stderr

    log = tmp_path / "log"
    with open(log, "w") as out:
        lost = subprocess.Popen([*worker, "--coordinator", f"127.0.0.1:{idle.http}", "--name", "lost"], stdout=out, stderr=out)
    try:
        wait_until(lambda: "workers connect to the one of --grpc" in log.read_text(), "the worker says that the port is the wrong one")
    finally:
        lost.kill()
        lost.wait()
    assert "worker=lost" in log.read_text()


def test_ctrl_c_in_a_wait_says_that_the_job_goes_on(idle, tmp_path):
    with subprocess.Popen([bin_dir() / "lightshaft", "submit", write_fog(tmp_path), "--wait"], env=environment(idle), text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as waiting:
        job = waiting.stdout.readline().strip()
        waiting.send_signal(signal.SIGINT)
        _, error = waiting.communicate()

    assert waiting.returncode == -signal.SIGINT
    assert f"job {job} continues: lightshaft watch {job} follows it, lightshaft cancel {job} ends it" in error
    assert json.loads(call(idle, "show", job, "--json").stdout)["state"] == "queued"


def test_ctrl_c_at_a_terminal_says_that_the_job_goes_on(idle, tmp_path):
    scene = write_fog(tmp_path)
    child, terminal = pty.fork()
    if child == 0:
        os.execve(bin_dir() / "lightshaft", ["lightshaft", "submit", str(scene), "--wait"], environment(idle))
    shown = b""

    def read():
        nonlocal shown
        try:
            part = os.read(terminal, 1 << 16)
        except OSError:  # the other side is closed
            part = b""
        shown += part
        return part

    while not (job := re.search(rb"(?m)^(j-\w+)\r$", shown)):
        assert read(), shown
    os.write(terminal, b"\x03")  # the terminal, not this test, makes it a signal
    while read():
        pass
    _, status = os.waitpid(child, 0)
    os.close(terminal)

    assert os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGINT, shown
    identity = job[1].decode()
    assert f"job {identity} continues: lightshaft watch {identity} follows it" in " ".join(shown.decode().split())
    assert json.loads(call(idle, "show", identity, "--json").stdout)["state"] == "queued"


def test_jobs_have_names_and_are_chosen_by_them_and_by_state(idle, tmp_path):
    chapel, hall = submitted(idle, tmp_path, "--name", "chapel v3"), submitted(idle, tmp_path, "--name", "hall")
    call(idle, "pause", hall)

    def listed(*options):
        return [job["id"] for job in json.loads(call(idle, "jobs", "--json", *options).stdout)["jobs"]]

    assert listed("--search", "chapel") == [chapel]
    assert listed("--state", "paused") == [hall]
    assert listed("--sort=-submitted", "--limit", 1) == [hall] and listed("--sort=-submitted", "--limit", 1, "--offset", 1) == [chapel]
    short = call(idle, "jobs", "--limit", 1)
    assert len(short.stdout.splitlines()) == 2 and "1 of " in short.stderr
    assert "'state' has an unknown word" in call(idle, "jobs", "--state", "runing", code=2).stderr


def test_a_bundle_may_have_a_name_too(idle, tmp_path):
    write_fog(tmp_path)
    subprocess.run(["tar", "-cf", "fog.tar", "fog.xml", "fog.vol"], cwd=tmp_path, check=True)
    job = call(idle, "submit", tmp_path / "fog.tar", "--name", "bundled").stdout.strip()
    assert json.loads(call(idle, "show", job, "--json").stdout)["name"] == "bundled"


def test_priority_log_again_and_remove(idle, tmp_path):
    job = submitted(idle, tmp_path)
    call(idle, "priority", job, 7)
    assert json.loads(call(idle, "show", job, "--json").stdout)["priority"] == 7
    call(idle, "priority", job, "-7")
    assert json.loads(call(idle, "show", job, "--json").stdout)["priority"] == -7
    assert "submitted" in call(idle, "log", job).stdout
    call(idle, "rename", job, "Chapel, take 2")
    assert idle.job(job)["name"] == "Chapel, take 2"
    assert "a text of 1 to 256 bytes" in call(idle, "rename", job, "x" * 257, code=2).stderr
    other = call(idle, "again", job, "--spp", 16, "--seed", 3).stdout.strip()
    assert json.loads(call(idle, "show", other, "--json").stdout)["spp"] == 16
    assert f"lightshaft cancel {job}" in call(idle, "remove", job, code=1).stderr
    assert json.loads(call(idle, "show", job, "--json").stdout)["state"] == "queued"
    call(idle, "cancel", job)
    call(idle, "remove", job)
    assert "there is no job" in call(idle, "show", job, code=1).stderr


def test_a_job_waits_for_another_and_says_so(idle, tmp_path):
    first = submitted(idle, tmp_path)
    second = submitted(idle, tmp_path, "--after", first)
    assert f"waits for job {first}, which is queued" in call(idle, "show", second).stdout
    assert "(waits for another job)" in call(idle, "jobs", "--search", second).stdout
    assert "would wait for itself" in call(idle, "after", first, second, code=2).stderr
    assert "there is no job j-none" in call(idle, "submit", tmp_path / "fog.xml", "--after", "j-none", code=2).stderr

    call(idle, "cancel", first)
    assert f"job {first}, for which it waits, was cancelled" in call(idle, "show", second).stdout
    call(idle, "after", second)
    assert "waits" not in call(idle, "show", second).stdout.split()


def test_a_foreign_job_cannot_be_waited_for(idle, tmp_path):
    anna, ben = (call(idle, "token", "add", "--role", "submit", "--user", user).stdout.strip() for user in ("anna", "ben"))
    job = call(idle, "submit", write_fog(tmp_path), LIGHTSHAFT_TOKEN=anna).stdout.strip()
    assert f"there is no job {job}" in call(idle, "submit", tmp_path / "fog.xml", "--after", job, LIGHTSHAFT_TOKEN=ben, code=2).stderr


def test_fetch_names_the_image_as_render_does(farm, tmp_path):
    farm.add_worker()
    job = submitted(farm, tmp_path, "--name", "../..x/chapel v3.xml")
    call(farm, "watch", job, "--quiet")
    sequence = call(farm, "submit", tmp_path / "fog.xml", "--spp", 2, "--frames", "1-2", "--wait", "--quiet").stdout.strip()
    (tmp_path / "here").mkdir()

    lightshaft("fetch", job, env=environment(farm), cwd=tmp_path / "here")
    lightshaft("fetch", sequence, env=environment(farm), cwd=tmp_path / "here")

    assert sorted(file.name for file in (tmp_path / "here").iterdir()) == ["chapel v3.exr", "fog_0001.exr", "fog_0002.exr"]


def test_a_frame_that_fails_does_not_keep_the_others_from_being_written(farm, tmp_path):
    """Its frames are cancelled one by one, as a failure would end them."""
    job = submitted(farm, tmp_path, "--frames", "1-2")
    call(farm, "cancel", job, "--frame", 2)
    farm.add_worker()
    wait_until(lambda: json.loads(call(farm, "show", job, "--frame", 1, "--json").stdout)["state"] == "done", "the first frame is done")

    call(farm, "watch", job, code=1)
    lightshaft("fetch", job, env=environment(farm), cwd=tmp_path, code=1)

    assert (tmp_path / "fog_0001.exr").exists() and not (tmp_path / "fog_0002.exr").exists()
