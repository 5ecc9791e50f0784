"""`lightshaft up`: runs a coordinator and a worker on this machine, until Ctrl-C. The program `lightshaft` describes the options
(cli/commands/python_commands.cpp)."""

import contextlib
import http.client
import importlib.util
import os
import pathlib
import shlex
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

from lightshaft_command import browser, enrolment
from lightshaft_command.children import Child, Children, has_ended, say
from lightshaft_command.connections import listens
from lightshaft_command.console import Given
from lightshaft_command.farm_up.numbers import whole_option
from lightshaft_command.first_picture import FirstPicture
from lightshaft_command.programs import Problem, Usage, find
from lightshaft_command.state import claim, data_of, threads_of

HTTP, WORKERS, JOINING = 8080, 50051, 50052  # ports, if they are free
PROXIES = ("http_proxy", "https_proxy", "all_proxy")
PATIENCE = 60.0  # seconds, after which it is said that the coordinator is still starting


@dataclass(frozen=True)
class Options:
    data: pathlib.Path
    threads: int | None
    lan: bool
    names: list[str]
    port: int | None
    first_scene: pathlib.Path | None
    browser: bool


def read_options(given: Given) -> Options:
    if given.flag("--name") and not given.flag("--lan"):
        raise Usage("--name needs --lan: otherwise only this machine can reach the farm")
    return Options(
        data=data_of(given),
        threads=threads_of(given),
        lan=given.flag("--lan"),
        names=given.all("--name"),
        port=whole_option("--port", given.text("--port"), 0, 65535) if given.flag("--port") else None,
        first_scene=pathlib.Path(given.text("--first-scene")) if given.flag("--first-scene") else None,
        browser=not given.flag("--no-browser"),
    )


def free_port(host: str, wanted: int, given: int | None) -> int:
    """Returns the given port, or the wanted one, or any free port if that is in use."""
    port = wanted if given is None else given
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            if given is not None:
                raise Problem(f"port {port} cannot be used ({error.strerror}): choose another with --port, or leave it out") from error
            probe.bind((host, 0))
        found: int = probe.getsockname()[1]
    return found


def reads_usd() -> bool:
    """Tells whether the coordinator's sandbox can read stages of USD with this Python."""
    if importlib.util.find_spec("pxr") is None:
        return False
    command = [sys.executable, "-I", "-B", "-c", "import lightshaft.usd"]
    return subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False).returncode == 0


def start_coordinator(children: Children, asked: Options, data: pathlib.Path, names: list[str]) -> dict[str, int]:
    """Starts the coordinator. Returns its ports `http` and `grpc`."""
    host = "0.0.0.0" if asked.lan else "127.0.0.1"
    home = data / "coordinator"
    tls = ["--tls", "--tls-names", ",".join(names)] if asked.lan else []
    usd = ["--usd-python", sys.executable] if reads_usd() else []

    def words(web: int, workers: int) -> list[str]:
        return [find("lightshaft-coordinator"), "--http", f"{host}:{web}", "--grpc", f"{host}:{workers}", "--data", str(home), *tls, *usd]

    # Another program may take a port that was free just now.
    for wanted_http, wanted_workers in ((HTTP, WORKERS), (0, 0)):
        ports = {"http": free_port(host, wanted_http, asked.port), "grpc": free_port(host, wanted_workers, None)}
        with contextlib.suppress(OSError):  # of a coordinator that was killed
            (home / "ports.json").unlink()
        # When it is started again, workers and browsers find it where it was.
        child = Child("coordinator", words(ports["http"], ports["grpc"]), data / "coordinator.log")
        children.kept = [child]
        if has_started(children, child, home / "ports.json", ports["http"], bool(tls)):
            return ports
    raise Problem(f"the coordinator did not start; its log, {child.log}, ends:\n{child.last_lines()}")


def answers(port: int, tls: bool) -> bool:
    # Whoever answers is this user's own program, so its certificate does not matter.
    unsigned = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    unsigned.check_hostname, unsigned.verify_mode = False, ssl.CERT_NONE
    host, limit = "127.0.0.1", 1.0
    connection = http.client.HTTPSConnection(host, port, timeout=limit, context=unsigned) if tls else http.client.HTTPConnection(host, port, timeout=limit)
    try:
        connection.request("GET", "/healthz")
        return connection.getresponse().status == 200
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()


def has_started(children: Children, child: Child, file: pathlib.Path, port: int, tls: bool) -> bool:
    """Returns False if the program has ended. While it runs it may still be loading stored jobs. If the disk is
    full it cannot write the file that shows that it has started."""
    patient_until = time.monotonic() + PATIENCE
    while not file.exists() and not (listens(child.process.pid, port) and answers(port, tls)):
        if children.wait(0.1):
            raise KeyboardInterrupt
        if has_ended(child.process):
            return False
        if time.monotonic() > patient_until:
            say(f"the coordinator is still starting (log: {child.log})")
            patient_until += PATIENCE
    return True


def farm_variables(asked: Options, home: pathlib.Path, ports: dict[str, int]) -> dict[str, str]:
    """Returns the environment variables by which `lightshaft` on this machine finds the farm."""
    found = {"LIGHTSHAFT_URL": f"{'https' if asked.lan else 'http'}://127.0.0.1:{ports['http']}", "LIGHTSHAFT_TOKEN": (home / "token").read_text().strip()}
    if asked.lan:
        found["LIGHTSHAFT_CA"] = str(home / "tls" / "ca.pem")
    # The token is not for a proxy, which could not reach this machine's own address either.
    if any(os.environ.get(name) for proxy in PROXIES for name in (proxy, proxy.upper())):
        exempt = os.environ.get("no_proxy") or os.environ.get("NO_PROXY") or ""
        if exempt != "*":  # all hosts; the star counts only if it stands alone
            exempt = ",".join(filter(None, [exempt, "127.0.0.1"]))
        found.update(no_proxy=exempt, NO_PROXY=exempt)  # programs differ in which of the two they read
    return found


def start_worker(children: Children, threads: int | None, data: pathlib.Path, coordinator: str, token: str, tls: pathlib.Path | None, leaves: str) -> None:
    words = [find("lightshaft-worker"), "--coordinator", coordinator, "--cache", str(data / "cache")]
    if threads:
        words += ["--threads", str(threads)]
    if tls:
        words += ["--tls-ca", str(tls / "ca.pem"), "--tls-cert", str(tls / "worker.pem"), "--tls-key", str(tls / "worker.key")]
    children.kept.append(Child("worker", words, data / "worker.log", {**os.environ, "LIGHTSHAFT_JOIN_TOKEN": token}, leaves))


def show(data: pathlib.Path, farm: dict[str, str]) -> str:
    """Prints the addresses of the farm, including the one that signs in automatically."""
    home = data / "coordinator"
    address = f"{farm['LIGHTSHAFT_URL']}/#token={farm['LIGHTSHAFT_TOKEN']}"
    say(f"dashboard:        {address}")
    say(f"token:            {farm['LIGHTSHAFT_TOKEN']}   (admin; in {home / 'token'})")
    others = "".join(f" {name}={shlex.quote(farm[name])}" for name in ("LIGHTSHAFT_CA", "no_proxy", "NO_PROXY") if name in farm)
    say(f"other terminals:  export LIGHTSHAFT_URL={farm['LIGHTSHAFT_URL']} LIGHTSHAFT_TOKEN=$(cat {home / 'token'}){others}")
    return address


def invite(data: pathlib.Path, names: list[str], ports: dict[str, int]) -> None:
    """Lets other machines join, and prints the command for that."""
    home = data / "coordinator"
    port = free_port("0.0.0.0", JOINING, None)
    answering = enrolment.Enrolment(port, home / "tls", (home / "join-token").read_text().strip(), ports["grpc"])
    say(f"add a machine:    lightshaft join {names[0]} --code {answering.code()}")
    fingerprint = enrolment.digest_of(ssl.PEM_cert_to_DER_cert((home / "tls" / "server.pem").read_text())).hex(":").upper()
    say(f"                  ports {ports['http']} (dashboard), {ports['grpc']} and {answering.server_port} (workers) must pass this machine's firewall")
    say(f"                  your browser will warn about the farm's own certificate, whose SHA-256 is: {fingerprint}")


def run(words: Sequence[str]) -> int:
    asked = read_options(Given(words))
    os.umask(0o077)
    data = asked.data
    children = Children()
    names = [*asked.names, *enrolment.own_addresses()] or ["127.0.0.1"]
    try:
        with claim(data) as claimed:
            ports = start_coordinator(children, asked, data, names)
            home = data / "coordinator"
            farm = farm_variables(asked, home, ports)
            start_worker(children, asked.threads, data, f"127.0.0.1:{ports['grpc']}", (home / "join-token").read_text().strip(), home / "tls" if asked.lan else None,
                         "was drained and has ended; the farm continues, and the next `lightshaft up` starts a new worker")  # fmt: skip
            address = show(data, farm)
            claimed.tell(address)
            if asked.lan:
                invite(data, names, ports)
            say(f"press Ctrl-C to stop the farm; what it has rendered stays in {data}, and the next `lightshaft up` continues with it")
            if asked.browser and (why := browser.open_address(address)):
                say(f"open the dashboard's address in a browser yourself: {why}")
            picture = FirstPicture(children, data / "first", asked.first_scene, farm)
            children.run(picture.go_on)
            say("stopping: the worker sends its results first (press Ctrl-C again to stop everything at once)")
            children.end()
            say(f"the farm has stopped; its data stay in {data}")
    finally:
        children.end()
    return 0
