"""The operations on a job, as steps, and its state. Job and AsyncJob run the steps."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib
import tempfile
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

from . import models
from .errors import NotFound, RequestRejected
from .images import Array, decode_layers, layer_of
from .light_groups import Mix
from .steps import (
    Call,
    Steps,
    ask_json,
    change_job,
    fetch,
    get_job,
    job_path,
    listed,
    succeed,
    text_at,
    work,
)


@dataclasses.dataclass(frozen=True)
class Verdict:
    """How far the error figures of an image can be trusted, from a job or from its report."""

    kind: str
    """early, converging, fast, heavy_tail or bias_floor."""
    words: str
    trusted: bool
    """False: the figures cannot be trusted yet; the words say why."""
    advice: str | None
    """What to do in that case, with the command; None: nothing needs to be done."""

    @staticmethod
    def of(told: Mapping[str, Any]) -> Verdict | None:
        """Returns the verdict of a job's view or of a report. None: there is none yet."""
        found = told.get("verdict")
        if isinstance(found, str):  # a report has its parts under keys of their own
            found = {
                "kind": told.get("verdict_kind"),
                "words": found,
                "trusted": told.get("trusted"),
                "advice": told.get("advice"),
            }
        if not isinstance(found, Mapping):
            return None
        advice = found.get("advice")
        return Verdict(
            str(found.get("kind") or ""),
            str(found.get("words") or ""),
            found.get("trusted") is not False,
            str(advice) if advice else None,
        )


class JobState:
    """The id of a job, and its state when the farm was last queried."""

    def __init__(self, view: models.Job) -> None:
        self._view = view

    @property
    def id(self) -> str:
        return self._view["id"]

    @property
    def view(self) -> models.Job:
        """Everything that the farm last sent about the job. refresh() fetches it again."""
        return self._view

    @property
    def state(self) -> str:
        """The state: queued, running, paused, done, failed or cancelled."""
        return self._view["state"]

    @property
    def progress(self) -> float:
        """The progress, from 0 to 1."""
        return self._view["progress"]

    @property
    def name(self) -> str:
        """The name of the job in lists. The default is the name of its scene."""
        return str(self._view.get("name") or "")

    @property
    def verdict(self) -> Verdict | None:
        """How far the error figures can be trusted. None: there are no figures yet."""
        return Verdict.of(self._view)

    def __repr__(self) -> str:
        name = f" {self.name!r}" if self.name else ""
        return f"<{type(self).__name__} {self.id}{name}: {self.state}, {100 * self.progress:.0f} %>"


def layers(job: str, mix: Mix | None = None) -> Steps[dict[str, Array]]:
    data = yield from fetch(_path(job, "/image.exr", _query(mix)))
    return (yield from work(lambda: decode_layers(data)))


def image(job: str, layer: str, mix: Mix | None) -> Steps[Array]:
    return layer_of((yield from layers(job, mix)), layer)


def mix(job: str, factors: Mix) -> Steps[models.MixError]:
    return ask_json(Call("GET", _path(job, "/mix", _query(factors))))  # type: ignore[return-value]


def _query(mix: Mix | None) -> dict[str, str]:
    return {} if mix is None else {"mix": json.dumps(mix)}


def _path(job: str, what: str, query: Mapping[str, str]) -> str:
    return job_path(job, what) + (f"?{urlencode(query)}" if query else "")


def save(job: str, path: str | os.PathLike[str], mix: Mix | None) -> Steps[None]:
    data = yield from fetch(_path(job, "/image.exr", _query(mix)))
    yield from work(lambda: _write(pathlib.Path(path), data))


def save_deep(job: str, path: str | os.PathLike[str]) -> Steps[None]:
    data = yield from fetch(_path(job, "/deep.exr", {}))
    yield from work(lambda: _write(pathlib.Path(path), data))


def _write(path: pathlib.Path, data: bytes) -> None:
    """Writes the whole file or nothing."""
    handle, aside = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(aside, 0o666 & ~_umask())
        os.replace(aside, path)
    except BaseException:
        pathlib.Path(aside).unlink(missing_ok=True)
        raise


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def png(job: str, exposure: float, denoised: bool, mix: Mix | None, view: str | None) -> Steps[bytes]:
    query = {
        **({"exposure": repr(float(exposure))} if exposure else {}),
        **({"layer": "denoised"} if denoised else {}),
        **({"view": view} if view else {}),
        **_query(mix),
    }
    return fetch(_path(job, "/image.png", query))


def report(job: str) -> Steps[models.Report]:
    return ask_json(Call("GET", job_path(job, "/report")))  # type: ignore[return-value]


def meters(job: str) -> Steps[list[models.Meter]]:
    return listed(job_path(job, "/meters"), "meters")


def tiles(job: str) -> Steps[list[models.Tile]]:
    return listed(job_path(job, "/tiles"), "tiles")


def log(job: str) -> Steps[str]:
    return text_at(job_path(job, "/log"))


def extend(job: str, spp: int | None, target_error: float | None) -> Steps[models.Job]:
    if (spp is None) == (target_error is None):
        raise RequestRejected(
            "extend() takes either spp, the new total of samples per pixel, or target_error"
        )
    return (
        yield from change_job(
            job, {"spp": int(spp)} if spp is not None else {"target_error": float(target_error or 0)}
        )
    )


def matching(filters: Mapping[str, Any]) -> Steps[list[models.Job]]:
    """Lists the jobs of a farm that match the filters of GET /jobs. Filters that are None are ignored."""
    given = {
        key: value if isinstance(value, (str, int, float)) else ",".join(value)
        for key, value in filters.items()
        if value is not None
    }
    return listed("/api/v1/jobs" + (f"?{urlencode(given)}" if given else ""), "jobs")


def remove(job: str) -> Steps[None]:
    """Cancels a job that has not ended, and removes it with its images."""
    view = yield from get_job(job)
    yield from succeed(Call("DELETE", job_path(job)))
    if view["state"] in ("done", "failed", "cancelled"):
        return
    try:
        yield from succeed(Call("DELETE", job_path(job)))
    except NotFound:  # it had ended in between, so that it is removed
        pass


def frame_ids(view: models.Job) -> list[str]:
    frames: Any = view.get("frames") or {}
    return [frame["id"] for frame in frames.get("list", [])]
