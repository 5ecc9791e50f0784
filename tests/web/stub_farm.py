"""A coordinator's HTTP side in Python: serves web/static under the real policy, and answers as a test tells it to.

A test double for the views only; what the real coordinator does is tested with the real one.
"""
import hashlib
import json
import pathlib
import queue
import struct
import threading
import urllib.parse
import zlib
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

STATIC = pathlib.Path(__file__).resolve().parents[2] / "web" / "static"
TYPES = {".html": "text/html; charset=utf-8", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml", ".png": "image/png"}
POLICY = ("default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; font-src 'self'; "
          "connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'")
TOKEN = "let-there-be-light"


def held(job):
    return job["state"] == "queued" and bool(job.get("after"))


def job(id="j-1", name="steam.xml", state="running", **more):
    return {"id": id, "name": name, "state": state, "stopped": "", "progress": 0.25, "spp": 64, "spp_done": 16, "rmse": 0.05, "relmse": 0.01,
            "relmse_ci95": [0.009, 0.011], "target_error": None, "denoise": False, "eta_seconds": 42, "error": "", "warnings": [], "size": [64, 48], "tile": 32,
            "priority": 0, "focus": None, "owner": "", "units_done": 6, "units_total": 24, "elapsed_seconds": 14, "core_seconds": 28, "submitted_unix": 1765000000,
            "health": {"clean": True, "nonfinite": 0, "negative": 0, "majorant_violations": 0, "causes": []}, **more}


def attempt(worker, reason, **more):
    """In failure()."""
    return {"worker": worker, "reason": reason, "signal": None, "pixel": None, "sample": None, **more}


def failure(*attempts, **more):
    """Why a job failed, as the coordinator tells it."""
    return {"kind": "unit", "tile": 3, "rect": [0, 0, 8, 8], "round": 1, "samples": [4, 8], "frame": None, "replay": None, "attempts": attempts, **more}


def worker(id="w-1", name="lab-01", **more):
    return {"id": id, "name": name, "build": "test", "numeric_class": "9c41f0aa", "threads": 2, "tags": [], "state": "connected",
            "activity": "rendering", "job": "j-1", "units_done": 5, "cpu_seconds": 12, "rss_bytes": 1 << 20, "last_seen_seconds": 0.1, **more}


def png(width, height, rgb):
    """A picture of one colour."""
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = (b"\0" + bytes(rgb) * width) * height
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


class Layer:
    """A layer of a picture: value(x, y) gives its channels. Levels above 0 have the value of each block's first pixel."""

    def __init__(self, channels, value, format="half", blocks="mean", names=None):
        self.row = {"channels": channels, "format": format, "blocks": blocks, **({"names": names} if names else {})}
        self.value = value

    def bytes(self, level, rect):
        x0, y0, x1, y1 = rect
        numbers = [v for y in range(y0, y1) for x in range(x0, x1) for v in self.value(x << level, y << level)]
        return struct.pack(f"<{len(numbers)}{'e' if self.row['format'] == 'half' else 'f'}", *numbers)


def gradient(x, y):
    """Red grows to the right, green downwards; an eighth of it is a power of two, which halves hold exactly."""
    return x / 64, y / 64, 0.5


class StubFarm:
    """State that requests read and change; `with StubFarm() as farm: ... farm.url`."""

    def __init__(self):
        self.lock = threading.Lock()
        self.jobs = {}
        self.announced = []  # jobs that wait for files
        self.workers = {}
        self.worker_logs = {}
        self.tiles = []
        self.report = {"convergence": []}
        self.image = png(64, 48, (200, 120, 40))
        self.thumbnail = png(16, 12, (40, 160, 90))
        self.images = {}  # by job, before `image`
        self.denoised = png(64, 48, (90, 120, 200))
        self.changes = []  # (job or worker, body) of every PATCH
        self.join = {"address": "0.0.0.0:15151", "tls": False, "token_file": "/srv/farm/join-token"}
        self.maps = {"error": png(64, 48, (150, 30, 110)), "samples": png(64, 48, (20, 10, 60))}
        self.size = [96, 64]  # of pictures in numbers
        self.layers = {"rgb": Layer(["R", "G", "B"], gradient), "stderr": Layer(["R", "G", "B"], lambda x, y: (0.25, 0.125, 0.0625)),
                       "error": Layer(["Y"], lambda x, y: (0.03,)), "spp": Layer(["Y"], lambda x, y: (64,))}
        self.layers_of = {}  # by job, before `layers`
        self.mix = {"relmse": 0.02, "relmse_ci95": [0.018, 0.022], "trusted": True, "verdict": "trusted"}  # of every mix; or why there is none
        self.default_view = "sRGB"
        self.broken_view = None  # one that no picture can be shown in
        self.cubes = {}  # view -> bytes of its table
        self.video = {"state": "none", "fps": None, "exposure": None, "layer": None, "frames": 0, "frames_done": 0, "bytes": None, "error": None}
        self.no_video = None  # why none is made
        self.log = ""  # of every job
        self.blobs = {}
        self.submitted = []
        self.refuse_again = None  # why no job is rendered again
        self.refusal = None  # problem details for the next POST /jobs
        self.requests = []  # (method, path)
        self.role, self.user = "admin", ""  # of the token
        self.other_tokens = {}  # token -> {"role", "user"}
        self.signed_in = False  # of the one browser that a test has
        self.broken = set()  # names under /api/v1/ that answer with 503
        self.put_gate = threading.Event()  # blobs are taken while it is set
        self.put_gate.set()
        self._streams = []
        self._event_id = 0
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}"

    @property
    def tokens(self):
        return {TOKEN: {"role": self.role, "user": self.user}, **self.other_tokens}

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *exc):
        self.drop_streams()
        self._server.shutdown()
        self._server.server_close()

    def emit(self, type, data):
        with self.lock:
            self._event_id += 1
            text = f"id: {self._event_id}\nevent: {type}\ndata: {json.dumps(data)}\n\n"
            for stream in self._streams:
                stream.put(text.encode())

    def change(self, id, **more):
        """Changes a job and tells the stream."""
        with self.lock:
            self.jobs[id] = {**self.jobs[id], **more}
        self.emit("job", self.jobs[id])

    def remove(self, id):
        with self.lock:
            del self.jobs[id]
        self.emit("job", {"id": id, "state": "removed"})

    def drop_streams(self):
        with self.lock:
            for stream in self._streams:
                stream.put(None)

    def open_stream(self):
        with self.lock:
            stream = queue.Queue()
            self._streams.append(stream)
            return stream

    def close_stream(self, stream):
        with self.lock:
            self._streams.remove(stream)

    def asked(self, method, path):
        with self.lock:
            return sum(1 for m, p in self.requests if m == method and p.split("?")[0] == path)


def _handler(farm):
    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *args):
            pass

        def _send(self, status, body=b"", type="application/json", headers=()):
            data = body if isinstance(body, bytes) else json.dumps(body).encode()
            self.send_response(status)
            self.send_header("Content-Type", type)
            self.send_header("Content-Length", str(len(data)))
            self.send_header("Content-Security-Policy", POLICY)
            for name, value in headers:
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(data)

        def _problem(self, status, detail, **more):
            self._send(status, {"type": "about:blank", "title": "refused", "status": status, "detail": detail, **more}, "application/problem+json")

        def _body(self):
            return self.rfile.read(int(self.headers.get("Content-Length") or 0))

        def _dispatch(self):
            path = self.path.split("?")[0]
            with farm.lock:
                farm.requests.append((self.command, self.path))
            body = self._body()
            if not path.startswith("/api/v1/"):
                return self._static(path)
            parts = path[len("/api/v1/"):].split("/")
            if parts == ["session"]:
                return self._session(body)
            if not farm.signed_in:
                return self._problem(401, "No valid token or session came with this request.")
            if parts[0] in farm.broken:
                return self._problem(503, "The store is away.")
            answer = getattr(self, f"_{self.command.lower()}_{parts[0]}", None)
            return answer(parts[1:], body) if answer else self._problem(404, f"There is nothing at {path}.")

        do_GET = do_POST = do_PUT = do_PATCH = do_DELETE = _dispatch

        def _static(self, path):
            file = STATIC / (path.lstrip("/") or "index.html")
            if STATIC not in file.resolve().parents or not file.is_file():
                return self._problem(404, f"There is nothing at {path}.")
            return self._send(200, file.read_bytes(), TYPES[file.suffix])

        def _session(self, body):
            if self.command == "GET" and "Authorization" in self.headers:
                asked = farm.tokens.get(self.headers["Authorization"].removeprefix("Bearer "))
                return self._send(200, asked) if asked else self._problem(401, "This token is not known.")
            if self.command == "GET":
                return self._send(200, {"role": farm.role, "user": farm.user}) if farm.signed_in else self._problem(401, "No session.")
            if self.command == "DELETE":
                farm.signed_in = False
                return self._send(204)
            asked = farm.tokens.get(json.loads(body)["token"])
            if not asked:
                return self._problem(401, "This token is not known.")
            farm.signed_in = True
            farm.role, farm.user = asked["role"], asked["user"]
            return self._send(204, headers=[("Set-Cookie", "session=1; HttpOnly; SameSite=Strict; Path=/")])

        def _list(self):
            asked = dict(urllib.parse.parse_qsl(self.path.partition("?")[2], keep_blank_values=True))
            everything = list(farm.jobs.values())
            states = asked["state"].split(",") if "state" in asked else None
            found = [job for job in everything
                     if (states is None or job["state"] in states or ("held" in states and held(job))) and asked.get("owner", job["owner"]) == job["owner"]
                     and job["submitted_unix"] >= float(asked.get("since", 0)) and all(word in f"{job['name']}\n{job['id']}".lower() for word in asked.get("search", "").lower().split())]
            rank = {"running": 0, "paused": 1, "queued": 2}
            keys = {"active": lambda job: (rank.get(job["state"], 3), -job["submitted_unix"]), "name": lambda job: job["name"].lower(),
                    "submitted": lambda job: job["submitted_unix"], "relmse": lambda job: job["relmse"], "owner": lambda job: job["owner"], "state": lambda job: job["state"],
                    "progress": lambda job: job["progress"]}
            sort = asked.get("sort", "active")
            found.sort(key=keys[sort.lstrip("-")], reverse=sort.startswith("-"))
            first = int(asked.get("offset", 0))
            return {"jobs": found[first:first + int(asked.get("limit", len(found)))], "total": len(found), "owners": sorted({job["owner"] for job in everything}),
                    "states": {**{state: sum(job["state"] == state for job in everything) for state in {job["state"] for job in everything}}, "held": sum(map(held, everything))}}

        def _get_views(self, parts, body):
            if not parts:
                return self._send(200, {"default": farm.default_view, "views": ["sRGB", *farm.cubes]})
            name = dict(urllib.parse.parse_qsl(self.path.partition("?")[2]))["view"]
            return self._send(200, farm.cubes[name], "application/octet-stream") if farm.cubes.get(name) else self._problem(404, f"there is no view '{name}'")

        def _delete_jobs(self, parts, body):
            if farm.jobs[parts[0]]["state"] == "running":
                return self._problem(409, "A job that renders is cancelled first.")
            farm.remove(parts[0])
            return self._send(204)

        def _get_jobs(self, parts, body):
            if not parts:
                return self._send(200, self._list())
            if parts[0] not in farm.jobs:
                return self._problem(404, f"There is no job \"{parts[0]}\".")
            what = parts[1] if len(parts) > 1 else None
            if what is None:
                return self._send(200, farm.jobs[parts[0]])
            if what == "tiles":
                return self._send(200, {"tiles": farm.tiles})
            if what == "report":
                return self._send(200, farm.report)
            layers = farm.layers_of.get(parts[0], farm.layers)
            if what == "layers":
                rows = [{"name": name, **layer.row} for name, layer in layers.items()]
                return self._send(200, {"size": farm.size, "max_level": 10, "max_side": 512, "max_pixels": 1 << 20, "layers": rows})
            if what == "pixels":
                asked = dict(urllib.parse.parse_qsl(self.path.split("?")[1]))
                rect = [int(v) for v in asked["rect"].split(",")]
                return self._send(200, layers[asked["layer"]].bytes(int(asked["level"]), rect), "application/octet-stream")
            if what == "mix":
                return self._problem(409, farm.mix) if isinstance(farm.mix, str) else self._send(200, farm.mix)
            if what == "log":
                return self._send(200, farm.log.encode(), "text/plain")
            if what == "video":
                return self._send(200, farm.video)
            if what == "thumbnail.png":
                return self._send(200, farm.thumbnail, "image/png")
            if what == "image.png" and farm.broken_view and f"view={urllib.parse.quote(farm.broken_view, safe='')}" in self.path:
                return self._problem(400, f"the view '{farm.broken_view}' cannot be shown: the coordinator's log says why")
            if what == "image.png" and "layer=denoised" in self.path:
                return self._send(200, farm.denoised, "image/png")
            if what == "image.png":
                return self._send(200, farm.images.get(parts[0], farm.image), "image/png")
            if what.removesuffix(".png") in farm.maps:
                return self._send(200, farm.maps[what.removesuffix(".png")], "image/png")
            return self._problem(404, "nothing here")

        def _patch_jobs(self, parts, body):
            farm.changes.append((parts[0], json.loads(body)))
            farm.change(parts[0], **json.loads(body))
            return self._send(200, farm.jobs[parts[0]])

        def _post_jobs(self, parts, body):
            if parts[1:] == ["again"]:
                if farm.refuse_again:
                    return self._problem(400, farm.refuse_again)
                farm.submitted.append((parts[0], json.loads(body)))
                farm.jobs["j-again"] = {**farm.jobs[parts[0]], "id": "j-again", "state": "queued", "progress": 0, "units_done": 0}
                return self._send(201, {"id": "j-again", "url": "/api/v1/jobs/j-again", "warnings": []})
            if parts[1:] == ["video"]:
                farm.submitted.append((parts[0], json.loads(body)))
                if farm.no_video:
                    return self._problem(409, farm.no_video)
                farm.video = {**farm.video, "state": "waiting", "frames": 3, **json.loads(body)}
                return self._send(202, farm.video)
            if farm.refusal:
                refusal, farm.refusal = farm.refusal, None
                return self._send(400, refusal, "application/problem+json")
            if self.headers["Content-Type"] in ("application/zip", "application/x-tar"):
                query = dict(urllib.parse.parse_qsl(self.path.partition("?")[2]))
                farm.submitted.append((self.headers["Content-Type"], query, hashlib.sha256(body).hexdigest()))
                request = {"name": "archive.xml"}
            else:
                request = json.loads(body)
                farm.submitted.append(request)
            farm.jobs["j-new"] = job("j-new", request["name"], "queued", progress=0, units_done=0)
            return self._send(201, {"id": "j-new", "url": "/api/v1/jobs/j-new"})

        def _get_announced(self, parts, body):
            return self._send(200, {"announced": farm.announced})

        def _get_workers(self, parts, body):
            if parts[1:] == ["log"]:
                return self._send(200, farm.worker_logs[parts[0]].encode(), "text/plain") if parts[0] in farm.worker_logs else self._problem(404, "there is no such worker")
            return self._send(200, {"workers": list(farm.workers.values()), **({"join": farm.join} if farm.join else {})})

        def _patch_workers(self, parts, body):
            farm.changes.append((parts[0], json.loads(body)))
            farm.workers[parts[0]] = {**farm.workers[parts[0]], **json.loads(body)}
            farm.emit("worker", farm.workers[parts[0]])
            return self._send(202)

        def _post_blobs(self, parts, body):
            return self._send(200, {"missing": [digest for digest in json.loads(body)["digests"] if digest not in farm.blobs]})

        def _put_blobs(self, parts, body):
            farm.put_gate.wait(timeout=180)
            if hashlib.sha256(body).hexdigest() != parts[0]:
                return self._problem(400, "These bytes have another SHA-256 than their name says.")
            farm.blobs[parts[0]] = body
            return self._send(201)

        def _get_events(self, parts, body):
            stream = farm.open_stream()
            self.send_response(200)
            self.send_header("Content-Type", "text/event-stream")
            self.send_header("Connection", "close")
            self.end_headers()
            self.close_connection = True
            try:
                self.wfile.write(b"retry: 100\n\n")
                while (text := stream.get()) is not None:
                    self.wfile.write(text)
            except OSError:
                pass
            finally:
                farm.close_stream(stream)

    return Handler
