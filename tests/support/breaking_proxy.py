"""A TCP proxy of the loopback whose connections break, as those over a bad line do: reset in the middle of a request."""

import socket
import struct
import threading

RESET_ON_CLOSE = struct.pack("ii", 1, 0)


class BreakingProxy:
    """Connection number k (from 0) is reset after breaks[k] bytes from the client; later ones live."""

    def __init__(self, port, breaks=()):
        self.target, self.breaks = port, list(breaks)
        self.sent = []  # bytes received from the client, for each connection
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.listener.close()

    @property
    def url(self):
        return f"http://127.0.0.1:{self.port}"

    def _accept(self):
        while True:
            try:
                client, _ = self.listener.accept()
            except OSError:
                return
            number = len(self.sent)
            self.sent.append(0)
            server = socket.create_connection(("127.0.0.1", self.target))
            limit = self.breaks[number] if number < len(self.breaks) else None
            threading.Thread(target=self._forward, args=(client, server, number, limit), daemon=True).start()
            threading.Thread(target=self._back, args=(server, client), daemon=True).start()

    def _forward(self, client, server, number, limit):
        try:
            while data := client.recv(16384):
                if limit is not None and self.sent[number] + len(data) >= limit:
                    server.sendall(data[: limit - self.sent[number]])
                    self.sent[number] = limit
                    break
                server.sendall(data)
                self.sent[number] += len(data)
        except OSError:
            pass
        try:
            server.shutdown(socket.SHUT_WR)  # the server receives the bytes that were on the way, and no more
        except OSError:
            pass
        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET_ON_CLOSE)
        try:
            client.shutdown(socket.SHUT_RD)
        except OSError:
            pass
        client.close()

    @staticmethod
    def _back(server, client):
        try:
            while data := server.recv(65536):
                client.sendall(data)
        except OSError:
            pass
        try:
            client.shutdown(socket.SHUT_WR)
        except OSError:
            pass
