"""The farm's RPCs without generated code: messages are written field by field as proto/farm.proto numbers them."""

import hashlib

import grpc

SERVICE = "/lightshaft.farm.v1.Farm/"
PROTOCOL = 1
PATIENCE = 20  # seconds


def varint(value):
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def number(field, value):
    return varint(field << 3) + varint(value)


def text(field, value):
    data = value if isinstance(value, bytes) else value.encode()
    return varint(field << 3 | 2) + varint(len(data)) + data


def hello(token):
    fields = (number(1, PROTOCOL) + text(2, "stranger") + text(3, "test") + text(4, hashlib.sha256(b"class").digest()) +
              number(5, 1) + number(6, 1 << 30) + text(9, token))
    return text(1, fields)  # FromWorker.hello


def first_field(message):
    return message[0] >> 3 if message else 0


def channel_of(port):
    return grpc.insecure_channel(f"127.0.0.1:{port}")


def work(channel, token):
    """OK when the coordinator welcomed a worker with this token, else the status that it ended the stream with."""
    call = channel.stream_stream(SERVICE + "Work")(iter([hello(token)]), timeout=PATIENCE)
    answers = []
    try:
        answers = list(call)
    except grpc.RpcError:
        pass
    welcomed = any(first_field(a) == 1 for a in answers)  # ToWorker.welcome
    return "OK" if welcomed else call.code().name


def fetch_blob(channel, token, digest):
    """(status, bytes of the chunks' messages)"""
    call = channel.unary_stream(SERVICE + "FetchBlob")(text(1, bytes.fromhex(digest)) + text(3, token), timeout=PATIENCE)
    got = 0
    try:
        for chunk in call:
            got += len(chunk)
    except grpc.RpcError:
        pass
    return call.code().name, got
