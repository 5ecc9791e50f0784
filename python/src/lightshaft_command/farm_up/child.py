"""Runs other programs, such as sbatch and ssh. Arguments are passed directly, without a shell.

The programs inherit the environment except our own variables (LIGHTSHAFT_...), which may contain tokens. Each has a session of its
own, so that Ctrl-C reaches only `farm up`.
"""

import contextlib
import os
import selectors
import signal
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import IO, Any

from lightshaft_command.programs import Problem

TICK = 0.05  # seconds between looks whether a program has ended
MOST_OUTPUT = 64 << 20  # bytes


@dataclass
class Output:
    code: int  # exit code, or 128 + number of the signal that ended the program
    out: str
    err: str


def open_program(words: Sequence[str], out: Any, err: Any, ours: bool = False) -> subprocess.Popen[bytes]:
    """`ours`: a program of Lightshaft, which gets our variables."""
    environment = {name: value for name, value in os.environ.items() if ours or not name.startswith("LIGHTSHAFT_")}
    try:
        return subprocess.Popen(words, stdin=subprocess.PIPE, stdout=out, stderr=err, env=environment, start_new_session=True)
    except OSError as error:
        raise Problem(f"cannot start {words[0]}: {error.strerror}") from error


def kill(process: subprocess.Popen[bytes]) -> None:
    """Ends it and what it has started. A process that was waited for is left alone: its id may be another one's."""
    if process.poll() is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def run(words: Sequence[str], text: str = "", most_seconds: float = 60.0, ours: bool = False) -> Output:
    """Runs a program to its end, with `text` as its input. Problem: it took longer, printed too much, or is not there."""
    process = open_program(words, subprocess.PIPE, subprocess.PIPE, ours)
    assert process.stdin and process.stdout and process.stderr
    try:
        out, err = _exchange(process, text.encode(errors="surrogateescape"), most_seconds, words[0])
    finally:
        kill(process)
        for pipe in (process.stdin, process.stdout, process.stderr):
            with contextlib.suppress(OSError):
                pipe.close()
    code = process.returncode
    return Output(128 - code if code < 0 else code, out.decode(errors="surrogateescape"), err.decode(errors="surrogateescape"))


def _exchange(process: subprocess.Popen[bytes], left: bytes, most_seconds: float, name: str) -> tuple[bytearray, bytearray]:
    """What the program prints. Reading stops soon after its end, even if programs that it left running keep its output open."""
    assert process.stdin and process.stdout and process.stderr
    deadline = time.monotonic() + most_seconds
    printed: dict[IO[bytes], bytearray] = {process.stdout: bytearray(), process.stderr: bytearray()}
    with selectors.DefaultSelector() as waiting:
        for pipe in printed:
            waiting.register(pipe, selectors.EVENT_READ)
        os.set_blocking(process.stdin.fileno(), False)
        if left:
            waiting.register(process.stdin, selectors.EVENT_WRITE)
        else:
            process.stdin.close()
        ended = False
        while waiting.get_map() or not ended:
            ended = ended or process.poll() is not None
            if not ended and time.monotonic() >= deadline:
                raise Problem(f"{name} did not end within {most_seconds:.0f} s")
            if max(map(len, printed.values())) > MOST_OUTPUT:
                raise Problem(f"{name} printed more than {MOST_OUTPUT >> 20} MiB")
            ready = waiting.select(0 if ended else TICK)
            if ended and not ready:
                break
            for key, _ in ready:
                if key.fileobj is process.stdin:
                    left = _write(process.stdin, left)
                    if not left:
                        waiting.unregister(process.stdin)
                        process.stdin.close()
                elif part := os.read(key.fd, 1 << 16):
                    printed[key.fileobj] += part  # type: ignore[index]
                else:
                    waiting.unregister(key.fileobj)
    return printed[process.stdout], printed[process.stderr]


def _write(pipe: IO[bytes], left: bytes) -> bytes:
    """What is still to be written; nothing if nobody reads it."""
    try:
        return left[os.write(pipe.fileno(), left) :]
    except BlockingIOError:
        return left
    except OSError:
        return b""


class LongCommand:
    """A program that runs in the background. Its input stays open until close_input(); its output goes to a file."""

    def __init__(self, words: Sequence[str], text: str, log: str):
        try:
            file = open(log, "ab", opener=lambda name, flags: os.open(name, flags, 0o600))  # noqa: SIM115
        except OSError as error:
            raise Problem(f"{log}: {error.strerror}") from error
        with file:
            self._process = open_program(words, file, file)
        assert self._process.stdin
        self._input = self._process.stdin
        # A pipe holds 64 KiB without a reader, far more than the command line and token of a worker. So this waits for nobody.
        os.set_blocking(self._input.fileno(), False)
        if _write(self._input, text.encode(errors="surrogateescape")):
            self.kill()
            raise Problem("the command is too long")

    def ended(self) -> bool:
        return self._process.poll() is not None

    def close_input(self) -> None:
        with contextlib.suppress(OSError):
            self._input.close()

    def kill(self) -> None:
        self.close_input()
        kill(self._process)
