"""`lightshaft farm up --on slurm` against a real Slurm: its daemons run on this machine."""

import pathlib
import subprocess

import pytest
import slurm_cluster
from cli_kit import lightshaft
from engine_kit import FarmUp, calm_pixels, connected, renders_as_alone
from local_farm import SCENE, wait_until

pytestmark = pytest.mark.skipif(bool(slurm_cluster.missing()), reason=f"Slurm is not installed: no {', '.join(slurm_cluster.missing())}")

LONG = {"spp": 400}


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with slurm_cluster.SlurmCluster(tmp_path_factory.mktemp("slurm")) as cluster:
        yield cluster


@pytest.fixture
def start(farm, cluster):
    """Starts farm-ups, and ends those that a failed test leaves behind."""
    started = []

    def start(*flags, **options):
        started.append(FarmUp(farm, "slurm", *flags, environment=cluster.environment, **options))
        return started[-1]

    yield start
    for up in started:
        up.kill()
    cluster.run("scancel", "--me", check=False)
    wait_until(lambda: not cluster.jobs(), "Slurm's queue is empty")


def running(cluster):
    return [job for job, state in cluster.jobs() if state == "RUNNING"]


def test_workers_render_the_pixels_of_render_and_go(farm, cluster, start, fog, tmp_path):
    up, _ = renders_as_alone(farm, start, fog, tmp_path)

    assert cluster.jobs() == []
    report = up.report()
    assert report["engine"].startswith("slurm")
    assert report["workers_started"] >= 1 and report["spent_core_hours"] > 0


@pytest.mark.slow
def test_one_picture_through_preemption_a_restarted_controller_and_a_lost_node(farm, cluster, start):
    pixels = calm_pixels(farm, SCENE, **LONG)
    job = farm.submit(SCENE, **LONG)
    up = start("--workers", 2, "--sbatch=--partition=low", delay=700)
    farm.wait_for_progress(job, 2)

    # A job of the other partition takes the whole machine: Slurm ends the workers and puts them back into its queue.
    urgent = cluster.run("sbatch", "--parsable", "--partition=urgent", "--ntasks=4", "--output=/dev/null", "--wrap=exec tail -f /dev/null").strip()
    wait_until(lambda: (urgent, "RUNNING") in cluster.jobs() and len(running(cluster)) == 1, "the urgent job has preempted the workers")
    cluster.run("scancel", urgent)
    done = farm.job(job)["units_done"]
    wait_until(lambda: running(cluster) and connected(farm), "a worker has come back")
    farm.wait_for_progress(job, done + 1)

    # The controller is restarted.
    cluster.stop_controller()
    wait_until(lambda: "the workers are unknown" in up.output(), "farm-up has noticed")
    cluster.start_controller()
    wait_until(lambda: running(cluster), "Slurm knows the worker")

    # The node is lost, and comes back.
    cluster.run("scontrol", "update", f"nodename={cluster.host}", "state=down", "reason=test")
    wait_until(lambda: not running(cluster), "no worker runs")
    cluster.run("scontrol", "update", f"nodename={cluster.host}", "state=resume")
    wait_until(lambda: running(cluster), "a worker runs again")

    assert farm.pixels(job) == pixels
    up.end()
    assert cluster.jobs() == []
    assert up.report()["workers_started"] >= 3


def test_idle_workers_go_and_new_work_brings_others(farm, cluster, start):
    first = farm.submit(SCENE, spp=8)
    up = start("--idle", 1, delay=1)
    farm.wait_for_job(first)

    wait_until(lambda: not cluster.jobs(), "Slurm has no worker")
    assert up.alive()

    farm.wait_for_job(farm.submit(SCENE, spp=8, seed=2))
    up.end()


@pytest.mark.slow
def test_farm_up_that_was_killed_takes_its_workers_up_again(farm, cluster, start):
    job = farm.submit(SCENE, **LONG)
    first = start(delay=300)
    farm.wait_for_progress(job, 1)
    before = cluster.jobs()
    first.kill()
    spent = first.report()["spent_core_hours"]

    again = start(delay=300)
    farm.wait_for_job(job)

    assert len(before) == 1 and {name for name, _ in cluster.jobs()} <= {name for name, _ in before}
    again.end()
    report = again.report()
    assert report["workers_started"] == 1
    assert report["spent_core_hours"] > spent


def test_budget_drains_the_workers_and_starts_no_more(farm, cluster, start):
    job = farm.submit(SCENE, **LONG)
    # A worker of one core needs a minute, its drain and two looks, 63.4 core seconds, to be started: the first is, no second.
    up = start("--workers", 3, "--drain", 3, "--budget", 66 / 3600, "--finish-in", .01, delay=1000)

    wait_until(lambda: "the budget" in up.output() and len(running(cluster)) == 1, "one worker runs, and the budget allows no more")

    assert len(cluster.jobs()) == 1
    up.end()
    assert up.report()["spent_core_hours"] <= 66 / 3600
    assert farm.job(job)["state"] != "done"


def test_token_is_in_no_script_argument_or_environment_of_slurm(farm, cluster, start):
    farm.submit(SCENE, **LONG)
    up = start(delay=1000)
    wait_until(lambda: connected(farm), "a worker has joined")
    (job,) = running(cluster)
    script = cluster.folder / "script"
    cluster.run("scontrol", "write", "batch_script", job, str(script))
    shown = cluster.run("scontrol", "show", "job", "-dd", job)
    lines = subprocess.run(["ps", "axeww", "-o", "args"], capture_output=True, text=True, check=True).stdout
    stored = [f.read_bytes() for f in cluster.folder.rglob("*") if f.is_file()] + [f.read_bytes() for f in up.logs.iterdir()]

    assert "exec" in script.read_text() and "lightshaft-farm" in shown and str(farm.secrets / "join-token") in lines
    for secret in (farm.join_token, farm.token):
        ours = [line for line in lines.splitlines() if secret in line and "LIGHTSHAFT_TOKEN=" not in line]
        assert ours == [] and secret not in shown
        assert not any(secret.encode() in text for text in stored)
    worker = [p for p in pathlib.Path("/proc").glob("[0-9]*/environ") if is_worker(p.parent, farm)]
    assert worker and all(farm.token.encode() not in p.read_bytes() and farm.join_token.encode() not in p.read_bytes() for p in worker)
    up.end()


def is_worker(process, farm):
    try:
        return f"127.0.0.1:{farm.grpc}".encode() in (process / "cmdline").read_bytes() and b"lightshaft-worker" in (process / "cmdline").read_bytes()
    except OSError:
        return False


def test_refused_submissions_are_tried_again_later_and_say_why(farm, cluster, start):
    farm.submit(SCENE, spp=8)
    up = start("--sbatch=--partition=nowhere")

    wait_until(lambda: "invalid partition" in up.output() and "starts of workers in a row failed" in up.output(), "farm-up says why")

    up.end()
