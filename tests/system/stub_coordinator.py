"""An HTTP server that answers the command as a test tells it to: what a broken or hostile farm would say."""

import json
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


class StubCoordinator:
    """`answers`: (method, path) -> [(status, body), ...], given one after the other, the last one for ever. A body is
    JSON, bytes, or a function of the request's body."""

    def __init__(self):
        self.answers = {}
        self.requests = []
        self.clock_lead = 0  # seconds by which the header Date is ahead of this machine's clock
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}"

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *error):
        self._server.shutdown()
        self._server.server_close()

    def times(self, method, path):
        return self.requests.count((method, path))

    def _answer(self, method, path, body):
        self.requests.append((method, path))
        exact = self.answers.get((method, path)) or self.answers.get((method, path.rsplit("/", 1)[0] + "/*"))
        if not exact:
            return 404, {"detail": f"nothing at {path}"}
        status, answer = exact.pop(0) if len(exact) > 1 else exact[0]
        return status, answer(body) if callable(answer) else answer


def _handler(stub):
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def date_time_string(self, timestamp=None):
            return super().date_time_string((time.time() if timestamp is None else timestamp) + stub.clock_lead)

        def log_message(self, *args):
            pass

        def _dispatch(self):
            body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
            status, answer = stub._answer(self.command, self.path, body)
            data = answer if isinstance(answer, bytes) else json.dumps(answer).encode()
            self.send_response(status)
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        do_GET = do_POST = do_PUT = do_PATCH = _dispatch

    return Handler
