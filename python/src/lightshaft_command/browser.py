"""Opens the dashboard in a browser."""

import http.server
import os
import secrets
import subprocess
import sys
import threading
import webbrowser

from lightshaft_command.children import start

PATIENCE = 60.0  # seconds within which the browser must have asked


def open_address(address: str) -> str:
    """Opens the address, which holds a token; says why not, or "".

    Every user of this machine can read the arguments of programs. So the browser is started with the address of a page that
    leads to the true one, and that answers once.
    """
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "there is no display"
    try:
        webbrowser.get()
    except webbrowser.Error:
        return "no browser is found"
    path = "/" + secrets.token_urlsafe(16)
    used = threading.Event()

    class Once(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            known = self.path == path and not used.is_set()
            if known:
                used.set()
            self.send_response(302 if known else 404)
            if known:
                self.send_header("Location", address)
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            """Says nothing: the terminal is the farm's."""

    server = http.server.HTTPServer(("127.0.0.1", 0), Once)
    threading.Thread(target=server.serve_forever, daemon=True).start()

    def close() -> None:
        used.wait(PATIENCE)
        server.shutdown()
        server.server_close()

    threading.Thread(target=close, daemon=True).start()
    start([sys.executable, "-m", "webbrowser", f"http://127.0.0.1:{server.server_port}{path}"], subprocess.DEVNULL)
    return ""
