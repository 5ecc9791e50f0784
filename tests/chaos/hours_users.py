"""The users of the hours of chaos: what they hand in and what they do to it (all of it drawn before the first job), what one undisturbed
worker makes of the same, and strangers who try what their tokens do not allow."""

import contextlib
import dataclasses
import hashlib
import http.client
import io
import json
import queue
import random
import socket
import subprocess
import sys
import threading
import time
import zipfile

from chaos_kit import FOG, ROOT
from hours_farm import ANYWHERE, Caller, wait
from local_farm import SCENE, LocalFarm, bin_dir

sys.path.insert(0, str(ROOT / "tests" / "system"))

import farm_rpc  # noqa: E402
import steam  # noqa: E402

USERS = ("anna", "bert", "carl", "dora", "emil")
GRID = 48  # voxels a side of a grid that is uploaded
BAD_SEED = 13  # workers with the tag crash die of it
SIZES, SAMPLES, MORE = ("256x192", "384x256"), (48, 64, 64, 64), 32
LARGEST = 32 * 32 * 32  # pixels and samples of the largest unit of these, in rounds of 2, 2, 4, 8, 16, 32 and 32 samples
SEEDS = 60  # jobs with the same seed are the same job, so that one undisturbed worker keeps up; those of one wave have different ones
# How a job of a kind may fail, and with which words: its unit is a crash; where only one honest worker could be asked about a liar, there is no
# third one to decide (docs/design/scheduling.md).
RIGHT_TO_FAIL = {"crash": "--pixel", "watched": "no third one agrees"}
AT_ONCE = 8  # jobs of a user that have not ended: on a machine that is short of time a wave waits for the one before
LOST_AFTER = 300  # seconds in which no coordinator has a job
# Seconds for which a change that was acknowledged may not be seen: a coordinator that is cut off from Redis, frozen or taken over shows what
# it knew until it learns that it has lost the job. The longest of these faults lasts 60 s (hours_faults.py); after it come two of the looks
# at Redis and the next look of the user.
SEEN_WITHIN = 120
ENDED = ("done", "failed", "cancelled")


@dataclasses.dataclass
class Task:
    number: int
    user: str
    due: float  # seconds
    kind: str  # plain, bundle, blobs, real, crash, watched (a worker that lies has a part in it)
    size: str
    spp: int
    seed: int
    acts: list  # (share of its units from which on, what)
    id: str = ""
    at: int = 0  # the coordinator that had it last
    asked: str = "running"
    pixels: str = ""
    ended: str = ""
    seen: float = 0.0
    submitted: float = 0.0
    resume_at: float = 0.0
    checked: int = 0
    priority: int = 0
    leaving: dict = None  # what is recorded of it once it is removed: its removal was asked for
    notes: dict = dataclasses.field(default_factory=dict)

    @property
    def tags(self):
        return self.kind if self.kind in ("real", "crash", "watched") else "fake"

    def asset(self):
        """The bytes of steam.vol, or None."""
        if self.kind not in ("bundle", "blobs"):
            return None
        dice = random.Random(self.seed)
        return steam.grid([dice.random() for _ in range(GRID ** 3)])

    def scene(self):
        if self.kind in ("bundle", "blobs"):
            return steam.scene(samples=2)
        return FOG if self.kind == "real" else SCENE

    def bundle(self):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            archive.writestr("scene.xml", self.scene())
            archive.writestr("steam.vol", self.asset())
        return out.getvalue()

    def samples(self):
        """Samples of pixels, all extensions done."""
        width, height = map(int, self.size.split("x"))
        return width * height * (self.spp + sum(more for _, (what, more) in self.acts if what.startswith("extend")))


def draw_tasks(seed, count, seconds, period):
    """Jobs come in waves: in each all users want the farm at once."""
    dice = random.Random(seed)
    waves = max(1, round(seconds / period))
    looks = [(dice.choices(("plain", "bundle", "blobs", "real", "crash"), (70, 10, 10, 7, 3))[0], dice.choice(SIZES), dice.choice(SAMPLES)) for _ in range(SEEDS)]
    tasks = []
    for number in range(count):
        wave = number * waves // count
        kind, size, spp = looks[number % SEEDS]
        if kind in ("real", "crash"):
            size, spp = {"real": "192x128", "crash": "256x192"}[kind], 64
        chance, acts = dice.random(), []
        if kind == "crash":
            pass
        elif chance < .12:
            acts = [(dice.uniform(0, .8), ("cancel", 0))]
        elif chance < .27:
            acts = [(dice.uniform(0, .8), ("pause", dice.uniform(2, 20)))]
        elif chance < .42:
            acts = [(dice.uniform(0, .7), ("extend", MORE))]
        elif chance < .5:
            acts = [(1, ("extend later", MORE))]
        elif chance < .6:
            acts = [(dice.uniform(0, .4), ("priority", -1)), (dice.uniform(.4, .8), ("priority", 0))]
        elif chance < .7:
            acts = [(dice.uniform(0, .5), ("watch", 0))]
        tasks.append(Task(number, dice.choice(USERS), wave * seconds / waves + dice.uniform(0, period / 20), kind, size, spp,
                          BAD_SEED if kind == "crash" else 1000 + number % SEEDS, acts))
    return tasks


class Undisturbed(threading.Thread):
    """What one worker makes of each job to which nothing happens; for pixels that are rendered, `lightshaft render`."""

    def __init__(self, folder, storm_farm):
        super().__init__(daemon=True)
        self.storm_farm, self.folder, self.record, self.todo, self.right, self.wrong = storm_farm, folder, storm_farm.record, queue.Queue(), 0, 0
        self.known = {}  # what was asked: pixels
        self.farm = LocalFarm(folder / "calm")
        self.farm.add_worker(threads=1)

    def expect(self, task, spp):
        if task.kind == "real":
            scene, report = self.folder / "alone.xml", self.folder / "alone.json"
            scene.write_text(task.scene())
            subprocess.run([str(part) for part in (bin_dir() / "lightshaft", "render", scene, "--spp", spp, "--seed", task.seed, "--size", task.size,
                                                   "--report", report, "-o", self.folder / "alone.exr", "--quiet")], check=True, capture_output=True)
            return json.loads(report.read_text())["pixels_sha256"]
        query = f"spp={spp}&seed={task.seed}&size={task.size}"
        asset = task.asset()
        body, kind = (task.bundle(), "application/zip") if asset else (task.scene().encode(), "application/xml")
        job = json.loads(self.farm.request("POST", f"/api/v1/jobs?{query}", body, kind))["id"]
        pixels = self.farm.pixels(job)
        self.farm.request("DELETE", f"/api/v1/jobs/{job}")
        return pixels

    def run(self):
        while (item := self.todo.get()) is not None:
            task, spp, pixels = item
            try:
                asked = task.kind, task.seed, task.size, spp
                if asked not in self.known:
                    self.known[asked] = self.expect(task, spp)
                equal = self.known[asked] == pixels
            except Exception as error:
                self.record.wrong("the undisturbed worker could not be asked", number=task.number, error=repr(error))
                continue
            self.right, self.wrong = self.right + equal, self.wrong + (not equal)
            self.record.write("hash", number=task.number, spp=spp, what=task.kind, equal=equal)
            if not equal and not (task.kind == "watched" and not self.storm_farm.liar_found.get(task.id, True)):
                self.record.wrong("another image", number=task.number, job=task.id, spp=spp, what=task.kind, pixels=pixels)

    def finish(self):
        self.todo.put(None)
        self.join()
        self.farm.__exit__(None, None, None)


class User(threading.Thread):
    """One user's jobs, through whichever coordinator answers."""

    def __init__(self, farm, name, token, tasks, undisturbed, seed, until):
        super().__init__()
        self.until = until  # seconds from which on nothing is handed in
        self.farm, self.name_, self.record = farm, name, farm.record
        self.caller, self.todo, self.undisturbed = Caller(farm, token), sorted(tasks, key=lambda t: t.due), undisturbed
        self.dice, self.tasks, self.hurry = random.Random(seed), {}, threading.Event()
        self.finished, self.gone, self.watching = [], set(), []
        self.removed = {}  # job: its task, of jobs whose removal was acknowledged
        self.stays = False  # also without a job

    # ---- handing in ----

    def upload(self, data):
        """In parts, over connections that break; True when some coordinator says that it is there."""
        digest = hashlib.sha256(data).hexdigest()
        path, end = f"/api/v1/blobs/{digest}", time.monotonic() + 3 * ANYWHERE
        at, breaks = self.dice.randrange(3), self.dice.randint(0, 3)
        while time.monotonic() < end:
            status, headers, _ = self.caller.try_ask(at, "HEAD", path)
            if status == 200:
                return True
            first = int(headers["Upload-Offset"]) if status == 404 else None
            if first is None:
                at = (at + 1) % 3
                wait(.3)
                continue
            if breaks and len(data) - first > 1000:
                breaks -= 1
                self.break_off(at, path, data, first)
                continue
            status, _, _ = self.caller.try_ask(at, "PUT", path, data[first:], "application/octet-stream", timeout=60,
                                               **{"Content-Range": f"bytes {first}-{len(data) - 1}/{len(data)}"} if first else {})
            if status not in (200, 201, 202, 204):
                self.record.write("upload", user=self.name_, status=status)
                wait(.5)
        return False

    def break_off(self, at, path, data, first):
        """Announces all that is left, sends a part of it, and hangs up."""
        with contextlib.suppress(OSError):
            with socket.create_connection(("127.0.0.1", self.farm.coordinators[at].http), 10) as raw, \
                    self.farm.trust.wrap_socket(raw, server_hostname="127.0.0.1") as line:
                line.sendall((f"PUT {path} HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {self.caller.token}\r\n"
                              f"Content-Range: bytes {first}-{len(data) - 1}/{len(data)}\r\nContent-Length: {len(data) - first}\r\n\r\n").encode()
                             + data[first:first + self.dice.randint(1, len(data) - first - 1)])

    def hand_in(self, task):
        spec = {"spp": task.spp, "seed": task.seed, "size": task.size, "tags": task.tags}
        query = "&".join(f"{key}={value}" for key, value in spec.items())
        path, body, kind = f"/api/v1/jobs?{query}", task.scene().encode(), "application/xml"
        if task.kind == "bundle":
            body, kind = task.bundle(), "application/zip"
        if task.kind == "blobs":
            scene, asset = task.scene().encode(), task.asset()
            if not (self.upload(scene) and self.upload(asset)):
                self.record.wrong("an upload did not come to an end", number=task.number)
                return
            width, height = map(int, task.size.split("x"))
            path, kind = "/api/v1/jobs", "application/json"
            body = json.dumps({"scene": hashlib.sha256(scene).hexdigest(), "assets": {"steam.vol": hashlib.sha256(asset).hexdigest()},
                               "spec": {**spec, "size": [width, height], "tags": [task.tags]}}).encode()
        at, status, data = self.caller.somewhere("POST", path, body, kind=kind, timeout=60, patience=3 * ANYWHERE)
        if status != 201:
            self.record.wrong("a job was not taken", number=task.number, what=task.kind, status=status, said=data[:300].decode(errors="replace"))
            return
        task.at, task.submitted = at, self.record.now()
        task.id = json.loads(data)["id"]
        task.seen = time.monotonic()
        self.tasks[task.id], self.farm.owners[task.id] = task, task.user
        self.record.write("submitted", number=task.number, job=task.id, user=task.user, what=task.kind, at=at, spp=task.spp, size=task.size,
                          acts=[what for _, (what, _) in task.acts])

    # ---- looking after ----

    def views(self):
        """{job: (coordinator, view)} of all coordinators that answer; of two that have a job, the one that has more of it."""
        found = {}
        for at in range(3):
            status, _, data = self.caller.try_ask(at, "GET", "/api/v1/jobs")
            if status != 200:
                continue
            for view in json.loads(data)["jobs"]:
                if view["owner"] != self.name_:
                    self.record.wrong("a token overstepped: a list has another user's job", user=self.name_, job=view["id"], owner=view["owner"])
                if view["id"] not in found or view["units_done"] > found[view["id"]][1]["units_done"]:
                    found[view["id"]] = at, view
        return found

    def change(self, task, what):
        at, status, data = self.caller.somewhere("PATCH", f"/api/v1/jobs/{task.id}", json.dumps(what).encode())
        if status == 0:
            self.record.wrong("nobody changed a job that there is", number=task.number, job=task.id, what=what, said=data.decode()[:600])
        return status == 200

    def note(self, task, what, every=20, **more):
        """Something that may be repeated, but not all the time; True if it is time."""
        last = task.notes.get(what, -every)
        if self.record.now() - last < every:
            return False
        task.notes[what] = self.record.now()
        self.record.write("note", what=what, number=task.number, job=task.id, **more)
        return True

    def kept(self, task, what, so, **more):
        """A change that was acknowledged must be seen (`so`) and is never made again; True once it was forgotten for good, which is wrong."""
        if so:
            task.notes.pop(what, None)
            return False
        since = task.notes.setdefault(what, time.monotonic())
        if time.monotonic() - since < SEEN_WITHIN:
            return False
        del task.notes[what]
        self.record.wrong(f"acknowledged and forgotten: {what}", number=task.number, job=task.id, **more)
        return True

    def act(self, task, what, more):
        """True if it was acknowledged; else it is tried again."""
        if what == "cancel":
            if not self.change(task, {"state": "cancelled"}):
                return False
            task.asked = "cancelled"
        elif what == "pause":
            if not self.change(task, {"state": "paused"}):
                return False
            task.asked, task.resume_at = "paused", time.monotonic() + more
        elif what == "extend":
            if not self.change(task, {"spp": task.spp + more}):
                return False
            task.spp += more
        elif what == "priority":
            if not self.change(task, {"priority": more}):
                return False
            task.priority = more
        elif what == "watch":
            thread = threading.Thread(target=self.watch)
            thread.start()
            self.watching.append(thread)
        self.record.write("act", number=task.number, what=what)
        return True

    def watch(self):
        """An event stream for a while: nothing of others' jobs may come."""
        caller, end = Caller(self.farm, self.caller.token), time.monotonic() + self.dice.uniform(5, 30)
        with contextlib.suppress(OSError, http.client.HTTPException):
            line = http.client.HTTPSConnection("127.0.0.1", self.farm.coordinators[self.dice.randrange(3)].http, timeout=5, context=self.farm.trust)
            line.request("GET", "/api/v1/events", headers={"Authorization": f"Bearer {caller.token}"})
            with line.getresponse() as stream:
                kind, seen = "", 0
                while time.monotonic() < end:
                    text = stream.readline().decode().rstrip("\n")
                    kind = text[7:] if text.startswith("event: ") else kind
                    if text.startswith("data: ") and kind in ("job", "tile"):
                        data = json.loads(text[6:])
                        job, seen = data.get("id") if kind == "job" else data.get("job"), seen + 1
                        if data.get("owner", self.name_) != self.name_ or (job not in self.tasks and job not in self.gone and job in self.farm.owners):
                            self.record.wrong("a token overstepped: an event of another user's job", user=self.name_, job=job)
                self.record.write("watched", user=self.name_, events=seen)
            line.close()

    def look_at(self, task, at, view):
        task.at, task.seen = at, time.monotonic()
        state, share = view["state"], view["units_done"] / max(1, view["units_total"])
        if state in ENDED:
            return self.at_its_end(task, at, view)
        if task.asked == "cancelled":
            if self.kept(task, "a cancel", False, state=state):
                self.change(task, {"state": "cancelled"})
            return None
        if task.asked == "paused" and time.monotonic() > task.resume_at and self.change(task, {"state": "running"}):
            task.asked = "running"
        elif task.asked == "running" and state == "paused" and self.note(task, "paused by itself", every=5, error=view["error"]):
            if "waits for its file" not in (view["error"] or ""):
                self.change(task, {"state": "running"})
        if self.kept(task, "an extension", view["spp"] == task.spp, spp=view["spp"], asked=task.spp):
            self.change(task, {"spp": task.spp})
        if self.kept(task, "a priority", view["priority"] == task.priority, priority=view["priority"], asked=task.priority):
            self.change(task, {"priority": task.priority})
        while task.acts and task.acts[0][0] <= share and task.acts[0][1][0] != "extend later" and self.act(task, *task.acts[0][1]):
            task.acts.pop(0)
        return None

    def at_its_end(self, task, at, view):
        state = view["state"]
        if state == "done" and task.asked != "cancelled":
            if view["spp"] != task.spp:
                if self.kept(task, "an extension", False, spp=view["spp"], asked=task.spp):
                    self.change(task, {"spp": task.spp})
                return
            if task.checked != task.spp:
                status, _, data = self.caller.try_ask(at, "GET", f"/api/v1/jobs/{task.id}/report")
                image, _, exr = self.caller.try_ask(at, "GET", f"/api/v1/jobs/{task.id}/image.exr", timeout=60)
                if status != 200 or image != 200:
                    if self.note(task, "its image cannot be fetched now", every=30, status=(status, image)) and self.record.now() - task.notes.setdefault("first", self.record.now()) > 300:
                        self.record.wrong("an image cannot be fetched", number=task.number, job=task.id, status=(status, image))
                    return
                if exr[:4] != b"\x76\x2f\x31\x01":
                    self.record.wrong("an image is no EXR", number=task.number)
                task.checked, task.pixels = task.spp, json.loads(data)["pixels_sha256"]
                self.undisturbed.todo.put((task, task.spp, task.pixels))
            if task.acts and task.acts[0][1][0] == "extend later":
                _, (what, more) = task.acts[0]
                if self.change(task, {"spp": task.spp + more}):
                    task.acts.pop(0)
                    task.spp += more
                    self.record.write("act", number=task.number, what=what)
                return
        elif state == "failed" and RIGHT_TO_FAIL.get(task.kind, "\0") not in (view["error"] or ""):
            self.record.wrong("a job failed", number=task.number, job=task.id, error=view["error"])
        elif state == "cancelled" and task.asked != "cancelled":
            self.record.wrong("a job was cancelled by nobody", number=task.number, job=task.id)
        elif state == "done" and task.kind == "crash":
            self.record.wrong("a job whose unit is a crash is done", number=task.number, job=task.id)
        task.leaving = {"state": state, "core_seconds": view["core_seconds"], "units": view["units_total"]}
        if self.caller.try_ask(at, "DELETE", f"/api/v1/jobs/{task.id}")[0] == 204:
            self.removed[task.id] = task
            self.is_gone(task)

    def is_gone(self, task):
        self.record.write("ended", number=task.number, job=task.id, seconds=self.record.now() - task.submitted, **task.leaving)
        task.ended = task.leaving["state"]
        self.gone.add(task.id)
        self.finished.append(self.tasks.pop(task.id))

    def turn(self):
        if self.todo and self.record.now() > self.until:
            self.record.write("not handed in", user=self.name_, jobs=len(self.todo))
            self.todo = []
        while self.todo and self.todo[0].due <= self.record.now() and len(self.tasks) < AT_ONCE:
            self.hand_in(self.todo.pop(0))
        found = self.views()
        for job, (at, view) in found.items():
            if job in self.tasks:
                self.look_at(self.tasks[job], at, view)
            elif job in self.removed:
                if self.kept(self.removed[job], "a removal", False, state=view["state"], at=at):
                    self.caller.try_ask(at, "DELETE", f"/api/v1/jobs/{job}")
            elif view["state"] in ENDED or view["submitted_unix"] + 120 < time.time():
                # A submission whose answer was lost.
                self.record.write("stray", job=job, user=self.name_, state=view["state"], at=at)
                self.caller.try_ask(at, "DELETE", f"/api/v1/jobs/{job}")
        for job, task in self.removed.items():
            if job not in found:
                self.kept(task, "a removal", True)
        for task in list(self.tasks.values()):
            # A coordinator that is cut off from Redis removes a job and answers 503: another one could bring it back.
            if task.leaving and task.id not in found and time.monotonic() - task.seen > 20:
                self.is_gone(task)
            elif task.id not in found and time.monotonic() - task.seen > LOST_AFTER and self.note(task, "nobody has it", every=60):
                self.record.wrong("a job is lost", number=task.number, job=task.id)

    def run(self):
        while (self.todo or self.tasks or self.stays) and not self.hurry.wait(2.5):
            try:
                self.turn()
            except Exception as error:
                self.record.wrong("a user could not go on", user=self.name_, error=repr(error))
        for thread in self.watching:
            thread.join()


class Strangers(threading.Thread):
    """Try, all the time, what their tokens do not allow."""

    def __init__(self, farm, users, tokens, seed):
        super().__init__(daemon=True)
        self.farm, self.record, self.users, self.tokens = farm, farm.record, users, tokens
        self.dice, self.stopped, self.count, self.redirects = random.Random(seed), threading.Event(), {}, 0
        self.callers = {name: Caller(farm, token) for name, token in tokens.items()}

    def expect(self, who, at, method, path, allowed, body=None, what=""):
        status, headers, data = self.callers[who].try_ask(at, method, path, body)
        if status == 0:
            return status
        self.count[what] = self.count.get(what, 0) + 1
        # Where it does not answer, or another coordinator must be asked, nothing is told or done.
        if status not in (*allowed, 503, 429):
            self.record.wrong("a token overstepped", what=what, who=who, method=method, path=path, status=status, said=data[:200].decode(errors="replace"))
        return status

    def anothers_job(self):
        owner, other = self.dice.sample([u for u in self.users], 2)
        jobs = list(owner.tasks)
        if not jobs:
            return
        job, at = self.dice.choice(jobs), self.dice.randrange(3)
        method, path, body = self.dice.choice((
            ("GET", "", None), ("GET", "/report", None), ("GET", "/image.png", None), ("GET", "/log", None), ("GET", "/tiles", None), ("GET", "/events", None),
            ("PATCH", "", b'{"state": "cancelled"}'), ("PATCH", "", b'{"priority": -5}'), ("DELETE", "", None), ("POST", "/again", b'{"spp": 2}')))
        status = self.expect(other.name_, at, method, f"/api/v1/jobs/{job}{path}", (404, 307), body, "another user's job")
        self.redirects += status == 307

    def other_ports(self):
        at = self.dice.randrange(3)
        who, method, path, allowed, body, what = self.dice.choice((
            ("join", "GET", "/api/v1/jobs", (403,), None, "a worker's token over HTTP"),
            ("read", "POST", "/api/v1/jobs?spp=2", (403,), SCENE.encode(), "a read token that hands in"),
            ("none", "GET", "/api/v1/jobs", (401,), None, "no token"),
            ("anna", "GET", "/metrics", (403,), None, "a user's token at the figures"),
            ("bert", "GET", "/api/v1/tokens", (403,), None, "a user's token at the tokens"),
            ("carl", "POST", "/api/v1/tokens", (403,), b'{"role": "admin"}', "a user's token that makes tokens"),
            ("read", "DELETE", "/api/v1/tokens/0", (403,), None, "a read token that revokes")))
        self.expect(who, at, method, path, allowed, body, what)

    def worker_port(self):
        """A user's token, or a guess, in a worker's hello; the certificate is right."""
        grpc, tls, at = farm_rpc.grpc, self.farm.folder / "secrets" / "tls", self.dice.randrange(3)
        pem = [(tls / name).read_bytes() for name in ("ca.pem", "worker.key", "worker.pem")]
        who = self.dice.choice(("anna", "read", "admin"))
        with grpc.secure_channel(f"127.0.0.1:{self.farm.coordinators[at].grpc}", grpc.ssl_channel_credentials(*pem)) as channel:
            said = farm_rpc.work(channel, self.tokens[who])
        if said not in ("UNAVAILABLE", "DEADLINE_EXCEEDED"):
            self.count["a user's token at the workers' port"] = self.count.get("a user's token at the workers' port", 0) + 1
            if said not in ("UNAUTHENTICATED", "RESOURCE_EXHAUSTED"):
                self.record.wrong("a token overstepped", what="a user's token at the workers' port", who=who, said=said)

    def revoked(self):
        """A guest's token, revoked at one coordinator, opens none."""
        status, _, data = self.callers["admin"].try_ask(self.dice.randrange(3), "POST", "/api/v1/tokens", b'{"role": "submit", "user": "guest"}')
        if status != 201:
            return
        made = json.loads(data)
        self.callers["guest"] = Caller(self.farm, made["token"])
        _, status, _ = self.callers["admin"].somewhere("DELETE", f"/api/v1/tokens/{made['id']}", final=())
        if status == 204:
            for at in range(3):
                self.expect("guest", at, "GET", "/api/v1/jobs", (401,), None, "a revoked token")

    def run(self):
        turn = 0
        while not self.stopped.wait(1):
            turn += 1
            try:
                self.anothers_job()
                if turn % 5 == 0:
                    self.other_ports()
                if turn % 30 == 0:
                    self.worker_port()
                if turn % 60 == 0:
                    self.revoked()
            except Exception as error:
                self.record.write("stranger", error=repr(error))

