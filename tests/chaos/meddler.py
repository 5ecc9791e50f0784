"""Stands between workers and coordinator, speaks the protocol (proto/farm.proto) with both, and meddles with what workers say:
results come twice, in another order, cut short, or far too large. Needs Debian's python3-grpcio, python3-protobuf and protoc."""

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
    """`chances`: of "doubled", "held" (sent after the next one), "cut", "oversized", for each result. `most_cut`: results that may be
    cut short in all, since each counts against its worker."""

    def __init__(self, folder, coordinator, seed, most_cut=2, **chances):
        self.grpc, self.protocol = None, load_protocol(folder)
        import grpc
        self.grpc = grpc
        self.dice, self.chances, self.cuts_left = random.Random(seed), chances, most_cut
        self.done = dict.fromkeys(("doubled", "held", "cut", "oversized"), 0)
        self.lock = threading.Lock()
        limits = [("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1)]
        self.channel = grpc.insecure_channel(coordinator, options=limits)
        same = dict(request_serializer=None, response_deserializer=None)
        self.work = self.channel.stream_stream("/lightshaft.farm.v1.Farm/Work", **same)
        self.fetch = self.channel.unary_stream("/lightshaft.farm.v1.Farm/FetchBlob", **same)
        self.server = grpc.server(concurrent.futures.ThreadPoolExecutor(32), options=limits)
        self.server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("lightshaft.farm.v1.Farm", {
            "Work": grpc.stream_stream_rpc_method_handler(self._work),
            "FetchBlob": grpc.unary_stream_rpc_method_handler(self._fetch)}),))
        self.port = self.server.add_insecure_port("127.0.0.1:0")
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
            hit = self.dice.random() < self.chances.get(what, 0)
            self.done[what] += hit
            self.cuts_left -= hit and what == "cut"
            return hit

    def _meddled(self, raw, held):
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
            out.append(short.SerializeToString())
        elif self._chance("held"):
            held.append(raw)
        else:
            out += [raw] * (2 if self._chance("doubled") else 1)
            out += held
            held.clear()
        return out

    def _work(self, requests, context):
        outgoing, held, end = queue.Queue(), [], object()

        def listen():
            try:
                for raw in requests:
                    for sent in self._meddled(raw, held):
                        outgoing.put(sent)
            except Exception:  # the worker's stream broke
                pass
            outgoing.put(end)

        def sent():
            while True:
                try:
                    message = outgoing.get(timeout=0.3)
                except queue.Empty:  # nothing follows: what was held goes now
                    yield from held
                    held.clear()
                    continue
                if message is end:
                    return
                yield message

        call = self.work(sent())
        context.add_callback(call.cancel)
        threading.Thread(target=listen, daemon=True).start()
        try:
            yield from call
        except self.grpc.RpcError as error:
            context.abort(error.code(), error.details())

    def _fetch(self, request, context):
        try:
            yield from self.fetch(request)
        except self.grpc.RpcError as error:
            context.abort(error.code(), error.details())
