"""TLS on both ports: versions, suites, certificates, plain text, and what never travels or is written in plain text."""

import contextlib
import os
import socket
import ssl
import subprocess
import warnings

import grpc
from attack_kit import LocalFarm, UNLIMITED, group
from farm_rpc import SERVICE, first_field, hello
from local_farm import HttpError, Process, bin_dir, refused_coordinator, wait_until
from test_tls import Authority

warnings.filterwarnings("ignore", category=DeprecationWarning)
VERSIONS = (("SSL 3", "-ssl3", False), ("TLS 1.0", "-tls1", False), ("TLS 1.1", "-tls1_1", False), ("TLS 1.2", "-tls1_2", True), ("TLS 1.3", "-tls1_3", True))
SUITES = ("NULL", "aNULL", "eNULL", "EXPORT", "RC4", "DES", "3DES", "MD5", "PSK", "AES128-SHA", "ADH-AES256-GCM-SHA384", "IDEA", "SEED", "CAMELLIA")


def shakes_hands(farm, port, *options):
    """Whether openssl's client came to a session with what the port speaks."""
    command = ["openssl", "s_client", "-connect", f"127.0.0.1:{port}", "-CAfile", farm.secrets / "tls/ca.pem", "-verify_return_error", "-verify_hostname", "localhost", *options]
    done = subprocess.run([str(c) for c in command], stdin=subprocess.DEVNULL, capture_output=True, text=True, errors="replace", timeout=60)
    return done.returncode == 0 and "Cipher is (NONE)" not in done.stdout and "New, " in done.stdout, (done.stdout + done.stderr)[-300:]


def joins(farm, ca, cert=None, key=None, token=None, plain=False, patience=3):
    """Whether a worker with these files is welcomed. `patience`: seconds; long where it should be."""
    credentials = None if plain else grpc.ssl_channel_credentials(ca.read_bytes(), key and key.read_bytes(), cert and cert.read_bytes())
    with (grpc.insecure_channel(f"localhost:{farm.grpc}") if plain else grpc.secure_channel(f"localhost:{farm.grpc}", credentials)) as channel:
        call = channel.stream_stream(SERVICE + "Work")(iter([hello(farm.join_token if token is None else token)]), timeout=patience)
        with contextlib.suppress(grpc.RpcError):
            for answer in call:
                return first_field(answer) == 1  # ToWorker.welcome
    return False


@group("TLS", quick=True)
def tls(record, folder):
    stranger = Authority(folder / "stranger")
    with LocalFarm(folder / "farm", tls=True, flags=UNLIMITED) as farm:
        own = farm.secrets / "tls"
        record.row = "versions and suites, on both ports"
        for label, option, right in VERSIONS:
            for port, certificate in ((farm.http, ()), (farm.grpc, ("-cert", own / "worker.pem", "-key", own / "worker.key", "-alpn", "h2"))):
                shaken, said = shakes_hands(farm, port, option, *certificate, "-cipher", "ALL:@SECLEVEL=0")
                record.attempt(f"{label} on {'HTTP' if port == farm.http else 'gRPC'}", shaken == right, said)
        for suite in SUITES:
            shaken, said = shakes_hands(farm, farm.http, "-tls1_2", "-cipher", f"{suite}:@SECLEVEL=0")
            record.attempt(f"only {suite}", not shaken or suite == "AES128-SHA" and "ECDHE" in said, said)
        done = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{farm.http}", "-tls1_2", "-CAfile", str(own / "ca.pem")], input="R\nR\nR\nQ\n", capture_output=True, text=True, errors="replace", timeout=60)
        record.attempt("renegotiation by the client", "RENEGOTIATING" not in done.stdout or "error" in done.stderr or "no renegotiation" in done.stderr, done.stderr[-300:])
        record.row = "who the coordinator is: name and authority"
        for label, context, name, right in (("its authority and name", ssl.create_default_context(cafile=own / "ca.pem"), "localhost", True), ("another name", ssl.create_default_context(cafile=own / "ca.pem"), "evil.example", False),
                                            ("another authority", ssl.create_default_context(cafile=stranger.folder / "ca.pem"), "localhost", False), ("the system's authorities", ssl.create_default_context(), "localhost", False)):
            try:
                with socket.create_connection(("127.0.0.1", farm.http), timeout=20) as raw, context.wrap_socket(raw, server_hostname=name):
                    trusted = True
            except ssl.SSLError:
                trusted = False
            record.attempt(label, trusted == right, trusted)
        record.row = "workers: no certificate, foreign, expired, self-signed, signed by a worker, the coordinator's own, plain text, a wrong token"
        record.attempt("the farm's certificate and token", joins(farm, own / "ca.pem", own / "worker.pem", own / "worker.key", patience=60), "not welcomed")
        foreign, late = stranger.issue("intruder"), Authority(folder / "late")
        for name in ("ca.pem", "ca.key"):
            (late.folder / name).write_bytes((own / name).read_bytes())
        expired = late.issue("late", end="20210101000000Z")
        by_worker = Authority(folder / "by-worker")
        (by_worker.folder / "ca.pem").write_bytes((own / "worker.pem").read_bytes())
        (by_worker.folder / "ca.key").write_bytes((own / "worker.key").read_bytes())
        signed = by_worker.issue("child")
        chain = folder / "chain.pem"
        chain.write_bytes(signed[0].read_bytes() + (own / "worker.pem").read_bytes())
        for label, files in (("no certificate", ()), ("a foreign one", foreign), ("an expired one", expired), ("its own authority's", (stranger.folder / "ca.pem", stranger.folder / "ca.key")), ("signed by a worker", signed), ("signed by a worker, with the chain", (chain, signed[1])),
                             ("another's key", (own / "worker.pem", stranger.folder / "ca.key"))):
            record.attempt(label, not joins(farm, own / "ca.pem", *files), "welcomed")
        record.attempt("plain text", not joins(farm, None, plain=True), "welcomed")
        record.attempt("a right certificate and a wrong token", not joins(farm, own / "ca.pem", own / "worker.pem", own / "worker.key", token="0" * 64), "welcomed")
        record.attempt("a right certificate and a user's token", not joins(farm, own / "ca.pem", own / "worker.pem", own / "worker.key", token=farm.token), "welcomed")
        record.row = "plain HTTP and garbage to the port of TLS"
        for label, data in (("plain HTTP", b"GET /api/v1/jobs HTTP/1.1\r\nHost: x\r\n\r\n"), ("a hello of 2^24", b"\x16\x03\x01\xff\xff\x01\xff\xff\xff" + bytes(1000)), ("heartbeats", b"\x18\x03\x02\0\3\1\x40\0" * 100), ("SSL 2", b"\x80\x2e\1\0\2\0\x15\0\0\0\x10" + bytes(40)), ("random bytes", os.urandom(10_000))):
            with socket.create_connection(("127.0.0.1", farm.http), timeout=30) as raw:
                got = b""
                with contextlib.suppress(ConnectionError):
                    raw.sendall(data)
                    raw.shutdown(socket.SHUT_WR)
                    while part := raw.recv(4096):
                        got += part
            record.attempt(label, b" 200 " not in got and farm.coordinator.alive(), got[:100])
        record.row = "keys are their owner's, tokens stand nowhere in plain text"
        for path in (*own.glob("*.key"), farm.data / "token", farm.data / "join-token"):
            record.attempt(path.name, path.stat().st_mode & 0o077 == 0, oct(path.stat().st_mode))
        tokens = [farm.token_of(f"user-{i}") for i in range(10)]
        for token in tokens:
            with contextlib.suppress(HttpError):
                farm.request("GET", f"/api/v1/jobs?search={token[:8]}", token=token)
        secrets = [t.encode() for t in (*tokens, farm.join_token, farm.token)]
        for path in sorted(p for p in farm.folder.rglob("*") if p.is_file()):
            record.attempt(path.name, path.name in ("token", "join-token") or not any(s in path.read_bytes() for s in secrets), "it has a token in it")
        record.row = "afterwards"
        record.attempt("others are served afterwards", "jobs" in farm.get("/api/v1/jobs") and farm.coordinator.alive(), "")
    record.row = "certificates that must not be used are refused at the start"
    cert, key = stranger.issue("server")
    for label, flags, mode in (("a key that others may read", ("--tls-cert", cert, "--tls-key", key, "--tls-ca", stranger.folder / "ca.pem"), 0o644), ("a key of another", ("--tls-cert", cert, "--tls-key", stranger.folder / "ca.key", "--tls-ca", stranger.folder / "ca.pem"), 0o600), ("half of the files", ("--tls-cert", cert), 0o600)):
        with record.expecting(label):
            os.chmod(key, mode)
            (refused := folder / label.replace(" ", "-")).mkdir()
            record.attempt(label, "tls-" in (said := refused_coordinator(refused, *flags)) or "key" in said, "")
    os.chmod(key, 0o644)
    worker = Process("worker", [bin_dir() / "lightshaft-worker", "--coordinator", "127.0.0.1:1", "--cache", folder / "cache", "--tls-ca", stranger.folder / "ca.pem", "--tls-cert", cert, "--tls-key", key],
                     folder / "worker.log", dict(os.environ, LIGHTSHAFT_JOIN_TOKEN="x"))
    try:
        wait_until(lambda: "may read the TLS key" in worker.output() or not worker.alive(), "the worker says that others may read its key", 30)
        record.attempt("a worker says that others may read its key", "may read the TLS key" in worker.output(), worker.output())
    finally:
        worker.kill()
