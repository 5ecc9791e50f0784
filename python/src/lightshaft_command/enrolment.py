"""Lets a second machine join a farm: `lightshaft up --lan` answers on a port of its own, to which `lightshaft
join` connects.

The code that `up` prints contains this port, the digest (SHA-256) of the certificate of the farm's authority, and the
join token. The joining machine first fetches that certificate and compares its digest. So it knows the other side
before it sends the token, and nobody in between can read the token or answer instead of the farm. In return for the
token it gets the address of the workers' port, and a worker's certificate and key.
"""

import base64
import binascii
import dataclasses
import hashlib
import hmac
import http.client
import http.server
import json
import pathlib
import socket
import ssl
import threading
import time
from typing import Any

from lightshaft_command.programs import Problem

PATIENCE = 10.0  # seconds for one answer
MOST_CALLS = 16  # answered at once; others are sent away
MOST_BYTES = 1 << 20
DIGEST = 32  # bytes
NOT_YET_VALID, EXPIRED = 9, 10  # X509_V_ERR_CERT_... of OpenSSL


@dataclasses.dataclass(frozen=True)
class Code:
    port: int
    authority: bytes  # the digest of its certificate
    token: str

    def __str__(self) -> str:
        return base64.urlsafe_b64encode(self.port.to_bytes(2, "big") + self.authority + bytes.fromhex(self.token)).decode().rstrip("=")

    @staticmethod
    def read(text: str) -> "Code":
        try:
            raw = base64.b64decode(text + "=" * (-len(text) % 4), altchars=b"-_", validate=True)
        except (binascii.Error, ValueError):
            raw = b""
        if len(raw) != 2 + 2 * DIGEST:
            raise Problem("this is not a code of `lightshaft up --lan`: copy the whole line that it printed")
        return Code(int.from_bytes(raw[:2], "big"), raw[2 : 2 + DIGEST], raw[2 + DIGEST :].hex())


def digest_of(certificate: bytes) -> bytes:
    """Returns the digest of a certificate as DER, because PEM may contain several certificates."""
    return hashlib.sha256(certificate).digest()


class _Hurried(ssl.SSLSocket):
    """Reads a request within PATIENCE seconds in total, however slowly its bytes arrive."""

    deadline = 0.0

    def recv_into(self, buffer: Any, nbytes: int | None = None, flags: int = 0) -> int:
        left = self.deadline - time.monotonic()
        if left <= 0:
            raise TimeoutError
        self.settimeout(left)
        return super().recv_into(buffer, nbytes, flags)


class Enrolment(http.server.ThreadingHTTPServer):
    """Answers joining machines in separate threads until this program ends."""

    daemon_threads = True

    def __init__(self, port: int, tls: pathlib.Path, token: str, workers_port: int):
        self.tls, self.token, self.workers_port = tls, token, workers_port
        self._free = threading.BoundedSemaphore(MOST_CALLS)
        super().__init__(("0.0.0.0", port), _Handler)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def code(self) -> Code:
        return Code(self.server_port, digest_of(ssl.PEM_cert_to_DER_cert((self.tls / "ca.pem").read_text())), self.token)

    def process_request(self, request, client_address) -> None:  # type: ignore[no-untyped-def]
        """Limits the calls at once: strangers can call too, and each waiting call holds an open file and a thread."""
        if not self._free.acquire(blocking=False):
            self.shutdown_request(request)
            return
        try:
            super().process_request(request, client_address)
        except BaseException:  # there is no thread that gives it back
            self._free.release()
            raise

    def process_request_thread(self, request, client_address) -> None:  # type: ignore[no-untyped-def]
        """Handles the request in a thread, so that a silent machine does not delay others."""
        try:
            request.settimeout(PATIENCE)
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.sslsocket_class = _Hurried
            # Read each time: the coordinator makes this certificate anew when it starts.
            context.load_cert_chain(self.tls / "server.pem", self.tls / "server.key")
            with context.wrap_socket(request, server_side=True) as secured:
                assert isinstance(secured, _Hurried)
                secured.deadline = time.monotonic() + PATIENCE
                self.finish_request(secured, client_address)
        except OSError:
            pass  # of TLS, or of a machine that went away
        finally:
            self.shutdown_request(request)
            self._free.release()


class _Handler(http.server.BaseHTTPRequestHandler):
    server: Enrolment

    def do_GET(self) -> None:
        tls = self.server.tls
        if self.path == "/authority":
            self.reply(200, (tls / "ca.pem").read_bytes())
        elif self.path != "/worker":
            self.reply(404, b"no such page\n")
        elif not hmac.compare_digest(self.headers.get("Authorization", "").encode(), f"Bearer {self.server.token}".encode()):
            self.reply(401, b"wrong join token\n")
        else:
            answer = {"port": self.server.workers_port, "certificate": (tls / "worker.pem").read_text(), "key": (tls / "worker.key").read_text()}
            self.reply(200, json.dumps(answer).encode())

    def reply(self, status: int, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Prints nothing, because the terminal shows the farm's messages."""


@dataclasses.dataclass(frozen=True)
class Joined:
    address: str  # HOST:PORT for workers
    authority: str
    certificate: str
    key: str


def _ask(host: str, code: Code, path: str, context: ssl.SSLContext, headers: dict[str, str]) -> bytes:
    connection = http.client.HTTPSConnection(host, code.port, timeout=PATIENCE, context=context)
    try:
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        body = answer.read(MOST_BYTES)
    except ssl.SSLCertVerificationError as error:
        if error.verify_code in (NOT_YET_VALID, EXPIRED):
            raise Problem(f"the farm's certificate is not valid now ({error.verify_message}): compare the clocks of the two machines") from error
        raise Problem(f"the farm's certificate does not fit {host}: {error.verify_message}; use a name or address that "
                      f"`lightshaft up --lan` printed, or start that with --name {host}") from error  # fmt: skip
    except (OSError, http.client.HTTPException, UnicodeError) as error:  # UnicodeError: of a host's name that cannot be one
        raise Problem(f"no farm answers at {host}, port {code.port} ({error}): check that `lightshaft up --lan` runs there, and that its "
                      "firewall allows this port and the one for workers") from error  # fmt: skip
    finally:
        connection.close()
    if answer.status == 401:
        raise Problem("the farm does not accept this code: copy the line that its `lightshaft up --lan` prints now")
    if answer.status != 200:
        raise Problem(f"{host}, port {code.port}, answers {answer.status}: it is not the port for joining a farm")
    return body


def join(host: str, code: Code) -> Joined:
    stranger = ssl.create_default_context()
    stranger.check_hostname, stranger.verify_mode = False, ssl.CERT_NONE
    shown = _ask(host, code, "/authority", stranger, {})
    try:
        certificate = ssl.PEM_cert_to_DER_cert(shown.decode())
        same = hmac.compare_digest(digest_of(certificate), code.authority)
    except ValueError:
        same = False
    if not same:
        raise Problem(f"the farm at {host} is not the one that printed this code: its certificate differs")
    # Nothing but what was compared is trusted: the answer may go on with the authority of whoever sent it.
    authority = ssl.DER_cert_to_PEM_cert(certificate)
    known = ssl.create_default_context(cadata=authority)
    answer = json.loads(_ask(host, code, "/worker", known, {"Authorization": f"Bearer {code.token}"}))
    name = f"[{host}]" if ":" in host else host
    return Joined(f"{name}:{answer['port']}", authority, answer["certificate"], answer["key"])


def own_addresses() -> list[str]:
    """Lists this machine's IPv4 addresses. The address towards other machines comes first."""
    found: list[str] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # chooses a way; nothing is sent
            found.append(probe.getsockname()[0])
        except OSError:
            pass
    last = ""
    try:
        table = pathlib.Path("/proc/net/fib_trie").read_text()
    except OSError:
        table = ""
    for line in table.splitlines():
        if "|--" in line:
            last = line.split("|-- ")[1].strip()
        elif "/32 host LOCAL" in line and not last.startswith("127.") and last not in found:
            found.append(last)
    return found
