"""Kubernetes as an engine: workers are pods. kubectl starts, lists, drains and ends them.

A pod is made from the template in a Deployment of the cluster, so that image, secrets, TLS and security settings are given in one
place, the Deployment's manifest.
"""

import contextlib
import copy
import datetime
import json
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from lightshaft_command.farm_up import child
from lightshaft_command.farm_up.engine import Unreadable, Worker, first_line, keep_log, new_id, worker_name
from lightshaft_command.farm_up.fields import at, text
from lightshaft_command.farm_up.numbers import read_number
from lightshaft_command.programs import Problem, Usage

FARM_LABEL, WORKER_LABEL = "lightshaft.io/farm", "lightshaft.io/worker"
# An autoscaler of nodes does not remove a node that runs a pod without a controller, such as ours, unless the pod is so marked.
SAFE_TO_EVICT = "cluster-autoscaler.kubernetes.io/safe-to-evict"
# A container does not start for one of these reasons, and waiting longer will not help: its image or its configuration is at fault.
HOPELESS = {"ImagePullBackOff", "ErrImagePull", "InvalidImageName", "CreateContainerConfigError", "CreateContainerError", "RunContainerError"}


@dataclass
class Options:
    farm: str
    like: str = "deployment/worker"  # the Deployment from whose template pods are made
    threads: int = 1  # cores that the template must request
    drain_seconds: int = 120  # the pods' grace period: time that a worker has to deliver its results and end
    minutes: int = 60  # time limit, after which Kubernetes ends the pod, with that grace period
    logs: str = "."
    kubectl: list[str] = field(default_factory=list)  # more options of kubectl, one word each
    worker_options: list[str] = field(default_factory=list)


class Kubernetes:
    def __init__(self, options: Options):
        self._options = options
        version = _parsed(self._kubectl("version", "--output=json"))
        self._deployment = _parsed(self._kubectl("get", options.like, "--output=json"))
        pod_like(self._deployment, options, "0")
        self.version = f"kubernetes {text(version, 'serverVersion', 'gitVersion')}"

    def workers(self) -> list[Worker]:
        answer = self._kubectl("get", "pods", f"--selector={FARM_LABEL}={self._options.farm}", "--output=json")
        workers, ended = parse_pods(_parsed(answer), time.time())
        for id in ended:
            self._remove_ended(id)
        return workers

    def start(self, count: int) -> Sequence[str]:
        ids = [new_id() for _ in range(count)]
        pods = [pod_like(self._deployment, self._options, id) for id in ids]
        self._kubectl("create", "--filename=-", stdin=json.dumps({"apiVersion": "v1", "kind": "List", "items": pods}))
        return ids

    def drain(self, workers: Sequence[Worker]) -> None:
        self._remove(workers)

    def kill(self, workers: Sequence[Worker]) -> None:
        """Removes the pods without waiting for their nodes to confirm it, because a lost node never confirms it."""
        self._remove(workers, "--grace-period=0", "--force")

    def _remove(self, workers: Sequence[Worker], *options: str) -> None:
        if workers:
            self._kubectl("delete", "pods", "--ignore-not-found", "--wait=false", *options, *(_pod_name(w.id) for w in workers))

    def _remove_ended(self, id: str) -> None:
        with contextlib.suppress(Problem):
            keep_log(self._options.logs, worker_name(self._options.farm, id), self._kubectl("logs", _pod_name(id)))
        with contextlib.suppress(Problem):
            self._kubectl("delete", "pod", "--ignore-not-found", "--wait=false", _pod_name(id))

    def _kubectl(self, *words: str, stdin: str = "") -> str:
        done = child.run(["kubectl", *self._options.kubectl, *words], stdin)
        if done.code != 0:
            raise Problem(f"kubectl {words[0]}: {first_line(done.err)}")
        return done.out


def _pod_name(id: str) -> str:
    return f"lightshaft-worker-{id}"


def _parsed(answer: str) -> Any:
    try:
        return json.loads(answer)
    except ValueError:
        return None


def _cores_of(container: Any) -> int:
    """The cores that the container requests ("4" or "2500m"), rounded up; 0: it requests none."""
    asked = text(container, "resources", "requests", "cpu")
    value = read_number(asked.removesuffix("m"))
    return math.ceil(value / 1000 if asked.endswith("m") else value) if value is not None else 0


def _unix_seconds(utc: str) -> float | None:
    """Parses "2026-11-25T15:03:21Z", for example."""
    try:
        return datetime.datetime.strptime(utc, "%Y-%m-%dT%H:%M:%SZ").replace(tzinfo=datetime.UTC).timestamp()
    except ValueError:
        return None


def pod_like(deployment: Any, options: Options, id: str) -> Any:
    """The pod of a new worker, made from the template in `deployment`, which `kubectl get -o json` has printed.

    Usage: there is no template, or it does not request `options.threads` cores.
    """
    pod = copy.deepcopy(at(deployment, "spec", "template"))
    worker = at(pod, "spec", "containers", 0)
    if not isinstance(worker, dict):
        raise Usage(f"{options.like} has no template of a pod")
    cores = _cores_of(worker)
    if cores != options.threads:
        raise Usage(f"the pods of {options.like} ask for {cores} cores: say --threads {max(cores, 1)}, or change its resources.requests.cpu")
    worker["args"] = [*(at(worker, "args") or []), *options.worker_options, "--name", worker_name(options.farm, id)]
    labels = {**(at(pod, "metadata", "labels") or {}), FARM_LABEL: options.farm, WORKER_LABEL: id}
    annotations = {**(at(pod, "metadata", "annotations") or {}), SAFE_TO_EVICT: "true"}
    pod["metadata"] = {**(at(pod, "metadata") or {}), "name": _pod_name(id), "labels": labels, "annotations": annotations}
    pod["spec"] |= {"restartPolicy": "Never", "terminationGracePeriodSeconds": options.drain_seconds, "activeDeadlineSeconds": options.minutes * 60}
    return {**pod, "apiVersion": "v1", "kind": "Pod"}


def parse_pods(answer: Any, unix_time: float) -> tuple[list[Worker], list[str]]:
    """Reads the answer of `kubectl get pods -o json`: the workers, and the ids of those that have ended; `unix_time` is now.

    Unreadable: it is not a list of pods that were made by pod_like().
    """
    pods = at(answer, "items")
    if not isinstance(pods, list):
        raise Unreadable("kubectl answered with no list of pods")
    workers: list[Worker] = []
    ended: list[str] = []
    for pod in pods:
        id, phase, container = text(pod, "metadata", "labels", WORKER_LABEL), text(pod, "status", "phase"), at(pod, "spec", "containers", 0)
        if not id or not phase or container is None:
            raise Unreadable("kubectl answered with something else than a worker's pod")
        if phase in ("Succeeded", "Failed"):
            ended.append(id)
            continue
        statuses = at(pod, "status", "containerStatuses")
        hopeless = isinstance(statuses, list) and any(text(status, "state", "waiting", "reason") in HOPELESS for status in statuses)
        since = _unix_seconds(text(pod, "status", "startTime"))
        seconds = 0.0 if since is None else max(0.0, unix_time - since)
        workers.append(Worker(id, "running" if phase != "Pending" else "stuck" if hopeless else "waiting", seconds, max(1, _cores_of(container))))
    return workers, ended
