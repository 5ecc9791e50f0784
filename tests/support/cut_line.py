"""A TCP line of the loopback that can be cut and mended: silently, as by a network that loses every packet (what was sent arrives when
it is mended), or loudly (connections are reset, new ones are ended at once)."""

import socket
import threading

from breaking_proxy import RESET_ON_CLOSE


class CutLine:
    def __init__(self, port):
        self.target, self.whole, self.loud, self.ends = port, threading.Event(), False, set()
        self.whole.set()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.listener.close()
        self.mend()

    def cut(self, loud=False):
        self.loud = loud
        self.whole.clear()
        if loud:
            for end in list(self.ends):
                self._reset(end)

    def mend(self):
        self.loud = False
        self.whole.set()

    def _accept(self):
        while True:
            try:
                near, _ = self.listener.accept()
                if self.loud:
                    self._reset(near)
                    continue
                far = socket.create_connection(("127.0.0.1", self.target))
            except OSError:
                if self.listener.fileno() < 0:
                    return
                near.close()  # the other end is unreachable
                continue
            self.ends |= {near, far}
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self._carry, args=(source, sink), daemon=True).start()

    def _carry(self, source, sink):
        try:
            while data := source.recv(65536):
                self.whole.wait()
                sink.sendall(data)
        except OSError:
            pass
        for end in (source, sink):
            self._reset(end)

    def _reset(self, end):
        self.ends.discard(end)
        try:
            end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET_ON_CLOSE)
            end.shutdown(socket.SHUT_RDWR)  # wakes the thread that reads it
        except OSError:
            pass
        end.close()
