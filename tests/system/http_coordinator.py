"""A coordinator process with short HTTP deadlines, and the few ways test_http.py talks to it."""

import http.client
import json
import os
import select
import socket
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TIMEOUT = 20  # seconds: how long a test waits for what must come; never how long it waits in vain

CONFIG = """
http-header-seconds = 1
http-body-grace-seconds = 1
http-min-rate = 1000000
http-heartbeat-seconds = 0.2
http-linger-seconds = 0.3
http-stop-seconds = 2
"""


def find_coordinator():
    """In the folder that LIGHTSHAFT_BIN names, else in the first build that has it."""
    folders = [Path(os.environ["LIGHTSHAFT_BIN"])] if "LIGHTSHAFT_BIN" in os.environ else [
        ROOT / "build" / preset / "bin" for preset in ("release", "dev")]
    found = [folder / "lightshaft-coordinator" for folder in folders if (folder / "lightshaft-coordinator").exists()]
    return str(found[0]) if found else None


class Answer:
    def __init__(self, response):
        self.status = response.status
        self.headers = response.headers
        self.body = response.read()

    def json(self):
        return json.loads(self.body)


class EventReader:
    def __init__(self, sock, head):
        self.sock = sock
        self.sock.sendall(head)
        self.file = sock.makefile("rb")
        assert b" 200 " in self.file.readline()
        while self.file.readline() != b"\r\n":
            pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()
        self.sock.close()

    def read_line_starting(self, start):
        for line in self.file:
            if line.startswith(start):
                return line
        return None

    def read_id(self):
        return int(self.read_line_starting(b"id: ")[4:])

    def read_event(self, kind):
        """The next event of this kind: {id, event, data}."""
        event = {}
        for line in self.file:
            key, _, value = line.decode().rstrip("\n").partition(": ")
            if key == "" and event.get("event") == kind:
                event["data"] = json.loads(event["data"])
                event["id"] = int(event["id"])
                return event
            if key == "":
                event = {}
            else:
                event[key] = value
        raise AssertionError("the event stream ended")


class Coordinator:
    def __init__(self, data: Path):
        self.data = Path(data)
        self.data.mkdir(parents=True, exist_ok=True)
        config = self.data.parent / "coordinator.toml"
        config.write_text(CONFIG)
        read_end, write_end = os.pipe()
        self.process = subprocess.Popen(
            [find_coordinator(), "--http", "127.0.0.1:0", "--grpc", "127.0.0.1:0", "--data", str(self.data),
             "--config", str(config)], stderr=write_end)
        os.close(write_end)
        self._wait_for(read_end, b"dashboard: ")
        self.pipe = read_end
        self.port = json.loads((self.data / "ports.json").read_text())["http"]
        self.token = (self.data / "token").read_text().strip()

    def _wait_for(self, fd, mark):
        """Reads the log until the line that is printed when all listens."""
        text = b""
        while mark not in text:
            ready, _, _ = select.select([fd], [], [], TIMEOUT)
            part = os.read(fd, 65536) if ready else b""
            assert part, f"the coordinator did not start: {text.decode(errors='replace')}"
            text += part
        return text

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.terminate()
        try:
            self.process.wait(timeout=TIMEOUT)
        finally:
            self.process.kill()
            os.close(self.pipe)

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=TIMEOUT)

    def ask(self, method, path, body=None, headers=None, token=True):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=TIMEOUT)
        headers = dict(headers or {})
        if token is not None:
            headers["Authorization"] = "Bearer " + (self.token if token is True else token)
        try:
            connection.request(method, path, body.encode() if isinstance(body, str) else body, headers)
            return Answer(connection.getresponse())
        finally:
            connection.close()

    def get(self, path, headers=None, token=True):
        return self.ask("GET", path, None, headers, token)

    def head(self, method, path, length=0, kind="application/octet-stream"):
        """The header of a request whose body the test sends as it likes."""
        return (f"{method} {path} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {self.token}\r\n"
                f"Content-Type: {kind}\r\nContent-Length: {length}\r\n\r\n").encode()

    def events(self, path):
        head = f"GET {path} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {self.token}\r\n\r\n"
        return EventReader(self.connect(), head.encode())
