"""Blobs in an S3-compatible store that checks every signature: the same pixels, also when it is slow, breaks off or lies."""

import hashlib
import json
import os
import re
import concurrent.futures
import shutil
import threading

import farm_rpc
import pytest
from local_farm import SCENE, HttpError, LocalFarm, refused_coordinator, wait_until
from s3_server import ENVIRONMENT, S3Server

SPEC = dict(spp=8, seed=3)


@pytest.fixture
def s3(monkeypatch):
    for name, value in ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    with S3Server() as server:
        yield server


@pytest.fixture
def s3_farm(s3, tmp_path):
    with LocalFarm(tmp_path, flags=["--blobs", s3.url()]) as farm:
        yield farm


def put(farm, data):
    digest = hashlib.sha256(data).hexdigest()
    farm.request("PUT", f"/api/v1/blobs/{digest}", data, "application/octet-stream")
    return digest


def all_missing(farm, digests):
    """Those of the digests that the coordinator says it lacks."""
    reply = farm.request("POST", "/api/v1/blobs/missing", json.dumps({"digests": digests}).encode())
    return json.loads(reply)["missing"]


def missing(farm, digest):
    return bool(all_missing(farm, [digest]))


def test_a_job_has_the_pixels_of_a_store_on_disk_also_after_the_local_copies_are_lost(s3, s3_farm, expected):
    job = s3_farm.submit(SCENE, **SPEC)
    assert len(s3.objects) == 1 and all(key.startswith("scenes/") for key in s3.objects)

    s3_farm.coordinator.kill()
    shutil.rmtree(s3_farm.data / "blobs")
    s3_farm.start_coordinator()
    s3_farm.add_worker()

    assert s3_farm.pixels(job) == expected


def test_a_blob_that_many_workers_ask_for_comes_once_and_others_are_answered_meanwhile(s3, s3_farm):
    digest = put(s3_farm, os.urandom(300_000))
    s3_farm.coordinator.kill()
    shutil.rmtree(s3_farm.data / "blobs")
    s3_farm.start_coordinator()
    s3.requests.clear()
    s3.gate = threading.Event()
    token = (s3_farm.data / "join-token").read_text().strip()

    with concurrent.futures.ThreadPoolExecutor(20) as pool:
        fetches = [pool.submit(farm_rpc.fetch_blob, farm_rpc.channel_of(s3_farm.grpc), token, digest) for _ in range(20)]
        wait_until(lambda: any(method == "GET" for method, _ in s3.requests), "the first fetch")
        s3_farm.add_worker()
        s3_farm.wait_for_workers(1)  # its stream is listened to
        job = s3_farm.submit(SCENE, spp=2)
        s3_farm.wait_for_progress(job, 1)
        s3.gate.set()
        assert {fetch.result(60)[0] for fetch in fetches} == {"OK"}

    assert sum(method == "GET" and key.endswith(digest) for method, key in s3.requests) == 1


def test_lists_of_many_pages_are_read_at_the_start(s3, s3_farm):
    digests = [put(s3_farm, b"%d" % i) for i in range(7)]

    s3_farm.restart_coordinator()
    before = len(s3.requests)

    assert not any(missing(s3_farm, digest) for digest in digests)
    assert len(s3.requests) == before, "what was listed is not asked for again"


def test_many_unknown_blobs_are_looked_for_in_lists_of_the_store(s3, s3_farm):
    there = [put(s3_farm, b"%d" % i) for i in range(3)]
    strangers = [hashlib.sha256(b"stranger %d" % i).hexdigest() for i in range(200)]
    late = hashlib.sha256(b"late").hexdigest()
    s3.objects[f"scenes/{late[:2]}/{late}"] = b"late"  # put there by somebody else
    before = len(s3.requests)

    assert all_missing(s3_farm, [*there, late, *strangers]) == strangers

    lists = len(s3.requests) - before
    assert lists == -(-len(s3.objects) // s3.PAGE), "one request for each page of the list"
    assert not missing(s3_farm, late)


def test_a_damaged_object_is_missing_in_a_list_too(s3, s3_farm):
    digest = put(s3_farm, b"right")
    s3.objects[f"scenes/{digest[:2]}/{digest}"] = b"wrong"
    shutil.rmtree(s3_farm.data / "blobs" / digest[:2], ignore_errors=True)
    s3_farm.restart_coordinator()
    token = (s3_farm.data / "join-token").read_text().strip()
    farm_rpc.fetch_blob(farm_rpc.channel_of(s3_farm.grpc), token, digest)  # finds the damage
    strangers = [hashlib.sha256(b"stranger %d" % i).hexdigest() for i in range(200)]

    assert all_missing(s3_farm, [*strangers, digest]) == [*strangers, digest]


def test_a_store_that_is_busy_is_asked_again(s3, s3_farm):
    s3.refuse = [503, 500, 503]

    digest = put(s3_farm, os.urandom(100_000))

    assert f"scenes/{digest[:2]}/{digest}" in s3.objects
    assert not s3.refuse


@pytest.mark.slow
def test_a_store_that_stays_away_is_named_and_the_upload_can_be_tried_again(s3, s3_farm):
    s3.refuse = [503] * 12
    data = os.urandom(1000)
    with pytest.raises(Exception, match="503.*SlowDown"):
        put(s3_farm, data)
    s3.refuse = []

    assert put(s3_farm, data)


def test_an_object_that_breaks_off_comes_again_and_one_that_is_damaged_is_not_believed(s3, s3_farm, expected):
    job = s3_farm.submit(SCENE, **SPEC)
    s3_farm.coordinator.kill()
    shutil.rmtree(s3_farm.data / "blobs")
    (key, good), = s3.objects.items()
    s3.objects[key] = good.replace(b"0", b"1", 1)
    s3_farm.start_coordinator()
    s3_farm.add_worker()
    wait_until(lambda: "is damaged" in s3_farm.coordinator.output(), "the damage is noticed")

    s3.objects[key] = good
    s3.cut = 1

    assert s3_farm.pixels(job) == expected


def readiness(farm):
    """(status, text)"""
    try:
        return 200, farm.request("GET", "/readyz").decode()
    except HttpError as error:
        return error.status, error.body


@pytest.mark.slow
def test_a_coordinator_whose_store_does_not_answer_says_that_it_is_not_ready_and_goes_on(s3, s3_farm, expected):
    s3_farm.add_worker("--fake-delay", 20)
    job = s3_farm.submit(SCENE, **SPEC)
    s3_farm.wait_for_progress(job, 1)
    assert readiness(s3_farm) == (200, "ready\n")

    s3.refuse = [503] * 1_000_000
    status, why = wait_until(lambda: (r := readiness(s3_farm))[0] != 200 and r, "it is noticed, though nobody asks for a blob")
    assert status == 503 and "the store of blobs does not answer" in why and "SlowDown" not in why and "status 503" in why
    assert s3_farm.pixels(job) == expected, "what needs no blob goes on"

    s3.refuse = []
    wait_until(lambda: readiness(s3_farm)[0] == 200, "it is noticed by itself")


LARGE = 12 << 20  # three parts of 5, 5 and 2 MiB


@pytest.fixture
def farm_of_parts(s3, tmp_path):
    with LocalFarm(tmp_path, flags=["--blobs", s3.url(more="&part-mib=5")]) as farm:
        yield farm


def of_large(s3, method):
    return sum(m == method for m, key in s3.requests if key)


def test_a_large_file_goes_in_parts_each_of_which_is_tried_again(s3, farm_of_parts):
    data = os.urandom(LARGE)
    s3.requests.clear()
    s3.refuse = [None, None, 503]  # of HEAD, which asks whether it is there, of the beginning, and of the first part
    digest = put(farm_of_parts, data)

    assert s3.objects[f"scenes/{digest[:2]}/{digest}"] == data
    assert (of_large(s3, "PUT"), of_large(s3, "POST"), s3.uploads) == (4, 2, {})

    small = put(farm_of_parts, b"x" * (5 << 20))
    assert f"scenes/{small[:2]}/{small}" in s3.objects
    assert of_large(s3, "POST") == 2, "what fits into one part goes in one request"


def test_an_end_whose_answer_was_lost_is_known_by_what_the_store_has(s3, farm_of_parts):
    s3.forget_ends = 1
    digest = put(farm_of_parts, os.urandom(LARGE))

    assert not missing(farm_of_parts, digest)
    assert of_large(s3, "POST") == 3


def test_an_end_that_is_refused_is_no_success_even_if_the_object_of_before_has_the_same_size(s3, farm_of_parts):
    data = os.urandom(LARGE)
    digest = put(farm_of_parts, data)
    key = f"scenes/{digest[:2]}/{digest}"
    s3.objects[key] = data[:-1] + bytes([data[-1] ^ 1])
    farm_of_parts.coordinator.kill()
    shutil.rmtree(farm_of_parts.data / "blobs")
    farm_of_parts.start_coordinator()
    token = (farm_of_parts.data / "join-token").read_text().strip()
    farm_rpc.fetch_blob(farm_rpc.channel_of(farm_of_parts.grpc), token, digest)
    assert missing(farm_of_parts, digest), "the damage has been found"

    s3.refuse_ends = 1
    with pytest.raises(Exception, match="AccessDenied"):
        put(farm_of_parts, data)
    assert missing(farm_of_parts, digest)

    put(farm_of_parts, data)
    assert s3.objects[key] == data
    assert not missing(farm_of_parts, digest)


def test_parts_of_a_file_that_could_not_be_sent_do_not_stay_in_the_store(s3, farm_of_parts):
    data = os.urandom(LARGE)
    s3.refuse = [None, None, None] + [503] * 6  # HEAD, the beginning, one part; then the second part, as often as it is tried
    with pytest.raises(Exception, match="503.*SlowDown"):
        put(farm_of_parts, data)

    assert (s3.uploads, s3.objects) == ({}, {})
    digest = put(farm_of_parts, data)
    assert not missing(farm_of_parts, digest)


def test_so_many_copies_as_there_is_room_for_stay_on_this_machine(s3, tmp_path):
    with LocalFarm(tmp_path, flags=["--blobs", s3.url(more="&copies-mib=1")]) as farm:
        blobs = [os.urandom(400_000) for _ in range(4)]
        digests = [put(farm, data) for data in blobs]
        here = {path.name for path in (farm.data / "blobs").rglob("*") if len(path.name) == 64}
        assert here == set(digests[2:]), "two of 400,000 bytes fit into a MiB"

        token = (farm.data / "join-token").read_text().strip()
        for data, digest in zip(blobs, digests):
            status, got = farm_rpc.fetch_blob(farm_rpc.channel_of(farm.grpc), token, digest)
            assert status == "OK" and got >= len(data)
        assert sum(path.stat().st_size for path in (farm.data / "blobs").rglob("*") if path.is_file()) <= 1 << 20


@pytest.mark.parametrize("change, said", [
    ({"AWS_SECRET_ACCESS_KEY": "wrong"}, "SignatureDoesNotMatch.*check AWS_ACCESS_KEY_ID"),
    ({"AWS_ACCESS_KEY_ID": ""}, "set AWS_ACCESS_KEY_ID"),
    ({"bucket": "other-bucket"}, "NoSuchBucket.*make the bucket first"),
    ({"prefix": "a b"}, "prefix with other characters"),
])
def test_what_cannot_work_is_told_at_the_start(s3, tmp_path, change, said):
    where = s3.url(change.get("prefix", "scenes"), change.get("bucket"))
    env = dict(os.environ, **{k: v for k, v in change.items() if k.startswith("AWS")})
    printed = refused_coordinator(tmp_path, "--blobs", where, env=env)
    assert re.search(said, printed), printed
