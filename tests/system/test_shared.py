"""Several coordinators on one Redis: when the owner of a job is killed, stands still or is started again, the job goes on
elsewhere or stays, workers and clients find it, and the image has the same bits."""

import json
import os
import shutil
import subprocess
import urllib.error
from concurrent.futures import ThreadPoolExecutor

import pytest
import s3_server
from local_farm import PATIENCE, SCENE, HttpError, LocalFarm, bin_dir, refused_coordinator, wait_until

pytestmark = pytest.mark.slow

SPEC = dict(spp=64, seed=3)


@pytest.fixture
def pair(redis, tmp_path):
    """Two coordinators with the same tokens."""
    flags = ["--shared", "--store", redis.url, "--blobs", tmp_path / "blobs"]
    (tmp_path / "a").mkdir()
    (tmp_path / "b" / "data").mkdir(parents=True)
    with LocalFarm(tmp_path / "a", flags=flags) as a:
        for name in ("token", "join-token"):
            shutil.copy(a.data / name, tmp_path / "b" / "data" / name)
        with LocalFarm(tmp_path / "b", flags=flags) as b:
            yield a, b


def add_worker(pair, *flags):
    a, b = pair
    return a.add_worker("--coordinator", f"127.0.0.1:{b.grpc}", *flags)


ask, has = LocalFarm.ask, LocalFarm.has


def test_a_killed_coordinators_job_goes_on_at_the_other_one(pair, redis, expected):
    a, b = pair
    add_worker(pair, "--fake-delay", 20)
    job = a.submit(SCENE, **SPEC)
    a.wait_for_progress(job, 5)

    a.coordinator.kill()
    wait_until(lambda: has(b, job), "the other one has the job")

    assert b.pixels(job) == expected
    assert redis.ask("HGET", f"lightshaft:job:{job}", "fence") == "2"
    assert "taken over from coordinator" in b.request("GET", f"/api/v1/jobs/{job}/log").decode()


def test_a_coordinator_sends_clients_to_the_one_that_has_the_job(pair):
    a, b = pair
    job = a.submit(SCENE, **SPEC)
    wait_until(lambda: ask(b, f"/api/v1/jobs/{job}")[0] == 307, "Redis has been told")

    status, location = ask(b, f"/api/v1/jobs/{job}/image.png?exposure=1")

    assert status == 307
    assert location == f"http://127.0.0.1:{a.http}/api/v1/jobs/{job}/image.png?exposure=1"
    assert b.job(job)["id"] == job, "urllib follows"
    assert ask(b, "/api/v1/jobs/j-0000")[0] == 404
    a.coordinator.kill()
    wait_until(lambda: ask(b, f"/api/v1/jobs/{job}")[0] == 503, "it is said that its owner does not answer")


def test_a_coordinator_that_stood_still_drops_what_another_has_taken(pair, redis, expected):
    a, b = pair
    add_worker(pair, "--fake-delay", 20)
    b.add_worker("--fake-delay", 20)
    job = a.submit(SCENE, **SPEC)
    a.wait_for_progress(job, 5)

    a.coordinator.stop()
    wait_until(lambda: has(b, job), "the other one has the job")
    a.coordinator.resume()

    wait_until(lambda: ask(a, f"/api/v1/jobs/{job}") == (307, f"http://127.0.0.1:{b.http}/api/v1/jobs/{job}"), "it has dropped the job")
    assert "another one has taken it over: dropped here" in a.coordinator.output()
    assert b.pixels(job) == expected
    assert redis.ask("HGET", f"lightshaft:job:{job}", "fence") == "2"
    assert a.get("/api/v1/jobs")["jobs"] == []
    wait_until(lambda: '"state":"done"' in redis.ask("HGET", f"lightshaft:job:{job}", "record"), "the new owner's word stands")


def test_a_store_of_blobs_that_is_away_during_a_takeover_delays_it_and_nothing_else(redis, tmp_path, monkeypatch, expected):
    for name, value in s3_server.ENVIRONMENT.items():
        monkeypatch.setenv(name, value)
    with s3_server.S3Server() as s3:
        flags = ["--shared", "--store", redis.url, "--blobs", s3.url()]
        (tmp_path / "a").mkdir()
        (tmp_path / "b" / "data").mkdir(parents=True)
        with LocalFarm(tmp_path / "a", flags=flags) as a:
            for name in ("token", "join-token"):
                shutil.copy(a.data / name, tmp_path / "b" / "data" / name)
            with LocalFarm(tmp_path / "b", flags=flags) as b:
                job = a.submit(SCENE, **SPEC)
                wait_until(lambda: redis.ask("HGET", f"lightshaft:job:{job}", "owner"), "Redis is told")
                s3.refuse = [503] * 1_000_000
                asked = len(s3.requests)
                a.coordinator.kill()
                # Six attempts, and once more after the pause: nobody has given the job up.
                wait_until(lambda: len(s3.requests) >= asked + 7, "the heir asks for the files again")
                wait_until(lambda: ask(b, "/readyz")[0] == 503, "it says that the store does not answer")
                assert ask(b, "/readyz")[0] == 503 and ask(b, "/api/v1/jobs")[0] == 200
                assert ask(b, f"/api/v1/jobs/{job}")[0] == 503, "on its way here"

                s3.refuse = []
                b.add_worker()
                wait_until(lambda: has(b, job), "the heir has it")
                assert b.pixels(job) == expected
                wait_until(lambda: ask(b, "/readyz")[0] == 200, "the store answers")


def test_a_coordinator_started_again_in_time_keeps_its_jobs(pair, redis, expected):
    a, b = pair
    add_worker(pair, "--fake-delay", 10)
    job = a.submit(SCENE, **SPEC)
    a.wait_for_progress(job, 5)

    a.restart_coordinator()

    assert a.job(job)["units_done"] >= 5, "nothing is rendered again"
    assert a.pixels(job) == expected
    assert redis.ask("HGET", f"lightshaft:job:{job}", "fence") == "1"


def test_a_coordinator_that_comes_back_after_its_jobs_were_taken_starts_without_them(pair, redis):
    a, b = pair
    job = a.submit(SCENE, **SPEC)
    wait_until(lambda: redis.ask("HGET", f"lightshaft:job:{job}", "owner"), "Redis is told")
    a.coordinator.kill()
    wait_until(lambda: has(b, job), "the other one has the job")

    a.start_coordinator()

    assert a.get("/api/v1/jobs")["jobs"] == []
    assert ask(a, f"/api/v1/jobs/{job}")[0] == 307


def test_a_redis_that_dies_and_forgets_moves_no_job(pair, redis, expected):
    a, b = pair
    a.add_worker("--fake-delay", 20)
    b.add_worker("--fake-delay", 20)
    jobs = [a.submit(SCENE, **SPEC), b.submit(SCENE, **SPEC)]
    a.wait_for_progress(jobs[0], 2)

    redis.kill()
    a.wait_for_progress(jobs[0], 5)
    redis.start()

    assert [a.pixels(jobs[0]), b.pixels(jobs[1])] == [expected] * 2
    wait_until(lambda: [redis.ask("HGET", f"lightshaft:job:{job}", "fence") for job in jobs] == ["1", "1"], "it is told again")


def test_the_cli_waits_through_the_death_of_the_coordinator_it_asked(pair, expected, tmp_path):
    a, b = pair
    add_worker(pair, "--fake-delay", 20)
    (tmp_path / "scene.xml").write_text(SCENE)
    waiting = subprocess.Popen(
        [bin_dir() / "lightshaft", "submit", tmp_path / "scene.xml", "--spp", "64", "--seed", "3", "--wait", "-o", tmp_path / "out.exr",
         "--to", f"http://127.0.0.1:{a.http},http://127.0.0.1:{b.http}"],
        env=dict(os.environ, LIGHTSHAFT_TOKEN=a.token), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    job = wait_until(lambda: (jobs := a.get("/api/v1/jobs")["jobs"]) and jobs[0]["id"], "it is submitted")
    a.wait_for_progress(job, 5)

    a.coordinator.kill()
    out, err = waiting.communicate(timeout=PATIENCE)

    assert waiting.returncode == 0, err
    assert (tmp_path / "out.exr").stat().st_size > 0
    assert b.report(job)["pixels_sha256"] == expected


@pytest.fixture(params=[False, True], ids=["open", "tls"])
def secret_pair(request, redis, tmp_path):
    """Two coordinators with one folder of secrets, which the first of them makes."""
    flags = ["--shared", "--store", redis.url, "--blobs", tmp_path / "blobs"]
    with LocalFarm(tmp_path / "a", flags=flags, tls=request.param, secrets=tmp_path / "secrets") as a:
        with LocalFarm(tmp_path / "b", flags=flags, tls=request.param, secrets=tmp_path / "secrets") as b:
            yield a, b


def status(farm, method, path, token, body=None, kind="application/json"):
    try:
        farm.request(method, path, body, kind, token)
        return 200
    except HttpError as error:
        return error.status
    except urllib.error.URLError:  # sent on to one that is dead
        return 0


def test_with_one_folder_of_secrets_users_and_workers_are_known_everywhere(secret_pair, expected):
    a, b = secret_pair
    made = json.loads(a.request("POST", "/api/v1/tokens", b'{"role": "submit", "user": "ann"}'))
    ann, stranger = made["token"], "0" * 64
    assert [status(farm, "GET", "/api/v1/jobs", token) for farm in (a, b) for token in (ann, stranger)] == [200, 401, 200, 401]
    add_worker((a, b), "--fake-delay", 20)
    job = json.loads(a.request("POST", "/api/v1/jobs?spp=64&seed=3", SCENE.encode(), "application/xml", ann))["id"]
    a.wait_for_progress(job, 5)

    a.coordinator.kill()  # its worker and its user go to the other one
    wait_until(lambda: status(b, "GET", f"/api/v1/jobs/{job}", ann) == 200, "the other one has the job, and knows whose it is")

    assert b.pixels(job) == expected
    assert b.job(job)["owner"] == "ann"
    a.start_coordinator()
    assert status(a, "GET", "/api/v1/jobs", ann) == 200
    b.request("DELETE", f"/api/v1/tokens/{made['id']}")
    assert [status(farm, "GET", "/api/v1/jobs", ann) for farm in (b, a)] == [401, 401], "revoked at one, revoked at all"


def test_tokens_made_at_two_coordinators_at_once_are_all_kept(redis, tmp_path):
    flags = ["--shared", "--store", redis.url, "--blobs", tmp_path / "blobs"]
    with LocalFarm(tmp_path / "a", flags=flags, secrets=tmp_path / "secrets") as a, \
            LocalFarm(tmp_path / "b", flags=flags, secrets=tmp_path / "secrets") as b, ThreadPoolExecutor(8) as pool:
        make = lambda n: json.loads((a, b)[n % 2].request("POST", "/api/v1/tokens", json.dumps({"role": "read", "user": f"u{n}"}).encode()))  # noqa: E731
        made = list(pool.map(make, range(40)))

        for farm in (a, b):
            assert {t["user"] for t in farm.get("/api/v1/tokens")["tokens"]} >= {f"u{n}" for n in range(40)}
            assert {status(farm, "GET", "/api/v1/jobs", m["token"]) for m in made} == {200}


def test_a_coordinator_that_knows_of_no_others_does_not_take_their_jobs(pair, redis, tmp_path):
    assert "start with --shared" in refused_coordinator(tmp_path, "--store", redis.url, code=1)


@pytest.mark.parametrize("flags, said", [
    (["--shared"], "storage that all coordinators reach"),
    (["--shared", "--store", "redis://127.0.0.1:1", "--blobs", "there", "--keep-unused-hours", "1"], "cannot be combined"),
    (["--shared", "--store", "redis://127.0.0.1:1", "--blobs", "there"], "start Redis first"),
    (["--shared", "--store", "redis://127.0.0.1:1", "--blobs", "there", "--tls"], "the same --secrets FOLDER"),
])
def test_what_cannot_be_shared_is_refused_with_a_reason(tmp_path, flags, said):
    assert said in refused_coordinator(tmp_path, *[str(tmp_path / f) if f == "there" else f for f in flags])
