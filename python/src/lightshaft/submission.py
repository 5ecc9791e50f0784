"""Submits a scene: finds its files, sends those that the farm does not have, and submits the job."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeAlias
from urllib.parse import urlencode

from . import models
from .errors import (
    BadAnswer,
    Diagnostic,
    FarmBusy,
    LightshaftError,
    RequestRejected,
    SceneRejected,
)
from .scene_dict import SceneText, scene_of_dict
from .scene_files import MAX_SCENE_BYTES, Folders, PathLike, Source, find_files, read_scene
from .steps import (
    DIGESTS_PER_QUESTION,
    UPLOAD_PART_BYTES,
    Call,
    Retry,
    Steps,
    ask,
    ask_json,
    post_json,
    problem_of,
    succeed,
    with_retries,
    work,
)

STAGES = (".usd", ".usda", ".usdc", ".usdz")
Scene: TypeAlias = str | os.PathLike[str] | Mapping[str, Any]


@dataclasses.dataclass(frozen=True)
class Options:
    """Arguments of submit() other than the scene and the job's settings."""

    name: str | None = None
    folder: PathLike | None = None
    allow: Iterable[PathLike] = ()
    assets: Mapping[str, PathLike | bytes] | None = None
    camera: str | None = None


@dataclasses.dataclass(frozen=True)
class Prepared:
    name: str
    scene: Source
    files: Mapping[str, Source]
    text_of: Callable[[str], SceneText | None] = lambda file: None
    """The text of each scene file that was made from a dictionary or a stage."""
    warnings: tuple[str, ...] = ()


def submit(scene: Scene, spec: Mapping[str, Any], options: Options) -> Steps[models.SubmitJobAnswer]:
    settings = {name: value for name, value in spec.items() if value is not None}
    if isinstance(settings.get("defines"), Mapping):
        settings["defines"] = {str(name): str(value) for name, value in settings["defines"].items()}
    if archive := _archive_of(scene):
        return (yield from _submit_archive(*archive, settings, options))
    prepared = yield from work(lambda: prepare(scene, settings, options))
    yield from _send_reference(settings)
    yield from _send_missing(
        {source.digest: source for source in (prepared.scene, *prepared.files.values())}
    )
    body = {
        "scene": prepared.scene.digest,
        "assets": {name: source.digest for name, source in prepared.files.items()},
        "name": prepared.name,
        "spec": _as_json(settings),
    }
    try:
        answer = _with_id((yield from post_json("/api/v1/jobs", body)))
    except SceneRejected as error:
        raise _with_paths(error, prepared) from None
    told = answer.get("warnings")
    answer["warnings"] = [*prepared.warnings, *(told if isinstance(told, list) else [])]
    return answer


def _with_id(answer: Mapping[str, Any]) -> models.SubmitJobAnswer:
    if not isinstance(answer.get("id"), str):
        raise BadAnswer("the farm's answer names no job")
    return answer  # type: ignore[return-value]


def _archive_of(scene: Any) -> tuple[pathlib.Path, str] | None:
    """Returns the path and the media type of an archive, or None if the scene is not an archive."""
    if not isinstance(scene, (str, os.PathLike)) or str(scene).lstrip("\ufeff \t\r\n").startswith("<"):
        return None
    path = pathlib.Path(scene)
    name = path.name.lower()
    if name.endswith(".zip"):
        return path, "application/zip"
    return (path, "application/x-tar") if name.endswith((".tar", ".tar.gz", ".tgz")) else None


def _submit_archive(
    path: pathlib.Path, kind: str, settings: dict[str, Any], options: Options
) -> Steps[models.SubmitJobAnswer]:
    """Submits an archive of a scene and all its files. The farm unpacks and checks it."""
    for option in ("name", "folder", "allow", "assets", "camera"):
        if getattr(options, option):
            raise RequestRejected(f"{path} is an archive, which contains all its files: {option} has no effect")
    yield from _send_reference(settings)
    query = _as_query(path, _as_json(settings))
    source = yield from work(lambda: Source.of_file(path))
    data = yield from work(lambda: source.read(0, source.size))
    return _with_id((yield from ask_json(Call("POST", f"/api/v1/jobs?{query}", data, kind))))


def _as_query(path: pathlib.Path, spec: Mapping[str, Any]) -> str:
    pairs: list[tuple[str, str]] = []
    for name, value in spec.items():
        if name == "defines" and isinstance(value, Mapping):
            pairs += [("define", f"{key}={text}") for key, text in value.items()]
        elif name == "size" and isinstance(value, list):
            pairs.append((name, "x".join(map(str, value))))
        elif isinstance(value, bool):
            pairs.append((name, str(value).lower()))
        elif isinstance(value, list):
            pairs.append((name, ",".join(map(str, value))))
        elif isinstance(value, (str, int, float)):
            pairs.append((name, str(value)))
        else:
            raise RequestRejected(f"{name} of the archive {path} must be given in its job.json")
    return urlencode(pairs)


def warnings_of(answer: models.SubmitJobAnswer) -> list[str]:
    texts = [text for text in answer.get("warnings", []) if isinstance(text, str)]
    if answer.get("reference_same_seed"):
        texts.append("the reference was rendered from this scene with this seed: the true errors will mean nothing")
    return texts


def prepare(scene: Scene, spec: Mapping[str, Any], options: Options) -> Prepared:
    """Returns the text of the scene, and its files with their digests."""
    if isinstance(scene, (str, os.PathLike)) and os.fspath(scene).lower().endswith(STAGES):
        return _prepare_stage(scene, spec, options)
    if options.camera is not None:
        raise RequestRejected("camera= is only for USD stages, and this scene is not one")
    dictionary = None
    if isinstance(scene, Mapping):
        dictionary = scene_of_dict(scene)
        text, name, folder = dictionary.xml.encode(), "scene.xml", pathlib.Path()
    elif isinstance(scene, str) and scene.lstrip("\ufeff \t\r\n").startswith("<"):
        text, name, folder = scene.encode("utf-8", "surrogatepass"), "scene.xml", pathlib.Path()
    elif isinstance(scene, (str, os.PathLike)):
        path = pathlib.Path(scene)
        text, name, folder = read_scene(path), path.name, path.parent
    else:
        raise RequestRejected(
            f"a scene is a path, a string of XML or a dictionary, not a {type(scene).__name__}"
        )
    if len(text) > MAX_SCENE_BYTES:
        raise RequestRejected(
            f"the scene is larger than the {MAX_SCENE_BYTES >> 20} MiB of a scene file"
        )
    folders = Folders(
        folder if options.folder is None else options.folder,
        options.allow,
        {**(dictionary.files if dictionary else {}), **(options.assets or {})},
    )
    # Settings of a wrong kind are left to the farm, which tells what it wants.
    defines, frames = spec.get("defines"), spec.get("frames")
    files = find_files(
        text,
        folders,
        defines if isinstance(defines, Mapping) else None,
        None if frames is None else str(frames),  # the farm takes the number of one frame, too
    )
    return Prepared(options.name or name, Source.of_bytes(text), files, lambda file: dictionary)


def _prepare_stage(scene: PathLike, spec: Mapping[str, Any], options: Options) -> Prepared:
    from . import usd  # only now: it needs packages that are optional

    if options.assets:
        raise RequestRejected("assets= cannot be used with a USD stage, which finds its files itself")
    frames, given = spec.get("frames"), spec.get("size")
    size = None
    if isinstance(given, (list, tuple)) and len(given) == 2:  # else the farm says what it wants
        size = int(given[0]), int(given[1])
    stage = usd.read(
        scene,
        camera=options.camera,
        frames=None if frames is None else str(frames),
        size=size,
        folder=options.folder,
        allow=options.allow,
    )
    text = Source.of_bytes(stage.main.xml.encode())
    name = options.name or pathlib.Path(scene).name
    return Prepared(name, text, stage.files, stage.text_of, stage.warnings)


def _as_json(spec: Mapping[str, Any]) -> dict[str, Any]:
    """Converts NumPy's numbers and tuples to JSON."""

    def plain(value: Any) -> Any:
        if hasattr(value, "tolist"):
            return value.tolist()
        raise RequestRejected(f"a {type(value).__name__} cannot be a setting of a job")

    loaded: dict[str, Any] = json.loads(json.dumps(spec, default=plain))
    return loaded


def _with_paths(error: SceneRejected, prepared: Prepared) -> SceneRejected:
    """Replaces line numbers by keys or prims in errors about XML that was generated from a dictionary or a stage."""

    def told(d: Diagnostic) -> Diagnostic:
        text = prepared.text_of(d.file)
        return d if text is None else dataclasses.replace(d, path=text.path_of(d.line))

    return SceneRejected(
        error.message, diagnostics=[told(d) for d in error.diagnostics], status=error.status
    )


def _send_reference(spec: dict[str, Any]) -> Steps[None]:
    """Sends the reference before the job if `reference` is the path of an image."""
    given = spec.get("reference")
    if given is None or re.fullmatch("[0-9a-f]{64}", str(given)):
        return
    source = yield from work(lambda: Source.of_file(pathlib.Path(given)))
    yield from _send_missing({source.digest: source})
    spec["reference"] = source.digest


def _send_missing(sources: Mapping[str, Source]) -> Steps[None]:
    digests = sorted(sources)
    for begin in range(0, len(digests), DIGESTS_PER_QUESTION):
        answer = yield from post_json(
            "/api/v1/blobs/missing", {"digests": digests[begin : begin + DIGESTS_PER_QUESTION]}
        )
        missing = answer.get("missing")
        if not isinstance(missing, list):
            raise BadAnswer("the farm's answer does not say which files it needs")
        for digest in missing:
            if (
                isinstance(digest, str) and digest in sources
            ):  # nothing else is sent, whatever it asks for
                yield from _send(sources[digest])


def _send(source: Source) -> Steps[None]:
    path = f"/api/v1/blobs/{source.digest}"
    if source.size > UPLOAD_PART_BYTES:
        yield from _send_in_parts(path, source)
        return
    data = yield from work(lambda: source.read(0, source.size))
    yield from with_retries(lambda: succeed(Call("PUT", path, data, "application/octet-stream")))


def _send_in_parts(path: str, source: Source) -> Steps[None]:
    """Sends the file from where an earlier attempt ended. After a broken connection, continues where the farm
    says."""
    retry = Retry()
    reached = -1
    while True:
        try:
            there = yield from ask(Call("HEAD", path))
            if there.status == 200:
                return
            if there.status != 404:
                raise problem_of(there)
            offset = _offset(there.headers)
            if offset > reached:
                retry.answered()
            reached = max(reached, offset)
            if (yield from _send_rest(path, source, offset, retry)):
                return
        except LightshaftError as error:
            pause = retry.pause(error)
        else:  # another request has gone on with the upload: ask again where
            pause = retry.pause(
                FarmBusy(f"the upload of {path} makes no progress: does another program upload it too?")
            )
        yield pause


def _send_rest(path: str, source: Source, offset: int, retry: Retry) -> Steps[bool]:
    """Returns True if everything has arrived, and False if the farm wants another part."""
    while True:
        begin, size = offset, min(UPLOAD_PART_BYTES, source.size - offset)
        data = yield from work(lambda: source.read(begin, size))
        place = f"{begin}-{begin + size - 1}" if size > 0 else "*"
        reply = yield from ask(
            Call(
                "PUT",
                path,
                data,
                "application/octet-stream",
                headers={"Content-Range": f"bytes {place}/{source.size}"},
            )
        )
        if reply.status == 409:
            return False
        if reply.status // 100 != 2:
            raise problem_of(reply)
        if reply.status != 202:
            return True
        retry.answered()
        offset = _offset(reply.headers)
        if offset <= begin or offset > source.size:
            return False


def _offset(headers: Mapping[str, str]) -> int:
    text = headers.get("upload-offset", "0")
    return int(text) if re.fullmatch("[0-9]{1,18}", text) else 0
