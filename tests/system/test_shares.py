"""No caller makes another one wait: one client takes all that it can get of a real coordinator, and others go on."""

import http.server
import json
import re
import socket
import sqlite3
import stat
import threading

import pytest
from local_farm import SCENE, HttpError, LocalFarm, wait_until


@pytest.fixture(scope="module")
def farm():
    with LocalFarm() as farm:
        yield farm


def connection(farm, text=b""):
    sock = socket.create_connection(("127.0.0.1", farm.http))
    sock.sendall(text)
    return sock


def head(token, line, more=""):
    return f"{line} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {token}\r\n{more}\r\n".encode()


def test_unfinished_bodies_of_one_user_keep_nobody_out(farm):
    mallory, bob = farm.token_of("mallory"), farm.token_of("bob")
    length = 32 << 20
    held = [connection(farm, head(mallory, "POST /api/v1/jobs", f"Content-Type: application/xml\r\nContent-Length: {length}\r\n")) for _ in range(8)]

    def fill(sock):
        try:
            sock.sendall(b" " * (length - 1))
        except OSError:
            pass  # beyond the share: refused

    senders = [threading.Thread(target=fill, args=(sock,)) for sock in held]
    for sender in senders:
        sender.start()
    for sender in senders:
        sender.join()
    seen = [-1]

    def all_is_read():
        text = farm.request("GET", "/metrics").decode()
        seen.append(int(float(re.search(r"^lightshaft_http_body_bytes_total (\S+)$", text, re.M).group(1))))
        return seen[-1] == seen[-2]

    wait_until(all_is_read, "no more bytes of the bodies come in")

    login = json.dumps({"token": farm.token}).encode()
    farm.request("POST", "/api/v1/session", login)
    job = json.loads(farm.request("POST", "/api/v1/jobs?spp=2", SCENE.encode() + b" " * 100_000, "application/xml", bob))["id"]
    farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "paused"}', token=bob)
    farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "cancelled"}', token=bob)
    for sock in held:
        sock.close()


def test_silent_sockets_hold_nothing(farm):
    held = []
    for _ in range(560):
        held.append(connection(farm, b"G"))
        if len(held) % 40 == 0:
            assert farm.request("GET", "/healthz") == b"ok\n"
    for _ in range(5):
        assert "jobs" in farm.get("/api/v1/jobs")
    for sock in held:
        sock.close()


def test_what_the_coordinator_makes_is_closed_to_other_users(farm):
    job = json.loads(farm.request("POST", "/api/v1/jobs?spp=2", SCENE.encode(), "application/xml"))["id"]
    farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "cancelled"}')

    for path in [farm.data, *farm.data.rglob("*")]:
        assert not stat.S_IMODE(path.lstat().st_mode) & 0o007, path


def test_a_job_is_refused_while_the_database_is_locked_and_readyz_says_why(tmp_path):
    with LocalFarm(tmp_path) as farm:
        other = sqlite3.connect(farm.data / "jobs.sqlite", isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(HttpError) as refused:
            farm.request("POST", "/api/v1/jobs?spp=2", SCENE.encode(), "application/xml")
        assert refused.value.status == 503 and "locked" in refused.value.body

        with pytest.raises(HttpError) as not_ready:
            farm.request("GET", "/readyz")
        assert not_ready.value.status == 503 and "locked" in not_ready.value.body
        other.execute("ROLLBACK")
        other.close()
        assert farm.request("GET", "/readyz")


def test_films_of_one_user_leave_room_for_others(tmp_path):
    with LocalFarm(tmp_path, flags=["--film-memory", "1G"]) as farm:
        mallory, bob = farm.token_of("mallory"), farm.token_of("bob")

        def submit(token):  # 402 MB of film each
            return farm.request("POST", "/api/v1/jobs?spp=1&size=4096x2048", SCENE.encode(), "application/xml", token)

        submit(mallory)
        with pytest.raises(HttpError) as refused:
            submit(mallory)
        assert refused.value.status == 507 and "--film-memory" in refused.value.body
        submit(bob)


def test_a_webhooks_address_is_not_in_the_log_and_its_answer_not_read(tmp_path):
    taken = []

    class Endless(http.server.BaseHTTPRequestHandler):
        def do_POST(self):
            self.rfile.read(int(self.headers["Content-Length"]))
            self.send_response(500 if not taken else 200)
            self.end_headers()
            taken.append(0)
            try:
                while True:
                    self.wfile.write(b"x" * 65536)
                    taken[-1] += 65536
            except OSError:
                pass  # the coordinator has read enough

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Endless)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with LocalFarm(tmp_path, flags=["--webhook", f"http://user:word@127.0.0.1:{server.server_port}/hooks/secret?key=secret"]) as farm:
        farm.request("POST", "/api/v1/jobs?spp=2", SCENE.encode(), "application/xml")
        wait_until(lambda: 'lightshaft_webhook_sendings_total{result="taken"} 1' in farm.request("GET", "/metrics").decode(), "it is sent again and taken")

        log = farm.coordinator.output()
        assert f"http://127.0.0.1:{server.server_port} does not take a delivery" in log
        assert "secret" not in log and "word" not in log
    server.shutdown()
