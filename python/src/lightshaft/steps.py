"""What a client does, without doing it: generators that yield requests and receive answers.

Farm and AsyncFarm run the same generators; only how a request is sent, and how a pause passes, differs
(transport.py). A step is a Call (answered by a Reply), a Pause, or Work: a function that reads files or
decodes images, which an event loop runs on a thread. An error of a step is thrown into its generator.
"""

from __future__ import annotations

import dataclasses
import json
import re
import time
from collections.abc import Callable, Generator, Mapping
from typing import Any, TypeAlias, TypeVar
from urllib.parse import quote, urljoin, urlsplit

from . import models
from .errors import BadAnswer, FarmBusy, FarmUnreachable, LightshaftError, RequestRejected, error_of

T = TypeVar("T")

MAX_JSON_BYTES = 256 << 20
MAX_IMAGE_BYTES = 8 << 30
CALL_SECONDS, DOWNLOAD_SECONDS = 120.0, 3600.0
MAX_REDIRECTS = 3
PATIENCE_SECONDS = 120.0  # that a farm may be out of reach before its job, or an upload, is given up
FIRST_PAUSE, LONGEST_PAUSE = 0.25, 4.0
UPLOAD_PART_BYTES = 16 << 20
DIGESTS_PER_QUESTION = 10_000


@dataclasses.dataclass(frozen=True)
class Call:
    method: str
    target: str
    """Path and query; after a redirect, the whole address."""
    body: bytes | None = None
    content_type: str = "application/json"
    headers: Mapping[str, str] = dataclasses.field(default_factory=dict)
    max_bytes: int = MAX_JSON_BYTES
    seconds: float = CALL_SECONDS
    """Time by which the whole response must have arrived."""


@dataclasses.dataclass(frozen=True)
class Reply:
    status: int
    headers: Mapping[str, str]
    """Header names in lower case."""
    body: bytes
    url: str
    """That was asked."""


@dataclasses.dataclass(frozen=True)
class Pause:
    seconds: float


@dataclasses.dataclass(frozen=True)
class Work:
    run: Callable[[], Any]


Step: TypeAlias = Call | Pause | Work
Steps: TypeAlias = Generator[Step, Any, T]


def ask(call: Call) -> Steps[Reply]:
    """Returns the response, whatever its status, and follows redirects.

    A coordinator redirects requests for a job to the coordinator that owns it. Both belong to the same farm and
    accept the same token. A request over TLS is never redirected to a connection without TLS.
    """
    for _ in range(MAX_REDIRECTS + 1):
        reply: Reply = yield call
        place = reply.headers.get("location")
        if reply.status not in (301, 302, 307, 308) or not place:
            return reply
        target = urljoin(reply.url, place)
        if urlsplit(target).scheme != "https" and not (
            reply.url.startswith("http://") and target.startswith("http://")
        ):
            raise BadAnswer(
                f"{reply.url} redirects this request to an address without https, which must not get the token; "
                "give the coordinators https addresses with --public-http"
            )
        call = dataclasses.replace(call, target=target)
    raise BadAnswer(f"{reply.url} redirects this request more than {MAX_REDIRECTS} times")


def succeed(call: Call) -> Steps[Reply]:
    reply = yield from ask(call)
    if reply.status // 100 != 2:
        raise problem_of(reply)
    return reply


def problem_of(reply: Reply) -> LightshaftError:
    return error_of(reply.status, _json(reply.body), reply.body, reply.url)


def _json(body: bytes) -> Any:
    try:
        return json.loads(body)
    except (ValueError, RecursionError):
        return None


def ask_json(call: Call) -> Steps[dict[str, Any]]:
    reply = yield from succeed(call)
    answer = _json(reply.body)
    if not isinstance(answer, dict):
        raise BadAnswer(
            f"{reply.url} did not answer with a JSON object: is this the address of a Lightshaft coordinator?"
        )
    return answer


def post_json(path: str, body: Mapping[str, Any], method: str = "POST") -> Steps[dict[str, Any]]:
    return ask_json(Call(method, path, json.dumps(body).encode()))


def fetch(path: str) -> Steps[bytes]:
    """Fetches a file, such as an image."""
    reply = yield from succeed(Call("GET", path, max_bytes=MAX_IMAGE_BYTES, seconds=DOWNLOAD_SECONDS))
    return reply.body


def work(run: Callable[[], T]) -> Steps[T]:
    done: T = yield Work(run)
    return done


class Retry:
    """Decides whether to repeat a request that failed because the farm could not be reached, or was too
    busy."""

    def __init__(self) -> None:
        self._last_answer = time.monotonic()
        self._pause = 0.0

    def answered(self) -> None:
        self._last_answer, self._pause = time.monotonic(), 0.0

    def pause(self, error: LightshaftError) -> Pause:
        """Returns the pause before the next attempt. Raises the error if there should be no further attempt."""
        lasting = isinstance(error, FarmBusy) and error.status == 507
        if (
            lasting
            or not isinstance(error, (FarmBusy, FarmUnreachable))
            or time.monotonic() - self._last_answer > PATIENCE_SECONDS
        ):
            raise error
        self._pause = min(max(2 * self._pause, FIRST_PAUSE), LONGEST_PAUSE)
        return Pause(self._pause)


def with_retries(steps: Callable[[], Steps[T]]) -> Steps[T]:
    retry = Retry()
    while True:
        try:
            return (yield from steps())
        except LightshaftError as error:
            pause = retry.pause(error)
        yield pause


def job_path(job: str, rest: str = "") -> str:
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,64}", job):
        raise RequestRejected(f"{job!r} cannot be the id of a job")
    return f"/api/v1/jobs/{job}{rest}"


def listed(path: str, key: str, kind: type = dict) -> Steps[list[Any]]:
    answer = yield from ask_json(Call("GET", path))
    found = answer.get(key)
    if not isinstance(found, list) or not all(isinstance(item, kind) for item in found):
        raise BadAnswer(f"the farm's answer to {path} has no list of {key}")
    return found


def text_at(path: str) -> Steps[str]:
    reply = yield from succeed(Call("GET", path))
    return reply.body.decode("utf-8", "replace")


def worker_path(worker: str) -> str:
    return f"/api/v1/workers/{quote(worker, safe='')}"


def change_worker(worker: str, state: str) -> Steps[None]:
    yield from succeed(Call("PATCH", worker_path(worker), json.dumps({"state": state}).encode()))


def get_job(job: str) -> Steps[models.Job]:
    return _checked(ask_json(Call("GET", job_path(job))))


def change_job(job: str, change: Mapping[str, Any]) -> Steps[models.Job]:
    return _checked(post_json(job_path(job), change, "PATCH"))


def _checked(steps: Steps[dict[str, Any]]) -> Steps[models.Job]:
    view = yield from steps
    if not _describes_a_job(view):
        raise BadAnswer("the farm's answer describes no job")
    return view  # type: ignore[return-value]


def _describes_a_job(view: dict[str, Any]) -> bool:
    """Returns True if the members that this package reads have the types of the OpenAPI document."""

    def number(value: object) -> bool:
        return value is None or isinstance(value, (int, float))

    interval, verdict, frames = view.get("relmse_ci95"), view.get("verdict"), view.get("frames")
    return (
        isinstance(view.get("id"), str)
        and isinstance(view.get("state"), str)
        and view["state"].isalpha()  # it is printed in terminals
        and all(number(view.get(key)) for key in ("progress", "spp_done", "relmse", "eta_seconds"))
        and (interval is None or (isinstance(interval, list) and all(map(number, interval))))
        and (verdict is None or isinstance(verdict, dict))
        and (frames is None or (isinstance(frames, dict) and _lists_frames(frames.get("list", []))))
    )


def _lists_frames(frames: object) -> bool:
    return isinstance(frames, list) and all(
        isinstance(frame, dict) and isinstance(frame.get("id"), str) for frame in frames
    )
