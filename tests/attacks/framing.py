"""Requests whose framing is ambiguous: each is refused, or read as one request."""

from attack_kit import LocalFarm, UNLIMITED, exchange, group, still_serves

# Where every reading that RFC 9112 allows ends the first request before the second one begins, the second one may be read: a length of
# zero (also as a list of equal ones, 6.3), a field that says nothing of the length, and one that is folded into the field before (5.2).
ENDS_BEFORE = {"Content-Length: '00'", "Content-Length: ''", "Content-Length: '0,0'", "name 'Content_Length'", "name ' Content-Length'", "Transfer-Encoding: 'CHUNKED'",
               "Transfer-Encoding: ' chunked'", "Transfer-Encoding: '\\tchunked'", "chunk of size '0;a=b'", "trailers that set a length", "a thousand trailers"}
MADE = '{"role": "read", "user": "smuggled"}'


def smuggled(token):
    """A request that leaves a trace if it is ever read as one."""
    return f"POST /api/v1/tokens HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {token}\r\nContent-Type: application/json\r\nContent-Length: {len(MADE)}\r\n\r\n{MADE}"


def request(*fields, body="", line="POST /api/v1/session HTTP/1.1", host=True):
    return ("\r\n".join([line, *(["Host: x"] if host else []), *fields]) + "\r\n\r\n" + body).encode("latin-1")


def ambiguous(token):
    """(label, bytes): after each, a second request lies where one of two readings has it."""
    inner = smuggled(token)
    n = len(inner)
    chunked = "Transfer-Encoding: chunked"
    yield "CL and TE", request(f"Content-Length: {n + 5}", chunked, body="0\r\n\r\n" + inner)
    yield "TE and CL", request(chunked, "Content-Length: 5", body="0\r\n\r\n" + inner)
    for a, b in ((0, n), (n, 0), (n, n), (2, n)):
        yield f"Content-Length {a} and {b}", request(f"Content-Length: {a}", f"Content-Length: {b}", body=inner)
    for odd in ("+0", "-0", "-1", "0x0", "0 0", "0,0", f"0, {n}", "0;", "1e0", "٠".encode().decode("latin-1"), "", "99999999999999999999", "18446744073709551616", "00"):
        yield f"Content-Length: {odd!r}", request(f"Content-Length: {odd}", body=inner)
    for name in ("Content-Length ", " Content-Length", "Content_Length", "Content-Length\t", "Content-Length\0"):
        yield f"name {name!r}", request(f"{name}: {n}", body=inner)
    for odd in ("xchunked", "chunked, identity", "identity, chunked", "chunked, chunked", "gzip, chunked", "chunked;q=1", " chunked", "\tchunked", "\x0bchunked",
                "CHUNKED", "chun\0ked", "identity", "", "deflate", "chunked,"):
        yield f"Transfer-Encoding: {odd!r}", request(f"Transfer-Encoding: {odd}", body="0\r\n\r\n" + inner)
    for name in ("Transfer-Encoding ", "Transfer_Encoding", "Transfer-\r\n Encoding"):
        yield f"name {name!r}", request(f"{name}: chunked", f"Content-Length: {n + 5}", body="0\r\n\r\n" + inner)
    yield "two Transfer-Encodings", request(chunked, "Transfer-Encoding: identity", body="0\r\n\r\n" + inner)
    yield "TE in HTTP/1.0", request(chunked, line="POST /api/v1/session HTTP/1.0", body="0\r\n\r\n" + inner)
    for size in ("0x0", "-0", "+0", " 0", "0 ", "0;a=b", "0;" + "a" * 20000, "FFFFFFFFFFFFFFFF1", "ffffffffffffffff", "10000000000000000", "8000000000000000", "", "g", "0\n"):
        yield f"chunk of size {size[:20]!r}", request(chunked, body=f"{size}\r\n\r\n{inner}")
    yield "chunk longer than it says", request(chunked, body="1\r\nabc\r\n0\r\n\r\n" + inner)
    yield "chunk without its end of line", request(chunked, body="1\r\na0\r\n\r\n" + inner)
    yield "chunk ends by a bare line feed", request(chunked, body="1\na\n0\n\n" + inner)
    yield "trailers that set a length", request(chunked, body=f"0\r\nContent-Length: {n}\r\nHost: y\r\n\r\n" + inner)
    yield "a thousand trailers", request(chunked, body="0\r\n" + "A: b\r\n" * 1000 + "\r\n" + inner)
    yield "a folded field", request("X: a", " b", f"Content-Length: {n}", body=inner)
    yield "a folded length", request("Content-Length:", f" {n}", body=inner)
    yield "bare line feeds", ("POST /api/v1/session HTTP/1.1\nHost: x\nContent-Length: 0\n\n" + inner).encode()
    yield "bare carriage returns", ("POST /api/v1/session HTTP/1.1\rHost: x\rContent-Length: 0\r\r" + inner).encode()
    yield "a carriage return in a field", request(f"X: a\rContent-Length: {n}", body=inner)
    yield "a field injected by a line feed", request(f"X: a\nContent-Length: {n}", body=inner)
    yield "a GET with a body", request(f"Content-Length: {n}", line="GET /healthz HTTP/1.1", body=inner)
    yield "Expect: 100-continue", request("Expect: 100-continue", f"Content-Length: {n}", body=inner)
    yield "Expect of something else", request("Expect: 200-ok", f"Content-Length: {n}", body=inner)
    yield "an upgrade to h2c", request("Upgrade: h2c", "Connection: Upgrade, HTTP2-Settings", "HTTP2-Settings: AAMAAABkAAQAAP__", f"Content-Length: {n}", body=inner)
    yield "an upgrade to websocket", request("Upgrade: websocket", "Connection: Upgrade", f"Content-Length: {n}", body=inner)


def alone():
    """(label, bytes): requests of which each is answered once at most."""
    for line in ("GET http://elsewhere/api/v1/jobs HTTP/1.1", "GET //elsewhere/api/v1/jobs HTTP/1.1", "GET *  HTTP/1.1", "OPTIONS * HTTP/1.1", "CONNECT elsewhere:80 HTTP/1.1",
                 "TRACE / HTTP/1.1", "GET / HTTP/0.9", "GET / HTTP/1.2", "GET / HTTP/2.0", "GET / HTTP/11", "GET / http/1.1", "GET  / HTTP/1.1", "GET /", "G\0T / HTTP/1.1",
                 "GET /\0 HTTP/1.1", "GET /\x7f HTTP/1.1", "GET /é HTTP/1.1", "get / HTTP/1.1", "GET / HTTP/1.1 x", "GET /%00 HTTP/1.1", "GET /%zz HTTP/1.1", "GET /% HTTP/1.1",
                 "PROPFIND / HTTP/1.1", "A" * 5000 + " / HTTP/1.1", "GET /" + "a" * 15000 + " HTTP/1.1", "GET /" + "a" * 70000 + " HTTP/1.1", "GET /?" + "a=b&" * 3000 + " HTTP/1.1"):
        yield line[:40], request(line=line)
    yield "no Host", request(line="GET /healthz HTTP/1.1", host=False)
    yield "two Hosts", request("Host: y", line="GET /healthz HTTP/1.1")
    yield "an odd Host", request("Host: a b/c@d", line="GET /healthz HTTP/1.1", host=False)
    yield "3,000 fields", request(*["A: b"] * 3000, line="GET /healthz HTTP/1.1")
    yield "a field of 60 KB", request("A: " + "b" * 60000, line="GET /healthz HTTP/1.1")
    yield "a field without a colon", request("nothing", line="GET /healthz HTTP/1.1")
    yield "a field without a name", request(": nothing", line="GET /healthz HTTP/1.1")
    yield "a NUL in a field", request("A: b\0c", line="GET /healthz HTTP/1.1")
    yield "UTF-8 in a field", request("A: é", line="GET /healthz HTTP/1.1")
    yield "HTTP/2's preface", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\4\0\0\0\0\0"
    yield "TLS to a plain port", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(300)
    yield "an empty line first", b"\r\n\r\n" + request(line="GET /healthz HTTP/1.1")
    yield "nothing", b""
    yield "half a request", b"GET /healthz HT"
    yield "zeros", bytes(4096)
    yield "a Range of a page", request("Range: bytes=0-0,1-1,2-2", line="GET / HTTP/1.1")


@group("HTTP framing", quick=True)
def framing(record, folder):
    with LocalFarm(folder, flags=UNLIMITED) as farm:
        def has_smuggled():
            return any(t.get("user") == "smuggled" for t in farm.get("/api/v1/tokens")["tokens"])

        record.row = "a second request hidden in the body or the fields of a first one"
        for label, data in ambiguous(farm.token):
            answers, rest, closed = exchange(farm.http, data)
            read = has_smuggled()
            fair = read and len(answers) == 2 and answers[1].status == 201 and label in ENDS_BEFORE
            record.attempt(label, closed and not rest and all(a.status < 500 or a.status == 501 for a in answers) and (fair or not read),
                           f"{[a.status for a in answers]}, closed {closed}, second one read {read}, rest {rest[:60]}")
            if read:
                for token in [t["id"] for t in farm.get("/api/v1/tokens")["tokens"] if t.get("user") == "smuggled"]:
                    farm.request("DELETE", f"/api/v1/tokens/{token}")

        record.row = "odd requests: methods, versions, targets, sizes, bytes"
        for label, data in alone():
            answers, rest, closed = exchange(farm.http, data)
            record.attempt(label, closed and not rest and len(answers) <= 1 and all(a.status < 500 or a.status in (501, 505) for a in answers),
                           f"{[a.status for a in answers]}, closed {closed}, rest {rest[:60]}")

        record.row = "requests one after another on one connection"
        two = request("Connection: keep-alive", line="GET /healthz HTTP/1.1") * 50
        answers, rest, closed = exchange(farm.http, two)
        record.attempt("fifty at once are answered in their order", [a.status for a in answers] == [200] * 50 and not rest, f"{len(answers)} answers, rest {rest[:60]}")
        answers, rest, closed = exchange(farm.http, request("Content-Length: x") + smuggled(farm.token).encode())
        record.attempt("an error ends the connection", len(answers) == 1 and answers[0].status == 400 and not has_smuggled(), [a.status for a in answers])
        still_serves(record, farm, farm.token)
