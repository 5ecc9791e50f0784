"""The farm of the hours of chaos: three coordinators with TLS on one Redis and one S3 store, a line of its own to Redis for each, fake
workers by direct connections, through lines that can be cut, through a meddler and in a network namespace, and workers that render."""

import contextlib
import http.client
import json
import random
import ssl
import sys
import threading
import time

from chaos_kit import ROOT, ChaosFarm, SmallDisk
from cut_line import CutLine
from machine_storms import FAKETIME
from meddler import Meddler
from redis_server import RedisServer
from s3_server import ENVIRONMENT, S3Server
from weather import Network, Skip
from webhook_receiver import Receiver

sys.path.insert(0, str(ROOT / "bench"))

ANYWHERE = 120  # seconds within which some coordinator must answer for a job that there is, whatever happens
MEDDLED = ("doubled", "held", "cut", "oversized", "to_doubled", "to_held")  # leases that are cut wait for two minutes


def wait(seconds):
    """A fault lasts, or somebody asks again later: this is the time between."""
    threading.Event().wait(seconds)


class Record:
    """What happened, a line of JSON each: the page is made of it alone."""

    def __init__(self, path):
        self.began = time.monotonic()
        self._out, self._lock = open(path, "a", encoding="utf-8"), threading.Lock()

    def now(self):
        return round(time.monotonic() - self.began, 3)

    def write(self, kind, **what):
        with self._lock:
            self._out.write(json.dumps({"t": self.now(), "kind": kind, **what}) + "\n")
            self._out.flush()

    def wrong(self, what, **more):
        """An invariant does not hold."""
        self.write("wrong", what=what, **more)
        print(f"WRONG at {self.now():.0f} s: {what} {more}", flush=True)


class Caller:
    """Asks coordinators as one token's owner; follows no redirect. For one thread."""

    def __init__(self, farm, token):
        self.farm, self.token, self._lines = farm, token, {}

    def ask(self, at, method, path, body=None, kind="application/json", timeout=15, **headers):
        """(status, headers, body) of coordinator number `at`; OSError or HTTPException if it does not answer."""
        line = self._lines.pop(at, None) or http.client.HTTPSConnection("127.0.0.1", self.farm.coordinators[at].http, timeout=timeout, context=self.farm.trust)
        line.timeout = timeout
        try:
            if body is not None:
                headers["Content-Type"] = kind
            if self.token:
                headers["Authorization"] = f"Bearer {self.token}"
            line.request(method, path, body, headers)
            answer = line.getresponse()
            data = answer.read()
        except BaseException:
            line.close()
            raise
        if answer.will_close:
            line.close()
        else:
            self._lines[at] = line
        return answer.status, answer.headers, data

    def try_ask(self, at, *arguments, **more):
        """As ask(); (0, {}, b"") if it does not answer."""
        for again in (True, False):
            had = at in self._lines
            try:
                return self.ask(at, *arguments, **more)
            except (OSError, http.client.HTTPException):
                if not (again and had):  # a kept connection may have died long ago
                    return 0, {}, b""
        return 0, {}, b""

    def somewhere(self, method, path, body=None, good=(200, 201, 202, 204), final=(400, 409), patience=ANYWHERE, **more):
        """(coordinator, status, body) from the first one that does it; asks all of them, again and again. 0: none did it in time."""
        end, said = time.monotonic() + patience, []
        while True:
            said = []
            for at in random.sample(range(len(self.farm.coordinators)), len(self.farm.coordinators)):
                status, _, data = self.try_ask(at, method, path, body, **more)
                if status in good or status in final:
                    return at, status, data
                said.append((at, status, data[:200].decode(errors="replace")))
            if time.monotonic() > end:
                return None, 0, json.dumps(said).encode()
            wait(.5)


class SharedFarm(contextlib.ExitStack):
    """Everything that faults happen to."""

    def __init__(self, folder, record, seed, fakes, reals, unit, audits=10):
        super().__init__()
        self.record, self.folder, self.dice = record, folder, random.Random(seed)
        self.audits, self.unit = audits, unit  # seconds a sample of a pixel
        self.redis = self.enter_context(RedisServer(folder))
        self.s3 = self.enter_context(S3Server())
        self.receiver = self.enter_context(Receiver())
        self.left_out = []  # why something is not here
        try:
            self.network = self.enter_context(Network(self.dice.random()))
        except Skip as why:
            self.network = None
            self.left_out.append(f"workers behind a network of their own: {why}")
        try:
            self.disk = self.enter_context(SmallDisk(folder / "b" / "data", 2000))
        except Skip as why:
            self.disk = None
            self.left_out.append(f"a full disk: {why}")
        self.clock = folder / "clock" if FAKETIME else None
        if FAKETIME:
            self.clock.write_text("+0")
        else:
            self.left_out.append("a clock that jumps: libfaketime is not here")
        self.lines = [self.enter_context(CutLine(self.redis.port)) for _ in "abc"]
        self.coordinators = [self._coordinator(n) for n in range(3)]
        self.busy = [threading.Lock() for _ in self.coordinators]  # held while a fault is made of it
        self.down = set()  # coordinators that are meant to be down
        self.trust = ssl.create_default_context(cafile=folder / "secrets" / "tls" / "ca.pem")
        self.admin_token = self.coordinators[0].token
        self.worker_lines = [self.enter_context(CutLine(c.grpc)) for c in self.coordinators]
        self.meddler = self.enter_context(Meddler(folder, f"127.0.0.1:{self.coordinators[0].grpc}", self.dice.random(), most_cut=0,
                                                  tls=folder / "secrets" / "tls", **dict.fromkeys(MEDDLED, 0)))
        self.workers = {}  # group: processes
        self.away = set()  # workers that are meant to be dead
        self.liars = set()  # names
        self.liar_found = {}  # job: whether it was, before the job's end
        self.barred = set()  # names of workers that a coordinator has quarantined
        self.owners = {}  # job: user
        self.keeper = None  # the user whose jobs liars take part in
        self._add_workers(fakes, reals)

    def _coordinator(self, number):
        name = "abc"[number]
        flags = ["--shared", "--store", f"redis://127.0.0.1:{self.lines[number].port}/0", "--blobs", self.s3.url(), "--webhook", self.receiver.url,
                 "--audit-percent", self.audits]
        host = "127.0.0.1"
        if self.network:
            host = "0.0.0.0"
            flags += ["--public-grpc", "127.0.0.1:1", "--tls-names", self.network.host]
        environment = dict(ENVIRONMENT)
        if self.clock and name == "c":
            environment |= {"LD_PRELOAD": FAKETIME, "FAKETIME_TIMESTAMP_FILE": str(self.clock), "FAKETIME_DONT_FAKE_MONOTONIC": "1",
                            "FAKETIME_CACHE_DURATION": "1", "DONT_FAKE_MONOTONIC": "1"}
        return self.enter_context(ChaosFarm(self.folder / name, flags=flags, tls=True, secrets=self.folder / "secrets", host=host, environment=environment))

    def _add_workers(self, fakes, reals):
        """A tenth of the fake ones behind lines that can be cut, a tenth in the namespace, some behind the meddler; three steady ones that nothing is
        done to themselves; the others are killed, frozen and so on. Of many ten each are one process (bench/fleet.cpp), as on a machine
        with ten of them."""
        ports = [c.grpc for c in self.coordinators]
        direct = [f"127.0.0.1:{port}" for port in ports]
        tenth, few = max(1, fakes // 10), max(1, fakes // 30)
        sizes = {"steady": min(3, few), "crash": 4, "cut": tenth, "meddled": few, "network": tenth if self.network else 0, "watched": max(3, few)}
        sizes["fake"] = fakes - sum(sizes.values())
        assert sizes["fake"] > 0, "too few workers"
        for group, size in sizes.items():
            # Those that are to find a liar have no other work: so enough of them are where it is.
            tags = group if group in ("fake", "watched") else f"fake,{group}"
            flags = ["--fake-sample-seconds", self.unit, "--tags", tags]
            if group == "crash":
                flags += ["--fake-fault", "crash,seed=13,tile=2,round=1"]
            each = 1 if fakes < 40 or group in ("steady", "crash") else 10 if size >= 20 else size
            for n, first in enumerate(range(0, size, each)):
                addresses = direct[n % 3:] + direct[:n % 3]
                if group == "cut":
                    addresses = [f"127.0.0.1:{line.port}" for line in self.worker_lines[n % 3:] + self.worker_lines[:n % 3]]
                if group == "meddled":
                    addresses = [f"127.0.0.1:{self.meddler.port}", *direct[1:]]
                if group == "network":
                    addresses = [f"{self.network.host}:{port}" for port in ports[n % 3:] + ports[:n % 3]]
                self.add(group, f"{group}-{n}", *flags, size=min(each, size - first), coordinator=",".join(addresses),
                         within=self.network.inside if group == "network" else ())
        for n in range(reals):
            self.add("real", f"real-{n}", "--tags", "real", fake=False, coordinator=",".join(direct[n % 3:] + direct[:n % 3]))

    def add(self, group, name, *flags, size=1, **options):
        program = ("lightshaft-worker",) if size == 1 else ("fleet", size)
        worker = self.coordinators[0].add_worker(*flags, name=name, program=program, **options)
        worker.shown, worker.size = name, size
        self.workers.setdefault(group, []).append(worker)
        return worker

    def all_workers(self):
        return [w for group in self.workers.values() for w in group]

    def start(self, number):
        """Starts a coordinator as a service manager does: again, until it stays."""
        end = time.monotonic() + 600
        while True:
            try:
                return self.coordinators[number].start_coordinator()
            except AssertionError as why:
                self.coordinators[number].coordinator.kill()
                self.record.write("start refused", coordinator=number, why=str(why)[-300:])
                if time.monotonic() > end:
                    raise

    def look_after(self):
        """Nothing ends by itself."""
        for worker in self.all_workers():
            if worker not in self.away and worker.shown not in self.liars and not worker.alive() and worker not in self.away:
                self.record.wrong("a worker ended by itself", worker=worker.shown, code=worker.popen.returncode, said=worker.output()[-500:])
                worker.start()
        for number, coordinator in enumerate(self.coordinators):
            if number not in self.down and not coordinator.coordinator.alive() and self.busy[number].acquire(blocking=False):
                try:
                    if number not in self.down and not coordinator.coordinator.alive():
                        self.record.wrong("a coordinator ended by itself", coordinator=number, code=coordinator.coordinator.popen.returncode,
                                          said=coordinator.coordinator.output()[-1500:])
                        self.start(number)
                finally:
                    self.busy[number].release()

