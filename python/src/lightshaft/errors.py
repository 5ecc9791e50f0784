"""The exceptions of this package, one class for each kind of problem. All of them derive from LightshaftError."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

MAX_SHOWN = 300  # characters that a message shows of an answer that is no problem document


@dataclasses.dataclass(frozen=True)
class Diagnostic:
    """One error or warning of a scene, with its place."""

    text: str
    severity: str = "error"
    file: str = ""
    line: int = 0
    column: int = 0
    source_line: str = ""
    length: int = 1
    path: str = ""
    """Of a scene that was submitted as a dictionary: the keys that lead to the place, as in
    'ball.bsdf.alpha'. Of a stage of USD: the path of a prim."""

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}:{self.column}" if self.line else self.file
        if self.path:
            return f"{self.path}: {self.severity}: {self.text}"
        shown = f"{place}: {self.severity}: {self.text}" if place else f"{self.severity}: {self.text}"
        if not self.source_line or not self.line:
            return shown
        number = str(self.line)
        mark = (
            " " * max(self.column - 1, 0)
            + "^"
            + "~" * max(min(self.length, len(self.source_line)) - 1, 0)
        )
        return f"{shown}\n  {number} | {self.source_line}\n  {' ' * len(number)} | {mark}"


class LightshaftError(Exception):
    """Any error of this package. `file`, `line` and `column` are those of the first diagnostic."""

    def __init__(
        self, message: str, *, diagnostics: Sequence[Diagnostic] = (), status: int | None = None
    ) -> None:
        super().__init__(message)
        self.message = message
        self.diagnostics = tuple(diagnostics)
        self.status = status
        """The HTTP status, if the farm responded."""

    def _first(self) -> Diagnostic | None:
        errors = [d for d in self.diagnostics if d.severity == "error"]
        return next(iter(errors or self.diagnostics), None)

    @property
    def file(self) -> str | None:
        first = self._first()
        return first.file or None if first else None

    @property
    def line(self) -> int | None:
        first = self._first()
        return first.line or None if first else None

    @property
    def column(self) -> int | None:
        first = self._first()
        return first.column or None if first else None

    @property
    def path(self) -> str | None:
        """For a scene that was submitted as a dictionary: the keys that lead to the first error. For a USD stage:
        the path of the prim."""
        first = self._first()
        return first.path or None if first else None

    def __str__(self) -> str:
        return "\n".join(map(str, self.diagnostics)) or self.message


class SceneWarning(UserWarning):
    """A warning about an accepted scene, such as a parameter that has no effect."""


class SceneRejected(LightshaftError):
    """The scene has errors. `diagnostics` has all of them with their places."""


class SceneDictError(SceneRejected):
    """A dictionary cannot be converted to a scene. `path` is the place of the error."""


class StageRejected(SceneRejected):
    """A USD stage cannot be converted to a scene. `path` is the first prim with an error."""


class RequestRejected(LightshaftError):
    """The farm rejected the request: an unknown option, or a value out of range."""


class FileRefused(LightshaftError):
    """A file of the scene cannot be sent: it is unreadable, or outside of the allowed folders."""


class Unauthorised(LightshaftError):
    """The request has no token, or one that the farm does not accept."""


class Forbidden(LightshaftError):
    """The token's role does not allow this."""


class NotFound(LightshaftError):
    """The job, frame or image does not exist."""


class Conflict(LightshaftError):
    """The request is not possible in the present state of the job or the farm."""


class FarmBusy(LightshaftError):
    """The farm responds but cannot serve this request now, or is full. Trying again later may help."""


class FarmUnreachable(LightshaftError):
    """The farm does not respond: the address is wrong, the farm is down, or the network is broken."""


class BadAnswer(LightshaftError):
    """The response does not come from a Lightshaft coordinator, or is too large."""


class JobFailed(LightshaftError):
    """The job ended without its image."""


class JobCancelled(JobFailed):
    """Somebody cancelled the job."""


class WaitTimeout(LightshaftError, TimeoutError):
    """The job did not end within the time limit of wait(). It continues to render."""


class MissingPackage(LightshaftError):
    """An optional package is not installed."""


BY_STATUS: Mapping[int, type[LightshaftError]] = {
    400: RequestRejected,
    413: RequestRejected,
    415: RequestRejected,
    401: Unauthorised,
    403: Forbidden,
    404: NotFound,
    409: Conflict,
    408: FarmBusy,
    429: FarmBusy,
    502: FarmBusy,
    503: FarmBusy,
    504: FarmBusy,
    507: FarmBusy,
}
TOKEN_HINT = (
    " (give the token with Farm(url, token=...) or in LIGHTSHAFT_TOKEN; a coordinator keeps it in the file "
    "`token` of its data folder)"
)


def error_of(status: int, problem: Any, body: bytes, url: str) -> LightshaftError:
    """Returns the exception for a response that is an error. `problem` is its JSON, or None."""
    kind = BY_STATUS.get(status, BadAnswer)
    if not isinstance(problem, dict):
        shown = body[:MAX_SHOWN].decode("utf-8", "replace")
        return kind(f"{url} answered with status {status}: {shown}", status=status)
    listed = problem.get("diagnostics")
    diagnostics = (
        [_diagnostic_of(d) for d in listed if isinstance(d, dict)] if isinstance(listed, list) else []
    )
    message = _text(problem, "detail") or _text(problem, "title") or f"status {status}"
    if status == 401:
        message += TOKEN_HINT
    if status == 400 and diagnostics:
        kind = SceneRejected
    return kind(message, diagnostics=diagnostics, status=status)


def _text(fields: Mapping[str, Any], name: str) -> str:
    value = fields.get(name)
    return value if isinstance(value, str) else ""


def _number(fields: Mapping[str, Any], name: str, fallback: int) -> int:
    value = fields.get(name)
    return value if isinstance(value, int) and not isinstance(value, bool) else fallback


def _diagnostic_of(fields: Mapping[str, Any]) -> Diagnostic:
    return Diagnostic(
        text=_text(fields, "text"),
        severity=_text(fields, "severity") or "error",
        file=_text(fields, "file"),
        line=_number(fields, "line", 0),
        column=_number(fields, "column", 0),
        source_line=_text(fields, "source_line"),
        length=_number(fields, "length", 1),
    )
