"""deploy/kubernetes without a cluster: every manifest has the fields that it should and no others, and whatever names another
thing (a volume, a port, a secret and its keys, labels, a service, an image) names one that is there."""

import copy
import json
import re
import ssl
import subprocess
import tomllib
import urllib.request

import pytest
from kubernetes_fields import schema_of
from local_farm import ROOT, LocalFarm, Process, bin_dir, wait_until

yaml = pytest.importorskip("yaml")
jsonschema = pytest.importorskip("jsonschema")

FOLDER = ROOT / "deploy" / "kubernetes"


def documents(text):
    return [d for d in yaml.safe_load_all(text) if d]


FILES = {path.name: documents(path.read_text()) for path in sorted(FOLDER.glob("*.yaml"))}
MANIFESTS = [d for name, all_of in FILES.items() if name != "kustomization.yaml" for d in all_of]


@pytest.fixture(scope="module")
def secrets():
    text = subprocess.run([FOLDER / "make-secrets.sh"], check=True, capture_output=True, text=True).stdout
    return {d["metadata"]["name"]: d for d in documents(text)}


def of_kind(*kinds):
    return [d for d in MANIFESTS if d["kind"] in kinds]


def sets():
    """(manifest, pod)"""
    return [(d, d["spec"]["template"]["spec"]) for d in of_kind("StatefulSet", "Deployment")]


def containers(pod):
    return pod.get("initContainers", []) + pod["containers"]


def labels_of_pods():
    return [d["spec"]["template"]["metadata"]["labels"] for d, _ in sets()]


def selectors(node):
    if isinstance(node, dict):
        if "matchLabels" in node:
            yield node["matchLabels"]
        for value in node.values():
            yield from selectors(value)
    elif isinstance(node, list):
        for value in node:
            yield from selectors(value)


@pytest.mark.parametrize("manifest", [d for all_of in FILES.values() for d in all_of],
                         ids=lambda d: f"{d['kind']}-{d.get('metadata', {}).get('name', '')}")
def test_every_field_is_one_that_the_kind_has(manifest):
    jsonschema.validate(manifest, schema_of(manifest))


def test_the_schema_finds_what_is_misspelt_missing_or_of_a_wrong_type():
    worker = next(d for d in MANIFESTS if d["kind"] == "Deployment")

    def broken(change):
        copied = copy.deepcopy(worker)
        change(copied["spec"]["template"]["spec"]["containers"][0])
        return copied

    for change in (lambda c: c.update(readynessProbe=c.pop("readinessProbe")), lambda c: c.pop("securityContext"),
                   lambda c: c["securityContext"].update(readOnlyRootFilesystem=False), lambda c: c["resources"]["limits"].update(memory=8)):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(broken(change), schema_of(worker))


def test_kustomize_takes_every_file_but_those_of_autoscaling():
    listed = FILES["kustomization.yaml"][0]["resources"]

    assert sorted(listed) == sorted(n for n in FILES if n != "kustomization.yaml" and not n.startswith("autoscaling-"))


def test_every_image_is_a_target_of_the_dockerfile_and_named_for_kustomize():
    targets = {f"lightshaft-{t}" for t in re.findall(r"^FROM base AS (\w+)$", (ROOT / "deploy" / "Dockerfile").read_text(), re.M)}
    used = {c["image"] for _, pod in sets() for c in containers(pod)}

    assert used == targets == {i["name"] for i in FILES["kustomization.yaml"][0]["images"]}


def test_every_mount_has_its_volume_and_every_volume_is_mounted():
    for manifest, pod in sets():
        volumes = {v["name"] for v in pod["volumes"]} | {v["metadata"]["name"] for v in manifest["spec"].get("volumeClaimTemplates", [])}
        mounted = {m["name"] for c in containers(pod) for m in c["volumeMounts"]}
        assert mounted == volumes, manifest["metadata"]["name"]


def test_every_secret_is_made_and_has_the_files_that_are_read(secrets):
    for manifest in secrets.values():
        jsonschema.validate(manifest, schema_of(manifest))
    for manifest, pod in sets():
        (wanted,) = {v["secret"]["secretName"] for v in pod["volumes"] if "secret" in v}
        said = " ".join(" ".join(c.get("command", []) + c.get("args", [])) for c in containers(pod))
        said += secrets[wanted]["stringData"].get("coordinator.conf", "")
        files = set(re.findall(r"/secrets/([\w.-]+)", said))
        assert files <= set(secrets[wanted]["stringData"]), manifest["metadata"]["name"]
    assert {"password", "redis.conf"} <= set(secrets["lightshaft-redis"]["stringData"])
    assert secrets["lightshaft-worker"]["stringData"]["join-token"] == secrets["lightshaft-coordinator"]["stringData"]["join-token"]
    password = secrets["lightshaft-redis"]["stringData"]["password"]
    assert f"redis://:{password}@redis:6379/0" in secrets["lightshaft-coordinator"]["stringData"]["coordinator.conf"]


def test_people_and_workers_speak_tls_with_the_coordinator(secrets, tmp_path):
    """The certificates of the secrets, in a real coordinator and worker that are started as the manifests say."""
    for name in ("coordinator", "worker"):
        (tmp_path / name).mkdir()
        for file, text in secrets[f"lightshaft-{name}"]["stringData"].items():
            (tmp_path / name / file).write_text(text)
            (tmp_path / name / file).chmod(0o600)
    config = tomllib.loads((tmp_path / "coordinator" / "coordinator.conf").read_text())
    own = {key: value.replace("/secrets", str(tmp_path / "coordinator")) for key, value in config.items() if key.startswith("tls")}
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "join-token").write_text(secrets["lightshaft-coordinator"]["stringData"]["join-token"])
    (tmp_path / "data" / "join-token").chmod(0o600)
    (args,) = [c["args"] for d, pod in sets() for c in pod["containers"] if c["name"] == "worker"]
    files = {a: args[args.index(a) + 1].replace("/secrets", str(tmp_path / "worker"))
             for a in ("--token-file", "--tls-ca", "--tls-cert", "--tls-key")}

    with LocalFarm(tmp_path, flags=[part for key, value in own.items() for part in (f"--{key}", value)]) as farm:
        worker = [bin_dir() / "lightshaft-worker", "--coordinator", f"localhost:{farm.grpc}", "--cache", tmp_path / "cache", "--fake"]
        farm.workers.append(Process("worker", worker + [part for pair in files.items() for part in pair], tmp_path / "worker.log"))
        trust = ssl.create_default_context(cafile=tmp_path / "worker" / "ca.pem")

        def workers():
            request = urllib.request.Request(f"https://localhost:{farm.http}/api/v1/workers", headers={"Authorization": f"Bearer {farm.token}"})
            with urllib.request.urlopen(request, context=trust) as reply:
                return json.load(reply)["workers"]

        wait_until(workers, "the worker has joined")
    probes = [c[p] for _, pod in sets() for c in pod["containers"] for p in ("startupProbe", "readinessProbe", "livenessProbe") if "httpGet" in c.get(p, {})]
    assert probes and all(p["httpGet"]["scheme"] == "HTTPS" for p in probes)


def test_secrets_are_new_at_every_run(secrets):
    again = subprocess.run([FOLDER / "make-secrets.sh"], check=True, capture_output=True, text=True).stdout

    assert secrets["lightshaft-worker"]["stringData"]["join-token"] not in again


def test_every_selector_selects_pods_of_one_set():
    found = [s for d in MANIFESTS for s in selectors(d["spec"] if "spec" in d else {})] + [d["spec"]["selector"] for d in of_kind("Service")]
    assert len(found) >= 12
    for selector in found:
        assert sum(selector.items() <= labels.items() for labels in labels_of_pods()) == 1, selector


def test_ports_of_services_probes_and_policies_are_ports_of_containers():
    ports = {p["name"]: p["containerPort"] for _, pod in sets() for c in pod["containers"] for p in c.get("ports", [])}
    for service in of_kind("Service"):
        for port in service["spec"]["ports"]:
            assert ports[port["targetPort"]] == port["port"]
    for _, pod in sets():
        for container in pod["containers"]:
            own = {p["name"] for p in container.get("ports", [])}
            for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
                for way in ("httpGet", "tcpSocket"):
                    if way in container.get(probe, {}):
                        assert container[probe][way]["port"] in own
    named = {p["port"] for d in of_kind("NetworkPolicy") for way in ("ingress", "egress") for rule in d["spec"].get(way, []) for p in rule["ports"]}
    assert named == set(ports.values()) | {53}


def test_every_set_has_readiness_and_a_disruption_budget():
    budgets = [d["spec"]["selector"]["matchLabels"] for d in of_kind("PodDisruptionBudget")]
    for manifest, pod in sets():
        labels = manifest["spec"]["template"]["metadata"]["labels"]
        assert all("readinessProbe" in c for c in pod["containers"])
        assert [b for b in budgets if b.items() <= labels.items()], manifest["metadata"]["name"]


def test_workers_may_be_preempted_and_have_time_to_drain():
    pod = next(d for d in of_kind("Deployment"))["spec"]["template"]["spec"]

    assert pod["terminationGracePeriodSeconds"] >= 60
    assert pod["priorityClassName"] in {d["metadata"]["name"] for d in of_kind("PriorityClass") if d["value"] < 0}
    assert pod["tolerations"]


def test_autoscaling_asks_for_metrics_that_there_are(farm):
    names = set(re.findall(r"^# TYPE (\w+)", farm.request("GET", "/metrics").decode(), re.M))
    keda = FILES["autoscaling-keda.yaml"][0]["spec"]["triggers"][0]["metadata"]["query"]
    hpa = FILES["autoscaling-hpa.yaml"][0]["spec"]["metrics"][0]["external"]["metric"]["name"]

    asked = set(re.findall(r"lightshaft_\w+", keda)) | {hpa}
    assert "lightshaft_queued_core_seconds" in asked and asked <= names
