"""Sends the requests of steps. There are two transports: one that blocks, and one for event loops."""

from __future__ import annotations

import asyncio
import os
import ssl
import time
from collections.abc import Iterator
from typing import Any, TypeVar

import httpx

from .errors import BadAnswer, FarmUnreachable, RequestRejected
from .steps import Call, Pause, Reply, Step, Steps, Work

T = TypeVar("T")
CONNECT_SECONDS, STALL_SECONDS = 15.0, 60.0


class Address:
    """The addresses and the credentials of a farm. The coordinator that responded last is tried first."""

    def __init__(self, url: str | None, token: str | None, ca: str | os.PathLike[str] | None) -> None:
        given = url or os.environ.get("LIGHTSHAFT_URL", "")
        if not given:
            raise RequestRejected(
                "the farm's address is missing: use Farm(url) or set LIGHTSHAFT_URL, for example http://localhost:8080"
            )
        self._ca = ca or os.environ.get("LIGHTSHAFT_CA") or None
        self.urls = [_checked_url(part, self._ca is not None) for part in given.split(",")]
        self.token = os.environ.get("LIGHTSHAFT_TOKEN", "") if token is None else token.strip()
        if any(not "!" <= character <= "~" for character in self.token):
            raise RequestRejected("the token has characters that a token cannot have")

    @property
    def url(self) -> str:
        return self.urls[0]

    def options(self) -> dict[str, Any]:
        """Returns the options of both kinds of httpx client."""
        verify: Any = True
        if self._ca is not None:
            try:
                verify = ssl.create_default_context(cafile=os.fspath(self._ca))
            except OSError as error:
                raise RequestRejected(
                    f"the certificates in {os.fspath(self._ca)} cannot be used: {error}"
                ) from None
        return {
            "verify": verify,
            "timeout": httpx.Timeout(STALL_SECONDS, connect=CONNECT_SECONDS),
            "follow_redirects": False,
        }

    def request(self, call: Call) -> dict[str, Any]:
        """Returns the arguments for httpx."""
        # Answers come as they are: a small one cannot grow when it is unpacked.
        headers = {"User-Agent": "lightshaft-python", "Accept-Encoding": "identity", **call.headers}
        if self.token:
            headers["Authorization"] = f"Bearer {self.token}"
        if call.body is not None:
            headers["Content-Type"] = call.content_type
        url = call.target if "://" in call.target else self.url + call.target
        return {"method": call.method, "url": url, "content": call.body, "headers": headers}

    def tries(self, call: Call) -> Iterator[dict[str, Any]]:
        """Sends the request to each coordinator in turn. The next one is tried only if nothing was sent to the one
        before."""
        for tried in range(len(self.urls)):
            if tried:
                self.urls.append(self.urls.pop(0))
            yield self.request(call)


def _checked_url(text: str, has_ca: bool) -> str:
    """Completes and checks the address. The scheme may be missing; http:// is then assumed for this machine only,
    so that the token is never sent unencrypted over a network."""
    url = text.strip().rstrip("/")
    if url and "://" not in url:
        local = url.startswith(("localhost", "127.", "[::1]"))
        url = f"http://{url}" if local and not has_ca else f"https://{url}"
    if not url.startswith(("http://", "https://")):
        raise RequestRejected(f"the farm's address {url!r} must begin with http:// or https://")
    if any(character <= " " or character == "\x7f" for character in url):
        raise RequestRejected(f"the farm's address {url!r} has spaces or control characters")
    return url


class _Body:
    """Collects a response within its limits."""

    def __init__(self, call: Call, response: httpx.Response) -> None:
        self._call, self._response = call, response
        self._deadline = time.monotonic() + call.seconds
        self._data = bytearray()

    def add(self, part: bytes) -> None:
        self._data += part
        if len(self._data) > self._call.max_bytes:
            raise BadAnswer(
                f"the answer of {self._response.url} is larger than {self._call.max_bytes} bytes"
            )
        if time.monotonic() > self._deadline:
            raise FarmUnreachable(
                f"{self._response.url} has not sent all of its answer within {self._call.seconds:.0f} s"
            )

    def reply(self) -> Reply:
        response = self._response
        return Reply(
            response.status_code,
            {k.lower(): v for k, v in response.headers.items()},
            bytes(self._data),
            str(response.url),
        )


def _unreachable(url: Any, error: Exception) -> FarmUnreachable:
    why = str(error) or type(error).__name__
    return FarmUnreachable(
        f"{url} cannot be reached: {why}. Is a coordinator running there, and is the address right? "
        "(`lightshaft jobs --to URL` tries the same; if it uses its own TLS certificate, give ca=FILE)"
    )


class SyncTransport:
    def __init__(self, address: Address) -> None:
        self._address = address
        self._client = httpx.Client(**address.options())

    def close(self) -> None:
        self._client.close()

    def run(self, steps: Steps[T]) -> T:
        try:
            step = next(steps)
            while True:
                try:
                    outcome = self._take(step)
                except Exception as error:
                    step = steps.throw(error)
                else:
                    step = steps.send(outcome)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]

    def _take(self, step: Step) -> Any:
        if isinstance(step, Pause):
            return time.sleep(step.seconds)
        return step.run() if isinstance(step, Work) else self._send(step)

    def _send(self, call: Call) -> Reply:
        for request in self._address.tries(call):
            try:
                with self._client.stream(**request) as response:
                    body = _Body(call, response)
                    for part in response.iter_raw():
                        body.add(part)
                return body.reply()
            except (httpx.ConnectError, httpx.ConnectTimeout) as error:
                last = _unreachable(request["url"], error)
            except (httpx.HTTPError, httpx.InvalidURL) as error:
                raise _unreachable(request["url"], error) from error
        raise last


class AsyncTransport:
    def __init__(self, address: Address) -> None:
        self._address = address
        self._client = httpx.AsyncClient(**address.options())

    async def close(self) -> None:
        await self._client.aclose()

    async def run(self, steps: Steps[T]) -> T:
        try:
            step = next(steps)
            while True:
                try:
                    outcome = await self._take(step)
                except Exception as error:
                    step = steps.throw(error)
                else:
                    step = steps.send(outcome)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]

    async def _take(self, step: Step) -> Any:
        if isinstance(step, Pause):
            return await asyncio.sleep(step.seconds)
        return await asyncio.to_thread(step.run) if isinstance(step, Work) else await self._send(step)

    async def _send(self, call: Call) -> Reply:
        for request in self._address.tries(call):
            try:
                async with self._client.stream(**request) as response:
                    body = _Body(call, response)
                    async for part in response.aiter_raw():
                        body.add(part)
                return body.reply()
            except (httpx.ConnectError, httpx.ConnectTimeout) as error:
                last = _unreachable(request["url"], error)
            except (httpx.HTTPError, httpx.InvalidURL) as error:
                raise _unreachable(request["url"], error) from error
        raise last
