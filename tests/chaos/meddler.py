"""Stands between workers and coordinator, speaks the protocol (proto/farm.proto) with both, and meddles with what they say:
results, leases and acknowledgements come twice, in another order, cut short, or far too large. Needs Debian's python3-grpcio, python3-protobuf and protoc."""

import concurrent.futures
import importlib
import pathlib
import queue
import random
import shutil
import subprocess
import sys
import threading

from weather import Skip

ROOT = pathlib.Path(__file__).resolve().parents[2]
OVERSIZED = 3 << 20  # bytes; a message may have 1 MiB


def load_protocol(folder):
    try:
        importlib.import_module("grpc")
    except ImportError:
        raise Skip("meddling with messages needs python3-grpcio") from None
    if not shutil.which("protoc"):
        raise Skip("meddling with messages needs protobuf-compiler")
    subprocess.run(["protoc", f"--proto_path={ROOT / 'proto'}", f"--python_out={folder}", "farm.proto"], check=True, capture_output=True)
    sys.path.insert(0, str(folder))
    sys.modules.pop("farm_pb2", None)
    try:
        return importlib.import_module("farm_pb2")
    finally:
        sys.path.remove(str(folder))


class Meddler:
    """`chances`: of "doubled", "held" (sent after the next one), "cut", "oversized", for each result; of "to_doubled", "to_held",
    "to_cut", for each lease and acknowledgement that a worker is sent. `most_cut`: results that may be cut short in all, since each
    counts against its worker. `tls`: the folder of what --tls made, of a farm that speaks it: to its workers it passes for the coordinator,
    to the coordinator for a worker."""

    def __init__(self, folder, coordinator, seed, most_cut=2, tls=None, **chances):
        self.grpc, self.protocol = None, load_protocol(folder)
        import grpc
        self.grpc = grpc
        self.dice, self.chances, self.cuts_left = random.Random(seed), chances, most_cut
        self.done = dict.fromkeys(chances, 0)
        self.lock = threading.Lock()
        limits = [("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1)]
        def pem(name):
            return (tls / name).read_bytes()
        self.channel = grpc.secure_channel(coordinator, grpc.ssl_channel_credentials(pem("ca.pem"), pem("worker.key"), pem("worker.pem")), options=limits) \
            if tls else grpc.insecure_channel(coordinator, options=limits)
        same = dict(request_serializer=None, response_deserializer=None)
        self.work = self.channel.stream_stream("/lightshaft.farm.v1.Farm/Work", **same)
        self.fetch = self.channel.unary_stream("/lightshaft.farm.v1.Farm/FetchBlob", **same)
        self.server = grpc.server(concurrent.futures.ThreadPoolExecutor(32), options=limits)
        self.server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("lightshaft.farm.v1.Farm", {
            "Work": grpc.stream_stream_rpc_method_handler(self._work),
            "FetchBlob": grpc.unary_stream_rpc_method_handler(self._fetch)}),))
        self.port = self.server.add_secure_port("127.0.0.1:0", grpc.ssl_server_credentials([(pem("server.key"), pem("server.pem"))], pem("ca.pem"), True)) \
            if tls else self.server.add_insecure_port("127.0.0.1:0")
        self.server.start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.server.stop(0)
        self.channel.close()

    def _chance(self, what):
        with self.lock:
            if what == "cut" and self.cuts_left == 0:
                return False
            hit = what in self.chances and self.dice.random() < self.chances[what]
            if hit:
                self.done[what] += 1
            self.cuts_left -= hit and what == "cut"
            return hit

    def _to_coordinator(self, raw, held):
        """What is sent on instead of this message."""
        message = self.protocol.FromWorker.FromString(raw)
        if message.WhichOneof("message") != "result":
            return [raw]
        out = []
        if self._chance("oversized"):
            large = self.protocol.FromWorker.FromString(raw)
            large.result.exr = bytes(OVERSIZED)
            out.append(large.SerializeToString())
        if self._chance("cut"):
            short = self.protocol.FromWorker.FromString(raw)
            short.result.exr = short.result.exr[:self.dice.randrange(len(short.result.exr))]
            return out + [short.SerializeToString()]
        return out + self._moved(raw, held, "")

    def _to_worker(self, raw, held, acknowledged):
        """`acknowledged`: what has been in this stream. Nothing is cut before: what is left of a lease may read as a shorter one, whose
        other units wait for its deadline, and that is two minutes later before a worker's first result."""
        what = self.protocol.ToWorker.FromString(raw).WhichOneof("message")
        if what not in ("assign", "ack"):
            return [raw]
        if acknowledged and self._chance("to_cut"):
            return [raw[:self.dice.randrange(1, len(raw))]]
        if what == "ack":
            acknowledged.append(raw)
        return self._moved(raw, held, "to_")

    def _moved(self, raw, held, prefix):
        if self._chance(prefix + "held"):
            held.append(raw)
            return []
        out = [raw] * (2 if self._chance(prefix + "doubled") else 1) + held
        held.clear()
        return out

    @staticmethod
    def _relay(messages, meddled):
        """The messages as `meddled(message, held)` has them; what it holds goes when nothing follows."""
        incoming, held, end = queue.Queue(), [], object()

        def listen():
            try:
                for raw in messages:
                    incoming.put(raw)
            except Exception:  # the stream broke: whoever asked for it sees why
                pass
            incoming.put(end)

        threading.Thread(target=listen, daemon=True).start()
        while True:
            try:
                raw = incoming.get(timeout=0.3)
            except queue.Empty:
                yield from held
                held.clear()
                continue
            if raw is end:
                return
            yield from meddled(raw, held)

    def _work(self, requests, context):
        call = self.work(self._relay(requests, self._to_coordinator))
        context.add_callback(call.cancel)
        acknowledged = []
        yield from self._relay(call, lambda raw, held: self._to_worker(raw, held, acknowledged))
        if call.code() != self.grpc.StatusCode.OK:
            context.abort(call.code(), call.details())

    def _fetch(self, request, context):
        try:
            yield from self.fetch(request)
        except self.grpc.RpcError as error:
            context.abort(error.code(), error.details())
