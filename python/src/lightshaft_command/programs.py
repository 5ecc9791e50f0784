"""Finds the programs of Lightshaft, and contains the commands of a wheel that start them."""

import importlib.util
import os
import pathlib
import shutil
import sys
from typing import NoReturn

PACKAGE = pathlib.Path(__file__).resolve().parent
BUNDLED = PACKAGE / "programs" / "bin"  # in a wheel


class Problem(Exception):
    """An error with advice, which the user sees without a traceback."""


class Usage(Problem):
    """The user's options or files are at fault."""


class Rejected(Problem):
    """A program of Lightshaft ended with an exit code and a message, `shown`."""

    def __init__(self, code: int, shown: str):
        super().__init__(shown.partition("\n")[0].removeprefix("lightshaft: error: "))
        self.code, self.shown = code, shown


def beside(name: str) -> pathlib.Path:
    """Where a program is, if it is beside the `lightshaft` that started this, or in the wheel."""
    return pathlib.Path(os.environ.get("LIGHTSHAFT_PROGRAMS") or BUNDLED) / name


def find(name: str) -> str:
    """Finds a program: beside the `lightshaft` that started this, in the wheel, or in the PATH (Debian's packages)."""
    here = beside(name)
    found = str(here) if here.exists() else shutil.which(name)
    if not found:
        raise Problem(f"{name} is neither in {here.parent} nor in the PATH: build it, or install its package or Lightshaft's wheel")
    return found


def find_denoiser() -> None:
    """Sets the variable by which programs find Open Image Denoise in the wheel `pyoidn` (the extra `denoise`)."""
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


def lightshaft() -> NoReturn:
    """The command `lightshaft` of a wheel."""
    find_denoiser()
    os.environ["LIGHTSHAFT_PYTHON"] = sys.executable  # for the commands that the program leaves to Python
    _become("lightshaft")


def coordinator() -> NoReturn:
    find_denoiser()
    _become("lightshaft-coordinator")


def worker() -> NoReturn:
    _become("lightshaft-worker")
