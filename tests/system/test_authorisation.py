"""Every route and every RPC, asked by everybody: what docs/reference/authorisation.md says is what the coordinator answers."""

import hashlib
import http.client
import json
import os
import re
import subprocess
from pathlib import Path

import pytest
from authorisation import CALLERS, ROUTES, RPC_CALLERS, RPCS, page
from local_farm import PATIENCE, ROOT, LocalFarm

SCENE = """<scene version="3.0.0"><integrator type="volpath"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film></sensor>
<emitter type="constant"/><shape type="sphere"/></scene>"""
ORIGIN = {"Origin": "http://farm"}
BLOB = b"known to all"


class Interface:
    """A farm with a token of every role, and a finished job of the owner."""

    def __init__(self, folder):
        self.farm = LocalFarm(folder, flags=["--http-wrong-tokens-per-minute", "0", "--http-requests-per-second", "0",
                                                "--http-heartbeat-seconds", "0.5"])
        self.farm.add_worker()
        self.tokens = {"none": None, "wrong": "0" * 64, "join": self.farm.join_token, "admin": self.farm.token,
                       "read": self.make_token("read", "rita"), "owner": self.make_token("submit", "anna"),
                       "other": self.make_token("submit", "bert")}
        self.sessions = {caller: self.open_session(caller) for caller in ("read", "owner", "other", "admin")}
        self.done = self.submit("owner")
        self.farm.wait_for_job(self.done)
        self.blob = hashlib.sha256(BLOB).hexdigest()
        assert self.ask("put", f"/api/v1/blobs/{self.blob}", "admin", BLOB)[0] == 201

    def ask(self, method, path, caller, body=None, kind="application/json", session=False, headers=None):
        """Status, headers and, unless it is an event stream, the body."""
        connection = http.client.HTTPConnection("127.0.0.1", self.farm.http, timeout=PATIENCE)
        sent = {"Host": "farm", **(headers or {})}
        if body is not None:
            sent["Content-Type"] = kind
        if session:
            sent |= {"Cookie": self.sessions[caller], **ORIGIN}
        elif self.tokens[caller]:
            sent["Authorization"] = f"Bearer {self.tokens[caller]}"
        connection.request(method.upper(), path, body, sent)
        answer = connection.getresponse()
        streams = answer.headers.get("Content-Type", "").startswith("text/event-stream")
        data = b"" if streams else answer.read()
        connection.close()
        return answer.status, answer.headers, data

    def make_token(self, role, user, of="admin"):
        body = json.dumps({"role": role, "user": user}).encode()
        self.tokens = getattr(self, "tokens", {"admin": self.farm.token})
        status, _, data = self.ask("post", "/api/v1/tokens", of, body)
        assert status == 201, data
        return json.loads(data)["token"]

    def open_session(self, caller):
        body = json.dumps({"token": self.tokens[caller]}).encode()
        status, headers, _ = self.ask("post", "/api/v1/session", "none", body)
        assert status == 204
        return headers["Set-Cookie"].split(";")[0]

    def submit(self, caller):
        status, _, data = self.ask("post", "/api/v1/jobs?spp=2", caller, SCENE.encode(), "application/xml")
        assert status == 201, data
        return json.loads(data)["id"]

    def prepare(self, operation, caller):
        """Path, body and its type for one call that a caller who may make it succeeds with."""
        method, path = operation.split()
        body, kind = None, "application/json"
        job = self.done
        if operation == "delete /api/v1/jobs/{id}":
            job = self.submit("owner")
        if method == "patch":
            body = b'{"priority": -3}'  # which also a user may choose
        if "{worker}" in path:
            path, body = path.replace("{worker}", "nobody"), b'{"state": "draining"}'
        if "{announcement}" in path:
            path, body = path.replace("{announcement}", f"of-{caller}"), b'{"name": "shot.xml", "files": ["smoke.vdb"]}'
            if method == "delete":
                path, body = path + "-none", None
        if operation == "post /api/v1/jobs":
            path, body, kind = path + "?spp=2", SCENE.encode(), "application/xml"
        if operation == "post /api/v1/jobs/{id}/again":
            body = b'{"spp": 2}'
        if operation == "post /api/v1/jobs/{id}/video":
            body, kind = b"{}", "application/json"
        if operation == "post /api/v1/session":
            body = json.dumps({"token": self.tokens[caller]} if self.tokens[caller] else {}).encode()
        if operation == "post /api/v1/tokens":
            body = b'{"role": "read"}'
        if operation == "get /api/v1/jobs/{id}/pixels":
            path += "?rect=0,0,1,1"
        if "{token}" in path:
            made = json.loads(self.ask("post", "/api/v1/tokens", "admin", b'{"role": "read"}')[2])
            path = path.replace("{token}", made["id"])
        if operation == "post /api/v1/blobs/missing":
            body = json.dumps({"digests": [self.blob]}).encode()
        if operation.startswith("put /api/v1/blobs"):
            body = f"new by {caller} {os.urandom(8).hex()}".encode()
            path, kind = path.replace("{sha256}", hashlib.sha256(body).hexdigest()), "application/octet-stream"
        return path.replace("{id}", job).replace("{sha256}", self.blob), body, kind


@pytest.fixture(scope="module")
def interface(tmp_path_factory):
    interface = Interface(tmp_path_factory.mktemp("interface"))
    with interface.farm:
        yield interface


def documented(interface):
    paths = json.loads(interface.ask("get", "/api/v1/openapi.json", "admin")[2])["paths"]
    return {f"{method} {path}" for path, item in paths.items() for method in item if method != "parameters"}


def test_every_route_of_the_document_has_a_row_and_every_row_a_route(interface):
    assert set(ROUTES) == documented(interface)


@pytest.mark.parametrize("operation", ROUTES)
def test_route_answers_each_caller_as_the_table_says(interface, operation):
    method = operation.split()[0]
    for caller in CALLERS:
        expected = ROUTES[operation][caller]
        path, body, kind = interface.prepare(operation, caller)
        status, headers, data = interface.ask(method, path, caller, body, kind)
        assert status == expected, (caller, data)
        if status >= 400 and method != "head":
            assert headers["Content-Type"] == "application/problem+json", caller
            assert json.loads(data)["status"] == status
        if method == "get":
            assert interface.ask("head", path, caller)[0] == expected, caller
        if caller in interface.sessions and "session" not in operation:
            path, body, kind = interface.prepare(operation, caller)
            assert interface.ask(method, path, caller, body, kind, session=True)[0] == expected, f"{caller}, with a session"


def test_a_job_of_another_and_none_at_all_look_the_same(interface):
    answers = [interface.ask("get", f"/api/v1/jobs/{job}", "other") for job in (interface.done, "j-" + "0" * (len(interface.done) - 2))]
    told = [json.loads(data) for _, _, data in answers]
    assert told[0] == told[1]
    assert [dict(h) | {"Date": ""} for _, h, _ in answers][0] == [dict(h) | {"Date": ""} for _, h, _ in answers][1]


def test_a_submit_token_lists_its_own_jobs_alone(interface):
    mine = interface.submit("other")
    jobs = {c: json.loads(interface.ask("get", "/api/v1/jobs", c)[2])["jobs"] for c in ("owner", "other", "read", "admin")}
    assert mine in {j["id"] for j in jobs["other"]} and {j["owner"] for j in jobs["other"]} == {"bert"}
    assert {j["owner"] for j in jobs["owner"]} == {"anna"}
    seen = json.loads(interface.ask("get", "/api/v1/jobs", "other")[2])
    assert seen["owners"] == ["bert"] and sum(seen["states"].values()) == seen["total"] == len(jobs["other"])
    for caller in ("read", "admin"):
        assert {interface.done, mine} <= {j["id"] for j in jobs[caller]}


def test_an_event_stream_tells_a_submit_token_of_its_own_jobs_alone(interface):
    last = json.loads(interface.ask("get", f"/api/v1/jobs/{interface.done}", "admin")[2])
    assert last["owner"] == "anna"
    connection = http.client.HTTPConnection("127.0.0.1", interface.farm.http, timeout=PATIENCE)
    connection.request("GET", "/api/v1/events?last_event_id=0", headers={"Authorization": f"Bearer {interface.tokens['other']}"})
    stream = connection.getresponse()
    mine = interface.submit("other")
    of_others, kind = [], None
    while True:
        line = stream.readline().decode().rstrip("\n")
        if line.startswith("event: "):
            kind = line[7:]
        if not line.startswith("data: "):
            continue
        data = json.loads(line[6:])
        if kind == "worker" and data.get("job") == interface.done:
            of_others.append(data)
        if kind == "tile" and data["job"] == interface.done:
            of_others.append(data)
        if kind == "job":
            if data["id"] == interface.done:
                of_others.append(data)
            if data["id"] == mine and data["state"] == "done":
                break
    connection.close()
    assert of_others == []


def test_a_revoked_token_ends_its_sessions_and_its_event_streams(interface):
    made = json.loads(interface.ask("post", "/api/v1/tokens", "admin", b'{"role": "read", "user": "gone"}')[2])
    interface.tokens["gone"] = made["token"]
    interface.sessions["gone"] = interface.open_session("gone")
    connection = http.client.HTTPConnection("127.0.0.1", interface.farm.http, timeout=PATIENCE)
    connection.request("GET", "/api/v1/events", headers={"Authorization": f"Bearer {made['token']}"})
    stream = connection.getresponse()
    assert stream.status == 200

    assert interface.ask("delete", f"/api/v1/tokens/{made['id']}", "admin")[0] == 204

    assert interface.ask("get", "/api/v1/jobs", "gone")[0] == 401
    assert interface.ask("get", "/api/v1/jobs", "gone", session=True)[0] == 401
    stream.read()  # returns: it has ended, with the next heartbeat
    connection.close()


def test_only_digests_of_tokens_are_on_the_disk(interface):
    secret = interface.make_token("submit", "carla")
    assert hashlib.sha256(secret.encode()).hexdigest() in (interface.farm.data / "tokens").read_text()
    for file in interface.farm.data.rglob("*"):
        if file.is_file():
            assert secret.encode() not in file.read_bytes(), file
    assert secret not in interface.farm.coordinator.output()


def test_the_command_line_makes_lists_and_revokes_tokens(interface):
    def run(*args, caller="admin"):
        env = dict(os.environ, LIGHTSHAFT_URL=f"http://127.0.0.1:{interface.farm.http}", LIGHTSHAFT_TOKEN=interface.tokens[caller])
        return subprocess.run([interface.farm.bin / "lightshaft", "token", *args], env=env, capture_output=True, text=True, timeout=PATIENCE)

    made = run("add", "--role", "submit", "--user", "dora")
    assert made.returncode == 0, made.stderr
    interface.tokens["dora"] = made.stdout.strip()
    assert interface.ask("get", "/api/v1/jobs", "dora")[0] == 200
    listed = run("list")
    assert "dora" in listed.stdout and "DATA/join-token" in listed.stdout and interface.tokens["dora"] not in listed.stdout
    identity = next(line.split()[0] for line in listed.stdout.splitlines() if "dora" in line)
    assert run("revoke", identity).returncode == 0
    assert interface.ask("get", "/api/v1/jobs", "dora")[0] == 401

    for args in (["revoke", identity], ["revoke", "../jobs"], ["add", "--role", "submit"], ["add", "--role", "boss"]):
        wrong = run(*args)
        assert wrong.returncode in (1, 2) and wrong.stderr and not wrong.stdout, (args, wrong.stderr)
    refused = run("list", caller="owner")
    assert refused.returncode == 1 and "submit" in refused.stderr


def test_tokens_survive_a_kill_of_the_coordinator(interface):
    interface.farm.restart_coordinator()
    for caller in ("read", "owner", "admin"):
        assert interface.ask("get", f"/api/v1/jobs/{interface.done}", caller)[0] == 200
    assert interface.ask("get", f"/api/v1/jobs/{interface.done}", "other")[0] == 404


def test_every_rpc_has_a_row():
    assert set(RPCS) == set(re.findall(r"^\s*rpc (\w+)", (ROOT / "proto/farm.proto").read_text(), re.MULTILINE))


@pytest.mark.parametrize("caller", RPC_CALLERS)
def test_rpcs_answer_each_caller_as_the_table_says(interface, caller):
    rpc = pytest.importorskip("farm_rpc", reason="python3-grpcio is not installed")
    token = interface.tokens[caller] or ""
    with rpc.channel_of(interface.farm.grpc) as channel:
        assert rpc.work(channel, token) == RPCS["Work"][caller]
        status, got = rpc.fetch_blob(channel, token, interface.blob)
    assert status == RPCS["FetchBlob"][caller]
    assert (got > 0) == (status == "OK")


def test_the_page_says_what_the_table_says():
    file = Path(ROOT / "docs/reference/authorisation.md")
    if os.environ.get("LIGHTSHAFT_UPDATE_DOCS"):
        file.write_text(page())
    assert file.read_text() == page(), "LIGHTSHAFT_UPDATE_DOCS=1 pytest tests/system/test_authorisation.py writes it anew"


def test_wrong_join_tokens_of_one_address_have_to_wait_and_right_ones_go_on(tmp_path):
    farm_rpc = pytest.importorskip("farm_rpc", reason="python3-grpcio is not installed")
    with LocalFarm(tmp_path, flags=["--http-wrong-tokens-per-minute", "4"]) as farm, farm_rpc.channel_of(farm.grpc) as channel:
        blob = hashlib.sha256(BLOB).hexdigest()
        assert farm_rpc.work(channel, farm.join_token) == "OK"

        tried = [farm_rpc.work(channel, f"{n:064x}") for n in range(3)] + [farm_rpc.fetch_blob(channel, f"{n:064x}", blob)[0] for n in range(3)]

        assert tried == ["UNAUTHENTICATED"] * 4 + ["RESOURCE_EXHAUSTED"] * 2
        assert farm_rpc.work(channel, "f" * 64) == "RESOURCE_EXHAUSTED"
        assert farm_rpc.work(channel, farm.join_token) == "OK", "it was right from this address before"
        assert farm.get("/api/v1/workers")["workers"], "HTTP counts for itself"
        assert "too many wrong join tokens" in farm.coordinator.output()
