"""Where the programs of Lightshaft are, and the commands of a wheel that start them."""

import importlib.util
import os
import pathlib
import shutil
import sys
from typing import NoReturn

PACKAGE = pathlib.Path(__file__).resolve().parent
BUNDLED = PACKAGE / "programs" / "bin"  # in a wheel


class Problem(Exception):
    """What is wrong, and what to do: shown to the user without a traceback."""


def find(name: str) -> str:
    """A program: beside the `lightshaft` that started this, in the wheel, or in the PATH (Debian's packages)."""
    beside = pathlib.Path(os.environ.get("LIGHTSHAFT_PROGRAMS") or BUNDLED) / name
    found = str(beside) if beside.exists() else shutil.which(name)
    if not found:
        raise Problem(f"there is no {name} in {beside.parent} and none in the PATH: build it, or install its package or Lightshaft's wheel")
    return found


def find_denoiser() -> None:
    """Tells the programs where the wheel `pyoidn` (the wheel's extra `denoise`) has Open Image Denoise."""
    if "LIGHTSHAFT_OIDN" in os.environ:
        return
    found = importlib.util.find_spec("pyoidn")
    for place in (found.submodule_search_locations or []) if found else []:
        library = next(pathlib.Path(place).rglob("libOpenImageDenoise.so.2*"), None)
        if library:
            os.environ["LIGHTSHAFT_OIDN"] = str(library)


def _become(program: str) -> NoReturn:
    path = BUNDLED / program
    try:
        os.execv(path, [str(path), *sys.argv[1:]])
    except OSError as error:
        sys.exit(f"error: cannot start {path}: {error.strerror}; this wheel is for Linux on x86-64 processors")


def lightshaft() -> int:
    """The command `lightshaft` of a wheel."""
    from lightshaft_command.command import COMMANDS, run

    find_denoiser()
    if len(sys.argv) > 1 and sys.argv[1] in COMMANDS:
        return run(sys.argv[1:])
    _become("lightshaft")


def coordinator() -> NoReturn:
    find_denoiser()
    _become("lightshaft-coordinator")


def worker() -> NoReturn:
    _become("lightshaft-worker")
