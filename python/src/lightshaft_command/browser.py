"""Opens the dashboard in a browser."""

import http.server
import os
import secrets
import subprocess
import sys
import threading
import webbrowser

from lightshaft_command.children import start
from lightshaft_command.connections import user_of

PATIENCE = 60.0  # seconds within which the browser must have asked
SILENCE = 10.0  # seconds after which a connection that says nothing is closed


class _Server(http.server.ThreadingHTTPServer):
    """Answers only this user, because others can read the page's address among the arguments of the browser."""

    daemon_threads = True

    def verify_request(self, request: object, client_address: tuple[str, int]) -> bool:
        return user_of(client_address, ("127.0.0.1", self.server_port)) == os.getuid()


def open_address(address: str) -> str:
    """Opens an address that contains a token. Returns why it could not, or "".

    Every user of this machine can read the arguments of programs. So the browser gets the address of a page that
    redirects to the real one, once, and only for this user.
    """
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "there is no display"
    try:
        webbrowser.get()
    except webbrowser.Error:
        return "no browser was found"
    path = "/" + secrets.token_urlsafe(16)
    used = threading.Event()

    class Once(http.server.BaseHTTPRequestHandler):
        timeout = SILENCE

        def do_GET(self) -> None:
            known = self.path == path and not used.is_set()
            if known:
                used.set()
            self.send_response(302 if known else 404)
            if known:
                self.send_header("Location", address)
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            """Prints nothing, because the terminal shows the farm's messages."""

    server = _Server(("127.0.0.1", 0), Once)
    threading.Thread(target=server.serve_forever, daemon=True).start()

    def close() -> None:
        used.wait(PATIENCE)
        server.shutdown()
        server.server_close()

    threading.Thread(target=close, daemon=True).start()
    # Isolated: with -m alone it would run files of the current folder.
    start([sys.executable, "-I", "-m", "webbrowser", f"http://127.0.0.1:{server.server_port}{path}"], subprocess.DEVNULL)
    return ""
