"""The coordinator's HTTP interface, as clients meet it: real process, real sockets, bad manners.

Only Python's standard library. The deadlines under test are shortened with the coordinator's config file, so nothing
here waits for more than a second or two, and nothing sleeps.
"""

import hashlib
import json
import os
import re
import signal
import socket
import stat
import subprocess
from pathlib import Path

import pytest
from http_coordinator import Coordinator, find_coordinator

pytestmark = pytest.mark.skipif(find_coordinator() is None, reason="lightshaft-coordinator is not built")

SCENE = """<scene version="3.0.0">
  <integrator type="volpath"/>
  <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/>
  </film></sensor>
  <emitter type="constant"/>
  <shape type="sphere"/>
</scene>"""


@pytest.fixture(scope="module")
def farm(tmp_path_factory):
    with Coordinator(tmp_path_factory.mktemp("http") / "data") as coordinator:
        yield coordinator


def sha(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def status_of(answer: bytes) -> int:
    assert answer.startswith(b"HTTP/1.1 "), answer[:100]
    return int(answer[9:12])


def read_all(sock: socket.socket) -> bytes:
    parts = []
    while True:
        part = sock.recv(65536)
        if not part:
            return b"".join(parts)
        parts.append(part)


def files_under(folder: Path) -> list:
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file() and "blobs" in p.parts)


def test_open_addresses_answer_without_a_token(farm):
    assert farm.get("/healthz", token=None).status == 200
    assert farm.get("/readyz", token=None).status == 200
    page = farm.get("/", token=None)
    assert page.status == 200
    assert "script-src 'self'" in page.headers["Content-Security-Policy"]
    assert page.headers["X-Content-Type-Options"] == "nosniff"


def test_the_pages_are_those_of_this_checkout(farm):
    """They are built into the program: one that is built again after a page has changed has the new one."""
    pages = Path(__file__).resolve().parents[2] / "web" / "static"
    names = [str(file.relative_to(pages)) for file in pages.rglob("*") if file.is_file()]
    assert "index.html" in names and "js/main.js" in names
    served = {name: farm.get(f"/{name}", token=None).body for name in names}
    assert [name for name in names if served[name] != (pages / name).read_bytes()] == ["index.html"]
    # The page names a script that asks for the session and the jobs, one that has all other modules, and one style.
    page = served["index.html"].decode()
    scripts, styles = (re.findall(rf'"([^"]+\.{kind})"', page) for kind in ("js", "css"))
    assert len(scripts) == page.count(".js") == 2 and len(styles) == page.count(".css") == 1
    script, style = (farm.get(f"/{name}", token=None).body.decode() for name in (scripts[-1], styles[0]))
    assert len(script) > (pages / "js" / "main.js").stat().st_size and script != served["js/main.js"].decode()
    assert all(served[name].decode().strip() in style for name in re.findall(r'css/\w+\.css', (pages / "index.html").read_text()))


@pytest.mark.parametrize("path", ["/api/v1/jobs", "/api/v1/workers", "/api/v1/events", "/metrics", "/api/v1/nothing"])
@pytest.mark.parametrize("token", [None, "", "wrong"])
def test_everything_else_asks_for_the_token(farm, path, token):
    answer = farm.get(path, token=token)
    assert answer.status == 401
    assert answer.headers["WWW-Authenticate"].startswith("Bearer")
    assert answer.json()["status"] == 401


def test_the_tokens_are_secret_files(farm):
    for name in ("token", "join-token"):
        path = farm.data / name
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        assert len(path.read_text().strip()) == 64
    assert (farm.data / "token").read_text() != (farm.data / "join-token").read_text()


def test_a_session_cookie_serves_a_browser_but_no_other_site(farm):
    opened = farm.ask("POST", "/api/v1/session", json.dumps({"token": farm.token}), {"Content-Type": "application/json"},
                      token=None)
    assert opened.status == 204
    cookie = opened.headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    pair = {"Cookie": cookie.split(";")[0]}
    own = f"http://127.0.0.1:{farm.port}"
    assert farm.get("/api/v1/jobs", pair, token=None).status == 200
    missing = ("POST", "/api/v1/blobs/missing", '{"digests":[]}')
    json_type = {"Content-Type": "application/json"}
    assert farm.ask(*missing, {**pair, **json_type, "Origin": own}, token=None).status == 200
    assert farm.ask(*missing, {**pair, **json_type, "Origin": "http://evil.example"}, token=None).status == 403
    assert farm.ask(*missing, {**pair, **json_type}, token=None).status == 403


def test_a_job_goes_in_as_xml_is_seen_and_cancelled(farm):
    answer = farm.ask("POST", "/api/v1/jobs?spp=4&name=ball.xml", SCENE, {"Content-Type": "application/xml"})
    assert answer.status == 201, answer.body
    url = answer.json()["url"]
    job = farm.get(url).json()
    assert job["state"] in ("queued", "running")
    assert job["spp"] == 4
    assert answer.json()["id"] in [j["id"] for j in farm.get("/api/v1/jobs").json()["jobs"]]
    tiles = farm.get(url + "/tiles").json()["tiles"]
    assert [t["rect"] for t in tiles] == [[0, 0, 32, 32]]
    assert farm.get(url + "/convergence.csv").body.startswith(b"seconds,core_seconds,spp")
    assert farm.ask("DELETE", url).status == 204
    assert farm.get(url).json()["state"] == "cancelled"


def test_a_job_goes_in_as_json_and_blobs(farm):
    digest = sha(SCENE.encode())
    missing = farm.ask("POST", "/api/v1/blobs/missing", json.dumps({"digests": [digest]}),
                       {"Content-Type": "application/json"})
    if missing.json()["missing"]:
        assert farm.ask("PUT", f"/api/v1/blobs/{digest}", SCENE).status == 201
    head = farm.ask("HEAD", f"/api/v1/blobs/{digest}")
    assert head.status == 200 and head.headers["Upload-Offset"] == str(len(SCENE))
    answer = farm.ask("POST", "/api/v1/jobs", json.dumps({"scene": digest, "assets": {}, "spec": {"spp": 2}}),
                      {"Content-Type": "application/json"})
    assert answer.status == 201, answer.body
    assert farm.ask("DELETE", answer.json()["url"]).status == 204


def test_a_wrong_scene_is_refused_with_places(farm):
    wrong = SCENE.replace('type="sphere"', 'type="sfere"')
    answer = farm.ask("POST", "/api/v1/jobs?name=ball.xml", wrong, {"Content-Type": "application/xml"})
    assert answer.status == 400
    assert answer.headers["Content-Type"] == "application/problem+json"
    first = answer.json()["diagnostics"][0]
    assert first["file"] == "ball.xml" and first["line"] == 6 and first["column"] > 0
    assert "sphere" in first["text"]


def test_garbage_is_answered(farm):
    for garbage in (b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n", b"GET\r\n\r\n", b"\xff" * 100 + b"\r\n\r\n"):
        with farm.connect() as sock:
            sock.sendall(garbage)
            assert status_of(read_all(sock)) == 400


def test_oversized_headers_and_bodies_are_refused(farm):
    with farm.connect() as sock:
        sock.sendall(b"GET / HTTP/1.1\r\nHost: x\r\nX: " + b"a" * 40000)
        assert status_of(read_all(sock)) == 431
    for path, kind, length in (("/api/v1/jobs", "application/xml", 1 << 40), ("/api/v1/jobs", "application/json", 1 << 23),
                               ("/api/v1/session", "application/json", 1 << 20)):
        with farm.connect() as sock:
            sock.sendall(farm.head("POST", path, length, kind))
            assert status_of(read_all(sock)) == 413
    with farm.connect() as sock:
        sock.sendall(farm.head("PUT", "/api/v1/blobs/" + sha(b"x"), 1 << 50))
        assert status_of(read_all(sock)) == 413


def test_slow_loris_is_cut_while_others_are_served(farm):
    drips = [farm.connect() for _ in range(30)]
    try:
        for sock in drips:
            sock.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\nX-Drip: ")
        assert farm.get("/healthz", token=None).status == 200
        for sock in drips:
            assert status_of(read_all(sock)) == 408
    finally:
        for sock in drips:
            sock.close()


def test_a_slow_upload_is_cut_and_leaves_nothing(farm):
    before = files_under(farm.data)
    with farm.connect() as sock:
        sock.sendall(farm.head("PUT", "/api/v1/blobs/" + sha(b"slow"), 10_000_000) + b"some")
        assert farm.get("/healthz", token=None).status == 200
        assert status_of(read_all(sock)) == 408
    assert farm.ask("HEAD", "/api/v1/blobs/" + sha(b"slow")).headers["Upload-Offset"] == "0"
    assert files_under(farm.data) == before


def test_an_upload_cut_off_leaves_nothing(farm):
    before = files_under(farm.data)
    data = os.urandom(1 << 20)
    with farm.connect() as sock:
        sock.sendall(farm.head("PUT", "/api/v1/blobs/" + sha(data), len(data)) + data[: 600_000])
        sock.shutdown(socket.SHUT_WR)
        read_all(sock)  # closed only after the upload was given up
    assert farm.ask("HEAD", "/api/v1/blobs/" + sha(data)).headers["Upload-Offset"] == "0"
    assert files_under(farm.data) == before
    assert farm.ask("PUT", "/api/v1/blobs/" + sha(data), data).status == 201
    assert len(files_under(farm.data)) == len(before) + 1


def test_a_blob_with_another_digest_is_refused_and_leaves_nothing(farm):
    before = files_under(farm.data)
    assert farm.ask("PUT", "/api/v1/blobs/" + sha(b"right"), b"wrong").status == 400
    assert files_under(farm.data) == before


def test_no_path_leads_out_of_the_pages(farm):
    for path in ("/../token", "/%2e%2e/token", "/..%2ftoken", "//token", "/js/../../token", "/token"):
        with farm.connect() as sock:
            sock.sendall(f"GET {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n".encode())
            answer = read_all(sock)
        assert status_of(answer) in (400, 404)
        assert farm.token.encode() not in answer


def test_events_tell_of_a_job_and_go_on_where_a_reader_left(farm):
    with farm.events("/api/v1/events") as stream:
        start = stream.read_id()
        url = farm.ask("POST", "/api/v1/jobs?spp=2", SCENE, {"Content-Type": "application/xml"}).json()["url"]
        event = stream.read_event("job")
        assert event["id"] > start
        assert url.endswith(event["data"]["id"])
        farm.ask("DELETE", url)
        while stream.read_event("job")["data"]["state"] != "cancelled":
            pass
    with farm.events(url + "/events?last_event_id=" + str(start)) as again:
        assert again.read_event("job")["id"] == event["id"]
    with farm.events("/api/v1/events") as silent:
        assert silent.read_line_starting(b":") is not None  # heartbeat


def test_metrics_count(farm):
    text = farm.get("/metrics").body.decode()
    assert 'lightshaft_jobs{state="queued"}' in text
    assert 'lightshaft_http_requests_total{method="GET",code="200"}' in text


def test_a_taken_port_and_a_taken_folder_are_told(farm, tmp_path):
    def start(*args):
        return subprocess.run([find_coordinator(), *args], capture_output=True, text=True, timeout=300)

    port = start("--http", f"127.0.0.1:{farm.port}", "--grpc", "127.0.0.1:0", "--data", str(tmp_path / "a"))
    assert port.returncode == 1 and "another program uses this port" in port.stderr
    folder = start("--http", "127.0.0.1:0", "--grpc", "127.0.0.1:0", "--data", str(farm.data))
    assert folder.returncode == 1 and "another coordinator" in folder.stderr
    assert start("--store", "redis://localhost:port").returncode == 2
    assert start("--colour", "red").returncode == 2
    assert start("--http", "nowhere").returncode == 2
    (tmp_path / "c.toml").write_text("htp = 'x'\n")
    assert start("--config", str(tmp_path / "c.toml")).returncode == 2
    assert start("--help").returncode == 0


@pytest.mark.parametrize("sig", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_stops_it_in_order_with_readers_connected(tmp_path, sig):
    with Coordinator(tmp_path / "data") as coordinator:
        with coordinator.events("/api/v1/events") as stream, coordinator.connect() as idle:
            stream.read_id()
            idle.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n")
            assert status_of(idle.recv(65536)) == 200  # accepted, and kept open
            assert json.loads((coordinator.data / "ports.json").read_text())["http"] == coordinator.port
            coordinator.process.send_signal(sig)
            assert coordinator.process.wait(timeout=300) == 0
            assert idle.recv(1) == b""
        assert not (coordinator.data / "ports.json").exists()


def test_sessions_and_tokens_survive_a_restart(tmp_path):
    with Coordinator(tmp_path / "data") as first:
        token = first.token
        cookie = first.ask("POST", "/api/v1/session", json.dumps({"token": token}), {"Content-Type": "application/json"},
                           token=None).headers["Set-Cookie"].split(";")[0]
    with Coordinator(tmp_path / "data") as second:
        assert second.token == token
        assert second.get("/api/v1/jobs", {"Cookie": cookie}, token=None).status == 200
