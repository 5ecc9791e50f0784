"""The command as a farm's client, against a real coordinator and real workers."""

import json
import os
import subprocess
import urllib.request

import pytest
from cli_kit import FOG, digest, lightshaft, load, png_size, write_fog
from local_farm import SCENE, LocalFarm, bin_dir, wait_until


@pytest.fixture(scope="module")
def rendering(tmp_path_factory):
    """A farm whose two workers render for real."""
    with LocalFarm(tmp_path_factory.mktemp("farm")) as farm:
        for _ in range(2):
            farm.add_worker(fake=False)
        yield farm


def environment(farm, **more):
    return {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token, **more}


def call(farm, *arguments, code=0, **more):
    return lightshaft(*arguments, env=environment(farm, **more), code=code)


def test_submit_renders_the_pixels_of_render(rendering, tmp_path):
    scene = write_fog(tmp_path)
    alone = digest(lightshaft("render", scene, "-o", tmp_path / "alone.exr", "--spp", 20, "--seed", 3))

    sent = lightshaft("submit", scene, "--to", f"http://127.0.0.1:{rendering.http}", "--token-file", rendering.data / "token",
                      "--spp", 20, "--seed", 3, "--wait", "-o", tmp_path / "farm.exr", "--report", tmp_path / "farm.json")

    job = sent.stdout.split()[0]
    assert load(tmp_path / "farm.json")["pixels_sha256"] == alone
    assert (tmp_path / "farm.exr").stat().st_size > 1000
    assert call(rendering, "fetch", job, "-o", tmp_path / "again.exr").returncode == 0
    assert (tmp_path / "again.exr").read_bytes() == (tmp_path / "farm.exr").read_bytes()
    call(rendering, "fetch", job, "-o", tmp_path / "again.png")
    assert png_size((tmp_path / "again.png").read_bytes()) == (72, 40)
    assert (tmp_path / "again.png").read_bytes() == rendering.request("GET", f"/api/v1/jobs/{job}/image.png")
    call(rendering, "fetch", job, "--html", tmp_path / "farm.html")
    assert alone in (tmp_path / "farm.html").read_text()


def test_submit_waits_for_files_that_are_still_written(rendering, tmp_path):
    scene = write_fog(tmp_path)
    whole = scene.read_bytes()
    scene.unlink()
    waiting = subprocess.Popen([bin_dir() / "lightshaft", "submit", scene, "--after-file", scene, "--after-file", tmp_path / "done.##", "--frames", "1-2"],
                               env=environment(rendering), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)  # fmt: skip
    assert waiting.stderr.readline() == f"waits for 3 files, the first is {scene}\n"
    (shown,) = wait_until(lambda: rendering.get("/api/v1/announced")["announced"], "the farm knows of the job")
    assert (shown["name"], shown["frames"], shown["files"], shown["count"]) == (scene.name, "1-2", [str(scene), *(str(tmp_path / f"done.0{n}") for n in (1, 2))], 3)
    assert f"{scene.name}, frames 1-2, will be submitted when {scene} and 2 more are complete on {shown['machine']}" in call(rendering, "jobs").stderr
    for name in ("done.01", "done.02"):
        (tmp_path / name).write_text("complete\n")
    scene.write_bytes(whole[: len(whole) // 2])
    # The files are complete 5 seconds after they were seen, but for the scene, which has grown meanwhile.
    with open(scene, "ab") as file:
        for byte in whole[len(whole) // 2 :]:
            file.write(bytes([byte]))
            file.flush()
    out, notes = waiting.communicate(timeout=120)

    assert waiting.returncode == 0, notes
    assert call(rendering, "show", out.split()[0]).returncode == 0
    assert rendering.get("/api/v1/announced")["announced"] == []
    unknown = call(rendering, "submit", scene, "--after-file", tmp_path / "never", LIGHTSHAFT_TOKEN="nobody's", code=1)
    assert "token" in unknown.stderr, "a token that nobody knows is told at once"
    refused = call(rendering, "submit", scene, "--after-file", tmp_path / "done.##", code=2)
    assert "# stands for the frame number, and there are no --frames" in refused.stderr


def test_a_farm_compares_with_a_reference_as_render_does(rendering, tmp_path):
    scene = write_fog(tmp_path)
    lightshaft("render", scene, "-o", tmp_path / "right.exr", "--spp", 64, "--seed", 9, "--float")
    reference = ["--spp", 8, "--reference", tmp_path / "right.exr"]
    lightshaft("render", scene, "-o", tmp_path / "alone.exr", *reference, "--report", tmp_path / "alone.json")

    sent = call(rendering, "submit", scene, *reference, "-o", tmp_path / "farm.exr", "--report", tmp_path / "farm.json")

    alone, farm = load(tmp_path / "alone.json"), load(tmp_path / "farm.json")
    truth = ["true_rmse", "true_relmse", "true_flip"]
    assert [[p[k] for k in truth] for p in farm["convergence"]] == [[p[k] for k in truth] for p in alone["convergence"]]
    assert farm["reference"] == alone["reference"] and farm["true_rmse"] > 0
    job = sent.stdout.split()[0]
    shown = json.loads(call(rendering, "show", job, "--json").stdout)
    assert shown["reference"]["relmse"] == farm["true_relmse"] and shown["verdict"]["words"]
    for name in ("error.png", "samples.png"):
        request = urllib.request.Request(f"http://127.0.0.1:{rendering.http}/api/v1/jobs/{job}/{name}",
                                         headers={"Authorization": f"Bearer {rendering.token}"})
        with urllib.request.urlopen(request) as answer:
            png = answer.read()
        assert png_size(png) == (72, 40)


def test_a_reference_of_the_jobs_own_seed_is_warned_of(rendering, tmp_path):
    scene = write_fog(tmp_path)
    lightshaft("render", scene, "-o", tmp_path / "right.exr", "--spp", 8, "--float")

    same = call(rendering, "submit", scene, "--spp", 8, "--reference", tmp_path / "right.exr")
    other = call(rendering, "submit", scene, "--spp", 8, "--seed", 1, "--reference", tmp_path / "right.exr")

    assert "shares this job's seed" in same.stderr and "seed" not in other.stderr


def test_a_reference_that_is_none_is_refused_before_anything_is_rendered(rendering, tmp_path):
    scene = write_fog(tmp_path)
    (tmp_path / "text.exr").write_text("no picture")
    assert "reference" in call(rendering, "submit", scene, "--reference", tmp_path / "text.exr", code=2).stderr
    assert "several frames" in call(rendering, "submit", scene, "--reference", tmp_path / "text.exr", "--frames", "1-3", code=2).stderr


def test_files_are_sent_once(rendering, tmp_path):
    folder = tmp_path / "fresh"
    folder.mkdir()
    scene = write_fog(folder, n=7)

    first = call(rendering, "submit", scene, "--spp", 2)
    second = call(rendering, "submit", scene, "--spp", 2, "--seed", 8)

    assert "fog.vol" in first.stderr and "fog.vol" not in second.stderr


def test_a_bad_scene_is_told_before_anything_is_sent(tmp_path):
    scene = tmp_path / "bad.xml"
    scene.write_text(FOG.replace("gridvolume", "gridvolme"))

    said = lightshaft("submit", scene, "--to", "http://127.0.0.1:9", code=2).stderr

    assert "bad.xml:" in said and "gridvolume" in said and "cannot be reached" not in said


def test_a_grid_that_only_the_worker_reads_fails_the_job_by_name(rendering, tmp_path):
    scene = write_fog(tmp_path)
    grid = tmp_path / "fog.vol"
    grid.write_bytes(grid.read_bytes()[:-9])

    said = call(rendering, "submit", scene, "--wait", code=1).stderr

    assert "fog.vol" in said


def test_the_coordinators_refusal_is_readable(rendering, tmp_path):
    scene = write_fog(tmp_path)

    assert "LIGHTSHAFT_TOKEN" in call(rendering, "jobs", code=1, LIGHTSHAFT_TOKEN="wrong").stderr
    assert "no job" in call(rendering, "show", "j-0", code=1).stderr
    assert "use larger tiles or fewer samples" in call(rendering, "submit", scene, "--spp", 10**7, "--size", "8192x8192", code=2).stderr
    assert "cannot be reached" in lightshaft("jobs", "--to", "http://127.0.0.1:9", code=1).stderr
    assert "http://" in lightshaft("jobs", "--to", "ftp://farm.example", code=2).stderr
    without = {k: v for k, v in os.environ.items() if k != "LIGHTSHAFT_URL"}
    assert "LIGHTSHAFT_URL" in lightshaft("jobs", env=without, code=2).stderr


def test_a_job_is_shown_paused_resumed_extended_and_cancelled(farm, tmp_path):
    """No worker yet, so that every state holds until the next command."""
    scene = write_fog(tmp_path)
    job = call(farm, "submit", scene, "--spp", 4).stdout.strip()

    assert json.loads(call(farm, "show", job, "--json").stdout)["id"] == job
    assert "fog.xml" in call(farm, "show", job).stdout
    assert job in call(farm, "jobs").stdout
    assert [j["id"] for j in json.loads(call(farm, "jobs", "--json").stdout)["jobs"]] == [job]
    assert "no workers" in call(farm, "workers").stdout
    assert "paused" in call(farm, "pause", job).stdout
    assert json.loads(call(farm, "resume", job, "--json").stdout)["state"] in ("queued", "running")
    call(farm, "extend", job, "--spp", 8)

    farm.add_worker()
    watched = call(farm, "watch", job, "--json").stdout.splitlines()
    assert json.loads(watched[-1])["state"] == "done" and json.loads(watched[-1])["spp_done"] == 8
    assert "worker-1" in call(farm, "workers").stdout
    assert json.loads(call(farm, "workers", "--json").stdout)["workers"][0]["name"] == "worker-1"
    assert " connected: " in call(farm, "workers", "--log", "worker-1").stdout
    assert "lightshaft workers` lists them" in call(farm, "workers", "--log", "nobody", code=1).stderr

    endless = call(farm, "submit", scene, "--spp", 1_000_000).stdout.strip()
    assert "cancelled" in call(farm, "cancel", endless).stdout
    assert "cancelled" in call(farm, "watch", endless, code=1).stderr


def test_watch_outlives_a_restart_of_the_coordinator(farm, tmp_path):
    scene = write_fog(tmp_path)
    farm.add_worker("--fake-delay", 10)
    job = call(farm, "submit", scene, "--spp", 64).stdout.strip()
    log = tmp_path / "watch.log"
    with open(log, "wb") as out:
        watching = subprocess.Popen([bin_dir() / "lightshaft", "watch", job, "--json"], stdout=out, env=environment(farm))
    try:
        wait_until(lambda: log.read_text().count("\n") > 0, "the watcher has seen the job")
        farm.restart_coordinator()
        assert watching.wait(120) == 0
    finally:
        watching.kill()

    assert json.loads(log.read_text().splitlines()[-1])["state"] == "done"


def test_a_job_whose_image_cannot_be_written_is_removed(tmp_path):
    """A full disk is made so: a folder is in the place of the image."""
    with LocalFarm(tmp_path) as farm:
        job = farm.submit(SCENE, spp=8)
        (farm.data / "jobs" / job / "image.exr" / "in the way").mkdir(parents=True)
        farm.add_worker()
        wait_until(lambda: "the final image cannot be written" in (farm.job(job)["error"] or ""), "the image was tried")
        assert farm.job(job)["state"] == "running"

        call(farm, "remove", job)

        call(farm, "show", job, code=1)


def test_a_job_that_renders_is_not_removed(tmp_path):
    with LocalFarm(tmp_path) as farm:
        job = farm.submit(SCENE, spp=8)
        assert f"lightshaft cancel {job}" in call(farm, "remove", job, code=1).stderr
        assert farm.job(job)["state"] == "queued"
