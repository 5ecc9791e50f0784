"""What tev does with its TCP protocol: keeps the images that a client creates and updates. Fields as tev's src/Ipc.cpp reads them."""

import socket
import struct
import threading

CREATE, UPDATE = 4, 6


class _Fields:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, form):
        values = struct.unpack_from("<" + form, self.data, self.at)
        self.at += struct.calcsize("<" + form)
        return values

    def text(self):
        end = self.data.index(0, self.at)
        text, self.at = self.data[self.at:end].decode(), end + 1
        return text


class StubTev:
    """`images`: {name: {channel: {(x, y): value}}}; `created`: [(name, (width, height), channels)] in their order."""

    def __init__(self):
        self.images, self.created, self.trouble = {}, [], None
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *error):
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def _serve(self):
        try:
            while True:
                client, _ = self._listener.accept()
                with client, client.makefile("rb") as stream:
                    while length := stream.read(4):
                        size, = struct.unpack("<I", length)
                        self._take(_Fields(stream.read(size - 4)))
        except OSError:
            pass  # the listener is closed
        except Exception as error:
            self.trouble = error
            raise

    def _take(self, fields):
        kind, _ = fields.take("BB")
        name = fields.text()
        if kind == CREATE:
            size = fields.take("2i")
            channels = [fields.text() for _ in range(fields.take("i")[0])]
            self.images[name] = {channel: {} for channel in channels}
            self.created.append((name, size, channels))
        else:
            assert kind == UPDATE
            channels = [fields.text() for _ in range(fields.take("i")[0])]
            x, y, width, height = fields.take("4i")
            offsets, strides = fields.take(f"{len(channels)}q"), fields.take(f"{len(channels)}q")
            values = memoryview(fields.data)[fields.at:].cast("f")
            for channel, offset, stride in zip(channels, offsets, strides):
                into = self.images[name][channel]
                for i in range(width * height):
                    into[x + i % width, y + i // width] = values[offset + i * stride]
            fields.at += 4 * len(values)
        assert fields.at == len(fields.data), "a packet ends with its last field"
