"""The fast attacks of tests/attacks; and that the attacks report a server that does not hold."""

import http.server
import sys
import threading

import pytest
from local_farm import ROOT

sys.path.insert(0, str(ROOT / "tests" / "attacks"))
pytest.importorskip("grpc", reason="python3-grpcio is not installed")
import attack_page  # noqa: E402
import attacks  # noqa: E402
from attack_kit import GROUPS, Record, ask, exchange, sane  # noqa: E402


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, (_, quick, _) in GROUPS.items() if quick])
def test_holds(name):
    ((_, record, seconds),) = attacks.run([name], quick=True)

    assert record.tries or record.faults
    assert not record.failures(), attack_page.told(name, record, seconds)


class Wrong(http.server.BaseHTTPRequestHandler):
    """A server with two faults: it answers every request with a server error, and reads the body of a request as the next request."""

    protocol_version = "HTTP/1.1"

    def do_GET(self):
        self.send_response(500)
        self.send_header("Content-Length", "0")
        self.end_headers()

    do_POST = do_GET

    def log_message(self, *_):
        pass


class Farm:
    def __init__(self, port):
        self.http = port


@pytest.fixture
def wrong():
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Wrong) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield Farm(server.server_port)
        server.shutdown()


def test_a_server_error_is_no_sane_answer(wrong):
    assert not sane(ask(wrong, "GET", "/"))


def test_a_request_within_a_request_is_seen(wrong):
    answers, _, closed = exchange(wrong.http, b"POST / HTTP/1.1\r\nHost: x\r\nContent-Length: 31\r\n\r\nGET / HTTP/1.1\r\nHost: smuggled\r\n\r\n")

    assert closed and [a.status for a in answers] == [500, 500]


def test_a_server_that_does_not_answer_is_no_sane_answer():
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Wrong) as server:  # accepts by its backlog, and serves nobody
        assert not sane(ask(Farm(server.server_port), "GET", "/", patience=0.2))


def test_what_does_not_hold_is_told_and_makes_the_program_fail(monkeypatch, capsys):
    def breaks(record, folder):
        record.row = "what was tried"
        record.attempt("held", True)
        record.attempt("not held", False, "why")
        raise OSError("the farm is gone")

    monkeypatch.setitem(GROUPS, "broken", (breaks, False, False))
    monkeypatch.setattr(sys, "argv", ["attacks.py", "--group", "broken"])

    assert attacks.main() == 1
    said = capsys.readouterr().out
    assert "1 of 3 tries held" in said and "not held: why" in said and "the farm is gone" in said


def test_the_page_counts_what_held_and_names_what_did_not():
    record = Record()
    record.row = "what was tried"
    record.attempt("held", True)
    record.attempt("a|b", False, "why")
    record.fault("F1", "attack", "for ever", "1 s", False)

    page = attack_page.page([("group", record, 1)], "c" * 8, 1, (0, 0, 0))

    assert "| group | what was tried | 2 | 1 |" in page and "- group, what was tried: a\\|b: why" in page
    assert "| F1 | attack | for ever | 1 s **did not hold** |" in page
