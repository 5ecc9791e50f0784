"""Runs a program in a session of its own, with a limit of time, and tells what it cost."""
import os
import signal
import subprocess
import threading
import time

from racing.adapter import Cost, RaceError

KEPT_OUTPUT = 1 << 16


class _Output:
    """The end of what a program writes, read as it comes."""

    def __init__(self, pipe):
        self.pipe, self.bytes = pipe, b""
        self.thread = threading.Thread(target=self._drain, daemon=True)
        self.thread.start()

    def _drain(self):
        while piece := os.read(self.pipe.fileno(), 1 << 12):
            self.bytes = (self.bytes + piece)[-KEPT_OUTPUT:]

    def last_words(self, patience=1):
        # A process outside the session may keep the pipe open: it is not waited for.
        self.thread.join(patience)
        lines = [line.strip() for line in self.bytes.decode(errors="replace").splitlines() if line.strip()]
        return f"; its last words: {lines[-1]}" if lines else ""


def _kill(session):
    try:
        os.killpg(session, signal.SIGKILL)
    except ProcessLookupError:
        pass


def run(command, most_seconds):
    """The cost of the whole program and of the children that it waited for. RaceError, with the last line that it wrote: it cannot be
    started, failed, or ran for too long. It gets no input, and no variables LIGHTSHAFT_*, which may hold tokens. What it started and
    left behind is killed."""
    name = command[0]
    environment = {key: value for key, value in os.environ.items() if not key.startswith("LIGHTSHAFT_")}
    begin = time.monotonic()
    try:
        child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment,
                                 start_new_session=True)
    except OSError as error:
        raise RaceError(f"{name} cannot be started: {error.strerror}") from None
    output = _Output(child.stdout)
    late = threading.Event()

    def end():
        late.set()
        _kill(child.pid)

    timer = threading.Timer(most_seconds, end)
    timer.start()
    try:
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    except KeyboardInterrupt:
        _kill(child.pid)
        child.wait()
        raise
    finally:
        timer.cancel()
        _kill(child.pid)
    wall = time.monotonic() - begin
    if late.is_set():
        raise RaceError(f"{name} ran for more than {most_seconds:g} s and was ended{output.last_words()}")
    if child.returncode < 0:
        raise RaceError(f"{name} died of signal {-child.returncode} ({signal.strsignal(-child.returncode)}){output.last_words()}")
    if child.returncode:
        raise RaceError(f"{name} ended with exit code {child.returncode}{output.last_words()}")
    return Cost(wall, usage.ru_utime + usage.ru_stime)
