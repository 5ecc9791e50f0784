"""`lightshaft farm up --on kubernetes` against a real API server. A node that runs pods as processes of this machine stands for
kubelet; where there is none, pods wait."""

import json
import os
import subprocess

import pytest
from cli_kit import lightshaft
from engine_kit import FarmUp, calm_pixels, connected, renders_as_alone
from kubernetes_api import Node, put_deployment
from local_farm import SCENE, bin_dir, wait_until

LONG = {"spp": 400}


@pytest.fixture
def cluster(api, farm):
    put_deployment(api, farm)
    yield api
    api.kubectl("delete", "pods", "--all", "--grace-period=0", "--force")
    api.kubectl("delete", "deployment", "worker")


@pytest.fixture
def node(cluster, farm):
    node = Node(cluster, farm.folder / "node", bin_dir() / "lightshaft-worker")
    yield node
    node.close()


@pytest.fixture
def start(farm, cluster):
    started = []

    def start(*flags, **options):
        started.append(FarmUp(farm, "kubernetes", *flags, environment=cluster.environment, **options))
        return started[-1]

    yield start
    for up in started:
        up.kill()


def test_pods_follow_the_wish_up_and_down_to_none(farm, cluster, start):
    """Without a node: they wait, until their job ends."""
    job = farm.submit(SCENE, **LONG)
    worker = farm.add_worker("--fake-delay", 20, name="desk")
    farm.wait_for_progress(job, 20)
    worker.terminate()
    up = start("--workers", 3, "--finish-in", .001)

    pods = wait_until(lambda: len(cluster.pods()) == 3 and cluster.pods(), "three pods wait")

    assert {p["status"]["phase"] for p in pods} == {"Pending"}
    labels = {"app.kubernetes.io/name": "lightshaft", "app.kubernetes.io/component": "worker", "lightshaft.io/farm": "farm"}
    for pod in pods:
        assert labels.items() <= pod["metadata"]["labels"].items()
        assert pod["spec"]["terminationGracePeriodSeconds"] == 120 and pod["spec"]["restartPolicy"] == "Never"
        assert pod["spec"]["containers"][0]["args"][-1] == f"farm-{pod['metadata']['labels']['lightshaft.io/worker']}"
        assert farm.join_token not in json.dumps(pod)
    farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "cancelled"}')
    wait_until(lambda: not cluster.pods(), "no pod is left")
    up.end()


def test_workers_render_the_pixels_of_render_and_go(farm, cluster, node, start, fog, tmp_path):
    up, _ = renders_as_alone(farm, start, fog, tmp_path)

    assert cluster.pods() == []
    report = up.report()
    assert report["engine"].startswith("kubernetes v1.") and report["workers_started"] >= 1
    print(report["engine"])


def test_a_worker_that_is_drained_hands_in_its_work_within_the_grace_period(farm, cluster, node, start):
    pixels = calm_pixels(farm, SCENE, **LONG)
    job = farm.submit(SCENE, **LONG)
    up = start(delay=300)
    farm.wait_for_progress(job, 1)
    first = connected(farm)

    # As an administrator who drains its node does.
    cluster.kubectl("delete", "pods", "--all", "--wait=false")
    wait_until(lambda: (now := connected(farm)) and now != first, "another worker has joined")

    log = next(f for f in (farm.folder / "node").glob("*/log") if first[0].removeprefix("farm-") in str(f)).read_text()
    assert "drain" in log.lower()
    metrics = farm.request("GET", "/metrics").decode()
    assert 'lightshaft_units_freed_total{cause="worker lost"} 0' in metrics
    assert farm.pixels(job) == pixels
    up.end()
    assert up.report()["workers_started"] >= 2


def test_farm_up_that_was_killed_takes_its_workers_up_again(farm, cluster, node, start):
    job = farm.submit(SCENE, **LONG)
    first = start(delay=300)
    farm.wait_for_progress(job, 1)
    before = {p["metadata"]["name"] for p in cluster.pods()}
    first.kill()

    again = start(delay=300)
    farm.wait_for_job(job)

    assert len(before) == 1 and {p["metadata"]["name"] for p in cluster.pods()} <= before
    again.end()
    assert again.report()["workers_started"] == 1


def test_refusals_say_what_to_do(farm, cluster):
    nowhere = dict(os.environ, KUBECONFIG="/nonexistent/config", LIGHTSHAFT_TOKEN=farm.token)
    there = dict(cluster.environment, LIGHTSHAFT_TOKEN=farm.token)
    up = ["farm", "up", "--on", "kubernetes", "--to", farm.url()]

    for environment, more, words in ((nowhere, [], "kubectl"), (there, ["--like", "deployment/other"], "not found"), (there, ["--threads", "4"], "say --threads 1")):
        said = subprocess.run([bin_dir() / "lightshaft", *up, *more], env=environment, capture_output=True, text=True)
        assert said.returncode == (2 if "--threads" in more else 1) and words in said.stderr, said.stderr
