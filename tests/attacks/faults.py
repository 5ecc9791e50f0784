"""The nineteen faults that a review of commit 54967dbd found: the same attacks, with the figures of that review and those of today."""

import contextlib
import errno
import hashlib
import json
import os
import socket
import struct
import threading
import time
import zlib

import forged_worker
from attack_kit import Bystander, LocalFarm, TINY, UNLIMITED, ask, cpu_seconds, group, resident_bytes, submit
from asked_process import AskedProcess
from forged_worker import ForgedWorker, fetch, pb
from http2_frames import CONTINUATION, DATA, HEADERS, PREFACE, SETTINGS, begin_call, closed_by_peer, connect, frame
from local_farm import SCENE, wait_until
from meddler import Meddler
from processes import family
from test_sandbox import CHMOD, FTRUNCATE, HERE, IOCTL, ON_A_TERMINAL, OPENAT, SHARED_MEMORY, TIOCSTI
from test_scene_reader import large

STRANGER = "127.0.0.2"  # another address than the workers'
FETCH = "/lightshaft.farm.v1.Farm/FetchBlob"


def seconds_of(function):
    began = time.monotonic()
    function()
    return time.monotonic() - began


def join_seconds(farm):
    """Returns the seconds until a new worker has joined and a job is done."""
    def joins():
        farm.add_worker()
        farm.wait_for_job(submit(farm, farm.token, TINY, spp=2))
    return seconds_of(joins)


def f1(record, folder):
    today = []
    for tls in (False, True):
        with LocalFarm(folder / f"f1-{tls}", tls=tls, within=["prlimit", "--nofile=1024:1024"]) as farm:
            held = [socket.create_connection(("127.0.0.1", farm.grpc), source_address=(STRANGER, 0)) for _ in range(1100)]
            for sock in held:
                sock.close()

            def joins():
                farm.add_worker()
                farm.wait_for_workers(1)
            today.append(seconds_of(joins))
    record.fault("F1", "1,100 connections to the workers' port of a process of 1,024 files, closed again (`test_workers_port.py`)", "no worker joins for ever",
                 f"a worker joins after {today[0]:.1f} s, with TLS after {today[1]:.1f} s", max(today) < 30)


def renderer(record, folder):
    """F2, F10, F11, F12: system calls of a renderer that an attacker controls."""
    with LocalFarm(folder / "renderer") as farm:
        worker = farm.add_worker(fake=False, within=ON_A_TERMINAL)
        farm.wait_for_workers(1)
        first = farm.pixels(submit(farm, farm.token, TINY, spp=2))
        child = family(worker.popen.pid)[-1]
        other = folder / "of-another"
        other.write_text("x")
        other.chmod(0o600)
        with AskedProcess(child) as asked:
            typed = [asked.call(IOCTL, descriptor, TIOCSTI, "x") for descriptor in range(6)] + [asked.call(OPENAT, HERE, "/dev/tty", 2)]
            cut = [asked.call(FTRUNCATE, SHARED_MEMORY, 0), asked.call(FTRUNCATE, 2, 0)]
            changed = [asked.call(number, str(other), 0o666) for number in (CHMOD, 92, 132, 188, 197)]  # chown, utime, setxattr, removexattr
        record.fault("F2", "TIOCSTI on every descriptor of the renderer of a worker on a terminal (`test_sandbox.py`)", "types commands into the operator's shell", f"{sum(e != 0 for e in typed)} of {len(typed)} calls refused", all(typed))
        alive = farm.pixels(submit(farm, farm.token, TINY, spp=2)) == first
        record.fault("F10", "the renderer cuts the shared memory to nothing (`test_sandbox.py`)", "the worker is dead of SIGBUS within 2 s", f"refused ({errno.errorcode.get(cut[0], 'allowed')}), the worker renders on", all(cut) and alive)
        record.fault("F11", "the renderer changes mode, owner, time and attributes of a file of its user (`test_sandbox.py`)", "0600 becomes 0666", f"{sum(e != 0 for e in changed)} of {len(changed)} calls refused, mode {oct(other.stat().st_mode & 0o777)}",
                     all(changed) and other.stat().st_mode & 0o777 == 0o600)
        size = lambda: (farm.folder / f"{worker.name}.log").stat().st_size  # noqa: E731
        before = size()
        with AskedProcess(child) as asked:
            for _ in range(300):
                asked.call(1, 2, "spam\n" * 500, 2500)
        farm.pixels(submit(farm, farm.token, TINY, spp=2))
        grown = size() - before
        record.fault("F12", "the renderer writes 750 KB of lines to its log (`test_sandbox.py`)", "700 MB in 2 s taken, lines forged and erased", f"{grown / 1000:.0f} KB in the log", grown < 50_000)


def f3(record, folder):
    with LocalFarm(folder / "f3", flags=UNLIMITED) as farm:
        mallory, bob, length, held = farm.token_of("mallory"), Bystander(farm), 32 << 20, []

        def hold():
            sock = socket.create_connection(("127.0.0.1", farm.http))
            held.append(sock)
            with contextlib.suppress(OSError):
                sock.sendall(f"POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {mallory}\r\nContent-Type: application/xml\r\nContent-Length: {length}\r\n\r\n".encode() + b" " * (length - 1))

        senders = [threading.Thread(target=hold) for _ in range(8)]
        with bob.watching():
            for thread in senders:
                thread.start()
            for thread in senders:
                thread.join()
            for _ in range(5):
                bob.asks("POST", "/api/v1/session", json.dumps({"token": bob.token}))
                job = bob.submits()
                for state in ("paused", "cancelled"):
                    bob.asks("PATCH", f"/api/v1/jobs/{job}", json.dumps({"state": state}))
        for sock in held:
            sock.close()
        record.fault("F3", "8 bodies of 32 MB that stop a byte before their end; another user signs in, submits, pauses, cancels (`test_shares.py`)", "503 for everybody, for up to 68 minutes", bob.told(), bob.served())


def in_threads(count, function):
    threads = [threading.Thread(target=function, daemon=True) for _ in range(count)]
    for thread in threads:
        thread.start()
    return threads


def f4(record, folder):
    with LocalFarm(folder / "f4", flags=UNLIMITED) as farm:
        farm.add_worker()
        mallory, bob = farm.token_of("mallory"), Bystander(farm)
        job = bob.submits()
        farm.wait_for_job(job)
        scene = large(10)
        threads = in_threads(4, lambda: ask(farm, "POST", "/api/v1/jobs?spp=2&frames=1-3", mallory, scene, "application/xml", patience=300))
        with bob.watching():
            while any(t.is_alive() for t in threads):
                bob.asks("GET", f"/api/v1/jobs/{job}/image.png")
                bob.submits()
                threads[-1].join(0.5)
        peak = resident_bytes(farm.coordinator.popen.pid)[1]
        record.fault("F4a", "4 requests of 10 MB (3 frames each) of one user; another asks for an image and submits", "image.png after 25-98 s, 4-5 GB", f"{bob.told()}; coordinator at most {peak / 1e9:.1f} GB", bob.served() and peak < 4e9)
        small = SCENE.replace("</scene>", '<shape type="sphere"/>' * 2000 + "</scene>")
        answer = ask(farm, "POST", "/api/v1/jobs?spp=2&size=8192x8192&frames=1-10000", mallory, small, "application/xml", patience=120)
        record.fault("F4b", "47 KB with 10,000 frames that do not fit", "refused after 16.5 s", f"{answer.status} after {answer.seconds:.2f} s", answer.status in (400, 507) and answer.seconds < 16.5)

    with LocalFarm(folder / "f4c", flags=UNLIMITED) as farm:
        mallory, bob = farm.token_of("mallory"), Bystander(farm)
        for _ in range(2000):
            submit(farm, mallory, TINY, spp=2)
        job, over = bob.submits(), threading.Event()

        def lists():
            while not over.is_set():
                with contextlib.suppress(OSError):
                    ask(farm, "GET", "/api/v1/jobs", mallory)

        threads = in_threads(24, lists)
        for _ in range(20):
            bob.asks("GET", f"/api/v1/jobs/{job}")
            bob.asks("PATCH", f"/api/v1/jobs/{job}", '{"priority": 0}')
        over.set()
        for thread in threads:
            thread.join()
        record.fault("F4c", "the list of 2,000 jobs on 24 connections of one token; another user asks for its job and changes it", "4.4-9.4 s", bob.told(), bob.served())


def f5(record, folder):
    with LocalFarm(folder / "f5", flags=UNLIMITED) as farm:
        farm.add_workers(4)
        farm.wait_for_workers(4)
        submit(farm, farm.token, TINY, spp=2)
        liars = [ForgedWorker(farm, name=f"liar-{i}", numeric_class=b"\x99" * 32, threads=4096) for i in range(3)]
        for liar in liars:
            liar.welcome()
        began = time.monotonic()
        jobs = [submit(farm, farm.token, SCENE, spp=16) for _ in range(10)]
        lured = sum(farm.job(j)["numeric_class"] == "99" * 32 for j in jobs)
        for liar in liars:
            liar.__exit__()
        waiting = 0
        try:
            wait_until(lambda: all(farm.job(j)["state"] == "done" for j in jobs), "the jobs are done", 60)
        except AssertionError:
            waiting = sum(farm.job(j)["state"] != "done" for j in jobs)
        record.fault("F5", "3 idle streams of a made-up class with 4,096 threads beside 4 workers, 10 jobs (`pin_test.cpp`)", "6-7 of 10 jobs wait for ever", f"{lured} were pinned to it at first; {waiting} wait, all done after {time.monotonic() - began:.1f} s" if not waiting else f"{waiting} wait after 60 s", waiting == 0)


class Overcharging(Meddler):
    """Says once that a unit of this job took a day."""

    job = None

    def _to_coordinator(self, raw, held):
        message = self.protocol.FromWorker.FromString(raw)
        if self.job and message.WhichOneof("message") == "result" and message.result.unit.job == self.job:
            message.result.cpu_seconds, self.job = 86399, None
            return [message.SerializeToString()]
        return [raw]


def f6(record, folder):
    (folder / "f6").mkdir()
    with LocalFarm(folder / "f6", flags=UNLIMITED) as farm, Overcharging(folder / "f6", f"127.0.0.1:{farm.grpc}", 1) as liar:
        alice, bob = farm.token_of("alice"), farm.token_of("bob")
        farm.add_worker("--fake-delay", "10", coordinator=f"127.0.0.1:{liar.port}")
        farm.wait_for_workers(1)
        jobs = [submit(farm, token, SCENE, spp=4096, size="1024x1024") for token in (alice, bob)]
        done = lambda: [farm.job(j)["units_done"] for j in jobs]  # noqa: E731
        wait_until(lambda: min(done()) > 20, "both are rendered")
        liar.job = jobs[1]
        wait_until(lambda: liar.job is None, "the lie is told")
        before = done()
        wait_until(lambda: sum(done()) >= sum(before) + 1500, "1,500 units more")
        gained = [b - a for a, b in zip(before, done())]
        # A unit is charged at most the time since its lease was given: two leases of two seconds, 400 units; shares are kept to a lease, 200.
        record.fault("F6", "one result of one user's job says that it took 86,399 s; units of both users after it (`Lies.FalseCostsDoNotStarveAUser`)", "619 : 4", f"{gained[0]} : {gained[1]}", gained[0] - gained[1] <= 600)


def f7(record, folder):
    with LocalFarm(folder / "f7", flags=UNLIMITED) as farm:
        bob, held = Bystander(farm), []
        for i in range(1120):  # as many again as there is room for
            sock = socket.create_connection(("127.0.0.1", farm.http), source_address=(STRANGER, 0))
            sock.sendall(b"G")
            held.append(sock)
            if i % 40 == 0:
                bob.asks()
        for _ in range(18):
            bob.asks()
        for sock in held:
            sock.close()
        record.fault("F7", "1,120 sockets with one byte each; another user's requests (`test_shares.py`)", "27 of 27 refused", bob.told(), bob.served())


def f8_f9(record, folder):
    with LocalFarm(folder / "f8", flags=UNLIMITED) as farm:
        pid = farm.coordinator.popen.pid
        before = resident_bytes(pid)[0]
        stranger = connect(farm.grpc, STRANGER)
        with contextlib.suppress(ConnectionError):
            for begin in range(0, 16_500, 250):
                stranger.sendall(b"".join(begin_call(2 * i + 1) for i in range(begin, begin + 250)))
        calls = join_seconds(farm)
        record.fault("F8a", "16,500 calls without a hello on one connection; a worker joins and renders (`test_workers_port.py`)", "20 s, repeated for ever; +230 MB", f"{calls:.1f} s; +{(resident_bytes(pid)[0] - before) / 1e6:.0f} MB", calls < 20 and closed_by_peer(stranger))
        before, sent = resident_bytes(pid)[0], 0
        stranger = connect(farm.grpc, "127.0.0.5")
        with contextlib.suppress(ConnectionError, TimeoutError):
            for i in range(400):
                part = begin_call(2 * i + 1) + b"".join(frame(DATA, 0, 2 * i + 1, (b"\0" + struct.pack(">I", 1 << 20) if k == 0 else b"") + bytes(16_000)) for k in range(60))
                stranger.sendall(part)
                sent += len(part)
        grown = (resident_bytes(pid)[1] - before) / 1e6
        record.fault("F8b", "400 hellos of 1 MiB that never end, on one connection (`connections_test.cpp`)", "+315 MB, all 416 MB taken", f"closed after {sent / 1e6:.1f} MB; +{max(0, grown):.0f} MB at most", sent < 50e6 and grown < 100)
        used, sent = cpu_seconds(pid), 0
        stranger = connect(farm.grpc, "127.0.0.4")
        endless = b"".join(frame(CONTINUATION, 0, 1, b"\x80" * 10) for _ in range(1000))
        with contextlib.suppress(ConnectionError, TimeoutError):
            stranger.sendall(frame(HEADERS, 0, 1, b"\x00\x7f"))
            while sent < 30 << 20:
                stranger.sendall(endless)
                sent += len(endless)
        used = cpu_seconds(pid) - used
        record.fault("F9", "a header whose length never ends (CVE-2023-33953; `test_workers_port.py`)", "7.3 CPU seconds for 10 MB, kept", f"closed after {sent / 1e6:.1f} MB, {used:.2f} CPU seconds", sent < 30 << 20 and used < 2)


def f15(record, folder):
    with LocalFarm(folder / "f15", flags=UNLIMITED) as farm:
        data = os.urandom(2_000_000)
        digest = hashlib.sha256(data).digest()
        ask(farm, "PUT", f"/api/v1/blobs/{digest.hex()}", farm.token, data, "application/octet-stream")
        request = pb.FetchBlobRequest(digest=digest, join_token=farm.join_token).SerializeToString()
        body = b"\0" + struct.pack(">I", len(request)) + request
        held = []
        for begin in range(0, 540, 30):
            sock = socket.create_connection(("127.0.0.1", farm.grpc), timeout=30, source_address=(STRANGER, 0))
            sock.sendall(PREFACE + frame(SETTINGS, 0, 0, struct.pack(">HI", 4, 0)))  # a window of no bytes
            with contextlib.suppress(ConnectionError):
                sock.sendall(b"".join(begin_call(2 * i + 1, FETCH) + frame(DATA, 1, 2 * i + 1, body) for i in range(30)))
            held.append(sock)
        waits, refused = [], 0
        for _ in range(10):
            began = time.monotonic()
            while (answer := fetch(farm, digest=digest)) != ("OK", answer[1]) and time.monotonic() - began < 40:
                refused += 1
            waits.append(time.monotonic() - began)
        for sock in held:
            sock.close()
        record.fault("F15a", "540 fetches that take no byte, of another address; workers fetch (`fetch_table_test.cpp`)", "all refused as long as held", f"{max(waits):.1f} s at most in 10, tried again {refused} times", max(waits) < 31)
        before = resident_bytes(farm.coordinator.popen.pid)[0]
        with forged_worker.grpc.insecure_channel(f"127.0.0.1:{farm.grpc}") as channel:
            for i in range(2000):
                with ForgedWorker(farm, name=f"visitor-{i}", channel=channel) as visitor:
                    assert visitor.welcome()
        wait_until(lambda: len(farm.get("/api/v1/workers")["workers"]) <= 64, "they are forgotten", 60)
        known, grown = len(farm.get("/api/v1/workers")["workers"]), (resident_bytes(farm.coordinator.popen.pid)[0] - before) / 1e6
        seconds = join_seconds(farm)
        record.fault("F15b", "2,000 workers that join and leave at once (then: 16,500)", "all are known for an hour, and no new one may join; 118 MB", f"{known} are known, a new one joins and renders in {seconds:.1f} s; +{grown:.0f} MB", known <= 64)


def zeros_exr(size):
    """An EXR of size x size pixels of three float channels, all zero, packed by ZIP: blocks of 16 lines."""
    def attribute(name, kind, value):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    channels = b"".join(name + b"\0" + struct.pack("<iBBBBii", 2, 0, 0, 0, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, size - 1, size - 1)
    header = struct.pack("<ii", 20000630, 2) + attribute(b"channels", b"chlist", channels) + attribute(b"compression", b"compression", b"\3") + attribute(b"dataWindow", b"box2i", window) + attribute(b"displayWindow", b"box2i", window) + \
        attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)) + attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0)) + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0"
    packed = zlib.compress(b"\0" + b"\x80" * (16 * size * 12 - 1), 9)  # differences of neighbouring bytes, 128 added
    blocks = [struct.pack("<ii", 16 * i, len(packed)) + packed for i in range(size // 16)]
    start = len(header) + 8 * len(blocks)
    return header + b"".join(struct.pack("<Q", start + i * len(blocks[0])) for i in range(len(blocks))) + b"".join(blocks)


def f17(record, folder):
    with LocalFarm(folder / "f17", flags=UNLIMITED) as farm:
        mallory, bob, pid = farm.token_of("mallory"), Bystander(farm), farm.coordinator.popen.pid
        image = zeros_exr(4096)
        digest = hashlib.sha256(image).hexdigest()
        ask(farm, "PUT", f"/api/v1/blobs/{digest}", mallory, image, "application/octet-stream")

        def submits(query):
            answer = ask(farm, "POST", f"/api/v1/jobs?spp=2&size=4096x4096{query}", mallory, TINY, "application/xml", patience=300)
            if answer.status == 201:
                ask(farm, "DELETE", f"/api/v1/jobs/{json.loads(answer.body)['id']}", mallory)
            return answer

        submits("")
        own = resident_bytes(pid)[1]  # with the job's own image
        with bob.watching():
            answers = [submits(f"&reference={digest}") for _ in range(3)]
        grown = (resident_bytes(pid)[1] - own) / 1e6
        record.fault("F17", f"jobs with a reference of {len(image) / 1e6:.1f} MB that unpacks to 201 MB (then: 805 MB); another user asks meanwhile (`ServiceReference`)", "5.7 s and 830 MB of the coordinator a request",
                     f"{max(a.seconds for a in answers):.1f} s a request, unpacked by another process (coordinator +{grown:.0f} MB beside the job's own image); the other user: {bob.told()}", bob.served() and all(a.status == 201 for a in answers) and grown <= 32 * 4096 * 4096 / 1e6)  # 32 bytes a pixel: what SECURITY.md allows an image


def f18(record, folder):
    with LocalFarm(folder / "f18", flags=UNLIMITED) as farm:
        mallory, alice = farm.token_of("mallory"), farm.token_of("alice")
        farm.add_worker(fake=False)
        farm.wait_for_workers(1)
        farm.wait_for_job(submit(farm, alice, TINY, spp=2))
        scene = TINY.replace("</scene>", '<shape type="sphere"/>' * 200_000 + "</scene>")
        job = json.loads(ask(farm, "POST", "/api/v1/jobs?spp=2", mallory, scene, "application/xml").body)["id"]
        wait_until(lambda: (farm.job(job)["state"] in ("running", "done")) and farm.get("/api/v1/workers")["workers"][0]["activity"] != "idle", "it is being built", 120)
        ask(farm, "DELETE", f"/api/v1/jobs/{job}", mallory)
        seconds = seconds_of(lambda: farm.wait_for_job(submit(farm, alice, TINY, spp=2, seed=7)))
        record.fault("F18", "200,000 spheres at one place, cancelled while they are built; another user's small job on that worker (`AgentThatBuilds.AbandonsTheWorldOfACancelledJob`)", "91.3 s", f"{seconds:.1f} s", seconds < 11)


def f19(record, folder):
    with LocalFarm(folder / "f19", flags=UNLIMITED) as farm:
        mallory, held = farm.token_of("mallory"), []
        for _ in range(128):
            sock = socket.create_connection(("127.0.0.1", farm.http), timeout=20)
            sock.sendall(f"GET /api/v1/events HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {mallory}\r\n\r\n".encode())
            held.append(sock)
        answers = [ask(farm, "GET", "/api/v1/events", farm.token) for _ in range(5)]
        for sock in held:
            sock.close()
        record.fault("F19a", "128 event streams of one token; the administrator's dashboard (`SharesTest.EventStreamsOfOneTokenLeaveRoomForOthers`)", "503", f"{sorted({a.status for a in answers})} after {max(a.seconds for a in answers):.2f} s", all(a.status == 200 for a in answers))
        alice = farm.token_of("alice")
        data = os.urandom(200_000)
        path = f"/api/v1/blobs/{hashlib.sha256(data).hexdigest()}"
        ask(farm, "PUT", path, alice, data[:100_000], "application/octet-stream", headers=("Content-Range: bytes 0-99999/200000",))
        for i in range(1100):
            ask(farm, "PUT", f"/api/v1/blobs/{hashlib.sha256(str(i).encode()).hexdigest()}", mallory, b"x", "application/octet-stream", headers=("Content-Range: bytes 0-0/1000",))
        kept = ask(farm, "HEAD", path, alice).headers.get("upload-offset")
        record.fault("F19b", "1,100 one-byte parts of another user beside a half upload (`Uploads.TokenBeyondItsShareLosesOnlyItsOwnOldestUpload`)", "the upload is lost", f"{kept} of 200,000 bytes are kept", kept == "100000")


@group("Faults of the review", quick=True)
def faults(record, folder):
    quick = (f3, f7, f8_f9, f19)
    for fault in (f1, renderer, f3, f4, f5, f6, f7, f8_f9, f15, f17, f18, f19) if not record.quick else quick:
        record.row = fault.__name__.upper().replace("_", ", ")
        with record.expecting("the attack itself"):
            fault(record, folder)
    # F13, F14 and F16 need workers of several addresses, or are tries of the group of forged messages.
    if not record.quick:
        record.fault("F13", "two streams of one process vote against an honest worker", "the honest worker is quarantined", "`Principal.TwoWorkersOfOnePrincipalCannotQuarantineAnHonestWorker` holds; on the coordinator's own machine each connection is a principal (SECURITY.md)", True)
        record.fault("F14", "a thief presents the id of a connected worker, without or with a wrong secret", "takes its stream over", "gets an id of its own: 5 hellos above; `Service.WorkerIdIsNotReusedWithoutItsSecret`", True)
        record.fault("F16", "12,000 failures of 4 KB for a unit that the worker does not hold", "12,000 forged and dated lines in another user's log", "no line: the flood above; `Service.FailureOfAUnitThatTheWorkerDoesNotHoldIsNotLogged`", True)
        record.faults.sort(key=lambda f: int("".join(c for c in f[0] if c.isdigit())))
