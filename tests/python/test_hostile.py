"""A server that is no coordinator, or a bad one: each answer ends in an error with words, within limits."""

import hashlib
import http.server
import json
import struct
import threading

import exr_layers
import pytest

import lightshaft
from lightshaft import snapshot, steps
from lightshaft.errors import LightshaftError
from lightshaft.images import decode_layers

JOB = {
    "id": "j-1",
    "state": "done",
    "progress": 1,
    "spp": 1,
    "relmse": None,
    "relmse_ci95": None,
    "eta_seconds": None,
    "error": None,
}


class Stub(http.server.ThreadingHTTPServer):
    """Answers {path, with or without its query: (status, headers, body)}; the rest with a job. Keeps what it was sent."""

    def __init__(self):
        super().__init__(("127.0.0.1", 0), _Handler)
        self.answers, self.requests = {}, []
        threading.Thread(target=self.serve_forever, args=(0.01,), daemon=True).start()

    @property
    def url(self):
        return f"http://127.0.0.1:{self.server_port}"


class _Handler(http.server.BaseHTTPRequestHandler):
    def answer(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.server.requests.append((self.command, self.path, dict(self.headers), body))
        answers = self.server.answers
        status, headers, data = answers.get(self.path) or answers.get(
            self.path.split("?")[0], (200, {}, json.dumps(JOB).encode())
        )
        self.send_response(status)
        for name, value in {"Content-Length": str(len(data)), **headers}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(data)

    do_GET = do_POST = do_PUT = do_PATCH = do_DELETE = do_HEAD = answer

    def log_message(self, *_):
        pass


@pytest.fixture
def stub():
    with Stub() as server:
        yield server
        server.shutdown()


@pytest.fixture
def farm(stub):
    with lightshaft.Farm(stub.url, "secret") as client:
        yield client


@pytest.mark.parametrize(
    "body, words",
    [
        (b"<html>hello</html>", "address of a Lightshaft coordinator"),
        (b"[1, 2]", "JSON object"),
        (b"[" * 100_000, "JSON object"),
        (b'{"id": 5}', "describes no job"),
        (b"\xff\xfe", "JSON object"),
        (b"", "JSON object"),
    ],
    ids=["html", "list", "deep", "id", "bytes", "empty"],
)
def test_an_answer_that_is_none(farm, stub, body, words):
    stub.answers["/api/v1/jobs/j-1"] = (200, {}, body)
    with pytest.raises(lightshaft.BadAnswer, match=words):
        farm.job("j-1")


@pytest.mark.parametrize(
    "body",
    [
        b"gone wrong",
        b'{"detail": 5, "diagnostics": [3, {"line": "x", "text": null}], "title": []}',
        b"\x00" * 5000,
    ],
    ids=["text", "wrong types", "zeros"],
)
@pytest.mark.parametrize("status", [400, 418, 500])
def test_a_problem_that_is_none(farm, stub, status, body):
    stub.answers["/api/v1/jobs/j-1"] = (status, {}, body)
    with pytest.raises(LightshaftError) as error:
        farm.job("j-1")
    assert error.value.status == status and str(error.value) and len(str(error.value)) < 1000
    assert error.value.line is None


def test_an_answer_longer_than_its_limit_is_dropped(farm, stub, monkeypatch):
    stub.answers["/api/v1/jobs/j-1/image.png"] = (200, {}, b"x" * 100_000)
    monkeypatch.setattr(steps, "MAX_IMAGE_BYTES", 99_999)
    with pytest.raises(lightshaft.BadAnswer, match="larger than 99999"):
        farm.job("j-1").png()


def test_a_packed_answer_is_not_unpacked(farm, stub):
    stub.answers["/api/v1/jobs/j-1/image.png"] = (200, {"Content-Encoding": "gzip"}, b"not gzip")
    assert farm.job("j-1").png() == b"not gzip"
    assert stub.requests[-1][2]["Accept-Encoding"] == "identity"


def test_an_answer_that_is_cut_off(farm, stub):
    stub.answers["/api/v1/jobs/j-1"] = (200, {"Content-Length": "1000", "Connection": "close"}, b"{")
    with pytest.raises(lightshaft.FarmUnreachable, match="/api/v1/jobs/j-1"):
        farm.job("j-1")


def test_only_what_was_offered_is_sent(farm, stub, tmp_path):
    other = hashlib.sha256(b"other").hexdigest()
    scene = b'<scene version="3.0.0"/>'
    stub.answers["/api/v1/blobs/missing"] = (
        200,
        {},
        json.dumps({"missing": [other, 3, None, "../../etc"]}).encode(),
    )
    farm.submit(scene.decode())
    assert [method for method, *_ in stub.requests] == ["POST", "POST", "GET"]
    stub.answers["/api/v1/blobs/missing"] = (200, {}, json.dumps({"missing": "all"}).encode())
    with pytest.raises(lightshaft.BadAnswer, match="which files it needs"):
        farm.submit(scene.decode())


@pytest.mark.parametrize("id", ["../../tokens", "a/b", "", "x" * 65, "a?b=c"])
def test_an_id_reaches_no_other_path(farm, stub, id):
    with pytest.raises(lightshaft.RequestRejected, match="cannot be the id"):
        farm.job(id)
    stub.answers["/api/v1/jobs"] = (200, {}, json.dumps({"jobs": [{**JOB, "id": id}]}).encode())
    (job,) = farm.jobs()
    with pytest.raises(lightshaft.RequestRejected):
        job.remove()
    assert [path for _, path, *_ in stub.requests] == ["/api/v1/jobs"]


def test_redirects_end_and_keep_method_body_and_token(farm, stub):
    stub.answers["/api/v1/jobs/j-1"] = (307, {"Location": "/api/v1/jobs/j-2"}, b"")
    assert farm.job("j-1").pause().id == "j-1"  # the stub's only job
    assert [(method, path) for method, path, *_ in stub.requests] == [
        (method, f"/api/v1/jobs/j-{n}") for method in ("GET", "PATCH") for n in (1, 2)
    ]
    assert (
        stub.requests[3][3] == b'{"state": "paused"}'
        and stub.requests[3][2]["Authorization"] == "Bearer secret"
    )
    stub.answers["/api/v1/jobs/j-2"] = (307, {"Location": stub.url + "/api/v1/jobs/j-1"}, b"")
    with pytest.raises(lightshaft.BadAnswer, match="more than 3 times"):
        farm.job("j-1")


@pytest.mark.parametrize(
    "place", ["http://127.0.0.1:1/x", "file:///etc/passwd", "ftp://127.0.0.1/x", "gopher:x"]
)
def test_nothing_is_sent_from_tls_to_plain_text_or_to_what_is_no_http(place):
    call = steps.ask(steps.Call("GET", "/x"))
    next(call)
    with pytest.raises(lightshaft.BadAnswer, match="without https"):
        call.send(steps.Reply(307, {"location": place}, b"", "https://farm.example/x"))


def test_names_are_shown_and_do_nothing(farm, stub):
    """What a page could run is escaped in a notebook."""
    evil = "<script>alert(1)</script>"
    stub.answers["/api/v1/jobs/j-1"] = (
        200,
        {},
        json.dumps(
            {
                **JOB,
                "name": evil,
                "error": evil,
                "waits_for": f"{evil} too",
                "denoised": {"relmse": evil, "relmse_ci95": [evil, evil]},
                "verdict": {"words": evil, "advice": evil},
            }
        ).encode(),
    )
    stub.answers["/api/v1/jobs/j-1/image.png"] = (200, {}, evil.encode())
    stub.answers["/api/v1/jobs/j-1/convergence.csv"] = (200, {}, b"core_seconds,relmse\n1,2\n2,1\n")
    html = farm.job("j-1")._repr_html_()
    assert (
        "<script>" not in html
        and html.count("&lt;script&gt;") == 5
        and "no picture yet" in html
        and "<svg" in html
    )


@pytest.mark.parametrize("table", [b"a,b\n1\n", b"a,b\nx,y\n"])
def test_a_table_that_is_none(farm, stub, table):
    stub.answers["/api/v1/jobs/j-1/convergence.csv"] = (200, {}, table)
    with pytest.raises(lightshaft.BadAnswer, match="table"):
        farm.job("j-1").convergence()


# ---- pictures of notebooks ----

PNG, DENOISED_PNG = b"\x89PNG the image", b"\x89PNG denoised"


@pytest.mark.parametrize(
    "of_job, asked, shown",
    [
        ({"state": "done", "denoise": True}, (200, {}, DENOISED_PNG), DENOISED_PNG),
        ({"state": "done", "denoise": False}, (200, {}, DENOISED_PNG), PNG),
        ({"state": "running", "denoise": True}, (200, {}, DENOISED_PNG), PNG),
        ({"state": "done", "denoise": True}, (503, {}, b"{}"), PNG),
        ({"state": "cancelled", "denoise": True}, (409, {}, b"{}"), PNG),
    ],
    ids=["denoised", "without", "not yet", "library gone", "none"],
)
def test_a_notebook_shows_the_denoised_picture_of_a_job_that_has_ended_with_one(
    stub, of_job, asked, shown
):
    stub.answers["/api/v1/jobs/j-1"] = (200, {}, json.dumps({**JOB, **of_job}).encode())
    stub.answers["/api/v1/jobs/j-1/image.png"] = (200, {}, PNG)
    stub.answers["/api/v1/jobs/j-1/image.png?layer=denoised"] = asked
    stub.answers["/api/v1/jobs/j-1/convergence.csv"] = (200, {}, b"core_seconds,relmse\n1,2\n")

    snapshot = lightshaft.Farm(stub.url).job("j-1").snapshot()

    assert snapshot._repr_png_() == shown and snapshot.denoised == (shown is DENOISED_PNG)
    caption = "denoised" if shown is DENOISED_PNG else "as rendered"
    assert f"<figcaption>{caption}</figcaption>" in snapshot._repr_html_()


# ---- images ----


@pytest.fixture
def image(tmp_path):
    """A small EXR file."""
    exr_layers.write_rgb(tmp_path / "small.exr", {name: [[0.5] * 8] * 4 for name in "RGB"})
    return (tmp_path / "small.exr").read_bytes()


def test_the_small_image_is_right(image):
    assert decode_layers(image)["color"].shape == (4, 8, 3)


def test_every_cut_of_an_image_is_refused(image):
    for length in range(0, len(image), 7):
        with pytest.raises(lightshaft.BadAnswer):
            decode_layers(image[:length])


def test_an_image_that_claims_to_be_huge_is_refused_before_memory_is_taken(image):
    window = struct.pack("<4i", 0, 0, 7, 3)
    assert image.count(window) == 2
    for corner in ((7, 30_000_000), (2_000_000, 3), (30_000, 30_000)):
        with pytest.raises(lightshaft.BadAnswer, match="claims .* more than a farm's images have"):
            decode_layers(image.replace(window, struct.pack("<4i", 0, 0, *corner)))


@pytest.mark.parametrize(
    "broken",
    [
        {"relmse_ci95": 5},
        {"relmse": "small"},
        {"verdict": "x"},
        {"frames": "all"},
        {"frames": {"list": [{"frame": 1}]}},
        {"frames": {"list": [7], "current": 1}},
        {"state": "\x1b[2Jdone"},
    ],
    ids=str,
)
def test_a_job_whose_figures_are_of_other_kinds_is_refused(stub, broken):
    stub.answers["/api/v1/jobs/j-1"] = (200, {}, json.dumps({**JOB, **broken}).encode())
    with pytest.raises(lightshaft.BadAnswer):
        lightshaft.Farm(stub.url).job("j-1")


def test_a_sequence_without_a_current_frame_is_shown_without_a_picture(stub):
    stub.answers["/api/v1/jobs/j-1"] = (200, {}, json.dumps({**JOB, "frames": {"list": []}}).encode())
    assert "no picture yet" in lightshaft.Farm(stub.url).job("j-1").snapshot()._repr_html_()


def test_a_table_with_a_field_without_end_is_refused():
    with pytest.raises(lightshaft.BadAnswer):
        snapshot.parse_curve("seconds\n" + "1" * 200_000)
