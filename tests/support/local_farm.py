"""LocalFarm: a coordinator and N real workers as processes of this machine, on ports that the system chooses.

Every system test uses it. Conditions are waited for by looking again until a deadline, never by a fixed sleep.
"""

import http.client
import json
import os
import pathlib
import signal
import ssl
import subprocess
import tempfile
import time
import urllib.error
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
PATIENCE = 300.0  # seconds after which a condition that should become true counts as failed


def bin_dir():
    """Where the executables are: $LIGHTSHAFT_BIN, else the first build that has them."""
    if "LIGHTSHAFT_BIN" in os.environ:
        return pathlib.Path(os.environ["LIGHTSHAFT_BIN"])
    for preset in ("release", "dev"):
        folder = ROOT / "build" / preset / "bin"
        if (folder / "lightshaft-coordinator").exists() and (folder / "lightshaft-worker").exists():
            return folder
    raise FileNotFoundError("build the project first, or set LIGHTSHAFT_BIN to the folder of its executables")


def wait_until(condition, what, patience=PATIENCE):
    """Returns the first true value of `condition`; AssertionError with `what` after the deadline."""
    deadline = time.monotonic() + patience
    while True:
        value = condition()
        if value:
            return value
        assert time.monotonic() < deadline, f"did not come true within {patience:.0f} s: {what}"
        time.sleep(0.02)


class HttpError(Exception):
    def __init__(self, status, body):
        super().__init__(f"HTTP {status}: {body}")
        self.status, self.body = status, body


class Process:
    """A child process with its output in a file."""

    def __init__(self, name, args, log, env=None):
        self.name, self.args, self.log, self.env = name, [str(a) for a in args], log, env
        self.start()

    def start(self):
        with open(self.log, "ab") as out:
            self.popen = subprocess.Popen(self.args, stdin=subprocess.DEVNULL, stdout=out, stderr=out, env=self.env)

    def signal(self, number):
        if self.popen.poll() is None:
            self.popen.send_signal(number)

    def kill(self):
        self.signal(signal.SIGKILL)
        self.popen.wait()

    def stop(self):
        self.signal(signal.SIGSTOP)

    def resume(self):
        self.signal(signal.SIGCONT)

    def terminate(self, patience=PATIENCE):
        """SIGTERM; the exit code."""
        self.signal(signal.SIGTERM)
        return self.wait(patience)

    def wait(self, patience=PATIENCE):
        return self.popen.wait(patience)

    def alive(self):
        return self.popen.poll() is None

    def output(self):
        return pathlib.Path(self.log).read_text(errors="replace")


def refused_coordinator(folder, *flags, code=(1, 2), env=None):
    """What a coordinator prints that does not start with these flags; `code`: the exit code, or those that it may have."""
    args = [bin_dir() / "lightshaft-coordinator", "--http", "127.0.0.1:0", "--grpc", "127.0.0.1:0", "--data", folder / "data", *flags]
    coordinator = Process("refused", args, folder / "refused.log", env)
    assert coordinator.wait() in (code if isinstance(code, tuple) else (code,)), coordinator.output()
    return coordinator.output()


class LocalFarm:
    def __init__(self, folder=None, bin=None, flags=(), tls=False, host="127.0.0.1", environment=None, secrets=None, allow_fake=True, within=()):
        self.within = list(within)  # a command that starts the coordinator somewhere else, e.g. in another system's folder
        self.host = host  # the host that workers connect to
        # variables for the coordinator in addition to this process's; read at every start
        self.environment = dict(environment or {})
        self.tls = tls
        # options of the coordinator besides its ports and folder
        self.flags = list(flags) + (["--tls"] if tls else []) + (["--allow-fake"] if allow_fake else [])
        self.bin = pathlib.Path(bin) if bin else bin_dir()
        self._temporary = tempfile.TemporaryDirectory(prefix="lightshaft-farm-") if folder is None else None
        self.folder = pathlib.Path(folder or self._temporary.name)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.data = self.folder / "data"
        self.secrets = pathlib.Path(secrets) if secrets else self.data  # folder of tokens and certificates
        self.flags += ["--secrets", self.secrets] if secrets else []
        self.workers = []
        self.coordinator = None
        self.http = self.grpc = None
        self.count = 0
        self.start_coordinator()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        for process in self.workers + ([self.coordinator] if self.coordinator else []):
            process.resume()
            process.kill()
        if error[0] is not None:
            self.print_logs()
        if self._temporary:
            self._temporary.cleanup()

    def print_logs(self):
        for log in sorted(self.folder.glob("*.log")):
            print(f"---- {log.name}\n{log.read_text(errors='replace')[-4000:]}")

    # ---- the coordinator ----
    def start_coordinator(self):
        """Starts it, or starts it again on the same ports after it was killed or ended."""
        (self.data / "ports.json").unlink(missing_ok=True)
        self.coordinator = Process(
            "coordinator",
            [*self.within, self.bin / "lightshaft-coordinator", "--http", f"127.0.0.1:{self.http or 0}",
             "--grpc", f"{self.host}:{self.grpc or 0}", "--data", self.data] + self.flags,
            self.folder / "coordinator.log", dict(os.environ, **self.environment))
        wait_until(lambda: (self.data / "ports.json").exists() or not self.coordinator.alive(), "the coordinator listens")
        assert self.coordinator.alive(), self.coordinator.output()
        ports = json.loads((self.data / "ports.json").read_text())
        self.http, self.grpc = ports["http"], ports["grpc"]
        self.token = (self.secrets / "token").read_text().strip()
        self.join_token = (self.secrets / "join-token").read_text().strip()

    def restart_coordinator(self):
        """kill -9 and a new one on the same folder and ports."""
        self.coordinator.kill()
        self.start_coordinator()

    # ---- workers ----
    def add_worker(self, *flags, threads=1, token=None, fake=True, within=(), environment=None, coordinator=None, name=None, program=("lightshaft-worker",)):
        """`within`: a command that starts it somewhere else, e.g. in a network namespace. `coordinator`: another address than its own.
        `program`: another one that takes a worker's options, and what comes before them."""
        self.count += 1
        called, name = name, f"worker-{self.count}"
        env = dict(os.environ, LIGHTSHAFT_JOIN_TOKEN=self.join_token if token is None else token, **(environment or {}))
        args = [*within, self.bin / program[0], *program[1:], "--coordinator", coordinator or f"{self.host}:{self.grpc}", "--threads", threads,
                "--cache", self.folder / "cache" / name, "--name", called or name]
        if self.tls:
            args += ["--tls-ca", self.secrets / "tls/ca.pem", "--tls-cert", self.secrets / "tls/worker.pem",
                     "--tls-key", self.secrets / "tls/worker.key"]
        worker = Process(name, args + (["--fake"] if fake else []) + list(flags), self.folder / f"{name}.log", env)
        self.workers.append(worker)
        return worker

    def add_workers(self, count, *flags, **options):
        return [self.add_worker(*flags, **options) for _ in range(count)]

    def wait_for_workers(self, count):
        wait_until(lambda: sum(w["state"] == "connected" for w in self.get("/api/v1/workers")["workers"]) >= count,
                   f"{count} workers are connected")

    # ---- HTTP ----
    def url(self):
        return f"{'https' if self.tls else 'http'}://127.0.0.1:{self.http}"

    def trust(self):
        return ssl.create_default_context(cafile=self.secrets / "tls/ca.pem") if self.tls else None

    def request(self, method, path, body=None, content_type="application/json", token=None):
        request = urllib.request.Request(f"{self.url()}{path}", data=body, method=method)
        request.add_header("Authorization", f"Bearer {self.token if token is None else token}")
        if body is not None:
            request.add_header("Content-Type", content_type)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE, context=self.trust()) as reply:
                return reply.read()
        except urllib.error.HTTPError as error:
            raise HttpError(error.code, error.read().decode(errors="replace")) from None

    def token_of(self, user):
        """A token of the role `submit`."""
        return json.loads(self.request("POST", "/api/v1/tokens", json.dumps({"role": "submit", "user": user}).encode()))["token"]

    def get(self, path):
        return json.loads(self.request("GET", path))

    def ask(self, path):
        """(status, Location), redirects not followed; of a coordinator without TLS."""
        connection = http.client.HTTPConnection("127.0.0.1", self.http, timeout=PATIENCE)
        connection.request("GET", path, headers={"Authorization": f"Bearer {self.token}"})
        answer = connection.getresponse()
        answer.read()
        return answer.status, answer.headers.get("Location")

    def has(self, job):
        """Itself, not one of those that share its Redis."""
        return self.ask(f"/api/v1/jobs/{job}")[0] == 200

    def submit(self, scene, **spec):
        """A self-contained scene (text); spec as in the HTTP contract's query. The job's id."""
        query = "&".join(f"{key}={value}" for key, value in spec.items())
        reply = self.request("POST", f"/api/v1/jobs?{query}", scene.encode(), "application/xml")
        return json.loads(reply)["id"]

    def job(self, job):
        return self.get(f"/api/v1/jobs/{job}")

    def wait_for_job(self, job, states=("done",), patience=PATIENCE):
        """Waits for an end of the job; it must be one of `states`."""
        ends = {"done", "failed", "cancelled"}

        def ended():
            view = self.job(job)
            return view if view["state"] in ends | set(states) else None

        view = wait_until(ended, f"job {job} ends", patience)
        assert view["state"] in states, view
        return view

    def wait_for_progress(self, job, units):
        return wait_until(lambda: (v := self.job(job))["units_done"] >= units and v, f"{units} units of {job} are done")

    def report(self, job):
        return self.get(f"/api/v1/jobs/{job}/report")

    def pixels(self, job):
        """The finished job's pixels_sha256."""
        self.wait_for_job(job)
        return self.report(job)["pixels_sha256"]


SCENE = """<scene version="3.0.0">
  <integrator type="volpath"/>
  <sensor type="perspective">
    <float name="fov" value="45"/>
    <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler>
    <film type="hdrfilm"><integer name="width" value="96"/><integer name="height" value="64"/><rfilter type="box"/></film>
  </sensor>
  <shape type="sphere"><bsdf type="diffuse"/></shape>
  <emitter type="constant"/>
</scene>
"""
