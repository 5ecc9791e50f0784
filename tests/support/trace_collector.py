"""A collector of traces on this machine: takes OTLP over HTTP in JSON, checks its form and keeps the spans."""

import dataclasses
import http.server
import json
import re
import threading


@dataclasses.dataclass(frozen=True)
class Span:
    name: str
    trace: str
    id: str
    parent: str  # empty: the first of its trace
    start: int  # ns since 1970
    end: int
    service: str
    attributes: tuple
    events: tuple
    failed: bool

    def attribute(self, key):
        return dict(self.attributes)[key]


def value_of(value):
    (kind, content), = value.items()
    return int(content) if kind == "intValue" else content


def read_spans(body):
    """The spans of an ExportTraceServiceRequest; an error if its form is not that of the specification."""
    spans = []
    for of_program in json.loads(body)["resourceSpans"]:
        resource = {a["key"]: value_of(a["value"]) for a in of_program["resource"]["attributes"]}
        for scope in of_program["scopeSpans"]:
            for s in scope["spans"]:
                assert re.fullmatch("[0-9a-f]{32}", s["traceId"]) and re.fullmatch("[0-9a-f]{16}", s["spanId"]), s
                assert isinstance(s["startTimeUnixNano"], str) and s["kind"] in (1, 3), s
                spans.append(Span(
                    s["name"], s["traceId"], s["spanId"], s.get("parentSpanId", ""), int(s["startTimeUnixNano"]),
                    int(s["endTimeUnixNano"]), resource["service.name"],
                    tuple((a["key"], value_of(a["value"])) for a in s["attributes"]),
                    tuple(e["name"] for e in s.get("events", [])), s.get("status", {}).get("code") == 2))
    return spans


class TraceCollector(http.server.ThreadingHTTPServer):
    """`answer`: (status, body) for every request; "hang": none until the end."""

    def __init__(self, answer=(200, b"{}")):
        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                self.server.take(self)

            def log_message(self, *arguments):
                pass

        super().__init__(("127.0.0.1", 0), Handler)
        self.answer, self.lock, self.over = answer, threading.Lock(), threading.Event()
        self.requests, self.broken, self._spans = [], [], []
        self.environment = {"OTEL_EXPORTER_OTLP_ENDPOINT": f"http://127.0.0.1:{self.server_port}",
                            "OTEL_EXPORTER_OTLP_HEADERS": "x-key=the%20key"}
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def take(self, request):
        body = request.rfile.read(int(request.headers["Content-Length"]))
        with self.lock:
            self.requests.append((request.path, dict(request.headers), body))
            try:
                self._spans += read_spans(body)
            except Exception as error:  # told by spans(), in the test's own thread
                self.broken.append(f"{error!r}: {body[:2000]}")
        if self.answer == "hang":
            self.over.wait()
            return
        status, text = self.answer
        request.send_response(status)
        request.send_header("Content-Length", str(len(text)))
        request.end_headers()
        request.wfile.write(text)

    def spans(self, name=None):
        with self.lock:
            assert not self.broken, self.broken
            return [s for s in self._spans if name in (None, s.name)]

    def __exit__(self, *error):
        self.over.set()
        self.shutdown()
        super().__exit__(*error)
