"""A validator passes the OpenAPI document, and a client that a generator makes of it submits a job."""

import copy
import hashlib
import importlib
import io
import json
import pathlib
import subprocess
import sys

import pytest
from local_farm import ROOT, SCENE, wait_until
from openapi_spec_validator import OpenAPIV31SpecValidator

DOCUMENT = ROOT / "coordinator/http/openapi.json"
# The generator knows images as bytes only if it is told.
CONFIG = {
    "content_type_overrides": {kind: "application/octet-stream" for kind in ("image/x-exr", "image/png")},
    "post_hooks": [],
}


def errors(document):
    return [
        f"{list(error.absolute_path)}: {error.message}"
        for error in OpenAPIV31SpecValidator(document).iter_errors()
    ]


def test_a_validator_passes_the_document():
    assert errors(json.loads(DOCUMENT.read_text())) == []


def break_type(document):
    document["components"]["schemas"]["Job"]["properties"]["progress"]["type"] = "nummer"


def break_parameter(document):
    del document["paths"]["/api/v1/jobs/{id}"]["parameters"]


def break_answers(document):
    del document["paths"]["/healthz"]["get"]["responses"]["200"]["description"]


@pytest.mark.parametrize("change", [break_type, break_parameter, break_answers])
def test_the_validator_finds_faults(change):
    broken = copy.deepcopy(json.loads(DOCUMENT.read_text()))
    change(broken)
    assert errors(broken)


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """The package `farm_client` that is made of the document."""
    folder = tmp_path_factory.mktemp("client")
    (folder / "config.json").write_text(json.dumps(CONFIG))
    generator = pathlib.Path(sys.executable).with_name("openapi-python-client")
    subprocess.run(
        [
            generator,
            "generate",
            "--path",
            DOCUMENT,
            "--output-path",
            folder / "farm_client",
            "--meta",
            "none",
            "--config",
            folder / "config.json",
        ],
        check=True,
        capture_output=True,
        cwd=folder,
    )
    sys.path.insert(0, str(folder))
    yield folder / "farm_client"
    sys.path.remove(str(folder))


def test_the_generated_client_has_every_operation(client):
    paths = json.loads(DOCUMENT.read_text())["paths"]
    named = {
        operation["operationId"].lower()
        for item in paths.values()
        for operation in item.values()
        if "operationId" in operation
    }
    made = {path.stem.replace("_", "") for path in (client / "api/default").glob("[a-z]*.py")}
    assert made == named


def test_the_generated_client_submits_a_job(client, local_farm):
    api = importlib.import_module("farm_client")
    models, types = (
        importlib.import_module("farm_client.models"),
        importlib.import_module("farm_client.types"),
    )

    def call(operation, *arguments, **options):
        reply = importlib.import_module(f"farm_client.api.default.{operation}").sync_detailed(
            *arguments, client=farm, **options
        )
        assert reply.status_code < 300, reply.content
        return reply.parsed

    with api.AuthenticatedClient(base_url=local_farm.url(), token=local_farm.token) as farm:
        scene = SCENE.encode()
        sha = hashlib.sha256(scene).hexdigest()
        assert call("missing_blobs", body=models.MissingBlobsBody(digests=[sha])).missing == [sha]
        call("put_blob", sha, body=types.File(payload=io.BytesIO(scene)))
        spec = models.JobSpec(spp=4, size=[48, 32])

        made = call("submit_job", body=models.SubmitJobJsonBody(scene=sha, spec=spec, name="ball.xml"))

        job = wait_until(
            lambda: (view := call("get_job", made.id)).state == "done" and view, "the job is done"
        )
        assert job.name == "ball.xml" and job.size == [48, 32] and job.spp_done == 4
        assert call("get_report", made.id).pixels_sha256 == local_farm.report(made.id)["pixels_sha256"]
        assert call("get_exr", made.id).payload.read(4) == b"\x76\x2f\x31\x01"
        assert made.id in [listed.id for listed in call("list_jobs").jobs]
        assert [worker.name for worker in call("list_workers").workers] == ["worker-1"]
        call("delete_job", made.id)
