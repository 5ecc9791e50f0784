"""Adapters: JSON files that say how to run another program for pictures (docs/reference/compare.md), and what is believed of its claims."""
import json
import pathlib
import re
from typing import NamedTuple

MOST_BYTES = 1 << 20  # of an adapter, and of what a program writes about its pictures
MOST_PICTURES = 64
MOST_ARGUMENTS = 256
MOST_SPP, MOST_FIRST_SPP = 1e12, 65536
EXTRA_SECONDS, MOST_EXTRA_SECONDS = 300, 1e6
CLOCK_RATIO, CLOCK_SECONDS = 1.02, .05  # by how much a program's clock may differ from ours
KEYS = ("about", "command", "first_spp", "most_seconds", "name", "scenes")
PLACEHOLDERS = ("adapter", "clock", "folder", "height", "image", "scene", "seed", "size", "spp", "threads", "time", "times", "width")


class RaceError(Exception):
    """What is wrong, and where."""


class Cost(NamedTuple):
    """Wall seconds, and CPU seconds of all threads."""
    wall: float
    cpu: float

    def seconds(self, clock, threads):
        return self.wall if clock == "wall" else self.cpu / threads


class Made(NamedTuple):
    """A picture that a program says it has made."""
    image: str
    spp: float
    seconds: float
    cpu_seconds: float | None


class Adapter(NamedTuple):
    name: str
    command: list
    lists: bool  # run once, for {time}, and lists its pictures; otherwise run for each picture of {spp}
    first_spp: int
    most_seconds: float
    scenes: list  # empty: all
    folder: pathlib.Path

    def filled(self, values):
        return [re.sub(r"\{(\w+)\}", lambda found: values[found[1]], word) for word in self.command]


def _object(text):
    try:
        found = json.loads(text, parse_constant=lambda name: None)
    except ValueError:
        return None
    return found if isinstance(found, dict) else None


def _number(found, key, most):
    """A number above 0, up to `most`; None: it is none."""
    value = found.get(key)
    return value if isinstance(value, (int, float)) and not isinstance(value, bool) and 0 < value <= most else None


def _texts(value):
    return isinstance(value, list) and all(isinstance(v, str) for v in value)


def _placeholders(command):
    used = set()
    for word in command:
        for name, closed in re.findall(r"\{([^}]*)(\}?)", word):
            if not closed:
                raise RaceError(f"'command' has {word!r}, a brace that is not closed")
            if name not in PLACEHOLDERS:
                raise RaceError(f"'command' has {{{name}}}; there are {{{'}, {'.join(PLACEHOLDERS)}}}")
            used.add(name)
    return used


def parse(text, folder):
    found = _object(text)
    if found is None:
        raise RaceError("an adapter is a JSON object")
    for key in found:
        if key not in KEYS:
            raise RaceError(f"unknown key {key!r}; there are {', '.join(KEYS)}")
    if not isinstance(found.get("name"), str) or not found["name"]:
        raise RaceError("'name' must be what the program is called in tables")
    command = found.get("command")
    if not _texts(command) or not 1 <= len(command) <= MOST_ARGUMENTS:
        raise RaceError("'command' must be an array of texts: the program and its arguments")
    used = _placeholders(command)
    if "scene" not in used:
        raise RaceError("'command' needs {scene}, or every race is the same")
    if ("spp" in used) == ("time" in used):
        raise RaceError("'command' needs either {spp} (one picture of so many samples) or {time} (pictures for so many seconds)")
    lists = "time" in used
    if lists and "folder" not in used:
        raise RaceError("'command' has {time} and so needs {folder}, where its pictures go")
    if not lists and "image" not in used:
        raise RaceError("'command' has {spp} and so needs {image}, the EXR to write")
    most = _number({"most_seconds": EXTRA_SECONDS, **found}, "most_seconds", MOST_EXTRA_SECONDS)
    if most is None:
        raise RaceError("'most_seconds' must be a number of seconds above 0")
    first = _number({"first_spp": 4, **found}, "first_spp", MOST_FIRST_SPP)
    if first is None or first != int(first):
        raise RaceError(f"'first_spp' must be a whole number from 1 to {MOST_FIRST_SPP}")
    scenes = found.get("scenes", [])
    if not _texts(scenes):
        raise RaceError("'scenes' must be an array of names of scenes")
    return Adapter(" ".join(found["name"].split()), command, lists, int(first), most, scenes, folder)


def text_of(path):
    """What a small text file says."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise RaceError(f"{path.name} has more than 1 MiB")
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise RaceError(f"{path.name} cannot be read: {error.strerror}") from None


def read(path):
    try:
        return parse(text_of(path), path.absolute().parent)
    except RaceError as error:
        raise RaceError(f"{path}: {error}") from None


def _made(text, whole):
    found = _object(text)
    if found is None:
        raise RaceError("this is no JSON object")
    seconds = _number(found, "seconds", MOST_EXTRA_SECONDS)
    if seconds is None:
        raise RaceError("'seconds' must be a number above 0")
    cpu = _number(found, "cpu_seconds", MOST_EXTRA_SECONDS)
    if "cpu_seconds" in found and cpu is None:
        raise RaceError("'cpu_seconds' must be a number above 0")
    if not whole:
        return Made("", 0, seconds, cpu)
    spp, image = _number(found, "spp", MOST_SPP), found.get("image")
    if spp is None:
        raise RaceError("'spp' must be a number above 0")
    if not isinstance(image, str) or image in ("", ".", "..") or "/" in image or "\0" in image:
        raise RaceError("'image' must be the name of a file in {folder}, without a folder")
    return Made(image, spp, seconds, cpu)


def pictures(lines):
    """What a program with {time} lists: a JSON object a line."""
    out = []
    for number, line in enumerate(lines.split("\n"), 1):
        if not line.strip():
            continue
        try:
            made = _made(line, True)
            if out and made.spp <= out[-1].spp:
                raise RaceError("'spp' must rise from line to line")
            if len(out) == MOST_PICTURES:
                raise RaceError(f"there are more than {MOST_PICTURES} pictures")
        except RaceError as error:
            raise RaceError(f"line {number}: {error}") from None
        out.append(made)
    if not out:
        raise RaceError("it names no picture")
    return out


def times(text):
    """What a program with {spp} may write: what rendering cost without loading."""
    return _made(text, False)


def plausible(claim, process, clock):
    """The cost that a program claims for a picture, held against what its process took."""
    def too_much(claimed, measured):
        return claimed > measured * CLOCK_RATIO + CLOCK_SECONDS

    if too_much(claim.seconds, process.wall):
        raise RaceError(f"it says that a picture took {claim.seconds:g} s, and the whole program ran for {process.wall:g} s")
    if claim.cpu_seconds is None and clock == "cpu":
        raise RaceError("it says no 'cpu_seconds', which a race by --clock cpu is about")
    cpu = claim.cpu_seconds or 0.
    if too_much(cpu, process.cpu):
        raise RaceError(f"it says that a picture took {cpu:g} CPU seconds, and the whole program had {process.cpu:g}")
    return Cost(claim.seconds, cpu)
