"""TLS for users, and for workers with certificates on both sides: real processes, and everybody who must not get in."""

import hashlib
import http.client
import http.server
import json
import os
import socket
import ssl
import stat
import subprocess
import sys
import threading

import pytest
from local_farm import ROOT, LocalFarm, Process, bin_dir, wait_until

SCENE = """<scene version="3.0.0"><integrator type="volpath"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film></sensor>
<emitter type="constant"/><shape type="sphere"/></scene>"""
TIMEOUT = 20  # seconds within which what must come comes


def openssl(*args, folder):
    subprocess.run(["openssl", *[str(a) for a in args]], cwd=folder, check=True, capture_output=True)


class Authority:
    """A certificate authority made with the openssl program: another than the farm's, or the operator's own."""

    def __init__(self, folder):
        self.folder = folder
        folder.mkdir()
        (folder / "index.txt").write_text("")
        (folder / "ca.cnf").write_text(
            "[ca]\ndefault_ca = d\n[d]\ndatabase = index.txt\nserial = serial\nnew_certs_dir = .\ndefault_md = sha256\n"
            "policy = p\nunique_subject = no\n[p]\ncommonName = supplied\n[e]\nsubjectAltName = IP:127.0.0.1,DNS:localhost\n")
        openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-subj", "/CN=authority",
                "-days", "10", "-keyout", "ca.key", "-out", "ca.pem", folder=folder)

    def issue(self, name, end="20991231235959Z"):
        openssl("req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-subj", f"/CN={name}",
                "-keyout", f"{name}.key", "-out", f"{name}.csr", folder=self.folder)
        openssl("ca", "-batch", "-config", "ca.cnf", "-cert", "ca.pem", "-keyfile", "ca.key", "-in", f"{name}.csr", "-out",
                f"{name}.pem", "-startdate", "20200101000000Z", "-enddate", end, "-extensions", "e", "-rand_serial", "-notext",
                folder=self.folder)
        os.chmod(self.folder / f"{name}.key", 0o600)
        return self.folder / f"{name}.pem", self.folder / f"{name}.key"


@pytest.fixture(scope="module")
def farm(tmp_path_factory):
    with LocalFarm(tmp_path_factory.mktemp("tls"), tls=True, flags=["--http-header-seconds", "1"]) as farm:
        yield farm


@pytest.fixture(scope="module")
def stranger(tmp_path_factory):
    return Authority(tmp_path_factory.mktemp("ca") / "stranger")


def worker_with(farm, name, *flags):
    """A worker with these certificates, or none, and the right join token."""
    env = dict(os.environ, LIGHTSHAFT_JOIN_TOKEN=farm.join_token)
    return Process(name, [farm.bin / "lightshaft-worker", "--coordinator", f"127.0.0.1:{farm.grpc}", "--fake", "--threads", 1,
                          "--cache", farm.folder / "cache" / name, "--name", name, *flags], farm.folder / f"{name}.log", env)


def connected(farm):
    return {w["name"] for w in farm.get("/api/v1/workers")["workers"] if w["state"] == "connected"}


def test_a_job_is_rendered_with_everything_encrypted(farm):
    farm.add_worker()
    job = farm.submit(SCENE, spp=4)
    farm.wait_for_job(job)
    assert farm.request("GET", f"/api/v1/jobs/{job}/image.exr")[:4] == b"\x76\x2f\x31\x01"
    blob = os.urandom(3 << 20)
    farm.request("PUT", f"/api/v1/blobs/{hashlib.sha256(blob).hexdigest()}", blob, "application/octet-stream")


def test_the_command_line_trusts_the_ca_that_it_is_told_of_and_no_other(farm, stranger):
    def jobs(ca):
        env = dict(os.environ, LIGHTSHAFT_URL=farm.url(), LIGHTSHAFT_TOKEN=farm.token)
        env.pop("LIGHTSHAFT_CA", None)
        if ca:
            env["LIGHTSHAFT_CA"] = str(ca)
        return subprocess.run([bin_dir() / "lightshaft", "workers"], env=env, capture_output=True, text=True, timeout=TIMEOUT)

    good = jobs(farm.data / "tls/ca.pem")
    assert good.returncode == 0, good.stderr
    for ca in (None, stranger.folder / "ca.pem"):
        bad = jobs(ca)
        assert bad.returncode == 1 and "certificate" in bad.stderr.lower(), bad.stderr


def answering(handler, context=None):
    """A server of its own thread, with TLS if there is a context."""
    server = http.server.HTTPServer(("127.0.0.1", 0), handler)
    if context:
        server.socket = context.wrap_socket(server.socket, server_side=True)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server


def test_a_token_that_goes_by_tls_is_not_sent_on_without(stranger):
    heard = []

    class Plain(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            heard.append(self.headers.get("Authorization"))
            body = b"[]"
            self.send_response(200)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            pass

    plain = answering(Plain)

    class SendsOn(Plain):
        def do_GET(self):
            self.send_response(307)
            self.send_header("Location", f"http://127.0.0.1:{plain.server_port}{self.path}")
            self.send_header("Content-Length", "0")
            self.end_headers()

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*stranger.issue("sends-on"))
    secure, open_one = answering(SendsOn, context), answering(SendsOn)
    env = dict(os.environ, LIGHTSHAFT_TOKEN="secret", LIGHTSHAFT_CA=str(stranger.folder / "ca.pem"))

    def jobs(url):
        return subprocess.run([bin_dir() / "lightshaft", "jobs", "--to", url], env=env, capture_output=True, text=True, timeout=TIMEOUT)

    refused = jobs(f"https://127.0.0.1:{secure.server_port}")

    assert refused.returncode == 1 and "sends this on to an address that is not https" in refused.stderr, refused.stderr
    assert heard == []
    jobs(f"http://127.0.0.1:{open_one.server_port}")  # from one without TLS to another: a farm without TLS
    assert heard == ["Bearer secret"]
    for server in (plain, secure, open_one):
        server.shutdown()


@pytest.mark.parametrize("case", ["no TLS", "no certificate of ours", "expired", "coordinator of a stranger"])
def test_a_worker_that_cannot_prove_itself_does_not_get_in(farm, stranger, case):
    ca = farm.data / "tls/ca.pem"
    if case == "no TLS":
        flags = []
    elif case == "no certificate of ours":
        cert, key = stranger.issue("intruder")
        flags = ["--tls-ca", ca, "--tls-cert", cert, "--tls-key", key]
    elif case == "expired":
        own = Authority(farm.folder / "own")
        for name in ("ca.pem", "ca.key"):
            (own.folder / name).write_bytes((farm.data / "tls" / name).read_bytes())
        cert, key = own.issue("late", end="20210101000000Z")
        flags = ["--tls-ca", ca, "--tls-cert", cert, "--tls-key", key]
    else:
        flags = ["--tls-ca", stranger.folder / "ca.pem", "--tls-cert", farm.data / "tls/worker.pem",
                 "--tls-key", farm.data / "tls/worker.key"]
    name = case.replace(" ", "-")
    worker = worker_with(farm, name, *flags)
    try:
        # It tells of every connection that failed; two of them, and it had its chance.
        failed = "no connection to the coordinator"
        wait_until(lambda: worker.output().count(failed) >= 2, "the worker tells of its failure")
        assert name not in connected(farm) and "joined" not in worker.output(), worker.output()
    finally:
        worker.kill()


def test_no_client_certificate_no_connection(farm):
    """The handshake as such: with the right CA but nothing to show, the port says no."""
    context = ssl.create_default_context(cafile=farm.data / "tls/ca.pem")
    context.set_alpn_protocols(["h2"])
    with socket.create_connection(("127.0.0.1", farm.grpc), timeout=TIMEOUT) as raw:
        with pytest.raises((ssl.SSLError, ConnectionError)):
            with context.wrap_socket(raw, server_hostname="127.0.0.1") as secure:
                # In TLS 1.3 a client learns of it with the first answer.
                secure.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\x00\x00\x00\x04\x00\x00\x00\x00\x00")
                while secure.recv(4096):
                    pass
                raise ConnectionError("closed")
    context.load_cert_chain(farm.data / "tls/worker.pem", farm.data / "tls/worker.key")
    with socket.create_connection(("127.0.0.1", farm.grpc), timeout=TIMEOUT) as raw:
        with context.wrap_socket(raw, server_hostname="127.0.0.1") as secure:
            secure.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\x00\x00\x00\x04\x00\x00\x00\x00\x00")
            assert secure.recv(9)[3] == 4  # SETTINGS


def test_plain_http_to_a_tls_port_is_told_so_and_ends(farm):
    with socket.create_connection(("127.0.0.1", farm.http), timeout=TIMEOUT) as raw:
        raw.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n")
        answer = b""
        while part := raw.recv(4096):
            answer += part
    assert answer.startswith(b"HTTP/1.1 400 ") and b"https://" in answer


def test_tls_to_a_plain_port_fails_at_once(tmp_path):
    with LocalFarm(tmp_path) as plain:
        with socket.create_connection(("127.0.0.1", plain.http), timeout=TIMEOUT) as raw, pytest.raises(ssl.SSLError):
            ssl.create_default_context().wrap_socket(raw, server_hostname="127.0.0.1")


@pytest.mark.slow
def test_a_worker_joins_though_a_handshake_takes_longer_than_a_second(tmp_path):
    """A far coordinator, or one that many workers join at once: an attempt that is broken off too soon begins anew, for ever."""
    sys.path.insert(0, str(ROOT / "tests" / "chaos"))
    from weather import Network, Skip
    try:
        network = Network(1)
    except Skip as why:
        pytest.skip(str(why))
    with network, LocalFarm(tmp_path, tls=True, host=network.host, flags=["--tls-names", network.host]) as far:
        network.weather(delay=.4)  # one way; a connection and its handshake are two ways there and back
        far.add_worker(within=network.inside)
        far.wait_for_workers(1)


def test_slow_handshakes_wait_alone_and_are_cut(farm):
    slow = [socket.create_connection(("127.0.0.1", farm.http), timeout=TIMEOUT) for _ in range(40)]
    for i, connection in enumerate(slow):
        if i % 2:
            connection.sendall(b"\x16\x03\x01\x02")  # the beginning of a hello that never comes
    assert farm.request("GET", "/healthz") == b"ok\n"
    for connection in slow:
        assert connection.recv(100) == b""  # cut after --http-header-seconds
        connection.close()


def test_garbage_after_the_first_byte_ends_the_connection_alone(farm):
    with socket.create_connection(("127.0.0.1", farm.http), timeout=TIMEOUT) as raw:
        raw.sendall(b"\x16" + b"\xff" * 600)
        while raw.recv(4096):
            pass
    assert farm.request("GET", "/healthz") == b"ok\n"


def test_connections_are_kept_and_events_stream(farm):
    connection = http.client.HTTPSConnection("127.0.0.1", farm.http, timeout=TIMEOUT, context=farm.trust())
    auth = {"Authorization": f"Bearer {farm.token}"}
    for _ in range(3):
        connection.request("GET", "/api/v1/jobs", headers=auth)
        answer = connection.getresponse()
        assert answer.status == 200 and json.loads(answer.read())
    first = connection.sock
    connection.request("GET", "/api/v1/events", headers=auth)
    assert connection.sock is first
    stream = connection.getresponse()
    job = farm.submit(SCENE, spp=2)
    while True:
        line = stream.readline()
        assert line, "the stream ended"
        if line.startswith(b"data: ") and job.encode() in line:
            break
    first.close()


def test_a_session_cookie_is_for_tls_alone(farm):
    connection = http.client.HTTPSConnection("127.0.0.1", farm.http, timeout=TIMEOUT, context=farm.trust())
    connection.request("POST", "/api/v1/session", json.dumps({"token": farm.token}), {"Content-Type": "application/json"})
    answer = connection.getresponse()
    assert answer.status == 204 and "; Secure" in answer.headers["Set-Cookie"]


def test_the_farms_authority_is_made_once_and_keys_are_its_owners(farm):
    folder = farm.data / "tls"
    before = {name: (folder / name).read_bytes() for name in ("ca.pem", "ca.key", "worker.pem", "worker.key", "server.pem")}
    for key in folder.glob("*.key"):
        assert stat.S_IMODE(key.stat().st_mode) == 0o600, key
    subprocess.run(["openssl", "verify", "-CAfile", folder / "ca.pem", "-purpose", "sslserver", folder / "server.pem"], check=True)
    subprocess.run(["openssl", "verify", "-CAfile", folder / "ca.pem", "-purpose", "sslclient", folder / "worker.pem"], check=True)
    # The worker's is no server's: a stolen one cannot play the coordinator.
    assert subprocess.run(["openssl", "verify", "-CAfile", folder / "ca.pem", "-purpose", "sslserver", folder / "worker.pem"],
                          capture_output=True).returncode != 0

    farm.restart_coordinator()

    for name, old in before.items():
        assert ((folder / name).read_bytes() == old) == (name != "server.pem"), name
    assert farm.request("GET", "/healthz") == b"ok\n"


def test_certificates_of_ones_own(tmp_path):
    own = Authority(tmp_path / "own")
    cert, key = own.issue("farm")
    worker_cert, worker_key = own.issue("worker")
    flags = ["--tls-ca", own.folder / "ca.pem", "--tls-cert", cert, "--tls-key", key]
    with LocalFarm(tmp_path, flags=flags) as farm:
        farm.url = lambda: f"https://127.0.0.1:{farm.http}"
        farm.trust = lambda: ssl.create_default_context(cafile=own.folder / "ca.pem")
        worker = worker_with(farm, "mine", "--tls-ca", own.folder / "ca.pem", "--tls-cert", worker_cert, "--tls-key", worker_key)
        farm.workers.append(worker)
        farm.wait_for_job(farm.submit(SCENE, spp=2))
        assert not (farm.data / "tls").exists()


@pytest.mark.parametrize("wrong", ["a key that others may read", "a key of another", "no key", "no PEM"])
def test_certificates_that_cannot_be_used_are_named_at_the_start(tmp_path, wrong):
    own = Authority(tmp_path / "own")
    cert, key = own.issue("farm")
    if wrong == "a key that others may read":
        key.chmod(0o644)
    if wrong == "a key of another":
        key = own.issue("other")[1]
    if wrong == "no PEM":
        cert = tmp_path / "text"
        cert.write_text("hello")
    args = ["--tls-ca", own.folder / "ca.pem", "--tls-cert", cert] + ([] if wrong == "no key" else ["--tls-key", key])
    start = subprocess.run([str(a) for a in [bin_dir() / "lightshaft-coordinator", "--http", "127.0.0.1:0", "--grpc", "127.0.0.1:0",
                                             "--data", tmp_path / "data", *args]], capture_output=True, text=True, timeout=TIMEOUT)
    assert start.returncode == 2, start.stderr
    said = {"a key that others may read": "chmod 600", "a key of another": "key", "no key": "--tls-key", "no PEM": "certificate"}
    assert said[wrong] in start.stderr, start.stderr


def test_the_names_of_the_certificate_are_those_that_were_given(tmp_path):
    with LocalFarm(tmp_path, tls=True, flags=["--tls-names", "farm.lab,10.1.2.3"]) as farm:
        text = subprocess.run(["openssl", "x509", "-in", farm.data / "tls/server.pem", "-noout", "-ext", "subjectAltName"],
                              check=True, capture_output=True, text=True).stdout
        for name in ("DNS:farm.lab", "IP Address:10.1.2.3", "DNS:localhost", "IP Address:127.0.0.1"):
            assert name in text
