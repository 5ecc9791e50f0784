"""Writes output files completely or not at all, and checks before long work that they can be written."""

import os
import pathlib
import tempfile

from lightshaft_command.programs import Problem, Usage


def check_folder(option: str, folder: pathlib.Path) -> None:
    """Usage: no file can be made in the folder. `option` names the folder, for the message."""
    try:
        handle, name = tempfile.mkstemp(prefix=".lightshaft-", dir=folder)
    except OSError as error:
        raise Usage(f"{option}: no file can be made in the folder {folder}: {error.strerror}") from error
    os.close(handle)
    os.unlink(name)


def check_file(option: str, file: pathlib.Path) -> None:
    """Usage: a file of this name cannot be written. The file itself is not touched."""
    if not file.parent.is_dir():
        raise Usage(f"{option} {file}: there is no folder {file.parent}")
    if file.is_dir():
        raise Usage(f"{option} {file}: this is a folder")
    if not file.exists() or file.is_file():
        check_folder(option, file.parent)
    elif not os.access(file, os.W_OK):
        raise Usage(f"{option} {file}: cannot be written")


def write_file(file: pathlib.Path, text: str) -> None:
    """Replaces the file completely or not at all; a pipe or device cannot be replaced, so it is written directly."""
    file = file.resolve()
    aside = file if file.exists() and not file.is_file() else file.with_name(f".{file.name}.{os.getpid()}")
    try:
        aside.write_text(text, encoding="utf-8", errors="replace")
        if aside != file:
            aside.replace(file)
    except OSError as error:
        if aside != file:
            aside.unlink(missing_ok=True)
        raise Problem(f"{file} cannot be written: {error.strerror}") from error
