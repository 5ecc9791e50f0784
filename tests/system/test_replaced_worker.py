"""A worker whose program file is replaced while it runs, by an upgrade say."""

import os
import pathlib
import shutil
import signal

from local_farm import SCENE, wait_until


def render_children(worker):
    tasks = pathlib.Path(f"/proc/{worker.popen.pid}/task")
    return [int(child) for task in tasks.iterdir() for child in (task / "children").read_text().split()]


def test_a_new_render_child_is_the_program_that_the_worker_was_started_as(farm, tmp_path):
    real, farm.bin = farm.bin, tmp_path / "bin"
    farm.bin.mkdir()
    program = farm.bin / "lightshaft-worker"
    shutil.copy(real / program.name, program)
    worker = farm.add_worker("--fake-delay", 10)
    job = farm.submit(SCENE, spp=2048)
    farm.wait_for_progress(job, 1)

    upgrade = farm.bin / "upgrade"
    upgrade.write_text("#!/bin/sh\nexit 7\n")
    upgrade.chmod(0o755)
    os.replace(upgrade, program)
    [child] = wait_until(lambda: render_children(worker), "the worker has a render child")
    os.kill(child, signal.SIGKILL)
    assert farm.job(job)["state"] == "running"

    farm.wait_for_job(job)
    assert worker.alive()
