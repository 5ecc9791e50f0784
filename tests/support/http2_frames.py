"""HTTP/2 frames written by hand (RFC 9113), for clients that do what no gRPC library would do."""

import socket
import struct

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, SETTINGS, CONTINUATION = 0, 1, 4, 9
END_HEADERS = 4
WORK = "/lightshaft.farm.v1.Farm/Work"


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + bytes([kind, flags]) + struct.pack(">I", stream) + payload


def literal(name, value):
    """A header field that is not indexed, without Huffman coding (RFC 7541, section 6.2.2); texts shorter than 127 bytes."""
    name, value = name.encode(), value.encode()
    return b"\x00" + bytes([len(name)]) + name + bytes([len(value)]) + value


def begin_call(stream, path=WORK):
    fields = [(":method", "POST"), (":scheme", "http"), (":path", path), (":authority", "farm"), ("te", "trailers"), ("content-type", "application/grpc")]
    return frame(HEADERS, END_HEADERS, stream, b"".join(literal(*field) for field in fields))


def connect(port, source="127.0.0.1", patience=60):
    """A connection to 127.0.0.1 from this address of this machine, with the beginning of HTTP/2 sent."""
    connection = socket.create_connection(("127.0.0.1", port), timeout=patience, source_address=(source, 0))
    connection.sendall(PREFACE + frame(SETTINGS, 0, 0))
    return connection


def closed_by_peer(connection):
    """Waits until the other side closes; False if it does not within the connection's timeout."""
    try:
        while connection.recv(65536):
            pass
    except ConnectionError:
        pass
    except TimeoutError:
        return False
    return True
