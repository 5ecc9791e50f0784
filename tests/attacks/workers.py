"""Workers with a right join token that send forged messages: these are refused, or have no effect on jobs, users and other workers."""

import hashlib
import json
import math
import os
import threading
import time

from attack_kit import Bystander, LocalFarm, TINY, UNLIMITED, ask, group, still_serves, submit
from forged_worker import ForgedWorker, fetch, pb
from local_farm import wait_until
from meddler import Meddler

DATED = "it failed\n2026-11-28T00:00:00Z cancelled by the administrator\x9b31m\u202e"
JOB = dict(spp=16, size="96x64", seed=5)  # 6 tiles of 4 rounds


class Listener(Meddler):
    """Passes all on, and keeps the results."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.results = []

    def _to_coordinator(self, raw, held):
        message = self.protocol.FromWorker.FromString(raw)
        if message.WhichOneof("message") == "result":
            self.results.append(message.result)
        return [raw]


def honest(farm, name="honest", **options):
    return farm.add_worker(name=name, **options)


def state_of(farm, name):
    return [w["state"] for w in farm.get("/api/v1/workers")["workers"] if w["name"] == name]


def hellos(farm, other):
    """(label, fields, whether such a worker may join)"""
    for protocol in (0, 2, -1, 2 ** 31 - 1):
        yield f"protocol {protocol}", dict(protocol=protocol), False
    for label, name in (("empty", ""), ("129 bytes", "n" * 129), ("100 KB", "n" * 100_000)):
        yield f"a name that is {label}", dict(name=name), None
    for size in (0, 31, 33, 10_000):
        yield f"a class of {size} bytes", dict(numeric_class=b"c" * size), False
    for threads in (0, -1, 4097, 2 ** 31 - 1):
        yield f"{threads} threads", dict(threads=threads), False
    yield "memory 2^64 - 1", dict(memory_bytes=2 ** 64 - 1), None
    yield "65 tags", dict(tags=[f"t{i}" for i in range(65)]), False
    yield "a tag of 10 KB", dict(tags=["t" * 10_000]), None
    yield "8,193 blobs", dict(blobs_held=[bytes(32)] * 8193), False
    yield "blobs of other lengths", dict(blobs_held=[b"", b"x", bytes(33)]), False
    yield "the id of another, no secret", dict(previous_id=other), None
    for secret in ("", "x", "0" * 64, "0" * 5000):
        yield f"the id of another, secret {secret[:5]!r}", dict(previous_id=other, secret=secret), None
    for previous in ("w-0", "../../x", "w" * 5000, "\n", "w-1-0-00000000"):
        yield f"an old id {previous[:10]!r}", dict(previous_id=previous, secret="x"), None
    yield "briefs of 2^64 - 1 bytes", dict(brief_bytes=2 ** 64 - 1), None
    yield "a platform of 100 KB", dict(platform="p" * 100_000), None
    yield "a build of 100 KB", dict(build="b" * 100_000), None
    for token in ("", "x", "0" * 64, farm.token, farm.join_token[:-1], farm.join_token + "0", "t" * 60_000):
        yield f"the token {token[:4]!r} of {len(token)}", dict(join_token=token), False


def first_messages():
    unit = pb.UnitKey(job="j", tile=0, round=0)
    yield "nothing", b""
    yield "a result", pb.FromWorker(result=pb.UnitResult(unit=unit)).SerializeToString()
    yield "progress", pb.FromWorker(progress=pb.Progress(activity="x")).SerializeToString()
    yield "garbage", os.urandom(1000)
    yield "a field that does not end", b"\x0a\xff\xff\xff\xff\x0f"
    yield "groups within groups", b"\x0b" * 100_000
    yield "2 MB", pb.FromWorker(result=pb.UnitResult(exr=bytes(2 << 20))).SerializeToString()
    yield "an unknown message", b"\xfa\x01\x03abc"


def results(good):
    """(label, a change of a good result) that must not be taken."""
    def changed(**fields):
        out = pb.UnitResult()
        out.CopyFrom(good)
        for name, value in fields.items():
            setattr(out, name, value)
        return out

    def other_unit(**fields):
        out = changed()
        for name, value in fields.items():
            setattr(out.unit, name, value)
        return out

    exr = good.exr
    yield "a wrong digest", changed(digest=hashlib.sha256(b"x").digest())
    yield "a digest of 31 bytes", changed(digest=good.digest[:31])
    yield "no digest", changed(digest=b"")
    for label, data in (("no partial", b""), ("a partial cut in half", exr[:len(exr) // 2]), ("a partial of zeros", bytes(len(exr))), ("random bytes", os.urandom(5000)), ("a head without lines", exr[:400]), ("a byte more", exr + b"x"),
                        ("one bit changed", exr[:-100] + bytes([exr[-100] ^ 1]) + exr[-99:]), ("NaN pixels", exr[:-400] + b"\xff\xff\xff\x7f" * 100), ("infinite pixels", exr[:-400] + b"\0\0\x80\x7f" * 100), ("largest floats", exr[:-400] + b"\xff\xff\x7f\x7f" * 100),
                        ("a window of 2^31", exr.replace(b"dataWindow\0box2i\0\x10\0\0\0" + exr[exr.index(b"dataWindow\0box2i\0") + 21:][:16], b"dataWindow\0box2i\0\x10\0\0\0" + b"\0\0\0\0" * 2 + b"\xff\xff\xff\x7f" * 2))):
        yield label, changed(exr=data)
    for label, fields in (("tile 10^9", dict(tile=10 ** 9)), ("round 10^9", dict(round=10 ** 9)), ("another tile", dict(tile=(good.unit.tile + 1) % 6)), ("another round", dict(round=good.unit.round + 1)), ("no job", dict(job="")), ("an unknown job", dict(job="j-00000000")),
                          ("a path as job", dict(job="../../etc/passwd")), ("a job of 5,000 bytes", dict(job="j" * 5000)), ("a job with a line break", dict(job="j\n2026-11-28T00:00:00Z x"))):
        yield label, other_unit(**fields)
    for label, health in (("not JSON", "{"), ("another type", "[]"), ("100,000 deep", "[" * 100_000), ("counts below zero", '{"nonfinite": -1}'), ("counts of 2^70", '{"nonfinite": 1180591620717411303424}'), ("markup", '{"<img>": 1}')):
        yield f"health: {label}", changed(health=health)
    for label, value in (("NaN", math.nan), ("infinite", math.inf), ("below zero", -1.0), ("1e300", 1e300)):
        yield f"seconds {label}", changed(cpu_seconds=value)
        out = changed()
        out.times.load = out.times.idle = value
        yield f"times {label}", out
    yield "2^64 - 1 bad samples", changed(nonfinite=2 ** 64 - 1, negative=2 ** 64 - 1, majorant_violations=2 ** 64 - 1)
    yield "a lease that is none", changed(lease="l-none")


def forged_results(record, farm, good, user):
    """One worker of the class gets the job's units; an honest one renders the job after it."""
    record.row = "forged results for leased units and for units of others: digests, partials, places, health, times"
    for label, forged in results(good):
        with record.expecting(label):
            job = submit(farm, user, TINY, **JOB)
            in_another_job = forged.unit.job == good.unit.job
            with ForgedWorker(farm, name="liar", numeric_class=farm.numeric_class, threads=4) as liar:
                liar.welcome()
                lease = liar.hears("assign")
                if in_another_job:
                    forged.unit.job = job
                if lease and not forged.lease.startswith("l-none"):
                    forged.lease = lease.lease
                liar.send(result=forged)
                ack = liar.hears("ack", 5)
                told = ack.refused.message if ack else liar.ended(0.1) or "no answer"
            view = farm.job(job)
            # A result with wrong figures (seconds, health) may be accepted, with corrected figures. A result with wrong pixels may not.
            figures = label.startswith(("seconds", "times", "2^64", "a lease", "health"))
            record.attempt(label, lease is not None and view["state"] in ("queued", "running") and (figures or not (ack and not ack.HasField("refused") and view["units_done"])), f"{told}; {view['state']}, {view['units_done']} units")
            worker = honest(farm, f"after-{len(farm.workers)}")
            try:
                pixels = farm.pixels(job)
                core = farm.job(job)["core_seconds"]
                record.attempt(f"{label}: the pixels after it", pixels == farm.expected and core < 3600, f"{pixels}, {core} core seconds")
            finally:
                worker.kill()
            wait_until(lambda: "connected" not in state_of(farm, f"after-{len(farm.workers)}"), "it is gone")


@group("Forged worker messages")
def forged(record, folder):
    with LocalFarm(folder, flags=UNLIMITED) as farm:
        alice = farm.token_of("alice")
        with Listener(folder, f"127.0.0.1:{farm.grpc}", 1) as listener:
            worker = honest(farm, "first", coordinator=f"127.0.0.1:{listener.port}")
            farm.wait_for_workers(1)
            farm.expected = farm.pixels(submit(farm, alice, TINY, **JOB))
            good = listener.results[0]
            farm.numeric_class = bytes.fromhex(farm.get("/api/v1/workers")["workers"][0]["numeric_class"])
            worker.kill()
        wait_until(lambda: state_of(farm, "first") != ["connected"], "it is gone")
        forged_results(record, farm, good, alice)

    with LocalFarm(folder / "second", flags=UNLIMITED) as farm:
        alice, bob = farm.token_of("alice"), Bystander(farm)
        worker = honest(farm)
        farm.wait_for_workers(1)
        known = farm.get("/api/v1/workers")["workers"][0]
        farm.numeric_class = bytes.fromhex(known["numeric_class"])
        record.row = "hellos: versions, names, classes, threads, tags, ids and secrets of others, tokens"
        for label, fields, may in hellos(farm, known["id"]):
            with record.expecting(label), ForgedWorker(farm, **fields) as liar:
                welcome = liar.hears("welcome", 5)
                held = state_of(farm, "honest") == ["connected"] and (may is None or bool(welcome) == may) and not (welcome and welcome.worker == known["id"])
                record.attempt(label, held and worker.alive(), f"welcomed {welcome}, {liar.ended(0.1)}")
        record.row = "first messages that are no hello, and a second hello"
        listed = len(farm.get("/api/v1/workers")["workers"])
        for label, raw in first_messages():
            with record.expecting(label), ForgedWorker(farm, first=raw) as liar:
                # gRPC ends the stream with OK if the bytes are no message.
                record.attempt(label, liar.ended() not in ("", "UNKNOWN", "INTERNAL") and len(farm.get("/api/v1/workers")["workers"]) == listed, f"ended with {liar.ended(0.1)!r}")
        with ForgedWorker(farm) as liar:
            liar.welcome()
            liar.send(hello=pb.Hello(protocol=1, name="again", numeric_class=b"\7" * 32, threads=1, join_token=farm.join_token))
            liar.send(progress=pb.Progress(activity="after the second hello"))
            wait_until(lambda: liar.ended(0.05) or any(w["activity"] == "after the second hello" for w in farm.get("/api/v1/workers")["workers"]), "it is read", 20)
            record.attempt("a second hello changes nothing", state_of(farm, "again") == [], farm.get("/api/v1/workers"))

        record.row = "failures, returned leases, progress and drains for what was never leased"
        job = submit(farm, alice, TINY, spp=1024, size="512x512")
        farm.wait_for_progress(job, 1)
        unit = pb.UnitKey(job=job, tile=0, round=3)
        for label, message in (("a failure", dict(failure=pb.UnitFailure(unit=unit, lease="none", scene_at_fault=True, reason=DATED))), ("a failure by signal", dict(failure=pb.UnitFailure(unit=unit, signal=-1, reason="x" * 4096))),
                               ("a failure of 100 KB", dict(failure=pb.UnitFailure(unit=unit, reason="x" * 100_000))), ("a failure at a pixel far away", dict(failure=pb.UnitFailure(unit=unit, pixel_x=-2 ** 31, pixel_y=2 ** 31 - 1, sample=2 ** 64 - 1))),
                               ("a returned lease", dict(returned=pb.LeaseReturned(lease="none", units=[unit] * 4096, reason=DATED))), ("50,000 returned units", dict(returned=pb.LeaseReturned(lease="none", units=[unit] * 30_000))), ("an unknown job", dict(returned=pb.LeaseReturned(lease="none", unknown_job=True))),
                               ("10,000 leases in progress", dict(progress=pb.Progress(leases=[pb.Progress.Entry(lease=f"l{i}", units_done=2 ** 32 - 1) for i in range(10_000)]))), ("an activity of 100 KB", dict(progress=pb.Progress(activity=DATED * 1000))),
                               ("NaN seconds", dict(progress=pb.Progress(cpu_seconds_total=math.nan, load_seconds=-math.inf, rss_bytes=2 ** 64 - 1))), ("drains", dict(draining=pb.Draining())), ("drains withdrawn", dict(draining=pb.Draining(withdrawn=True))),
                               ("unknown fields", None)):
            with record.expecting(label), ForgedWorker(farm, name="liar") as liar:
                liar.welcome()
                for _ in range(20):
                    liar.send(raw=b"\xfa\x01\x03abc") if message is None else liar.send(**message)
                liar.send(draining=pb.Draining())
                liar.ended(0.2)
                view, log = farm.job(job), farm.request("GET", f"/api/v1/jobs/{job}/log").decode()
                record.attempt(label, view["state"] == "running" and state_of(farm, "honest") == ["connected"] and "administrator" not in log, f"{view['state']} {view['error']} {log[-200:]}")

        record.row = "a flood of progress, of log lines and of hellos beside another user"
        for label, message in (("20,000 messages of progress", dict(progress=pb.Progress(activity="busy", cpu_seconds_total=1))), ("12,000 failures with long reasons", dict(failure=pb.UnitFailure(unit=unit, reason="y" * 4000)))):
            with record.expecting(label), ForgedWorker(farm, name="flood") as liar:
                carol = Bystander(farm, label.split()[-1])
                liar.welcome()
                before, began = len(farm.request("GET", f"/api/v1/jobs/{job}/log")), time.monotonic()
                raw = pb.FromWorker(**message).SerializeToString()
                with carol.watching():
                    for _ in range(int(label.split()[0].replace(",", ""))):
                        liar.send(raw=raw)
                    wait_until(lambda: liar.to_send.qsize() < 100 or liar.ended(0.01), "they are sent", 60)
                grown = len(farm.request("GET", f"/api/v1/jobs/{job}/log")) - before
                record.attempt(label, carol.served() and grown < 10_000 and state_of(farm, "honest") == ["connected"], f"{carol.told()}, log grew by {grown} bytes in {time.monotonic() - began:.1f} s")

        record.row = "FetchBlob: digests, offsets, tokens"
        data = os.urandom(100_000)
        digest = hashlib.sha256(data).digest()
        ask(farm, "PUT", f"/api/v1/blobs/{digest.hex()}", alice, data, "application/octet-stream")
        for label, request, expected in (("as it should be", dict(digest=digest), "OK"), ("another digest", dict(digest=bytes(32)), "NOT_FOUND"), ("a digest of 31 bytes", dict(digest=digest[:31]), ""), ("no digest", dict(digest=b""), ""), ("a digest of 1 MB", dict(digest=bytes(1_000_000)), ""),
                                         ("an offset beyond", dict(digest=digest, offset=100_001), "OUT_OF_RANGE"), ("an offset of 2^63", dict(digest=digest, offset=2 ** 63), ""), ("an offset of 2^64 - 1", dict(digest=digest, offset=2 ** 64 - 1), ""), ("at its end", dict(digest=digest, offset=100_000), "OK"),
                                         ("no token", dict(digest=digest, join_token=""), "UNAUTHENTICATED"), ("a user's token", dict(digest=digest, join_token=alice), "UNAUTHENTICATED"), ("it arrived wrong", dict(digest=digest, arrived_wrong=True), "OK")):
            with record.expecting(label):
                status, got = fetch(farm, **request)
                record.attempt(label, status == expected if expected else status not in ("OK", "UNKNOWN", "INTERNAL", "DEADLINE_EXCEEDED") and got == 0, (status, got))

        record.row = "without --allow-fake, a worker that makes its pixels up"
        with LocalFarm(folder / "third", allow_fake=False) as strict:
            with ForgedWorker(strict) as liar:
                record.attempt("is refused", liar.ended() == "FAILED_PRECONDITION" and strict.get("/api/v1/workers")["workers"] == [], liar.ended(0.1))
            still_serves(record, strict, strict.token)

        record.row = "three workers that blame the scene, beside three honest ones"
        more = [honest(farm, f"good-{i}", fake=True) for i in range(2)]
        ask(farm, "DELETE", f"/api/v1/jobs/{job}", alice)
        farm.wait_for_workers(3)
        liars = [ForgedWorker(farm, name=f"liar-{i}", numeric_class=farm.numeric_class, threads=8) for i in range(3)]
        for liar in liars:
            liar.welcome()

        def blame(liar):
            for lease in iter(lambda: liar.hears("assign", 2), None):
                for u in lease.units:
                    liar.send(failure=pb.UnitFailure(unit=pb.UnitKey(job=lease.job, tile=u.tile, round=u.round), lease=lease.lease, scene_at_fault=True, reason="the scene is broken"))


        threads = [threading.Thread(target=blame, args=(liar,), daemon=True) for liar in liars]
        for thread in threads:
            thread.start()
        for i in range(3):
            view = json.loads(ask(farm, "GET", f"/api/v1/jobs/{(j := submit(farm, alice, TINY, **JOB))}", alice).body)
            ends = wait_until(lambda: (v := farm.job(j))["state"] in ("done", "failed") and v, "the job ends", 120)
            # Votes are counted by principal (SECURITY.md). The liars on this machine are three principals.
            record.attempt(f"job {i} ends", ends["state"] == "done" or "the scene is broken" in (ends["error"] or ""), ends)
        for liar in liars:
            liar.__exit__()
        record.attempt("jobs after them are done", farm.pixels(submit(farm, alice, TINY, **JOB)), view)
        record.attempt("honest workers are connected", state_of(farm, "honest") + state_of(farm, "good-0") + state_of(farm, "good-1") == ["connected"] * 3 and all(w.alive() for w in more), farm.get("/api/v1/workers"))
        record.row = "afterwards"
        still_serves(record, farm, bob.token)
