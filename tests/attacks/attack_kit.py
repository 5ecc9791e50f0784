"""Shared by the attacks: a record of tries and their expected answers, raw connections, and a bystander, a user who must be served during an attack."""

import contextlib
import dataclasses
import json
import os
import pathlib
import re
import socket
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
for folder in ("support", "system", "chaos", "web"):
    sys.path.insert(0, str(ROOT / "tests" / folder))

from local_farm import SCENE, HttpError, LocalFarm  # noqa: E402

# Seconds after which an answer counts as one that never came. The longest limit of the coordinator for a stranger is the grace of a
# body, 15 s (SECURITY.md, "How much at once"); the rest is for a busy machine.
NO_ANSWER = 60
# Seconds that a bystander may wait: one second on a quiet machine. If other programs keep the processors busy before the first attack, the
# limit grows with the load average.
BYSTANDER = 1.0 * max(1, os.getloadavg()[0] / os.cpu_count())
# The limit of the system test. It follows from a limit of the coordinator, not from the speed of this machine: if an attack holds something
# that a bystander needs, the bystander waits until the coordinator ends the attack, which is 15 s after its beginning or later.
UNHELD = 14.0
UNLIMITED = ("--http-requests-per-second", "0", "--http-wrong-tokens-per-minute", "0")
TINY = SCENE.replace('"96"', '"16"').replace('"64"', '"16"')


@dataclasses.dataclass(frozen=True)
class Try:
    row: str  # what was tried, as the page names it
    label: str  # which one of them
    held: bool
    detail: str  # what happened instead


class Record:
    """All tries of a run, and today's figures of the faults."""

    def __init__(self, quick=False):
        self.quick = quick  # the selection that is a system test
        self.tries, self.faults, self.left_out = [], [], []
        self.row = ""

    def attempt(self, label, held, detail=""):
        held = bool(held)
        self.tries.append(Try(self.row, str(label), held, "" if held else str(detail)[:300]))
        return held

    def fault(self, name, what, before, today, held):
        self.faults.append((name, what, before, today, bool(held)))
        return held

    @contextlib.contextmanager
    def expecting(self, label):
        """Counts an exception as a try that did not hold, and goes on with the group."""
        try:
            yield
        except Exception as error:
            self.attempt(label, False, f"{type(error).__name__}: {error}")

    def failures(self):
        return [t for t in self.tries if not t.held] + [f for f in self.faults if not f[4]]

    def rows(self):
        """(what was tried, how many, how many held), in the order of the first of each."""
        out = {}
        for t in self.tries:
            out.setdefault(t.row, []).append(t.held)
        return [(row, len(held), sum(held)) for row, held in out.items()]


# ---- HTTP ----

@dataclasses.dataclass(frozen=True)
class Answer:
    status: int  # 0: none came
    headers: dict
    body: bytes
    seconds: float = 0

    def text(self):
        return self.body.decode(errors="replace")


NONE = Answer(0, {}, b"")


def read_answers(data):
    """The HTTP answers in these bytes, and what is left of them."""
    answers = []
    while match := re.match(rb"HTTP/1\.[01] (\d{3}) [^\r\n]*\r\n((?:[^\r\n]+\r\n)*)\r\n", data):
        headers = {name.strip().lower(): value.strip() for name, _, value in
                   (line.partition(":") for line in match[2].decode("latin-1").split("\r\n") if line)}
        data = data[match.end():]
        length = int(headers.get("content-length", 0))
        if match[1].startswith(b"1"):
            length = 0
        answers.append(Answer(int(match[1]), headers, data[:length]))
        data = data[length:]
    return answers, data


def exchange(port, data, half_close=True, patience=NO_ANSWER, tls=None):
    """(all answers to these bytes on one connection until it closes, bytes that are no answer, whether it closed)"""
    with socket.create_connection(("127.0.0.1", port), timeout=patience) as sock:
        if tls:
            sock = tls.wrap_socket(sock, server_hostname="127.0.0.1")
        got, closed = bytearray(), True
        try:
            sock.sendall(data)
            if half_close:
                sock.shutdown(socket.SHUT_WR)
        except OSError:
            pass  # it has refused by now
        try:
            while part := sock.recv(1 << 16):
                got += part
        except ConnectionError:
            pass
        except TimeoutError:
            closed = False
        return *read_answers(bytes(got)), closed


def ask(farm, method, path, token=None, body=None, kind="application/json", headers=(), patience=NO_ANSWER):
    """One request on a connection of its own; the target is sent as it is given. Of a stream only the head is read."""
    lines = [f"{method} {path} HTTP/1.1", "Host: farm", "Connection: close"]
    if token is not None:
        lines.append(f"Authorization: Bearer {token}")
    if body is not None:
        body = body if isinstance(body, bytes) else body.encode()
        lines += [f"Content-Type: {kind}", f"Content-Length: {len(body)}"]
    lines += list(headers)
    head = "\r\n".join(lines).encode("utf-8", "surrogateescape") + b"\r\n\r\n"
    began = time.monotonic()
    with socket.create_connection(("127.0.0.1", farm.http), timeout=patience) as sock:
        with contextlib.suppress(ConnectionError):
            sock.sendall(head + (body or b""))
        data = bytearray()
        try:
            while part := sock.recv(1 << 16):
                data += part
                if b"text/event-stream" in data[:2000] and b"\r\n\r\n" in data:
                    break
        except (ConnectionError, TimeoutError):
            pass
    seconds = time.monotonic() - began
    head, _, rest = bytes(data).partition(b"\r\n\r\n")
    if not re.match(rb"HTTP/1\.1 \d{3}", head):
        return dataclasses.replace(NONE, seconds=seconds)
    headers = {name.strip().lower(): value.strip() for name, _, value in (line.partition(":") for line in head.decode("latin-1").split("\r\n")[1:])}
    return Answer(int(head[9:12]), headers, rest, seconds)


def sane(answer, allowed=(501,)):
    """Returns whether an answer came that is no server error. 501 is right for parts of HTTP that the coordinator does not have."""
    return 200 <= answer.status < 500 or answer.status in allowed


def shown(answer):
    return f"{answer.status or 'no answer'} after {answer.seconds:.1f} s: {answer.text()[:160]}"


def submit(farm, token, scene=TINY, **query):
    """The job's id."""
    path = "/api/v1/jobs?" + "&".join(f"{k}={v}" for k, v in query.items())
    answer = ask(farm, "POST", path, token, scene, "application/xml")
    assert answer.status == 201, shown(answer)
    return json.loads(answer.body)["id"]


def still_serves(record, farm, token, label="others are served afterwards"):
    """The service answers a bystander, and its process is the one that was there before."""
    with record.expecting(label):
        answer = ask(farm, "GET", "/api/v1/jobs?limit=1", token)
        record.attempt(label, answer.status == 200 and farm.coordinator.alive(), shown(answer))


class Bystander:
    """Another user, whose longest wait for an answer is measured."""

    limit = BYSTANDER

    def __init__(self, farm, user="bob"):
        self.farm, self.token = farm, farm.token_of(user)
        self.waits, self.refused = [], []

    def asks(self, method="GET", path="/api/v1/jobs?limit=10", body=None, kind="application/json"):
        answer = ask(self.farm, method, path, self.token, body, kind)
        self.waits.append(answer.seconds)
        if not 200 <= answer.status < 300:
            self.refused.append(shown(answer))
        return answer

    def submits(self):
        answer = self.asks("POST", "/api/v1/jobs?spp=2", TINY, "application/xml")
        return json.loads(answer.body)["id"] if answer.status == 201 else None

    @contextlib.contextmanager
    def watching(self):
        """Sends requests from another thread for as long as the context is open, as an open dashboard does."""
        over = threading.Event()

        def look():
            while not over.wait(0.05):
                with contextlib.suppress(OSError):
                    self.asks()

        self.asks()
        thread = threading.Thread(target=look, daemon=True)
        thread.start()
        try:
            yield self
        finally:
            over.set()
            thread.join()
            self.asks()

    def told(self):
        return f"{max(self.waits):.2f} s at most in {len(self.waits)} requests" + (f", {len(self.refused)} refused" if self.refused else "")

    def served(self):
        return not self.refused and max(self.waits) < self.limit


# ---- groups ----

GROUPS = {}


def group(name, quick=False, whole=True):
    """A function of (record, folder). `quick`: part of the system test; `whole`: of a run of all."""
    def remember(function):
        GROUPS[name] = function, quick, whole
        return function
    return remember


def resident_bytes(process):
    """(now, highest ever) of a process."""
    status = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{process}/status").read_text().splitlines() if line.startswith("Vm"))
    return tuple(int(status[key].split()[0]) << 10 for key in ("VmRSS", "VmHWM"))


def cpu_seconds(process):
    fields = pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / 100


__all__ = ["Answer", "BYSTANDER", "Bystander", "GROUPS", "HttpError", "LocalFarm", "NO_ANSWER", "ROOT", "Record", "SCENE", "TINY", "UNHELD", "UNLIMITED", "ask",
           "cpu_seconds", "exchange", "group", "resident_bytes", "sane", "shown", "still_serves", "submit"]
