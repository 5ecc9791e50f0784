"""Whatever is asked of the HTTP interface, it answers as its own OpenAPI document says: never a 5xx,
never a body of another shape, never nothing at all. Requests are made from the document (api_strategies.py); the seed is fixed."""

import hashlib
import http.client
import json
import urllib.parse

import pytest
from local_farm import LocalFarm

hypothesis = pytest.importorskip("hypothesis", reason="python3-hypothesis is not installed")
jsonschema = pytest.importorskip("jsonschema", reason="python3-jsonschema is not installed")
from api_strategies import Generator  # noqa: E402

SCENE = b"""<scene version="3.0.0"><integrator type="volpath"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film></sensor>
<emitter type="constant"/><shape type="sphere"/></scene>"""
EXAMPLES = 40  # of each operation
TIMEOUT = 20  # seconds: an answer that takes longer is none


class Api:
    def __init__(self, folder):
        self.farm = LocalFarm(folder, flags=["--http-requests-per-second", "0", "--http-wrong-tokens-per-minute", "0"])
        self.farm.add_worker()
        job = self.farm.submit(SCENE.decode(), spp=2)
        self.farm.wait_for_job(job)
        sequence = json.loads(self.farm.request("POST", "/api/v1/jobs?spp=2&frames=1-2", SCENE, "application/xml"))["id"]
        blob = hashlib.sha256(SCENE).hexdigest()
        self.farm.request("PUT", f"/api/v1/blobs/{blob}", SCENE, "application/octet-stream")
        self.document = self.farm.get("/api/v1/openapi.json")
        self.generator = Generator(self.document, {
            "id": [job, sequence, f"{sequence}-frame2", f"{sequence}-frame7"], "sha256": [blob, "0" * 64],
            "application/xml": [SCENE, SCENE[:-9]], "text/xml": [SCENE]})
        self.resolver = jsonschema.RefResolver.from_schema(self.document)

    def ask(self, method, path, request):
        for name, value in request["path"].items():
            path = path.replace("{" + name + "}", urllib.parse.quote(value, safe=""))
        query = urllib.parse.urlencode({**request["query"], **request["stray"]})
        headers = {"Authorization": f"Bearer {self.farm.token}", **request["headers"]}
        body = None
        if request["body"]:
            headers["Content-Type"], value = request["body"]
            body = value if isinstance(value, bytes) else json.dumps(value).encode()
        connection = http.client.HTTPConnection("127.0.0.1", self.farm.http, timeout=TIMEOUT)
        connection.request(method.upper(), path + ("?" + query if query else ""), body, headers)
        answer = connection.getresponse()
        kind = answer.headers.get_content_type() if answer.headers.get("Content-Type") else None
        data = b"" if kind == "text/event-stream" else answer.read()
        connection.close()
        return answer.status, kind, data

    def check(self, method, operation, status, kind, data):
        assert status < 500, data
        said = operation["responses"].get(str(status), operation["responses"].get("default"))
        assert said, f"the document knows no answer {status}"
        content = self.generator.resolve(said).get("content", {})
        if method == "head" or status == 204:
            assert data == b""
            return
        assert (kind in content) if content else (data == b"" or kind == "application/problem+json"), (status, kind)
        if kind and "json" in kind:
            value = json.loads(data)
            schema = content.get(kind, {"schema": {"$ref": "#/components/schemas/Problem"}})["schema"]
            for error in jsonschema.Draft202012Validator(schema, resolver=self.resolver).iter_errors(value):
                raise AssertionError(f"{list(error.absolute_path)}: {error.message[:300]}")
            if kind == "application/problem+json":
                assert value["status"] == status and value["detail"]


@pytest.fixture(scope="module")
def api(tmp_path_factory):
    api = Api(tmp_path_factory.mktemp("api"))
    with api.farm:
        yield api


# One test for all, since the operations are known only once a coordinator runs.
@pytest.mark.slow
def test_every_operation_keeps_to_the_document_whatever_it_is_asked(api):
    operations = list(api.generator.operations())
    assert len(operations) > 25
    seen = set()
    for method, path, operation, parameters in operations:

        @hypothesis.settings(max_examples=EXAMPLES, deadline=None, derandomize=True, database=None,
                             suppress_health_check=list(hypothesis.HealthCheck))
        @hypothesis.given(api.generator.request(operation, parameters))
        def holds(request):
            if path == "/api/v1/jobs/{id}" and method in ("delete", "patch"):
                request["path"]["id"] = request["path"]["id"][::-1]  # the jobs stay for the others
            status, kind, data = api.ask(method, path, request)
            seen.add(status // 100)
            api.check(method, operation, status, kind, data)

        holds()
    assert api.farm.coordinator.alive()
    assert {2, 4} <= seen
    assert api.farm.request("GET", "/healthz") == b"ok\n"
