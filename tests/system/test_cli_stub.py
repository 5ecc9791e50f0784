"""The command against farms that are away, wrong or hostile."""

import json
import os
import stat

import pytest
from cli_kit import lightshaft, write_fog
from stub_coordinator import StubCoordinator


@pytest.fixture
def stub():
    with StubCoordinator() as stub:
        yield stub


def accept_jobs(stub, job=None):
    stub.answers[("POST", "/api/v1/blobs/missing")] = [(200, lambda body: {"missing": json.loads(body)["digests"]})]
    stub.answers[("PUT", "/api/v1/blobs/*")] = [(201, {})]
    stub.answers[("POST", "/api/v1/jobs")] = [(201, job or {"id": "j-1"})]


def test_submit_goes_on_after_what_a_proxy_or_a_restart_answers(stub, tmp_path):
    accept_jobs(stub)
    stub.answers[("PUT", "/api/v1/blobs/*")] = [(502, b"bad gateway"), (201, {})]
    stub.answers[("GET", "/api/v1/jobs/j-1")] = [(status, {}) for status in (429, 502, 504)] + [(200, {"id": "j-1", "state": "done"})]
    stub.answers[("GET", "/api/v1/jobs/j-1/image.exr")] = [(503, {}), (200, b"the image")]

    lightshaft("submit", write_fog(tmp_path), "--to", stub.url, "-o", tmp_path / "out.exr")

    assert (tmp_path / "out.exr").read_bytes() == b"the image"
    assert sum(method == "PUT" for method, _ in stub.requests) == 3  # two blobs, one of them twice
    assert stub.times("POST", "/api/v1/jobs") == 1


@pytest.mark.parametrize("answer", [{"id": 5}, {"id": None}, {}, {"id": ["j-1"]}])
def test_a_job_without_an_id_is_an_error(stub, tmp_path, answer):
    accept_jobs(stub, answer or {"state": "queued"})

    assert "names no job" in lightshaft("submit", write_fog(tmp_path), "--to", stub.url, code=1).stderr


def test_states_and_lists_of_a_wrong_type_are_stood(stub, tmp_path):
    stub.answers[("PATCH", "/api/v1/jobs/j-1")] = [(200, {"state": 7})]
    accept_jobs(stub)
    stub.answers[("POST", "/api/v1/blobs/missing")] = [(200, {"missing": "all"})]

    assert lightshaft("pause", "j-1", "--to", stub.url).stdout.split() == ["j-1"]
    assert "which files it lacks" in lightshaft("submit", write_fog(tmp_path), "--to", stub.url, code=1).stderr


def test_a_farm_that_is_full_is_not_the_users_mistake(stub):
    stub.answers[("GET", "/api/v1/jobs")] = [(507, {"detail": "the disk is full"})]

    assert "the disk is full" in lightshaft("jobs", "--to", stub.url, code=1).stderr


def test_fetch_writes_into_a_pipe_and_leaves_it_one(stub, tmp_path):
    stub.answers[("GET", "/api/v1/jobs/j-1")] = [(200, {"id": "j-1"})]
    stub.answers[("GET", "/api/v1/jobs/j-1/image.exr")] = [(200, b"the image")]
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    holder = os.open(pipe, os.O_RDWR)  # neither side waits for the other, and the bytes stay
    try:
        lightshaft("fetch", "j-1", "-o", pipe, "--to", stub.url)

        assert stat.S_ISFIFO(pipe.stat().st_mode)
        os.set_blocking(holder, False)
        assert os.read(holder, 100) == b"the image"
    finally:
        os.close(holder)


def test_a_farms_texts_do_not_steer_the_terminal(stub):
    evil = "fog\x1b[2J\x9b2J\nj-2 done\x07"
    stub.answers[("GET", "/api/v1/jobs")] = [(200, {"jobs": [{"id": "j-1", "name": evil, "state": evil}]})]
    stub.answers[("GET", "/api/v1/jobs/j-1")] = [(200, {"id": "j-1", "state": "failed", "error": evil})]
    stub.answers[("GET", "/api/v1/workers")] = [(400, {"detail": evil, "diagnostics": [
        {"file": evil, "line": 1, "column": 1, "text": evil, "source_line": evil}]})]
    stub.answers[("PATCH", "/api/v1/jobs/j-1")] = [(200, {"state": evil})]

    shown = [lightshaft("jobs", "--to", stub.url), lightshaft("watch", "j-1", "--to", stub.url, code=1),
             lightshaft("workers", "--to", stub.url, code=2), lightshaft("pause", "j-1", "--to", stub.url)]

    for done in shown:
        text = done.stdout + done.stderr
        assert "fog" in text
        assert not any(c in text for c in "\x1b\x9b\x07") and "\nj-2 done" not in text
