"""Programs that run as long as this one: they are restarted when they fail, and end with it."""

import contextlib
import ctypes
import os
import pathlib
import signal
import subprocess
import time
from collections.abc import Callable
from typing import IO

from lightshaft_command.programs import Problem

# A signal that is ignored from the start, as nohup has it, would still be waited for. SIGINT is ignored in all programs that a
# script starts in the background, and it is by this signal that scripts end them.
ENDS = {s for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) if s == signal.SIGINT or signal.getsignal(s) != signal.SIG_IGN}
WAKES = ENDS | {signal.SIGCHLD}
QUICK_END = 5.0  # seconds: a program that runs for less has not started well
MOST_QUICK_ENDS = 5  # in a row; after these it is not started again
MOST_PAUSE = 16.0  # seconds between such starts
PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None)


def say(text: str) -> None:
    print(text, flush=True)


def _begin() -> None:
    """Runs in a child before its program: unblocks signals, and lets the kernel end the child if this program is
    killed."""
    signal.pthread_sigmask(signal.SIG_SETMASK, set())
    _libc.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)


def start(args: list[str], output: "int | IO[bytes] | None" = None, environment: dict[str, str] | None = None,
          errors: "IO[bytes] | None" = None) -> subprocess.Popen[bytes]:  # fmt: skip
    """Starts the program in its own session, so that Ctrl-C reaches only this program, which then ends the others
    in order. Errors go to the output unless they have their own file."""
    return subprocess.Popen(args, stdin=subprocess.DEVNULL, stdout=output, stderr=errors or (None if output is None else subprocess.STDOUT),
                            env=environment, start_new_session=True, preexec_fn=_begin)  # fmt: skip


def how_it_ended(code: int) -> str:
    return f"by signal {-code} ({signal.Signals(-code).name})" if code < 0 else f"with exit code {code}"


def has_ended(process: subprocess.Popen[bytes]) -> bool:
    """Checks for the end without reaping the process, so that its id is not reused."""
    return process.returncode is not None or os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


def finish(process: subprocess.Popen[bytes]) -> int:
    """Ends the program and what is left of its session. Returns its exit code."""
    if process.returncode is None:  # afterwards the id may be another program's
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    return process.wait()


class Child:
    """A program that is restarted when it ends unexpectedly. With `leaves` (what a normal end means), it is not
    restarted after exit code 0."""

    def __init__(self, name: str, args: list[str], log: pathlib.Path, environment: dict[str, str] | None = None, leaves: str = ""):
        self.name, self.args, self.log, self.environment, self.leaves = name, args, log, environment, leaves
        self.has_left = False
        self._quick_ends = 0
        self._next_start: float | None = None
        self.log.write_bytes(b"")
        self.start()

    def start(self) -> None:
        self._next_start = None
        self._started = time.monotonic()
        with self.log.open("ab") as output:
            self.process = start(self.args, output, self.environment)

    def last_lines(self) -> str:
        return "\n".join("  " + line for line in self.log.read_text(errors="replace").splitlines()[-8:])

    def look(self) -> None:
        """Restarts the program if it has ended. Raises Problem if it ends repeatedly."""
        if self.has_left:
            return
        if self._next_start is not None:
            if time.monotonic() >= self._next_start:
                self.start()
            return
        if not has_ended(self.process):
            return
        code = finish(self.process)
        if code == 0 and self.leaves:
            self.has_left = True
            say(f"the {self.name} {self.leaves}")
            return
        quick = time.monotonic() - self._started < QUICK_END
        self._quick_ends = self._quick_ends + 1 if quick else 0
        if self._quick_ends >= MOST_QUICK_ENDS:
            raise Problem(f"the {self.name} ended {how_it_ended(code)}, {MOST_QUICK_ENDS} times in a row; its log, {self.log}, ends:\n{self.last_lines()}")
        pause = min(2.0**self._quick_ends, MOST_PAUSE) if quick else 0.0
        say(f"the {self.name} ended {how_it_ended(code)} and is restarted (log: {self.log})")
        self._next_start = time.monotonic() + pause


class Children:
    """All child programs in the order of their start. Signals are blocked from the constructor on, and handled in
    run()."""

    def __init__(self) -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, WAKES)
        self.kept: list[Child] = []
        self.extra: subprocess.Popen[bytes] | None = None  # a program that runs once, beside them

    def wait(self, seconds: float) -> bool:
        """Waits until something ends or the time is over. Returns True if the user requested the end."""
        woken = signal.sigtimedwait(WAKES, seconds)
        return woken is not None and woken.si_signo in ENDS

    def run(self, each_time: Callable[[], None]) -> None:
        """Runs until the user requests the end or all programs have ended."""
        while not all(child.has_left for child in self.kept) and not self.wait(1.0):
            for child in self.kept:
                child.look()
            each_time()

    def end(self) -> None:
        """Ends the programs in reverse order; each finishes its work first. Another signal from the user ends all
        at once."""
        at_once = False
        running = [process for process in [*(child.process for child in self.kept), self.extra] if process]
        for process in reversed(running):
            if not has_ended(process):
                process.terminate()
            while not has_ended(process) and not at_once:
                at_once = self.wait(0.5)
        for process in running:
            finish(process)
