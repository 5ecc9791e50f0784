"""A worker that sends arbitrary messages of proto/farm.proto."""

import contextlib
import pathlib
import queue
import tempfile
import threading

import grpc
from meddler import load_protocol

_folder = tempfile.TemporaryDirectory(prefix="lightshaft-protocol-")
pb = load_protocol(pathlib.Path(_folder.name))
PATIENCE = 20  # seconds
MESSAGES = [("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1)]


class ForgedWorker:
    """Joins with `hello`'s fields beside the usual ones. What the coordinator says comes into `heard`, None at the end of the stream."""

    def __init__(self, farm, first=None, token=None, channel=None, **hello):
        self.own_channel = channel is None
        # a connection of its own: gRPC would give channels of one address the same one
        self.channel = channel or grpc.insecure_channel(f"127.0.0.1:{farm.grpc}", options=[*MESSAGES, ("grpc.use_local_subchannel_pool", 1)])
        self.to_send, self.heard = queue.Queue(), queue.Queue()
        fields = dict(protocol=1, name="forged", build="0.3.0", numeric_class=b"\7" * 32, threads=1, memory_bytes=1 << 30, join_token=farm.join_token if token is None else token, fake=True, platform="fake")
        self.to_send.put(first if first is not None else pb.FromWorker(hello=pb.Hello(**{**fields, **hello})).SerializeToString())
        self.call = self.channel.stream_stream("/lightshaft.farm.v1.Farm/Work")(iter(self.to_send.get, None))
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self):
        with contextlib.suppress(grpc.RpcError):
            for raw in self.call:
                self.heard.put(pb.ToWorker.FromString(raw))
        self.heard.put(None)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.to_send.put(None)
        self.call.cancel()
        if self.own_channel:
            self.channel.close()

    def send(self, raw=None, **message):
        self.to_send.put(raw if raw is not None else pb.FromWorker(**message).SerializeToString())

    def hears(self, what, patience=PATIENCE):
        """The next message of this kind; None if the stream ended before, or nothing came."""
        while True:
            try:
                message = self.heard.get(timeout=patience)
            except queue.Empty:
                return None
            if message is None:
                self.heard.put(None)
                return None
            if message.WhichOneof("message") == what:
                return getattr(message, what)

    def welcome(self):
        return self.hears("welcome")

    def ended(self, patience=PATIENCE):
        """The status by which the coordinator ended the stream; "" while it goes on."""
        while True:
            try:
                if self.heard.get(timeout=patience) is None:
                    self.heard.put(None)
                    return self.call.code().name
            except queue.Empty:
                return ""


def fetch(farm, patience=PATIENCE, **request):
    """(status, bytes) of FetchBlob."""
    with grpc.insecure_channel(f"127.0.0.1:{farm.grpc}") as channel:
        call = channel.unary_stream("/lightshaft.farm.v1.Farm/FetchBlob")(pb.FetchBlobRequest(**{"join_token": farm.join_token, **request}).SerializeToString(), timeout=patience)
        got = 0
        with contextlib.suppress(grpc.RpcError):
            for chunk in call:
                got += len(chunk)
        return call.code().name, got
