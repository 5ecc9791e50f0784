"""What the tests of `lightshaft farm up` share: starting it for a LocalFarm, and its report."""

import json
import os
import signal

from cli_kit import digest, lightshaft
from local_farm import Process, bin_dir


class FarmUp(Process):
    """`lightshaft farm up` as a process. Fake workers, unless told otherwise, whose units take `delay` milliseconds."""

    def __init__(self, farm, engine, *flags, environment=None, delay=30, fake=True, name="farm", poll=.2):
        self.report_file = farm.folder / f"{name}-report.json"
        self.logs = farm.folder / "worker-logs"
        self.logs.mkdir(exist_ok=True)
        worker = [f"--worker-option={word}" for word in ("--fake", "--fake-delay", delay)] if fake else []
        super().__init__(
            "farm-up",
            [bin_dir() / "lightshaft", "farm", "up", "--on", engine, "--to", farm.url(), "--coordinator", f"127.0.0.1:{farm.grpc}",
             "--join-token", farm.secrets / "join-token", "--report", self.report_file, "--logs", self.logs, "--poll", poll, "--name", name, *worker, *flags],
            farm.folder / f"{name}-up.log", dict(environment or os.environ, LIGHTSHAFT_TOKEN=farm.token))

    def report(self):
        return json.loads(self.report_file.read_text())

    def end(self):
        """Ctrl-C: it drains its workers and ends with 0."""
        self.signal(signal.SIGINT)
        assert self.wait() == 0, self.output()


def calm_pixels(farm, scene, **spec):
    """The pixels of a job on one undisturbed worker of the same farm."""
    worker = farm.add_worker()
    pixels = farm.pixels(farm.submit(scene, **spec))
    worker.terminate()
    return pixels


def renders_as_alone(farm, start, scene, folder):
    """The workers of a farm-up that `start` starts give a scene the pixels of `lightshaft render`, and go. It, and the job."""
    alone = digest(lightshaft("render", scene, "-o", folder / "alone.exr", "--spp", 16))
    sent = lightshaft("submit", scene, "--to", farm.url(), "--token-file", farm.data / "token", "--spp", 16)
    job = sent.stdout.split()[0]
    up = start("--until-done", "--workers", 2, fake=False)
    assert up.wait() == 0, up.output()
    assert farm.pixels(job) == alone
    return up, job


def connected(farm):
    return [w["name"] for w in farm.get("/api/v1/workers")["workers"] if w["state"] == "connected"]
