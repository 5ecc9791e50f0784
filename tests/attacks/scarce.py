"""Too few file descriptors, too little memory, full disks, clocks that jump, kills: refusals say why, and work goes on once there is more."""

import hashlib
import json
import os
import signal
import socket
import subprocess

from attack_kit import Bystander, LocalFarm, TINY, UNLIMITED, ask, group, sane, shown, still_serves, submit
from chaos_kit import SmallDisk
from local_farm import SCENE, bin_dir, wait_until
from machine_storms import FAKETIME
from weather import Skip

JOB = dict(spp=24, seed=5, size="256x192")  # 48 tiles of 5 rounds


def descriptors(record, folder):
    record.row = "few descriptors: 24 to 200 of them, and 300 connections to each port"
    for limit in (24, 32, 48, 64, 96, 200):
        with record.expecting(f"{limit} descriptors"):
            args = ["prlimit", f"--nofile={limit}:{limit}", bin_dir() / "lightshaft-coordinator", "--http", "127.0.0.1:0", "--grpc", "127.0.0.1:0", "--data", folder / f"files-{limit}"]
            if limit < 96:
                done = subprocess.Popen([str(a) for a in args], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
                ports = folder / f"files-{limit}" / "ports.json"
                wait_until(lambda: ports.exists() or done.poll() is not None, "it starts or says why not", 60)
                ended = done.poll()
                done.kill()
                said = done.communicate()[1]
                record.attempt(f"{limit}: starts, or ends with a sentence", ended is None or ended > 0 and "open" in said and "terminate" not in said, f"exit code {ended}: {said[-200:]}")
                continue
            with LocalFarm(folder / f"farm-{limit}", within=["prlimit", f"--nofile={limit}:{limit}"]) as farm:
                held = []
                for port in (farm.http, farm.grpc):
                    for _ in range(300):
                        held.append(socket.create_connection(("127.0.0.1", port), timeout=20, source_address=("127.0.0.2", 0)))
                for sock in held:
                    sock.close()
                wait_until(lambda: ask(farm, "GET", "/readyz").status == 200, "it is ready again", 60)
                farm.add_worker()
                record.attempt(f"{limit}: a job afterwards", farm.pixels(submit(farm, farm.token, TINY, spp=2)), "")


def memory(record, folder):
    record.row = "little memory: 1.5 GB of data for the coordinator, beside large scenes, images and bundles"
    with LocalFarm(folder / "memory", flags=UNLIMITED, within=["prlimit", "--data=1500000000"]) as farm:
        farm.add_worker()
        token = farm.token_of("mallory")
        ball = '<shape type="sphere"><transform name="to_world"><translate x="1"/></transform></shape>\n'
        large = SCENE.replace("</scene>", ball * 200_000 + "</scene>")
        for label, method, path, body, kind in (("a scene of 18 MB", "POST", "/api/v1/jobs?spp=2", large, "application/xml"), ("an image of 16,384 square", "POST", "/api/v1/jobs?spp=2&size=16384x16384", SCENE, "application/xml"),
                                                ("an image of 4,096 square", "POST", "/api/v1/jobs?spp=2&size=4096x4096", SCENE, "application/xml"), ("10,000 frames", "POST", "/api/v1/jobs?spp=2&frames=1-10000", SCENE, "application/xml")):
            with record.expecting(label):
                answer = ask(farm, method, path, token, body, kind, patience=180)
                # 503 and 507 are what a lack of the coordinator's own is answered with.
                record.attempt(label, sane(answer, (503, 507)) and farm.coordinator.alive(), shown(answer))
                if answer.status == 201:
                    job = json.loads(answer.body)["id"]
                    for what in ("image.exr", "image.png", "report.html"):
                        answer = ask(farm, "GET", f"/api/v1/jobs/{job}/{what}", token, patience=180)
                        record.attempt(f"{label}: {what}", sane(answer, (503, 507)) and farm.coordinator.alive(), shown(answer))
                    ask(farm, "DELETE", f"/api/v1/jobs/{job}", token)
        still_serves(record, farm, farm.token_of("bob"))
        record.attempt("a job is rendered", farm.pixels(submit(farm, farm.token, TINY, spp=2)), "")


def answers(farm):
    try:
        return ask(farm, "GET", "/healthz").status == 200
    except OSError:
        return False


def disk(record, folder):
    record.row = "a disk of 24 MB that is full"
    try:
        small = SmallDisk(folder / "disk" / "data", 24)
    except Skip as why:
        record.left_out.append(f"full disks: {why}")
        return
    with small, LocalFarm(folder / "disk", flags=UNLIMITED) as farm:
        token, bob = farm.token_of("mallory"), farm.token_of("bob")
        worker = farm.add_worker("--fake-delay", "15")
        job = submit(farm, token, SCENE, **JOB)
        farm.wait_for_progress(job, 10)
        small.fill()
        view = wait_until(lambda: (v := farm.job(job))["state"] == "paused" and v, "the job waits", 60)
        record.attempt("the job is paused with the reason", "No space left" in (view["error"] or ""), view["error"])
        data = os.urandom(100_000)
        for label, method, path, body, kind in (("a blob", "PUT", f"/api/v1/blobs/{hashlib.sha256(data).hexdigest()}", data, "application/octet-stream"), ("a job", "POST", "/api/v1/jobs?spp=2", SCENE + " " * 100_000, "application/xml"), ("a token", "POST", "/api/v1/tokens", '{"role": "read"}', "application/json")):
            answer = ask(farm, method, path, farm.token, body, kind)
            record.attempt(f"{label} is refused with the reason", answer.status in (503, 507) and b"pace" in answer.body, shown(answer))
        for path in ("/api/v1/jobs", f"/api/v1/jobs/{job}", f"/api/v1/jobs/{job}/image.png", "/api/v1/workers"):
            answer = ask(farm, "GET", path, token)
            record.attempt(f"{path.replace(job, 'ID')} is answered", answer.status == 200, shown(answer))
        farm.coordinator.kill()
        with record.expecting("it starts again on the full disk, and with 400 KB of room jobs can be removed"):
            farm.coordinator.args[farm.coordinator.args.index("--http") + 1] = f"127.0.0.1:{farm.http}"
            farm.coordinator.start()  # it cannot write ports.json
            wait_until(lambda: answers(farm) or not farm.coordinator.alive(), "it serves", 60)
            record.attempt("it starts again on the full disk", farm.coordinator.alive() and ask(farm, "GET", f"/api/v1/jobs/{job}", token).status == 200, farm.coordinator.output()[-300:])
            small.free()
            small.fill(leave=400_000)  # docs/guide/operations.md: the database needs some 100 KB
            removed = ask(farm, "DELETE", f"/api/v1/jobs/{job}", farm.token)
            record.attempt("with 400 KB of room, jobs can be removed", removed.status == 204, shown(removed))
        small.free()
        farm.coordinator.kill()
        farm.start_coordinator()
        record.attempt("with room again, a job is rendered", farm.pixels(submit(farm, token, TINY, spp=2)) and worker.alive(), "")
        still_serves(record, farm, bob)


def clock(record, folder, expected):
    record.row = "a clock that jumps by ten days forward, ten back, and 400 forward"
    if not FAKETIME:
        record.left_out.append("a clock that jumps: libfaketime is not installed")
        return
    (folder / "clock").mkdir()
    now = folder / "clock" / "now"
    now.write_text("+0")
    with LocalFarm(folder / "clock" / "farm", flags=UNLIMITED, environment=dict(LD_PRELOAD=FAKETIME, FAKETIME_TIMESTAMP_FILE=str(now), FAKETIME_NO_CACHE="1", DONT_FAKE_MONOTONIC="1")) as farm:
        token = farm.token_of("mallory")
        farm.add_worker("--fake-delay", "5")
        for shift in ("+10d", "-10d", "+400d"):
            job = submit(farm, token, SCENE, **JOB)
            farm.wait_for_progress(job, 10)
            now.write_text(shift)
            record.attempt(shift, farm.pixels(job) == expected, "other pixels")
            still_serves(record, farm, token, f"{shift}: tokens are valid, others served")


def kills(record, folder, expected):
    record.row = "kill -9 of the coordinator, six times within one job"
    with LocalFarm(folder / "kills", flags=UNLIMITED) as farm:
        farm.add_worker("--fake-delay", "15")
        job = submit(farm, farm.token, SCENE, **JOB)
        total = farm.job(job)["units_total"]
        for i in range(6):
            farm.wait_for_progress(job, (i + 1) * total // 8)
            farm.restart_coordinator()
            record.attempt(f"kill {i + 1}: the job is there", farm.job(job)["state"] in ("running", "queued"), farm.job(job)["state"])
        record.attempt("the pixels are those of an undisturbed run", farm.pixels(job) == expected, "other pixels")
        process = farm.coordinator
        process.signal(signal.SIGTERM)
        record.attempt("it ends when it is told to", process.wait(60) == 0, "")


def many_jobs(record, folder):
    record.row = "2,000 tiny jobs of one user"
    with LocalFarm(folder / "many", flags=UNLIMITED) as farm:
        mallory, bob = farm.token_of("mallory"), Bystander(farm)
        with bob.watching():
            seconds = [ask(farm, "POST", "/api/v1/jobs?spp=2", mallory, TINY, "application/xml").seconds for _ in range(2000)]
        late, early = sorted(seconds[-200:])[100], sorted(seconds[:200])[100]
        record.attempt("the last are taken as fast as the first", late < 3 * early + 0.02, f"median of the first 200 {early:.4f} s, of the last 200 {late:.4f} s")
        record.attempt("another user meanwhile waits less than a second", bob.served(), bob.told())
        for path in ("/api/v1/jobs?limit=50", "/api/v1/jobs?limit=500", "/api/v1/jobs", "/api/v1/jobs?search=x&limit=50", "/api/v1/jobs?sort=name&offset=1900&limit=100"):
            answer = ask(farm, "GET", path, mallory)
            record.attempt(path, answer.status == 200 and answer.seconds < 1, shown(answer))


@group("Exhausted descriptors, memory, disks, clocks; kills")
def scarce(record, folder):
    with LocalFarm(folder / "undisturbed") as farm:
        farm.add_worker()
        expected = farm.pixels(submit(farm, farm.token, SCENE, **JOB))
    for part in (descriptors, memory, disk, many_jobs):
        with record.expecting("this part runs to its end"):
            part(record, folder)
    for part in (clock, kills):
        with record.expecting("this part runs to its end"):
            part(record, folder, expected)
