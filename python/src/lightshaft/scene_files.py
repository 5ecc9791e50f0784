"""Finds the files that a scene names, so that they can be sent with it.

A file is searched as the coordinator does it: included files beside the file that includes them, all others in the
folders of <path> elements and beside the scene. Missing files are skipped here; the farm reports them with their
place in the scene. Since a scene may come from anywhere, only files in the folder of the scene (after following
links) and in the folders that the caller allows are sent.
"""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import os
import pathlib
import re
import stat
import unicodedata
import zlib
from collections.abc import Iterable, Iterator, Mapping
from typing import BinaryIO
from xml.parsers import expat

from .errors import FileRefused

MAX_SCENE_BYTES = 32 << 20  # of one scene file, as the farm allows
MAX_INCLUDES, MAX_INCLUDE_DEPTH = 256, 15  # as the scene format allows
MAX_FILES = 100_000
MAX_FRAMES = 10_000
MAX_ELEMENTS = 500_000  # as the scene format allows
MAX_NAMES_LOOKED_AT = 4096  # in one folder
MAX_NAME = 4096  # characters of a file's name
MAX_VALUE = 64 << 10  # characters of an attribute after its parameters were put in
READ_BYTES = 1 << 20

Element = tuple[str, dict[str, str]]
PathLike = str | os.PathLike[str]


@dataclasses.dataclass(frozen=True)
class Source:
    """The bytes of a file to send, on disk or in memory."""

    digest: str
    size: int
    path: pathlib.Path | None = None
    data: bytes = b""

    @classmethod
    def of_bytes(cls, data: bytes) -> Source:
        return cls(hashlib.sha256(data).hexdigest(), len(data), data=data)

    @classmethod
    def of_file(cls, path: pathlib.Path) -> Source:
        digest, size = hashlib.sha256(), 0
        try:
            with _open_regular(path) as file:
                while part := file.read(READ_BYTES):
                    digest.update(part)
                    size += len(part)
        except OSError as error:
            raise FileRefused(f"{path} cannot be read: {error.strerror or error}") from None
        return cls(digest.hexdigest(), size, path)

    def read(self, offset: int, size: int) -> bytes:
        if self.path is None:
            return self.data[offset : offset + size]
        try:
            with _open_regular(self.path) as file:
                file.seek(offset)
                return file.read(size)
        except OSError as error:
            raise FileRefused(f"{self.path} cannot be read: {error.strerror or error}") from None


def _open_regular(path: pathlib.Path) -> BinaryIO:
    """Opens a regular file without waiting for the other end of a pipe."""
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    file = open(os.open(path, flags), "rb")
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise FileRefused(f"{path} is not a regular file")
    return file


def read_scene(path: pathlib.Path) -> bytes:
    """The text of a scene file."""
    try:
        with _open_regular(path) as file:
            text = file.read(MAX_SCENE_BYTES + 1)
    except FileNotFoundError:
        raise FileRefused(f"there is no file {path}") from None
    except OSError as error:
        raise FileRefused(f"{path} cannot be read: {error.strerror or error}") from None
    text = unpacked(text, str(path))
    if len(text) > MAX_SCENE_BYTES:
        raise FileRefused(f"{path} is larger than the {MAX_SCENE_BYTES >> 20} MiB of a scene file")
    return text


def written_otherwise(folder: pathlib.Path, name: str) -> pathlib.Path | None:
    """Finds the file `name` in `folder`, or the only file that it can mean. The name may have backslashes between
    its folders, as on Windows, or letters and accents that are composed differently on this disk (macOS separates
    them). None: there is no such file, or there are several."""
    place = folder / name
    if os.path.exists(place):  # Path.exists() raises for names that are too long
        return place
    place = folder
    for part in pathlib.PurePosixPath(name.replace("\\", "/")).parts:
        there = place / part
        if not os.path.exists(there):
            alike = [entry for entry in _names_in(place) if _composed(entry) == _composed(part)]
            if len(alike) != 1:
                return None
            there = place / alike[0]
        place = there
    return place


def _composed(name: str) -> str:
    return unicodedata.normalize("NFC", name)


def _names_in(folder: pathlib.Path) -> list[str]:
    try:
        with os.scandir(folder) as entries:
            return [entry.name for entry in itertools.islice(entries, MAX_NAMES_LOOKED_AT)]
    except OSError:
        return []


def unpacked(text: bytes, name: str) -> bytes:
    """Returns the text of a scene file, unpacked if it is a gzip file, with at most one byte more than the limit
    for scenes."""
    if not text.startswith(b"\x1f\x8b"):
        return text
    unpacker = zlib.decompressobj(wbits=31)  # 31: the largest window, in the format of gzip
    try:
        plain = unpacker.decompress(text, MAX_SCENE_BYTES + 1)
    except zlib.error as error:
        raise FileRefused(f"{name} is a damaged gzip file: {error}") from None
    if not unpacker.eof and len(plain) <= MAX_SCENE_BYTES:
        raise FileRefused(f"{name} is a gzip file that was cut short")
    return plain


class Folders:
    """The folders that files may come from: `folder` for relative names, and those that the caller allows."""

    def __init__(
        self,
        folder: PathLike,
        allowed: Iterable[PathLike] = (),
        given: Mapping[str, PathLike | bytes] | None = None,
    ) -> None:
        self._folder = pathlib.Path(folder)
        self._roots = [pathlib.Path(os.path.realpath(root)) for root in (folder, *allowed)]
        self._given = {join("", name): value for name, value in (given or {}).items()}
        self.sources: dict[str, Source] = {}  # by the name that the farm knows them by

    def find(self, place: str) -> bool:
        """Returns True if the file exists; it will then be sent. Raises FileRefused if it exists but must not be
        sent."""
        if place in self.sources:
            return True
        if len(self.sources) >= MAX_FILES:
            raise FileRefused(f"the scene names more than {MAX_FILES} files")
        if place in self._given:
            value = self._given[place]
            self.sources[place] = (
                Source.of_bytes(value)
                if isinstance(value, (bytes, bytearray, memoryview))
                else Source.of_file(pathlib.Path(value))
            )
            return True
        real = self._locate(place)
        if real is None:
            return False
        self.sources[place] = Source.of_file(real)
        return True

    def _locate(self, place: str) -> pathlib.Path | None:
        if "\0" in place:
            return None
        found = written_otherwise(self._folder, place)
        if found is None:
            return None
        real = pathlib.Path(os.path.realpath(found))
        if not real.is_file():
            return None
        if not any(real.is_relative_to(root) for root in self._roots):
            raise FileRefused(
                f"the scene names {place}, which is {real} and lies outside {self._roots[0]}; "
                f"to send it, allow its folder: submit(..., allow=[{str(real.parent)!r}])"
            )
        return real

    def text(self, place: str) -> bytes | None:
        if not self.find(place):
            return None
        return unpacked(self.sources[place].read(0, MAX_SCENE_BYTES + 1), place)


def join(folder: str, name: str) -> str:
    """Returns a file name as the farm writes it, with '.' and '..' resolved."""
    joined = name if name.startswith("/") or not folder else f"{folder}/{name}"
    parts: list[str] = []
    for part in joined.split("/"):
        if part in ("", "."):
            continue
        if part == ".." and parts and parts[-1] != "..":
            parts.pop()
        else:
            parts.append(part)
    return ("/" if joined.startswith("/") else "") + "/".join(parts)


def find_files(
    text: bytes, folders: Folders, defines: Mapping[str, str] | None = None, frames: str | None = None
) -> dict[str, Source]:
    """Finds all existing files that the scene names."""
    parsed: dict[str, list[Element]] = {}
    for frame in frame_numbers(frames):
        _Finder(folders, dict(defines or {}), frame, parsed).find(text)
    return folders.sources


def frame_numbers(frames: str | None) -> Iterator[int | None]:
    """Returns the frame numbers of a range such as 1-10x2. None: there is no range, or it is malformed."""
    match = re.fullmatch(r"(\d{1,7})(?:-(\d{1,7})(?:x(\d{1,7}))?)?", frames or "")
    if not match:  # the farm says what is wrong with it
        yield None
        return
    first, last, step = int(match[1]), int(match[2] or match[1]), int(match[3] or 1)
    yield from range(first, last + 1, max(step, 1))[:MAX_FRAMES]


class _Finder:
    def __init__(
        self,
        folders: Folders,
        defines: dict[str, str],
        frame: int | None,
        parsed: dict[str, list[Element]],
    ) -> None:
        self._folders, self._values, self._frame, self._parsed = folders, defines, frame, parsed
        if frame is not None:
            self._values["frame"] = str(frame)
        self._paths: list[str] = []
        self._includes = 0
        self._names: list[str] = []

    def find(self, text: bytes) -> None:
        self._read("", text, ())
        for name in dict.fromkeys(self._names):
            self._first([*(join(path, name) for path in self._paths), join("", name)])

    def _first(self, places: list[str]) -> str | None:
        """Returns the first place that has the file. A place from which it must not be sent counts only if there
        is no other."""
        refused: FileRefused | None = None
        for place in places:
            try:
                if self._folders.find(place):
                    return place
            except FileRefused as error:
                refused = refused or error
        if refused:
            raise refused
        return None

    def _read(self, place: str, text: bytes, including: tuple[str, ...]) -> None:
        if place not in self._parsed:
            self._parsed[place] = _elements(text)
        for tag, attributes in self._parsed[place]:
            a = {name: self._filled(value) for name, value in attributes.items()}
            if tag == "default" and "name" in a:
                self._values.setdefault(a["name"], a.get("value", ""))
            elif tag == "path" and "value" in a:
                self._paths.insert(0, join("", a["value"]))
            elif tag == "include" and "filename" in a:
                self._include(self._numbered(a["filename"]), including)
            elif (
                tag == "string"
                and a.get("name", "").lower() == "filename"
                and 0 < len(a["value"]) <= MAX_NAME
            ):
                self._names.append(self._numbered(a["value"]))

    def _include(self, name: str, including: tuple[str, ...]) -> None:
        self._includes += 1
        if self._includes > MAX_INCLUDES or len(including) >= MAX_INCLUDE_DEPTH:
            return
        beside = [join(join(including[-1], ".."), name)] if including else []
        place = self._first([*beside, *(join(path, name) for path in self._paths), join("", name)])
        if place is not None and place not in including:
            self._read(place, self._folders.text(place) or b"", (*including, place))

    def _numbered(self, name: str) -> str:
        if self._frame is None:
            return name
        # A single # in the name of a folder ("shot#3") is only a #.
        folder, slash, file = name.rpartition("/")
        one_by_one = "#" in file
        ahead, rest = (folder + slash, file) if one_by_one else ("", name)
        return ahead + re.sub("#+" if one_by_one else "##+", lambda run: str(self._frame).zfill(len(run[0])), rest)

    def _filled(self, value: str) -> str:
        """Inserts the parameters: each $ is followed by the longest name that is defined."""
        if "$" not in value:
            return value

        def put_in(match: re.Match[str]) -> str:
            word = match[1]
            if word is None:  # \$
                return "$"
            for end in range(len(word), 0, -1):
                if word[:end] in self._values:
                    return self._values[word[:end]] + word[end:]
            return match[0]

        return re.sub(r"\\\$|\$([A-Za-z0-9_]{1,128})", put_in, value[:MAX_VALUE])[:MAX_VALUE]


def _elements(text: bytes) -> list[Element]:
    """Returns the elements that can name files, in document order. It stops at malformed text, which the farm will
    report."""
    found: list[Element] = []
    parser = expat.ParserCreate()

    def note(tag: str, attributes: dict[str, str]) -> None:
        if tag in ("default", "path", "include") or tag == "string" and "value" in attributes:
            found.append((tag, attributes))
        if len(found) > MAX_ELEMENTS:
            raise _Unreadable

    def refuse(*_: object) -> None:
        raise _Unreadable

    parser.StartElementHandler = note
    parser.EntityDeclHandler = refuse  # entities can make a short text endless, and no scene needs them
    try:
        if len(text) <= MAX_SCENE_BYTES:
            parser.Parse(text, True)
    except (expat.ExpatError, _Unreadable, UnicodeError, LookupError):
        pass
    return found


class _Unreadable(Exception):
    pass
