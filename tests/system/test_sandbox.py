"""The render child of a real worker is shut in: asked of the child that runs, not of the function that should be called."""

import errno
import os
import pathlib
import signal
import socket
import subprocess

import pytest
from asked_process import AskedProcess
from landlock import landlock
from local_farm import PATIENCE, SCENE, bin_dir, wait_until
from processes import family

# system calls of x86-64
WRITE, IOCTL, SOCKET, KILL, FLOCK, FTRUNCATE, CHMOD, OPENAT, FALLOCATE = 1, 16, 41, 62, 73, 77, 90, 257, 285
HERE = -100  # AT_FDCWD
TIOCSTI = 0x5412
SHARED_MEMORY = 3  # the child's descriptor of it
ON_A_TERMINAL = ("/usr/bin/python3", "-c", "import pty, sys; pty.spawn(sys.argv[1:])")


@pytest.fixture
def child(farm):
    """The id of the child's process."""
    worker = farm.add_worker(fake=False)
    farm.wait_for_workers(1)
    (agent, child) = family(worker.popen.pid)
    assert agent == worker.popen.pid
    return child


def test_every_thread_of_the_child_has_the_filter_of_system_calls_and_no_rights(farm, child):
    farm.pixels(farm.submit(SCENE, spp=4))  # so that its render threads are there

    for thread in pathlib.Path(f"/proc/{child}/task").iterdir():
        status = dict(line.split(":\t", 1) for line in (thread / "status").read_text().splitlines())
        assert (status["Seccomp"], status["NoNewPrivs"]) == ("2", "1"), f"thread {thread.name} of the renderer is free"
        assert {int(status[which], 16) for which in ("CapInh", "CapPrm", "CapEff", "CapAmb")} == {0}, f"thread {thread.name} has rights of root"


def test_the_child_opens_no_socket_and_signals_nobody(farm, child):
    with AskedProcess(child) as asked:
        for kind in (socket.AF_INET, socket.AF_INET6, socket.AF_UNIX):
            assert asked.call(SOCKET, kind, socket.SOCK_STREAM, 0) == errno.EPERM
        assert asked.call(KILL, farm.workers[0].popen.pid, 0) == errno.EPERM

    farm.pixels(farm.submit(SCENE, spp=4))  # it was asked, not harmed


def test_the_child_reads_its_cache_and_no_other_file(farm, child, tmp_path):
    if not landlock():
        pytest.skip("this kernel has no Landlock (Linux 5.13, switched on): it cannot keep the renderer from other files")
    secret = tmp_path / "secret"
    secret.write_text("of its user")
    farm.pixels(farm.submit(SCENE, spp=4))
    blob = next(file for file in (farm.folder / "cache").rglob("*") if file.is_file())

    with AskedProcess(child) as asked:
        assert asked.call(OPENAT, HERE, str(blob), 0) == 0
        for file in (secret, "/etc/passwd", farm.data / "token"):
            assert asked.call(OPENAT, HERE, str(file), 0) == errno.EACCES, file
        assert asked.call(OPENAT, HERE, str(blob), 1) == errno.EACCES, "a file of the cache is not written"
    assert "cannot keep the renderer" not in farm.workers[0].output()


def test_the_child_changes_and_locks_no_file_and_leaves_its_agent_the_memory(farm, child):
    first = farm.pixels(farm.submit(SCENE, spp=4))
    blob = next(file for file in (farm.folder / "cache").rglob("*") if file.is_file())

    with AskedProcess(child) as asked:
        assert asked.call(CHMOD, str(blob), 0) == errno.EPERM
        assert asked.call(FTRUNCATE, SHARED_MEMORY, 0) == errno.EPERM
        assert asked.call(FALLOCATE, SHARED_MEMORY, 3, 0, 1 << 20) == errno.EPERM
        for descriptor in range(6):
            assert asked.call(FLOCK, descriptor, 2) == errno.EPERM

    assert farm.pixels(farm.submit(SCENE, spp=4)) == first  # the agent lives


def session_and_terminal(process):
    fields = pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return int(fields[3]), int(fields[4])


def assert_that_only_the_agent_has_a_terminal(agent, child):
    assert session_and_terminal(agent)[1] != 0, "this test needs an agent on a terminal"
    assert session_and_terminal(child) == (child, 0)
    assert [str(pathlib.Path(f"/proc/{child}/fd/{standard}").readlink()).split(":")[0] for standard in range(3)] == ["/dev/null", "pipe", "pipe"]
    with AskedProcess(child) as asked:
        for descriptor in range(6):
            assert asked.call(IOCTL, descriptor, TIOCSTI, "x") == errno.EPERM
        assert asked.call(OPENAT, HERE, "/dev/tty", 2) != 0


def test_the_child_of_a_worker_on_a_terminal_has_none(farm):
    worker = farm.add_worker(fake=False, within=ON_A_TERMINAL)
    farm.wait_for_workers(1)

    (_, agent, child) = family(worker.popen.pid)

    assert_that_only_the_agent_has_a_terminal(agent, child)


def test_the_child_of_an_isolated_render_on_a_terminal_has_none(tmp_path):
    (tmp_path / "scene.xml").write_text(SCENE)
    command = [*ON_A_TERMINAL, bin_dir() / "lightshaft", "render", tmp_path / "scene.xml", "-o", tmp_path / "image.exr", "--isolate", "--spp", "16777216"]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as popen:
        try:
            (_, agent, child) = wait_until(lambda: len(found := family(popen.pid)) == 3 and found, "the child renders")
            wait_until(lambda: "ls-render-child" in pathlib.Path(f"/proc/{child}/comm").read_text(), "it is confined")
            # Its first thread waits for requests once the others are there.
            wait_until(lambda: len(list(pathlib.Path(f"/proc/{child}/task").iterdir())) > 1, "it serves")

            assert_that_only_the_agent_has_a_terminal(agent, child)
        finally:
            for process in reversed(family(popen.pid)):
                os.kill(process, signal.SIGKILL)


def test_what_the_child_writes_is_marked_as_its_own_cleaned_and_bounded(farm, child):
    (worker,) = farm.workers
    forged = "2026-11-29T00:00:00.000 info job=j-1 all is \x1b[31mwell\n"

    with AskedProcess(child) as asked:
        assert asked.call(WRITE, 2, forged, len(forged)) == 0
        for _ in range(10):
            assert asked.call(WRITE, 1, "spam\n" * 100, 500) == 0
    assert worker.terminate() == 0

    lines = [line for line in worker.output().splitlines() if "all is" in line or "spam" in line]
    assert all(" program=renderer wrote: " in line for line in lines), lines
    assert "\x1b" not in worker.output()
    assert 0 < len(lines) <= 200 + PATIENCE / 10  # LineBudget: 200 at once, and one more every 10 s of this test
    assert "lines are left out here" in worker.output()
