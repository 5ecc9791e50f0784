#!/usr/bin/env python3
"""What an engine adds to a job: a table.

    bench/engines.py [ENGINE...]      a row for each of local, slurm, ssh, docker, kubernetes, openjd, or of those that are named

`local` is a worker that a person starts by hand. For openjd, which has no farm-up, the session with its worker is started together
with the job, and the idle cost is that of the command `openjd` (tests/venv.sh openjd installs it). Slurm and sshd are started on this machine. For docker its engine must answer; for
kubernetes LIGHTSHAFT_KUBERNETES must say what tests/kubernetes/tools.sh has built: the API server is a real one, the node is
tests/support/kubernetes_api.py. Fake workers, so that only the engine's own time shows.
"""

import contextlib
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests/support"), str(ROOT / "tests/system")]

import docker_engine  # noqa: E402
import openjd_job  # noqa: E402
from engine_kit import FarmUp  # noqa: E402
from kubernetes_api import KubernetesApi, Node, put_deployment  # noqa: E402
from local_farm import SCENE, LocalFarm, bin_dir, wait_until  # noqa: E402
from slurm_cluster import SlurmCluster  # noqa: E402
from ssh_server import SshServer  # noqa: E402

REPEATS = 3


class Session(openjd_job.OpenjdJob):
    """A worker as a task of Open Job Description."""

    def __init__(self, farm):
        super().__init__(
            "workers", farm.folder / "openjd.log", Coordinator=f"127.0.0.1:{farm.grpc}", TokenFile=farm.secrets / "join-token", IdleSeconds=600,
            Threads=1, CacheFolder=farm.folder / "cache", Program=bin_dir() / "lightshaft-worker", MoreOptions="--fake --fake-delay=500")

    def end(self):
        self.cancel()

    def report(self):
        return {"engine": openjd_job.version()}


def idle_cost(farm, up):
    """Core seconds of farm-up itself in ten minutes without work."""
    def used():
        fields = pathlib.Path(f"/proc/{up.popen.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")  # itself and the commands that it ran
    began, before = time.monotonic(), used()
    wait_until(lambda: time.monotonic() - began > 20, "twenty seconds have passed")
    return (used() - before) * 600 / (time.monotonic() - began)


def round_of(farm, up):
    """(what had started the workers, seconds from submission to the first pixels, seconds from Ctrl-C to the end of farm-up with all workers drained)"""
    began = time.monotonic()
    job = farm.submit(SCENE, spp=400)
    up = up() if callable(up) else up
    farm.wait_for_progress(job, 1)
    first = time.monotonic() - began
    began = time.monotonic()
    if hasattr(up, "end"):
        up.end()
    else:
        up.terminate()
    drained = time.monotonic() - began
    farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "cancelled"}')
    return up, first, drained


def measure(make, folder):
    """`make`: a context manager of what starts workers for a farm, or of a function that starts it once there is a job."""
    firsts, drains, idle = [], [], 0.0
    for number in range(REPEATS):
        with LocalFarm(folder / str(number)) as farm, make(farm) as up:
            if number == 0 and callable(up):
                idle_session = up()
                farm.wait_for_workers(1)
                idle = idle_cost(farm, idle_session)
                idle_session.end()
            elif number == 0 and isinstance(up, FarmUp):
                idle = idle_cost(farm, up)
            up, first, drained = round_of(farm, up)
            firsts.append(first)
            drains.append(drained)
            version = up.report()["engine"] if hasattr(up, "report") else "none"
    return version, idle, firsts, drains


def up_on(engine, farm, *flags, **options):
    return FarmUp(farm, engine, *flags, delay=500, poll=5, **options)


@contextlib.contextmanager
def local(folder):
    yield lambda farm: contextlib.nullcontext(farm.add_worker("--fake-delay", 500))


@contextlib.contextmanager
def slurm(folder):
    with SlurmCluster(folder / "cluster") as cluster:
        yield lambda farm: contextlib.nullcontext(up_on("slurm", farm, environment=cluster.environment))


@contextlib.contextmanager
def ssh(folder):
    with SshServer(folder / "sshd", ["one"]) as server:
        machines = folder / "machines"
        machines.write_text("one\n")
        yield lambda farm: contextlib.nullcontext(up_on("ssh", farm, "--machines", machines, "--ssh-config", server.config))


@contextlib.contextmanager
def docker(folder):
    yield lambda farm: contextlib.nullcontext(up_on("docker", farm, *docker_engine.of_this_build()))


@contextlib.contextmanager
def kubernetes(folder):
    with KubernetesApi(folder / "api", pathlib.Path(os.environ["LIGHTSHAFT_KUBERNETES"])) as api:
        @contextlib.contextmanager
        def up(farm):
            put_deployment(api, farm)
            node = Node(api, farm.folder / "node", bin_dir() / "lightshaft-worker")
            try:
                yield up_on("kubernetes", farm, environment=api.environment)
            finally:
                node.close()
        yield up


@contextlib.contextmanager
def openjd(folder):
    yield lambda farm: contextlib.nullcontext(lambda: Session(farm))


ENGINES = {engine.__name__: engine for engine in (local, slurm, ssh, docker, kubernetes, openjd)}


def main():
    folder = pathlib.Path(tempfile.mkdtemp(prefix="lightshaft-engines-"))
    print("| engine | farm-up's own core seconds in 10 min without work | submission to first pixels, s | Ctrl-C until all have drained, s |\n|---|---|---|---|")
    for name in sys.argv[1:] or ENGINES:
        (folder / name).mkdir()
        with ENGINES[name](folder / name) as make:
            version, idle, firsts, drains = measure(make, folder / name)

        def figures(values):
            return f"{statistics.median(values):.1f} ({min(values):.1f} to {max(values):.1f})"
        print(f"| {'a worker that waits' if version == 'none' else version} | {'-' if version == 'none' else f'{idle:.1f}'} "
              f"| {figures(firsts)} | {figures(drains)} |", flush=True)
    print(f"\n{REPEATS} rounds each, units of 0.5 s, --poll 5; commit "
          + subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip())


if __name__ == "__main__":
    main()
