"""A receiver of webhooks of a test's own."""

import hashlib
import hmac
import http.server
import queue
import threading

from local_farm import PATIENCE


class Receiver(http.server.ThreadingHTTPServer):
    """Takes POSTs; answers with the statuses it is given, then 200."""

    def __init__(self, statuses=()):
        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                status = self.server.statuses.pop(0) if self.server.statuses else 200
                self.send_response(status)
                if status == 302:
                    self.send_header("Location", f"http://127.0.0.1:{self.server.server_port}/elsewhere")
                self.send_header("Content-Length", "0")
                self.end_headers()
                self.server.came.put((self.path, dict(self.headers), body, status))

            def log_message(self, *arguments):
                pass

        super().__init__(("127.0.0.1", 0), Handler)
        self.statuses, self.came = list(statuses), queue.Queue()
        self.url = f"http://127.0.0.1:{self.server_port}/hook"
        threading.Thread(target=self.serve_forever, daemon=True).start()

    def __exit__(self, *error):
        self.shutdown()
        super().__exit__(*error)

    def next(self):
        return self.came.get(timeout=PATIENCE)

    def until(self, event):
        """All that comes, up to the first delivery of this event that was taken."""
        seen = [self.next()]
        while seen[-1][1]["Lightshaft-Event"] != event or seen[-1][3] != 200:
            seen.append(self.next())
        return seen


def signed_by(secret, headers, body):
    fields = dict(part.split("=", 1) for part in headers["Lightshaft-Signature"].split(","))
    return hmac.compare_digest(hmac.new(secret.encode(), fields["t"].encode() + b"." + body, hashlib.sha256).hexdigest(), fields["v1"])


def signature_is_right(farm, headers, body):
    return signed_by((farm.data / "webhook-secret").read_text().strip(), headers, body)
