"""Blobs that the coordinator's disk damages: never rendered from; the job waits, and goes on when the file is here again."""

import hashlib
import json
import os
import random
import subprocess

import farm_rpc
import pytest
import steam
from local_farm import PATIENCE, HttpError, LocalFarm, bin_dir, wait_until
from s3_server import ENVIRONMENT, S3Server

from chaos_kit import flip_bytes

SCENE = steam.scene(samples=4)
SIDE = 48  # 442 kB of grid: read by the coordinator in two pieces


def grid():
    return steam.grid([(i * 2654435761 >> 7) % 256 / 256 for i in range(SIDE ** 3)])


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def put(farm, data):
    farm.request("PUT", f"/api/v1/blobs/{sha256(data)}", data, "application/octet-stream")


def submit(farm, data):
    """A job whose files are blobs."""
    for blob in (SCENE.encode(), data):
        put(farm, blob)
    body = {"scene": sha256(SCENE.encode()), "name": "bath.xml", "assets": {"steam.vol": sha256(data)}}
    return json.loads(farm.request("POST", "/api/v1/jobs", json.dumps(body).encode()))["id"]


def missing(farm, digest):
    return json.loads(farm.request("POST", "/api/v1/blobs/missing", json.dumps({"digests": [digest]}).encode()))["missing"]


def file_of(farm, digest):
    return farm.data / "blobs" / digest[:2] / digest


def damage(path):
    flip_bytes(path, random.Random(path.name), 3)


def failures(farm):
    said = farm.request("GET", "/metrics").decode()
    return [line for line in said.splitlines() if line.startswith('lightshaft_units_freed_total{cause="failed"}')]


def waits(farm, job):
    return wait_until(lambda: (v := farm.job(job))["state"] == "paused" and v["error"] and v, "the job waits and says why")


@pytest.fixture(scope="module")
def data():
    return grid()


@pytest.fixture(scope="module")
def expected(tmp_path_factory, data):
    with LocalFarm(tmp_path_factory.mktemp("sound")) as farm:
        farm.add_worker(fake=False)
        return farm.pixels(submit(farm, data))


def test_a_job_waits_for_a_damaged_file_and_goes_on_when_it_is_uploaded_again(farm, data, expected):
    digest = sha256(data)
    job = submit(farm, data)
    damage(file_of(farm, digest))
    workers = farm.add_workers(3, fake=False)

    error = waits(farm, job)["error"]
    assert "steam.vol" in error and digest in error and "damaged" in error and "upload the file again" in error, error
    assert missing(farm, digest) == [digest]
    assert file_of(farm, digest + ".damaged").exists()

    put(farm, data)

    assert farm.pixels(job) == expected
    assert missing(farm, digest) == []
    assert [line.split()[-1] for line in failures(farm)] == ["0"], "no unit counts as failed"
    assert all(worker.alive() for worker in workers)
    assert not farm.job(job)["error"]


def test_a_job_waits_for_its_file_over_a_restart(farm, data, expected):
    job = submit(farm, data)
    damage(file_of(farm, sha256(data)))
    farm.add_worker(fake=False)
    waits(farm, job)

    farm.restart_coordinator()
    assert "steam.vol" in waits(farm, job)["error"]
    put(farm, data)

    assert farm.pixels(job) == expected


def test_submitting_the_same_scene_again_repairs_what_the_job_waits_for(farm, data, expected, tmp_path):
    (tmp_path / "bath.xml").write_text(SCENE)
    (tmp_path / "steam.vol").write_bytes(data)

    def submit_by_cli():
        return subprocess.run([bin_dir() / "lightshaft", "submit", tmp_path / "bath.xml", "--to", farm.url()],
                              env=dict(os.environ, LIGHTSHAFT_TOKEN=farm.token), capture_output=True, text=True, timeout=PATIENCE)

    job = submit_by_cli().stdout.strip()
    for blob in (farm.data / "blobs").glob("??/*"):
        damage(blob)  # the grid, the scene and its canonical form
    farm.add_worker(fake=False)
    assert "submit" in waits(farm, job)["error"]

    # Each try repairs what those before it have found: the first one finds the scene's own file, and is refused.
    submit_by_cli()
    assert submit_by_cli().returncode == 0
    wait_until(lambda: (v := farm.job(job))["state"] == "done" or "steam.vol" in (v["error"] or ""), "the grid is looked at")
    assert submit_by_cli().returncode == 0

    assert farm.pixels(job) == expected


def test_a_damaged_scene_is_refused_and_an_upload_of_the_right_one_is_taken(farm, data):
    submit(farm, data)
    scene = sha256(SCENE.encode())
    text = file_of(farm, scene).read_text()
    file_of(farm, scene).write_text(text.replace('value="32"', 'value="33"', 1))  # another scene, and a valid one

    body = json.dumps({"scene": scene, "name": "bath.xml", "assets": {"steam.vol": sha256(data)}}).encode()
    with pytest.raises(HttpError, match=f"blob {scene} is damaged.*upload the file again"):
        farm.request("POST", "/api/v1/jobs", body)
    put(farm, SCENE.encode())

    assert farm.request("POST", "/api/v1/jobs", body)


def test_an_upload_repairs_a_blob_that_nobody_has_found_damaged_yet(farm, data):
    put(farm, data)
    damage(file_of(farm, sha256(data)))

    put(farm, data)

    assert file_of(farm, sha256(data)).read_bytes() == data


def test_a_damaged_copy_of_what_s3_has_is_fetched_again(tmp_path, data, expected, monkeypatch):
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    with S3Server() as s3, LocalFarm(tmp_path, flags=["--blobs", s3.url()]) as farm:
        job = submit(farm, data)
        damage(file_of(farm, sha256(data)))
        farm.add_worker(fake=False)

        assert farm.pixels(job) == expected
        assert file_of(farm, sha256(data)).read_bytes() == data


def test_what_s3_has_damaged_is_repaired_by_an_upload(tmp_path, data, expected, monkeypatch):
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    with S3Server() as s3, LocalFarm(tmp_path, flags=["--blobs", s3.url()]) as farm:
        digest = sha256(data)
        job = submit(farm, data)
        s3.objects[f"scenes/{digest[:2]}/{digest}"] = data[:-1] + b"?"
        file_of(farm, digest).unlink()
        farm.add_worker(fake=False)

        assert "steam.vol" in waits(farm, job)["error"]
        assert missing(farm, digest) == [digest]
        put(farm, data)

        assert farm.pixels(job) == expected
        assert s3.objects[f"scenes/{digest[:2]}/{digest}"] == data


def test_a_worker_that_asks_for_what_is_damaged_is_told_so(farm, data):
    put(farm, data)
    damage(file_of(farm, sha256(data)))

    status, got = farm_rpc.fetch_blob(farm_rpc.channel_of(farm.grpc), farm.join_token, sha256(data))

    assert (status, got) == ("FAILED_PRECONDITION", 0)
