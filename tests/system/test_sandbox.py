"""The render child of a real worker is shut in: asked of the child that runs, not of the function that should be called."""

import ctypes
import errno
import pathlib
import socket

import pytest
from asked_process import AskedProcess
from local_farm import SCENE
from processes import family

SOCKET, OPENAT, KILL, LANDLOCK_VERSION = 41, 257, 62, 444  # system calls of x86-64
HERE = -100  # AT_FDCWD


def landlock():
    """Which version of Landlock the kernel has; 0: none."""
    return max(0, ctypes.CDLL(None).syscall(LANDLOCK_VERSION, None, 0, 1))


@pytest.fixture
def child(farm):
    """The id of the child's process."""
    worker = farm.add_worker(fake=False)
    farm.wait_for_workers(1)
    (agent, child) = family(worker.popen.pid)
    assert agent == worker.popen.pid
    return child


def test_every_thread_of_the_child_has_the_filter_of_system_calls(farm, child):
    farm.pixels(farm.submit(SCENE, spp=4))  # so that its render threads are there

    for thread in pathlib.Path(f"/proc/{child}/task").iterdir():
        status = dict(line.split(":\t", 1) for line in (thread / "status").read_text().splitlines())
        assert (status["Seccomp"], status["NoNewPrivs"]) == ("2", "1"), f"thread {thread.name} of the renderer is free"


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
