"""Makes the XML of a scene from a dictionary in the style of Mitsuba's mi.load_dict.

Each element is on a line of its own, and SceneText remembers its keys: so an error that the farm reports for a line
can be reported for the dictionary. Arrays become files beside the XML (scene_arrays.py), named by their content.
"""

from __future__ import annotations

import dataclasses
import difflib
import hashlib
import os
import re
from collections.abc import Mapping
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from ._plugins import ELEMENTS
from .errors import Diagnostic, SceneDictError
from .scene_arrays import NoFile, file_of

MAX_NESTING = 64  # as the scene format allows
MAX_ELEMENTS = 500_000
FORBIDDEN = re.compile("[\x00-\x1f\x7f\ud800-\udfff\ufffe\uffff]")


@dataclasses.dataclass(frozen=True)
class SceneText:
    xml: str
    paths: tuple[str, ...]
    """For each line the keys that led to it, joined by dots."""
    files: Mapping[str, bytes] = dataclasses.field(default_factory=dict)
    """Of arrays, by the names that the XML has for them."""

    def path_of(self, line: int) -> str:
        return self.paths[line - 1] if 0 < line <= len(self.paths) else ""


def scene_of_dict(scene: Mapping[str, Any]) -> SceneText:
    """Returns the scene as Mitsuba XML. Raises SceneDictError with the keys of an impossible value."""
    if scene.get("type") != "scene":
        raise _wrong(
            "", f"the outermost dictionary must have 'type': 'scene', not {scene.get('type')!r}"
        )
    writer = _Writer()
    writer.add(0, "", '<scene version="3.0.0">')
    for key, value in scene.items():
        if key != "type":
            writer.write(1, "", key, value, names_it=True)
    writer.add(0, "", "</scene>")
    return SceneText("\n".join(writer.lines) + "\n", tuple(writer.paths), writer.files)


def _wrong(path: str, text: str) -> SceneDictError:
    return SceneDictError(text, diagnostics=[Diagnostic(text=text, path=path or "scene")])


class _Writer:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self.paths: list[str] = []
        self.files: dict[str, bytes] = {}
        self.inside: list[str] = []  # the elements that are being written

    def add(self, depth: int, path: str, line: str) -> None:
        if len(self.lines) >= MAX_ELEMENTS:
            raise _wrong(path, f"the scene has more than {MAX_ELEMENTS} elements")
        self.lines.append("  " * depth + line)
        self.paths.append(path)

    def write(self, depth: int, parent: str, key: Any, value: Any, names_it: bool = False) -> None:
        """Writes an object. `names_it`: top-level objects get their keys as ids, and can be referred to by them."""
        if not isinstance(key, str):
            raise _wrong(parent, f"keys must be strings, not {key!r}")
        path = f"{parent}.{key}" if parent else key
        if depth > MAX_NESTING:
            raise _wrong(
                path,
                f"dictionaries are nested more than {MAX_NESTING} deep (does one contain itself?)",
            )
        if isinstance(value, Mapping) and value and not any(isinstance(k, str) for k in value):
            self.write_animation(depth, path, key, value)
        elif isinstance(value, Mapping):
            self.write_dict(depth, path, key, value, names_it)
        else:
            self.write_value(depth, path, key, value)

    def write_dict(
        self, depth: int, path: str, key: str, value: Mapping[str, Any], names_it: bool
    ) -> None:
        kind = value.get("type")
        if not isinstance(kind, str):
            raise _wrong(path, "a dictionary needs a 'type' that is a string")
        if kind == "ref":
            self.write_reference(depth, path, key, value)
        elif kind == "rgb" or (kind == "spectrum" and "value" in value):
            self.write_colour(depth, path, key, kind, value)
        else:
            self.write_object(depth, path, key, kind, value, names_it)

    def write_animation(self, depth: int, path: str, key: str, value: Mapping[Any, Any]) -> None:
        """Writes transforms by their times, as of a camera that moves."""
        self.add(depth, path, f"<animation name={_quoted(path, key)}>")
        for time in value:
            if isinstance(time, bool) or not isinstance(time, (int, float, np.integer, np.floating)):
                raise _wrong(path, f"the keys of an animation are times, not {time!r}")
        for time in sorted(value):
            at = f"{path}[{time!r}]"
            matrix = self.array_of(at, value[time])
            if matrix.shape not in ((3, 3), (4, 4)):
                raise _wrong(at, "an animation has a transform (4 x 4 numbers) at each of its times")
            text = " ".join(map(_number, _numbers(at, matrix.ravel(), (9, 16))))
            number = _number(_numbers(at, time, (1,))[0])
            self.add(depth + 1, at, f'<transform time="{number}"><matrix value="{text}"/></transform>')
        self.add(depth, path, "</animation>")

    def write_reference(self, depth: int, path: str, key: str, value: Mapping[str, Any]) -> None:
        if not isinstance(value.get("id"), str) or set(value) != {"type", "id"}:
            raise _wrong(path, "a reference is {'type': 'ref', 'id': NAME}")
        self.add(depth, path, f"<ref name={_quoted(path, key)} id={_quoted(path, value['id'])}/>")

    def write_colour(
        self, depth: int, path: str, key: str, kind: str, value: Mapping[str, Any]
    ) -> None:
        if set(value) != {"type", "value"}:
            raise _wrong(path, f"a colour is {{'type': '{kind}', 'value': ...}} and has nothing else")
        given = value["value"]
        if isinstance(given, str):  # '#ff8000', or a spectrum as XML has it
            text = given
        elif (
            kind == "spectrum" and isinstance(given, (list, tuple)) and given and np.ndim(given[0]) == 1
        ):
            text = ", ".join(":".join(map(_number, _numbers(path, pair, (2,)))) for pair in given)
        else:
            text = " ".join(map(_number, _numbers(path, given, (1, 3))))
        self.add(depth, path, f"<{kind} name={_quoted(path, key)} value={_quoted(path, text)}/>")

    def write_object(
        self, depth: int, path: str, key: str, kind: str, value: Mapping[str, Any], names_it: bool
    ) -> None:
        element = _element_of(path, key, kind, self.inside[-1] if self.inside else "")
        name = value.get("id", key if names_it else None)
        if name is not None and not isinstance(name, str):
            raise _wrong(path, "an 'id' must be a string")
        head = f"<{element} type={_quoted(path, kind)}"
        if not names_it:
            head += f" name={_quoted(path, key)}"
        if name is not None:
            head += f" id={_quoted(path, name)}"
        inner = self.with_files(
            path, kind, {k: v for k, v in value.items() if k not in ("type", "id")}
        )
        if not inner:
            return self.add(depth, path, f"{head}/>")
        self.add(depth, path, f"{head}>")
        self.inside.append(element)
        for inner_key, inner_value in inner.items():
            self.write(depth + 1, path, inner_key, inner_value)
        self.inside.pop()
        self.add(depth, path, f"</{element}>")

    def with_files(self, path: str, kind: str, values: dict[str, Any]) -> dict[str, Any]:
        """Replaces arrays by the names of their files."""
        try:
            made = file_of(kind, values)
        except NoFile as error:
            raise _wrong(f"{path}.{error.key}", error.text) from None
        if made is None:
            return values
        data, ending, keys = made
        name = f"array-{hashlib.sha256(data).hexdigest()[:32]}{ending}"
        self.files[name] = data
        return {"filename": name, **{k: v for k, v in values.items() if k not in keys}}

    def write_value(self, depth: int, path: str, key: str, value: Any) -> None:
        name = _quoted(path, key)
        if isinstance(value, (bool, np.bool_)):
            self.add(depth, path, f'<boolean name={name} value="{str(bool(value)).lower()}"/>')
        elif isinstance(value, (int, np.integer)):
            self.add(depth, path, f'<integer name={name} value="{int(value)}"/>')
        elif isinstance(value, (float, np.floating)):
            self.add(
                depth, path, f'<float name={name} value="{_number(_numbers(path, value, (1,))[0])}"/>'
            )
        elif isinstance(value, (str, os.PathLike)):
            self.add(depth, path, f"<string name={name} value={_quoted(path, os.fspath(value))}/>")
        else:
            self.write_array(depth, path, key, value)

    def array_of(self, path: str, value: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
        given = getattr(value, "matrix", value)
        try:
            array = np.asarray(given, dtype=np.float64)
        except (TypeError, ValueError):
            raise _wrong(
                path,
                f"a {type(value).__name__} is not possible here: use only dictionaries, numbers, strings, three "
                "numbers, and transforms (4 x 4 numbers, or an object with a .matrix)",
            ) from None
        if array.ndim == 3 and array.shape[-1] == 1:  # a transform of Dr.Jit, with one entry
            array = array[..., 0]
        return array

    def write_array(self, depth: int, path: str, key: str, value: Any) -> None:
        """Writes three numbers as a point or vector, which the format does not distinguish, and 9 or 16 numbers as
        a transform."""
        array = self.array_of(path, value)
        if array.shape == (3,):
            text = " ".join(map(_number, _numbers(path, array, (3,))))
            self.add(depth, path, f'<point name={_quoted(path, key)} value="{text}"/>')
        elif array.shape in ((3, 3), (4, 4)):
            text = " ".join(map(_number, _numbers(path, array.ravel(), (9, 16))))
            self.add(
                depth,
                path,
                f'<transform name={_quoted(path, key)}><matrix value="{text}"/></transform>',
            )
        else:
            raise _wrong(
                path,
                f"an array of shape {array.shape} is not possible here: three numbers are a point or vector, "
                "4 x 4 a transform; a colour is {'type': 'rgb', 'value': ...}; images are the 'data' of a "
                "'bitmap' or 'envmap', grids that of a 'gridvolume', and a mesh is a 'ply' with "
                "'vertex_positions' and 'faces'",
            )


def _element_of(path: str, key: str, kind: str, parent: str) -> str:
    """Some kinds, such as 'product', are of several elements: the key or the parent says which, else it is the first."""
    elements = ELEMENTS.get(kind)
    if elements is None:
        near = difflib.get_close_matches(kind, ELEMENTS, 1)
        raise _wrong(
            path,
            f"there is no plugin of type {kind!r}" + (f"; did you mean {near[0]!r}?" if near else ""),
        )
    if "volume" in elements and parent in ("medium", "volume", "phase"):
        return "volume"
    return key if key in elements else elements[0]


def _numbers(path: str, value: Any, counts: tuple[int, ...]) -> list[float]:
    try:
        array = np.asarray(value, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        raise _wrong(path, f"numbers are needed here, not {str(value)[:80]!r}") from None
    if array.size not in counts:
        raise _wrong(path, f"{' or '.join(map(str, counts))} numbers are needed here, not {array.size}")
    if not np.isfinite(array).all():
        raise _wrong(path, "a number is infinite or not a number (nan)")
    return [float(x) for x in array]


def _number(value: float) -> str:
    return repr(value)  # the shortest text that reads back to the same bits


def _quoted(path: str, text: str) -> str:
    """Quotes a value as an attribute. `$` is escaped, because in a dictionary it is an ordinary character and
    names no parameter."""
    if FORBIDDEN.search(text):
        raise _wrong(path, f"{text[:80]!r} has characters that are not allowed in scenes")
    return quoteattr(text.replace("$", "\\$"))
