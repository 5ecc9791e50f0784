"""The folder in which `lightshaft up` and `lightshaft join` keep their state."""

import contextlib
import fcntl
import os
import pathlib
from collections.abc import Iterator
from typing import IO

from lightshaft_command.console import Given
from lightshaft_command.farm_up.numbers import whole_option
from lightshaft_command.programs import Problem, Usage

MOST_THREADS = 256  # as the worker has it


def usual() -> pathlib.Path:
    named = os.environ.get("XDG_DATA_HOME")
    return (pathlib.Path(named) if named else pathlib.Path.home() / ".local" / "share") / "lightshaft"


def data_of(given: Given) -> pathlib.Path:
    if not given.flag("--data"):
        return usual().absolute()
    try:
        return pathlib.Path(given.text("--data")).expanduser().absolute()
    except RuntimeError:
        raise Usage(f"--data '{given.text('--data')}': there is no such user") from None


def threads_of(given: Given) -> int | None:
    return whole_option("--threads", given.text("--threads"), 1, MOST_THREADS) if given.flag("--threads") else None


class Claim:
    def __init__(self, file: IO[str]):
        self._file = file

    def tell(self, where: str) -> None:
        """Writes the address of this farm for later starts of `up`. If the disk is full this is skipped: the farm
        runs, so that jobs can be removed."""
        with contextlib.suppress(OSError):
            os.ftruncate(self._file.fileno(), 0)
            os.write(self._file.fileno(), (f"process {os.getpid()}" + (f", {where.split('#')[0]}" if where else "")).encode())


@contextlib.contextmanager
def claim(folder: pathlib.Path) -> Iterator[Claim]:
    """Makes the folder, readable by this user only, and locks it. Raises Problem if another process has it or if
    it cannot be used."""
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        file = (folder / "in-use").open("a+")
    except OSError as error:
        raise Problem(f"{folder} cannot be used ({error.strerror}): choose another folder with --data") from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.seek(0)
            raise Problem(f"{folder} is in use ({file.read() or 'by a process that is starting'}): choose another folder with --data, or end the other process") from None
        claimed = Claim(file)
        claimed.tell("")
        yield claimed
