"""What kustomize makes of deploy/kubernetes, taken by a real API server: its validation knows every field of every kind."""

import json
import subprocess

import pytest
from kubernetes_api import OVERLAYS, render
from local_farm import ROOT

# Of KEDA's own definition, which is not in Kubernetes, just so much that the API server takes its objects.
KEDA = {
    "apiVersion": "apiextensions.k8s.io/v1", "kind": "CustomResourceDefinition", "metadata": {"name": "scaledobjects.keda.sh"},
    "spec": {"group": "keda.sh", "scope": "Namespaced", "names": {"kind": "ScaledObject", "plural": "scaledobjects"},
             "versions": [{"name": "v1alpha1", "served": True, "storage": True, "schema": {"openAPIV3Schema": {
                 "type": "object", "properties": {"spec": {"type": "object", "x-kubernetes-preserve-unknown-fields": True}}}}}]}}

APPLY = ["apply", "--server-side", "--validate=strict", "--force-conflicts"]


@pytest.fixture(scope="module", autouse=True)
def keda(api):
    api.kubectl(*APPLY, "--filename=-", input=json.dumps(KEDA))
    api.kubectl("wait", "--for=condition=Established", "crd/scaledobjects.keda.sh", "--timeout=60s")


@pytest.mark.parametrize("overlay", OVERLAYS)
def test_the_api_server_takes_every_overlay(api, overlay):
    text = render(f"overlays/{overlay}")

    tried = api.kubectl(*APPLY, "--dry-run=server", "--filename=-", input=text, check=False)
    assert tried.returncode == 0 and "Warning" not in tried.stderr, tried.stderr
    api.kubectl(*APPLY, "--filename=-", input=text)
    applied = len(tried.stdout.splitlines())
    assert applied == text.count("\nkind: ") + text.startswith("kind: ") >= 5
    api.kubectl("delete", "--wait=false", "--filename=-", input=text)


def test_the_api_server_takes_the_secrets(api):
    made = subprocess.run([ROOT / "deploy/kubernetes/make-secrets.sh"], check=True, capture_output=True, text=True).stdout

    api.kubectl(*APPLY, "--filename=-", input=made)

    assert {"lightshaft-join-token", "lightshaft-redis"} <= {s["metadata"]["name"] for s in api.get("secrets")["items"]}


@pytest.mark.parametrize("wrong, right", [("terminationGracePeriodSeconds:", "terminationGraceSeconds:"), ("maxUnavailable: 25%", "maxUnavailable: most"),
                                          ("readOnlyRootFilesystem: true", "readOnlyRootFilesystem: often")])
def test_the_api_server_refuses_what_is_misspelt_or_of_a_wrong_type(api, wrong, right):
    text = render("overlays/farm")
    assert wrong in text

    tried = api.kubectl(*APPLY, "--dry-run=server", "--filename=-", input=text.replace(wrong, right), check=False)

    assert tried.returncode != 0
