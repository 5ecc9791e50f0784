"""See run.sh. Prints a line for each thing that is so, and ends with 1 at the first that is not."""

import json
import os
import pathlib
import socket
import ssl
import subprocess
import sys
import tempfile
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
sys.path.insert(0, str(ROOT / "tests" / "system"))

from cli_kit import write_fog  # noqa: E402
from local_farm import wait_until  # noqa: E402



def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


PROJECT = "lightshaft-check"
TAG = os.environ.get("LIGHTSHAFT_TAG", "local")
PORT = os.environ.get("LIGHTSHAFT_PORT") or str(free_port())
WORKERS = 3
OPTIONS = ["--size", "288x160", "--spp", "64", "--seed", "7"]
PATIENCE = 600


def docker(*arguments, check=True, **more):
    done = subprocess.run(["docker", *arguments], capture_output=True, text=True, **more)
    if check and done.returncode != 0:
        raise SystemExit(f"docker {' '.join(arguments)}: {done.stderr or done.stdout}")
    return done.stdout.strip() if check else done


def compose(*arguments):
    command = ["docker-compose", "-p", PROJECT, "-f", str(ROOT / "deploy" / "docker-compose.yml"), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, env=dict(os.environ, LIGHTSHAFT_PORT=PORT, LIGHTSHAFT_TAG=TAG))
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")
    return done.stdout.strip()


def containers(service):
    return compose("ps", "-q", service).split()


def so(condition, what):
    print(f"{'ok ' if condition else 'NOT SO'} {what}", flush=True)
    if not condition:
        raise SystemExit(1)


URL = f"https://localhost:{PORT}"


class Api:
    def __init__(self, token, authority):
        self.token, self.trust = token, ssl.create_default_context(cadata=authority)

    def get(self, path):
        request = urllib.request.Request(f"{URL}{path}", headers={"Authorization": f"Bearer {self.token}"})
        with urllib.request.urlopen(request, timeout=20, context=self.trust) as reply:
            return json.loads(reply.read())

    def patient(self, path):
        """The same, while the coordinator may be away."""
        def asked():
            try:
                return self.get(path)
            except OSError:
                return None
        return wait_until(asked, f"an answer to {path}", PATIENCE)

    def connected(self):
        return sum(w["state"] == "connected" for w in self.patient("/api/v1/workers")["workers"])


def client(scene, *arguments, network):
    """The command `lightshaft` of the worker's image, with the scene's folder to read and write."""
    mount = f"{scene.parent}:/scene"
    return docker("run", "--rm", "--network", network, "--user", f"{os.getuid()}:{os.getgid()}", "-v", mount, "-w", "/scene",
                  "-e", "LIGHTSHAFT_TOKEN", "-e", "LIGHTSHAFT_CA=ca.pem", "--entrypoint", "lightshaft", f"lightshaft-worker:{TAG}", *arguments)


def expected_pixels(scene):
    client(scene, "render", scene.name, *OPTIONS, "-o", "out.exr", "--report", "report.json", "--quiet", network="none")
    return json.loads((scene.parent / "report.json").read_text())["pixels_sha256"]


def check_confinement():
    for service in ("coordinator", "redis", "worker"):
        for one in containers(service):
            facts = json.loads(docker("inspect", one))[0]
            host = facts["HostConfig"]
            confined = (host["ReadonlyRootfs"] and facts["Config"]["User"] == "10001:10001" and host["CapDrop"] == ["ALL"]
                        and any("no-new-privileges" in o for o in host["SecurityOpt"]) and host["RestartPolicy"]["Name"] == "unless-stopped")
            so(confined, f"{facts['Name'][1:]}: read-only root, user 10001, no capability, no new privileges, restarted by itself")
    bindings = json.loads(docker("inspect", containers("coordinator")[0]))[0]["NetworkSettings"]["Ports"]
    so([b["HostIp"] for b in bindings["8080/tcp"]] == ["127.0.0.1"], "the dashboard is published on localhost only")
    so(not bindings.get("50051/tcp"), "the workers' port is not published")
    worker = containers("worker")[0]
    host = json.loads(docker("inspect", worker))[0]["HostConfig"]
    so(0 < host["Memory"] == host["MemorySwap"] and host["PidsLimit"] > 0 and host["OomScoreAdj"] > 0,
       f"a worker has at most {host['Memory'] >> 20} MiB and {host['PidsLimit']} processes and threads, and is the first to go")
    reach = "exec 3<>/dev/tcp/{}"
    so(docker("exec", worker, "timeout", "3", "bash", "-c", reach.format("coordinator/50051"), check=False).returncode == 0,
       "a worker reaches the coordinator")
    so(docker("exec", worker, "timeout", "3", "bash", "-c", reach.format("redis/6379"), check=False).returncode != 0,
       "a worker does not reach Redis")
    networks = json.loads(docker("inspect", worker))[0]["NetworkSettings"]["Networks"]
    so(set(networks) == {f"{PROJECT}_farm"} and json.loads(docker("network", "inspect", f"{PROJECT}_farm"))[0]["Internal"],
       "a worker is on one network, which leads nowhere else")
    listing = docker("run", "--rm", "--entrypoint", "find", f"lightshaft-coordinator:{TAG}", "/usr", "-name", "*embree*", "-o", "-name", "*openvdb*")
    so(listing == "", "the coordinator's image has neither Embree nor OpenVDB")


def kill_inside(container):
    """kill -9 of everything in it: its init then ends, and so it does."""
    docker("exec", container, "sh", "-c", "kill -9 -1", check=False)


def restarts():
    return sum(json.loads(docker("inspect", one))[0]["RestartCount"] for s in ("coordinator", "redis", "worker") for one in containers(s))


def storm(api, scene, expected, what, kill):
    print(f"    storm: {what}", flush=True)
    before, begun = restarts(), time.monotonic()
    job = client(scene, "submit", scene.name, *OPTIONS, "--to", URL, network="host").split()[0]
    total = api.get(f"/api/v1/jobs/{job}")["units_total"]
    for share in kill:
        wait_until(lambda: api.patient(f"/api/v1/jobs/{job}")["units_done"] >= total * share, f"{share:.0%} of the job", PATIENCE)
        kill[share]()
    wait_until(lambda: api.patient(f"/api/v1/jobs/{job}")["state"] in ("done", "failed", "cancelled"), "the job ends", PATIENCE)
    pixels = api.patient(f"/api/v1/jobs/{job}/report").get("pixels_sha256")
    seconds = time.monotonic() - begun
    so(pixels == expected, f"   the same pixels, in {seconds:.1f} s, {restarts() - before} containers restarted")
    wait_until(lambda: api.connected() == WORKERS, "all workers are back", PATIENCE)


def check_vdb(api, folder):
    """A scene with an OpenVDB file: the program that reads it is in the worker's image."""
    subprocess.run([sys.executable, "-B", ROOT / "scenes" / "bath" / "make_bath.py", folder / "bath", "--setting", "sketch"], check=True, capture_output=True)
    bath = folder / "bath" / "bath.xml"
    (bath.parent / "ca.pem").write_text((folder / "ca.pem").read_text())
    small = ["--size", "96x54", "--spp", "8"]
    client(bath, "render", bath.name, *small, "-o", "out.exr", "--report", "report.json", "--quiet", network="none")
    job = client(bath, "submit", bath.name, *small, "--to", URL, network="host").split()[0]
    view = wait_until(lambda: (v := api.patient(f"/api/v1/jobs/{job}"))["state"] in ("done", "failed") and v, "the job with a .vdb ends", PATIENCE)
    same = view["state"] == "done" and api.patient(f"/api/v1/jobs/{job}/report")["pixels_sha256"] == json.loads((bath.parent / "report.json").read_text())["pixels_sha256"]
    so(same, f"a scene with a .vdb has the pixels of `lightshaft render` {view['error'] or ''}")


def storms(api, scene, expected):
    def some(service, count=None):
        return lambda: [kill_inside(c) for c in containers(service)[:count]]

    def everything():
        for service in ("redis", "coordinator", "worker"):
            some(service)()

    storm(api, scene, expected, "nothing is killed", {})
    storm(api, scene, expected, "two of three workers killed, twice", {.1: some("worker", 2), .5: some("worker", 2)})
    storm(api, scene, expected, "all workers killed", {.3: some("worker")})
    storm(api, scene, expected, "the coordinator killed, twice", {.2: some("coordinator"), .6: some("coordinator")})
    storm(api, scene, expected, "Redis killed, twice", {.2: some("redis"), .6: some("redis")})
    storm(api, scene, expected, "coordinator, Redis and all workers killed at once", {.4: everything})


def main():
    os.umask(0)
    with tempfile.TemporaryDirectory(prefix="lightshaft-compose-") as folder:
        os.chmod(folder, 0o777)
        scene = pathlib.Path(folder) / "fog.xml"
        write_fog(scene.parent)
        try:
            compose("up", "-d", "--scale", f"worker={WORKERS}")
            token = wait_until(lambda: docker("exec", containers("coordinator")[0], "cat", "/data/token", check=False).stdout.strip(), "the token is made")
            os.environ["LIGHTSHAFT_TOKEN"] = token
            authority = docker("exec", containers("coordinator")[0], "cat", "/secrets/ca.pem")
            (scene.parent / "ca.pem").write_text(authority + "\n")
            api = Api(token, authority + "\n")
            wait_until(lambda: api.connected() == WORKERS, f"{WORKERS} workers are connected", PATIENCE)
            health = lambda: [json.loads(docker("inspect", c))[0]["State"]["Health"]["Status"] for s in ("coordinator", "redis", "worker") for c in containers(s)]
            wait_until(lambda: set(health()) == {"healthy"}, "all containers are healthy", PATIENCE)
            so(True, f"{len(health())} containers are healthy")
            check_confinement()
            expected = expected_pixels(scene)
            check_vdb(api, scene.parent)
            storms(api, scene, expected)
            worker = containers("worker")[0]
            docker("stop", "-t", "60", worker)
            so(json.loads(docker("inspect", worker))[0]["State"]["ExitCode"] == 0, "a worker that is stopped drains and ends with 0")
        except BaseException:
            print(compose("logs", "--tail", "40"), file=sys.stderr)
            raise
        finally:
            compose("down", "-v", "-t", "5")


if __name__ == "__main__":
    main()
