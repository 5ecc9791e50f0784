"""What kustomize makes of deploy/kubernetes, without a cluster: every manifest has the fields that it should and no others, and
whatever names another thing (a volume, a port, a secret and its keys, labels, a service, an image) names one that is there."""

import copy
import json
import re
import ssl
import subprocess
import urllib.request

import pytest
from kubernetes_api import OVERLAYS, render
from kubernetes_fields import schema_of
from local_farm import ROOT, LocalFarm, Process, bin_dir, wait_until

yaml = pytest.importorskip("yaml")
jsonschema = pytest.importorskip("jsonschema")

FOLDER = ROOT / "deploy" / "kubernetes"
BUCKET = {"AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY", "BLOBS"}  # of the Secret lightshaft-s3, which an administrator makes


def documents(text):
    return [d for d in yaml.safe_load_all(text) if d]


@pytest.fixture(scope="module", params=OVERLAYS)
def manifests(request):
    """Of an overlay."""
    try:
        return documents(render(f"overlays/{request.param}"))
    except (FileNotFoundError, subprocess.CalledProcessError) as error:
        version = subprocess.run("kubectl version --client", shell=True, capture_output=True, text=True).stdout
        if "Kustomize Version: v5" in version:
            raise
        pytest.skip(f"there is no kubectl here that knows kustomize's components: {error}")


@pytest.fixture(scope="module")
def secrets():
    text = subprocess.run([FOLDER / "make-secrets.sh"], check=True, capture_output=True, text=True).stdout
    return {d["metadata"]["name"]: d for d in documents(text)}


def of_kind(manifests, *kinds):
    return [d for d in manifests if d["kind"] in kinds]


def sets(manifests):
    """(manifest, pod)"""
    return [(d, d["spec"]["template"]["spec"]) for d in of_kind(manifests, "StatefulSet", "Deployment")]


def containers(pod):
    return pod.get("initContainers", []) + pod["containers"]


def selectors(node):
    if isinstance(node, dict):
        if "matchLabels" in node:
            yield node["matchLabels"]
        for value in node.values():
            yield from selectors(value)
    elif isinstance(node, list):
        for value in node:
            yield from selectors(value)


def test_every_field_is_one_that_the_kind_has(manifests):
    for manifest in manifests:
        jsonschema.validate(manifest, schema_of(manifest))


def test_the_schema_finds_what_is_misspelt_missing_or_of_a_wrong_type(manifests):
    (worker,) = of_kind(manifests, "Deployment")

    def broken(change):
        copied = copy.deepcopy(worker)
        change(copied["spec"]["template"]["spec"]["containers"][0])
        return copied

    for change in (lambda c: c.update(readynessProbe=c.pop("readinessProbe")), lambda c: c.pop("securityContext"),
                   lambda c: c["securityContext"].update(readOnlyRootFilesystem=False), lambda c: c["resources"]["limits"].update(memory=8)):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(broken(change), schema_of(worker))


def test_every_component_is_used_and_no_file_is_left_out():
    lists = {path.parent: yaml.safe_load(path.read_text()) for path in FOLDER.rglob("kustomization.yaml")}
    used = {(folder / entry).resolve() for folder, k in lists.items() for entry in k.get("resources", []) + k.get("components", [])}

    assert {p.resolve() for p in FOLDER.rglob("*.yaml") if p.name != "kustomization.yaml"} <= used
    assert {p.parent.resolve() for p in FOLDER.glob("components/*/kustomization.yaml")} <= used


def test_every_image_is_a_target_of_the_dockerfile(manifests):
    targets = {f"lightshaft-{t}:local" for t in re.findall(r"^FROM base AS (\w+)$", (ROOT / "deploy" / "Dockerfile").read_text(), re.M)}
    used = {c["image"] for _, pod in sets(manifests) for c in containers(pod)}

    assert {"lightshaft-coordinator:local", "lightshaft-worker:local"} <= used <= targets


def test_every_mount_has_its_volume_and_every_volume_is_mounted(manifests):
    claims = {d["metadata"]["name"] for d in of_kind(manifests, "PersistentVolumeClaim")}
    for manifest, pod in sets(manifests):
        volumes = {v["name"] for v in pod["volumes"]} | {v["metadata"]["name"] for v in manifest["spec"].get("volumeClaimTemplates", [])}
        mounted = {m["name"] for c in containers(pod) for m in c["volumeMounts"]}
        assert mounted == volumes, manifest["metadata"]["name"]
        assert {v["persistentVolumeClaim"]["claimName"] for v in pod["volumes"] if "persistentVolumeClaim" in v} <= claims


def files_of_secrets(pod, secrets):
    """The files that a pod's containers see of its Secrets."""
    places = {m["name"]: m["mountPath"] for c in containers(pod) for m in c["volumeMounts"]}
    for volume in pod["volumes"]:
        if "secret" in volume:
            keys = secrets[volume["secret"]["secretName"]]["stringData"]
            shown = [i["path"] for i in volume["secret"]["items"] if i["key"] in keys] if "items" in volume["secret"] else keys
            yield from (f"{places[volume['name']]}/{key}" for key in shown)


def test_every_secret_is_made_and_has_the_files_that_are_read(manifests, secrets):
    for manifest in secrets.values():
        jsonschema.validate(manifest, schema_of(manifest))
    for manifest, pod in sets(manifests):
        said = " ".join(" ".join(c.get("command", []) + c.get("args", [])) for c in containers(pod))
        read = set(re.findall(r"(?:/secrets|/tls|/redis)/[\w-]+\.(?:pem|key|conf)|/secrets/join-token", said))
        assert read <= set(files_of_secrets(pod, secrets)) and (read or manifest["metadata"]["name"] == "redis"), manifest["metadata"]["name"]
        for container in containers(pod):
            for variable in container.get("env", []):
                if "secretKeyRef" in variable["valueFrom"]:
                    assert variable["valueFrom"]["secretKeyRef"]["name"] == "lightshaft-s3" and variable["valueFrom"]["secretKeyRef"]["key"] in BUCKET
    assert {"password", "redis.conf", "coordinator.conf"} <= set(secrets["lightshaft-redis"]["stringData"])
    password = secrets["lightshaft-redis"]["stringData"]["password"]
    assert f"redis://:{password}@redis:6379/0" in secrets["lightshaft-redis"]["stringData"]["coordinator.conf"]


def test_every_variable_of_an_argument_is_set(manifests):
    for _, pod in sets(manifests):
        for container in containers(pod):
            names = {variable["name"] for variable in container.get("env", [])}
            assert set(re.findall(r"\$\((\w+)\)", " ".join(container.get("args", [])))) <= names


def test_people_and_workers_speak_tls_with_the_coordinator(secrets, tmp_path):
    """The certificates of the Secrets, in a real coordinator and worker that are started as the manifests of `farm` say."""
    made = documents(render("overlays/farm"))

    def options(kind):
        (name, container), = [(d["metadata"]["name"], pod["containers"][0]) for d, pod in sets(made) if d["metadata"]["name"] == kind]
        (tmp_path / name).mkdir()
        for secret in ("lightshaft-join-token", f"lightshaft-{name}-tls"):
            for file, text in secrets[secret]["stringData"].items():
                (tmp_path / name / file).write_text(text)
                (tmp_path / name / file).chmod(0o600)
        return [re.sub("/(tls|secrets)/", f"{tmp_path / name}/", a) for a in container["args"] if a.startswith(("--tls", "--token"))]

    own, files = options("coordinator"), options("worker")
    (tmp_path / "data").mkdir()
    (tmp_path / "coordinator" / "join-token").rename(tmp_path / "data" / "join-token")

    with LocalFarm(tmp_path, flags=own) as farm:
        worker = [bin_dir() / "lightshaft-worker", "--coordinator", f"localhost:{farm.grpc}", "--cache", tmp_path / "cache", "--fake"]
        farm.workers.append(Process("worker", worker + files, tmp_path / "worker.log"))
        trust = ssl.create_default_context(cafile=tmp_path / "worker" / "ca.pem")

        def workers():
            request = urllib.request.Request(f"https://localhost:{farm.http}/api/v1/workers", headers={"Authorization": f"Bearer {farm.token}"})
            with urllib.request.urlopen(request, context=trust) as reply:
                return json.load(reply)["workers"]

        wait_until(workers, "the worker has joined")
    probes = [c[p] for _, pod in sets(made) for c in pod["containers"] for p in ("startupProbe", "readinessProbe", "livenessProbe") if "httpGet" in c.get(p, {})]
    assert probes and all(p["httpGet"]["scheme"] == "HTTPS" for p in probes)


def test_certificates_have_the_names_by_which_coordinators_are_called(secrets, tmp_path):
    (tmp_path / "server.pem").write_text(secrets["lightshaft-coordinator-tls"]["stringData"]["server.pem"])
    said = subprocess.run(["openssl", "x509", "-in", tmp_path / "server.pem", "-noout", "-ext", "subjectAltName"], check=True, capture_output=True, text=True).stdout
    names = set(re.findall(r"DNS:([\w.-]+)", said))

    for overlay in ("farm", "shared"):
        (args,) = [pod["containers"][0]["args"] for d, pod in sets(documents(render(f"overlays/{overlay}"))) if d["metadata"]["name"] == "worker"]
        called = args[0].removeprefix("--coordinator=").split(",")
        assert {address.split(":")[0] for address in called} <= names


def test_secrets_are_new_at_every_run(secrets):
    again = subprocess.run([FOLDER / "make-secrets.sh"], check=True, capture_output=True, text=True).stdout

    assert secrets["lightshaft-join-token"]["stringData"]["join-token"] not in again


def test_every_selector_selects_pods_of_one_set(manifests):
    found = [s for d in manifests for s in selectors(d.get("spec", {}))] + [d["spec"]["selector"] for d in of_kind(manifests, "Service")]
    assert len(found) >= 6
    for selector in found:
        assert sum(selector.items() <= d["spec"]["template"]["metadata"]["labels"].items() for d, _ in sets(manifests)) == 1, selector


def test_ports_of_services_probes_and_policies_are_ports_of_containers(manifests):
    ports = {p["name"]: p["containerPort"] for _, pod in sets(manifests) for c in pod["containers"] for p in c.get("ports", [])}
    for service in of_kind(manifests, "Service"):
        for port in service["spec"]["ports"]:
            assert ports[port["targetPort"]] == port["port"]
    for _, pod in sets(manifests):
        for container in pod["containers"]:
            own = {p["name"] for p in container.get("ports", [])}
            for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
                for way in ("httpGet", "tcpSocket"):
                    if way in container.get(probe, {}):
                        assert container[probe][way]["port"] in own
    named = {p["port"] for d in of_kind(manifests, "NetworkPolicy") for way in ("ingress", "egress") for rule in d["spec"].get(way, []) for p in rule["ports"]}
    assert named == set(ports.values()) | {53}


def test_every_set_has_readiness_and_where_nodes_are_drained_a_disruption_budget(manifests):
    budgets = [d["spec"]["selector"]["matchLabels"] for d in of_kind(manifests, "PodDisruptionBudget")]
    for manifest, pod in sets(manifests):
        labels = manifest["spec"]["template"]["metadata"]["labels"]
        assert all("readinessProbe" in c for c in pod["containers"])
        assert not budgets or [b for b in budgets if b.items() <= labels.items()], manifest["metadata"]["name"]


def test_workers_have_time_to_drain_and_may_be_preempted_where_that_costs_less(manifests):
    pod = of_kind(manifests, "Deployment")[0]["spec"]["template"]["spec"]
    low = {d["metadata"]["name"] for d in of_kind(manifests, "PriorityClass") if d["value"] < 0}

    assert pod["terminationGracePeriodSeconds"] >= 60
    assert bool(low) == bool(pod.get("tolerations")) and {pod.get("priorityClassName")} == (low or {None})


def test_autoscaling_asks_for_metrics_that_there_are(farm):
    names = set(re.findall(r"^# TYPE (\w+)", farm.request("GET", "/metrics").decode(), re.M))
    asked = set()
    for scaler in ("keda", "hpa"):
        asked |= set(re.findall(r"lightshaft_\w+", json.dumps(yaml.safe_load((FOLDER / "components" / scaler / "worker.yaml").read_text())["spec"])))

    assert "lightshaft_queued_core_seconds" in asked and asked <= names
