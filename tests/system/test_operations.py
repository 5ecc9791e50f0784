"""What docs/guide/operations.md promises: metrics and the dashboard that shows them, logs, webhooks, backup and restore."""

import json
import re
import shutil
import subprocess

import pytest
from local_farm import ROOT, SCENE, HttpError, LocalFarm, bin_dir, refused_coordinator, wait_until
from redis_server import RedisServer
from webhook_receiver import Receiver, signature_is_right

SPEC = dict(spp=24, seed=5)


def metrics(farm):
    text = farm.request("GET", "/metrics").decode()
    return {line.rsplit(" ", 1)[0]: float(line.rsplit(" ", 1)[1]) for line in text.splitlines() if not line.startswith("#")}


# ---- metrics ----

def test_the_dashboard_of_Grafana_asks_only_for_metrics_that_there_are(tmp_path):
    dashboard = json.loads((ROOT / "deploy" / "grafana" / "lightshaft.json").read_text())
    asked = [t["expr"] for p in dashboard["panels"] for t in p["targets"]]
    names = {name for expression in asked for name in re.findall(r"\b((?:lightshaft|process)_\w+)", expression)}
    labels = {label for expression in asked for label in re.findall(r"by \((\w+)\)", expression)}
    with RedisServer(tmp_path) as redis, LocalFarm(
            tmp_path / "farm", flags=["--store", redis.url, "--webhook", "http://127.0.0.1:9/"]) as farm:
        farm.add_worker()
        farm.pixels(farm.submit(SCENE, **SPEC))
        text = farm.request("GET", "/metrics").decode()

    given = set(re.findall(r"^# TYPE (\w+)", text, re.M))
    assert len(names) > 25
    assert given == names, "every metric is shown somewhere"
    assert labels <= set(re.findall(r"(\w+)=\"", text))


def test_metrics_count_what_a_job_took(farm):
    farm.add_worker()
    job = farm.submit(SCENE, **SPEC)
    farm.pixels(job)

    m, units = metrics(farm), farm.job(job)["units_total"]
    assert m["lightshaft_units_folded_total"] == m['lightshaft_results_total{verdict="accepted"}'] == units
    assert m["lightshaft_units_leased_total"] >= units and m["lightshaft_leases_granted_total"] >= 1
    assert m["lightshaft_units_leased"] == m["lightshaft_leases"] == 0
    assert m["lightshaft_result_bytes_total"] > units * 32 * 32 * 24 / 4 and m["lightshaft_blob_bytes_total"] > 0
    assert 0 < m["lightshaft_fold_lag_seconds_total"] < 60 * units
    assert m["process_threads"] > 3 and m["process_open_fds"] > 3 and m["process_resident_memory_bytes"] > 1e6


def test_metrics_count_retries_by_their_cause(farm):
    victim = farm.add_worker("--fake-delay", 50)
    job = farm.submit(SCENE, **SPEC)
    farm.wait_for_progress(job, 2)
    held = wait_until(lambda: metrics(farm)["lightshaft_units_leased"], "units are lent")
    victim.kill()

    lost = wait_until(lambda: metrics(farm)['lightshaft_units_freed_total{cause="worker lost"}'], "its units are freed")
    assert 0 < lost <= held + 64
    farm.add_worker()
    farm.wait_for_job(job)


def test_units_of_a_cancelled_job_are_counted_under_a_cause_that_is_documented(farm):
    farm.add_worker("--fake-delay", 50)
    job = farm.submit(SCENE, **SPEC)
    farm.wait_for_progress(job, 2)
    farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "cancelled"}')

    freed = {cause: count for name, count in metrics(farm).items() for cause in re.findall(r'units_freed_total\{cause="(.*)"', name)}
    (row,) = [line for line in (ROOT / "docs" / "guide" / "operations.md").read_text().splitlines() if line.startswith("| `lightshaft_units_freed_total{cause}`")]
    assert freed["job ended"] > 0
    assert set(re.findall(r"`([a-z ]+)`", row.split("|")[2])) == set(freed), "documented are those that there are"


def test_prometheus_is_told_how_to_reach_each_kind_of_farm(tmp_path):
    jobs = {j["job_name"]: j for j in pytest.importorskip("yaml").safe_load((ROOT / "deploy" / "grafana" / "prometheus.yml").read_text())["scrape_configs"]}
    with LocalFarm(tmp_path / "plain") as plain, LocalFarm(tmp_path / "tls", tls=True) as tls:
        for job in jobs.values():
            farm = tls if job.get("scheme") == "https" else plain
            assert farm.url().startswith(job.get("scheme", "http") + ":") and ("ca_file" in job.get("tls_config", {})) == farm.tls
            assert b"lightshaft_jobs" in farm.request("GET", job["metrics_path"]) and job["authorization"]["type"] == "Bearer"

    host = {name: job["static_configs"][0]["targets"][0].split(":")[0] for name, job in jobs.items()}
    assert f",{host['lightshaft-tls']}," in (ROOT / "deploy" / "container" / "make-secrets.sh").read_text(), "a name in the certificate"
    assert f",{host['lightshaft-kubernetes']}," in (ROOT / "deploy" / "kubernetes" / "make-secrets.sh").read_text()
    labels = jobs["lightshaft-kubernetes"]["static_configs"][0]["labels"]
    asked = re.findall(r'(\w+)="(\w+)"', (ROOT / "deploy" / "kubernetes" / "components" / "keda" / "worker.yaml").read_text())
    assert asked and set(asked) == set(labels.items()), "what KEDA's query selects by"


# ---- logs ----

def test_logs_are_lines_of_json_with_the_keys_of_job_and_worker(tmp_path):
    with LocalFarm(tmp_path, flags=["--log-format", "json"]) as farm:
        worker = farm.add_worker("--log-format", "json", name='a "b" job=stolen')
        job = farm.submit(SCENE, **SPEC)
        farm.wait_for_job(job)
        coordinator = [json.loads(line) for line in farm.coordinator.output().splitlines()]
        said = [json.loads(line) for line in worker.output().splitlines()]

    assert all(re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", line["time"]) for line in coordinator + said)
    assert {line["level"] for line in coordinator} == {"info"}
    assert [line for line in coordinator if line.get("job") == job and line.get("state") == "done"]
    joined = next(line for line in coordinator if line["text"] == "joined" and "name" in line)
    assert joined["worker"].startswith("w-") and "job" not in joined and "stolen" in joined["name"]
    assert any(line["text"] == "joined the coordinator" for line in said)


def test_a_result_that_is_refused_is_logged_with_job_tile_round_and_worker(tmp_path):
    """Cut short on its way by the meddler of the storms."""
    pytest.importorskip("grpc")
    from meddler import Meddler
    with LocalFarm(tmp_path, flags=["--log-format", "json"]) as farm, Meddler(tmp_path, f"127.0.0.1:{farm.grpc}", 1, most_cut=1, cut=1) as meddler:
        farm.add_worker("--log-format", "json", coordinator=f"127.0.0.1:{meddler.port}")
        job = farm.submit(SCENE, **SPEC)
        farm.wait_for_job(job)
        warned = [line for line in map(json.loads, farm.coordinator.output().splitlines()) if line["level"] == "warning"]
        said = [line for line in map(json.loads, farm.workers[0].output().splitlines()) if line["level"] == "warning"]
        tiles = farm.get(f"/api/v1/jobs/{job}/tiles")["tiles"]

    assert len(warned) == len(said) == 1, (warned, said)
    assert warned[0]["job"] == said[0]["job"] == job and warned[0]["worker"].startswith("w-")
    assert warned[0]["tile"] == said[0]["tile"] and 0 <= int(warned[0]["tile"]) < len(tiles) and int(warned[0]["round"]) >= 0


def test_the_log_of_a_job_tells_its_life(farm):
    farm.add_worker()
    job = farm.submit(SCENE, **SPEC)
    farm.wait_for_job(job)

    log = wait_until(lambda: (t := farm.request("GET", f"/api/v1/jobs/{job}/log").decode()).count("\n") >= 1 and t, "it is written")
    assert "running" in log


# ---- readiness ----

def test_readiness_tells_that_redis_is_away(tmp_path):
    with RedisServer(tmp_path) as redis, LocalFarm(tmp_path / "farm", flags=["--store", redis.url]) as farm:
        assert farm.request("GET", "/readyz") == b"ready\n"
        redis.kill()
        farm.submit(SCENE, **SPEC)

        wait_until(lambda: b"but" in farm.request("GET", "/readyz"), "it is told")
        redis.start()


def test_readiness_tells_that_the_disk_is_full_until_results_can_be_stored_again(tmp_path, expected):
    from chaos_kit import SmallDisk
    from weather import Skip
    try:
        disk = SmallDisk(tmp_path / "data", 64)
    except Skip as why:
        pytest.skip(str(why))
    with disk, LocalFarm(tmp_path) as farm:
        farm.add_worker("--fake-delay", 20)
        job = farm.submit(SCENE, **SPEC)
        farm.wait_for_progress(job, 2)
        disk.fill()
        farm.wait_for_job(job, states=("paused",))

        with pytest.raises(HttpError) as refused:
            farm.request("GET", "/readyz")
        assert refused.value.status == 503 and re.search("No space left|disk is full", refused.value.body)

        disk.free()
        farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "running"}')
        assert farm.pixels(job) == expected
        assert farm.request("GET", "/readyz") == b"ready\n"


# ---- webhooks ----

def test_a_webhook_is_told_of_a_jobs_life_signed_and_in_order(tmp_path):
    with Receiver() as receiver, LocalFarm(tmp_path, flags=["--webhook", receiver.url]) as farm:
        job = farm.submit(SCENE, **SPEC)
        farm.add_worker()
        came = receiver.until("job.done")

        assert [h["Lightshaft-Event"] for _, h, _, _ in came] == ["job.queued", "job.running", "job.done"]
        assert all(signature_is_right(farm, h, body) for _, h, body, _ in came)
        assert not signature_is_right(farm, came[0][1], came[0][2] + b" ")
        told = json.loads(came[-1][2])["job"]
        assert told["id"] == job and told["state"] == "done" and told["units_done"] == told["units_total"]


def test_a_webhook_that_fails_is_repeated_and_a_redirect_is_not_followed(tmp_path):
    with Receiver([500, 302]) as receiver, LocalFarm(tmp_path, flags=["--webhook", receiver.url]) as farm:
        farm.submit(SCENE, **SPEC)
        came = receiver.until("job.queued")

        assert wait_until(lambda: (m := metrics(farm)) and m['lightshaft_webhook_sendings_total{result="taken"}'] == 1 and m, "it is counted")
        m = metrics(farm)
        assert m['lightshaft_webhook_sendings_total{result="failed"}'] == 2
        assert m["lightshaft_webhooks_waiting"] == m["lightshaft_webhooks_given_up_total"] == 0

    assert [status for _, _, _, status in came] == [500, 302, 200]
    assert {path for path, _, _, _ in came} == {"/hook"}
    assert len({h["Lightshaft-Delivery"] for _, h, _, _ in came}) == 1


def test_what_a_receiver_does_not_take_is_counted_as_waiting(tmp_path):
    with LocalFarm(tmp_path, flags=["--webhook", "http://127.0.0.1:9/"]) as farm:
        farm.submit(SCENE, **SPEC)
        wait_until(lambda: metrics(farm)['lightshaft_webhook_sendings_total{result="failed"}'] >= 1, "a sending has failed")

        assert metrics(farm)["lightshaft_webhooks_waiting"] == 1


def test_a_webhook_is_told_after_kill_9_of_the_coordinator(tmp_path):
    with Receiver([503] * 3) as receiver, LocalFarm(tmp_path, flags=["--webhook", receiver.url]) as farm:
        job = farm.submit(SCENE, **SPEC)
        receiver.next()
        farm.restart_coordinator()
        farm.add_worker()
        came = receiver.until("job.done")

    taken = [h["Lightshaft-Event"] for _, h, _, status in came if status == 200]
    assert taken[0] == "job.queued" and taken[-1] == "job.done"
    assert json.loads(came[-1][2])["job"]["id"] == job


def test_a_webhook_that_is_no_address_is_refused_at_the_start(tmp_path):
    assert "http://HOST" in refused_coordinator(tmp_path, "--webhook", "file:///etc/passwd", code=2)


# ---- backup and restore ----

def backup(farm, to, *more):
    subprocess.run([ROOT / "deploy" / "backup.sh", farm.data, to, *more], check=True, capture_output=True)


def restore(archive, *to):
    subprocess.run([ROOT / "deploy" / "restore.sh", archive, *to], check=True, capture_output=True)


def test_a_farm_restored_from_a_backup_made_while_it_worked_finishes_the_job(farm, tmp_path, expected):
    farm.add_worker("--fake-delay", 10)
    farm.request("POST", "/api/v1/tokens", b'{"role": "read"}')
    job = farm.submit(SCENE, **SPEC)
    farm.wait_for_progress(job, 8)
    backup(farm, tmp_path / "backup.tar.gz")
    farm.wait_for_progress(job, 12)
    for process in farm.workers + [farm.coordinator]:
        process.kill()
    shutil.rmtree(farm.data)

    restore(tmp_path / "backup.tar.gz", farm.data)
    assert (farm.data / "token").read_text().strip() == farm.token and (farm.data / "tokens").exists()
    farm.start_coordinator()

    assert farm.job(job)["units_done"] >= 8, "what was accepted before the backup is not rendered again"
    farm.add_worker()
    assert farm.pixels(job) == expected


def test_a_restored_coordinator_of_several_is_who_it_was_and_knows_users_and_workers(tmp_path, expected):
    """Redis says whose a job is by the name in DATA/node-id; tokens and certificates are in the folder of secrets."""
    with RedisServer(tmp_path) as redis:
        flags = ["--shared", "--store", redis.url, "--blobs", tmp_path / "blobs"]
        with LocalFarm(tmp_path / "farm", flags=flags, tls=True, secrets=tmp_path / "secrets") as farm:
            farm.add_worker("--fake-delay", 10)
            user = farm.token_of("ann")
            job = farm.submit(SCENE, **SPEC)
            farm.wait_for_progress(job, 8)
            backup(farm, tmp_path / "backup.tar.gz", farm.secrets)
            farm.coordinator.kill()
            shutil.rmtree(farm.data)
            shutil.rmtree(farm.secrets)

            restore(tmp_path / "backup.tar.gz", farm.data, farm.secrets)
            farm.start_coordinator()

            assert farm.job(job)["units_done"] >= 8 and redis.ask("HGET", f"lightshaft:job:{job}", "fence") == "1"
            assert json.loads(farm.request("GET", "/api/v1/jobs", token=user))["jobs"] == []
            assert farm.pixels(job) == expected, "its worker, with its old certificate and token, comes back"


def test_secrets_that_were_kept_elsewhere_are_restored_beside_the_rest_where_no_folder_is_named(tmp_path):
    with LocalFarm(tmp_path / "farm", secrets=tmp_path / "secrets") as farm:
        backup(farm, tmp_path / "backup.tar.gz", farm.secrets)
        restore(tmp_path / "backup.tar.gz", tmp_path / "new")

        assert (tmp_path / "new" / "secrets" / "token").read_text().strip() == farm.token


@pytest.mark.parametrize("folder", ["data", "secrets"])
def test_a_restore_does_not_touch_a_folder_that_has_a_farm_in_it(tmp_path, folder):
    with LocalFarm(tmp_path / "farm", secrets=tmp_path / "secrets") as farm:
        backup(farm, tmp_path / "backup.tar.gz", farm.secrets)
        to = {"data": tmp_path / "new", "secrets": tmp_path / "new-secrets", folder: getattr(farm, folder)}

        refused = subprocess.run([ROOT / "deploy" / "restore.sh", tmp_path / "backup.tar.gz", to["data"], to["secrets"]], capture_output=True, text=True)

        assert refused.returncode == 1 and "not empty" in refused.stderr
        assert farm.get("/api/v1/jobs")["jobs"] == []
    assert not (tmp_path / "new").exists(), "all or nothing"


# ---- upgrade ----

@pytest.mark.parametrize("megabytes", [60, 200, 400, 600])
def test_a_coordinator_with_too_little_memory_ends_with_a_sentence(tmp_path, megabytes):
    """Its threads alone need more: 8 MiB of stack each."""
    limited = ["prlimit", f"--data={megabytes * 1_000_000}", bin_dir() / "lightshaft-coordinator",
               "--data", tmp_path, "--http", "127.0.0.1:0", "--grpc", "127.0.0.1:0"]
    done = subprocess.run([str(word) for word in limited], capture_output=True, text=True, timeout=120)
    assert done.returncode == 1, (done.returncode, done.stderr)
    assert "lightshaft-coordinator: error: " in done.stderr and "RLIMIT_DATA" in done.stderr


def test_a_worker_of_another_protocol_is_refused_with_both_versions(farm, tmp_path):
    grpc = pytest.importorskip("grpc")
    from meddler import load_protocol
    protocol = load_protocol(tmp_path)
    hello = protocol.FromWorker(hello=protocol.Hello(protocol=99, name="old-timer", build="9.9", numeric_class=bytes(32), threads=1,
                                                     join_token=farm.join_token))
    with grpc.insecure_channel(f"127.0.0.1:{farm.grpc}") as channel:
        work = channel.stream_stream("/lightshaft.farm.v1.Farm/Work", request_serializer=None, response_deserializer=None)
        answer = protocol.ToWorker.FromString(next(iter(work(iter([hello.SerializeToString()])))))

    assert answer.WhichOneof("message") == "refused" and not answer.refused.retry
    assert "99" in answer.refused.problem.message and "coordinator speaks 1" in answer.refused.problem.message
    assert farm.get("/api/v1/workers")["workers"] == []
    assert "old-timer" in farm.coordinator.output(), "its name is in the log"
