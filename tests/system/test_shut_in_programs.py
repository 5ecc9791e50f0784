"""Programs of other languages in the sandbox of lightshaft-scene, which read stages of USD: what limits them."""

import os
import signal
import subprocess

import pytest
from landlock import landlock
from local_farm import bin_dir

PYTHON = "/usr/bin/python3"
MIB = 1 << 20


def run(script, folder, seconds=60, memory=1024 * MIB, output=MIB):
    """Runs a script as the coordinator runs the package. Returns the process and what it has written."""
    folder.mkdir(exist_ok=True)
    with open(folder / "output", "w+b") as out:
        # Descriptor 3 of the program, as run_helper() gives it
        shell = ["/bin/sh", "-c", 'exec "$@" 3>&1 >/dev/null', "sh"]
        words = [bin_dir() / "lightshaft-scene", str(seconds), str(memory), str(output), folder, "--", PYTHON, "-I", "-B", "-c", script]
        ended = subprocess.run([*shell, *map(str, words)], stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.PIPE, text=True, timeout=120)
        out.seek(0)
        return ended, out.read()


def test_it_reads_its_folder_and_writes_its_file(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "stage").write_text("a stage")

    ended, written = run(f"import os; os.write(3, open({str(tmp_path / 'in' / 'stage')!r}, 'rb').read())", tmp_path / "in")

    assert ended.returncode == 0, ended.stderr
    assert written == b"a stage"


@pytest.mark.parametrize("script", [
    "open('/etc/passwd')", "open('{}/secret')", "open('{}/in/new', 'w')", "import os; os.fork()", "import subprocess; subprocess.run(['/bin/true'])",
    "import socket; socket.socket()", "import os; os.kill(os.getppid(), 0)", "import os; os.setsid()"])
def test_it_can_do_nothing_else(tmp_path, script):
    if "open(" in script and not landlock():
        pytest.skip("this kernel has no Landlock (Linux 5.13, switched on): it cannot keep the program from other files")
    (tmp_path / "secret").write_text("of others")

    ended, _ = run(script.format(tmp_path), tmp_path / "in")

    assert ended.returncode == 1 and ("Permission denied" in ended.stderr or "Operation not permitted" in ended.stderr), ended.stderr


def test_its_threads_run(tmp_path):
    ended, written = run("import os, threading; t = threading.Thread(target=lambda: os.write(3, b'by a thread')); t.start(); t.join()", tmp_path / "in")

    assert ended.returncode == 0 and written == b"by a thread", ended.stderr


def test_it_is_killed_after_its_time(tmp_path):
    ended, _ = run("while True: pass", tmp_path / "in", seconds=1)

    assert ended.returncode == -signal.SIGALRM


def test_its_memory_and_its_file_are_limited(tmp_path):
    hungry, _ = run(f"b'x' * {2048 * MIB}", tmp_path / "in")
    wordy, written = run(f"import os\nfor i in range(3): os.write(3, b'x' * {MIB // 2})", tmp_path / "in")

    assert hungry.returncode == 1 and "MemoryError" in hungry.stderr
    assert wordy.returncode == 1 and "File too large" in wordy.stderr
    assert len(written) == MIB


def test_a_program_that_is_not_there_is_told(tmp_path):
    ended = subprocess.run([bin_dir() / "lightshaft-scene", "1", str(MIB), "1", "--", "/nowhere/python"], capture_output=True, text=True)

    assert ended.returncode == 2 and "/nowhere/python cannot be started: No such file or directory" in ended.stderr
    assert os.listdir(tmp_path) == []
