"""A job with a target error: tiles stop after different numbers of samples, and still it is one image, whoever renders it."""

import os
import random

import pytest
from cli_kit import digest, lightshaft, load
from exr_layers import read

SIZE = "136x104"  # 4 x 3 whole tiles, and cut ones that stop with their neighbours
TARGET = 0.002  # more than the 64 samples of the first decision in some tiles, not in all
OPTIONS = ("--size", SIZE, "--target-error", TARGET)


@pytest.fixture(scope="module")
def alone(fog, tmp_path_factory):
    """What `lightshaft render` makes of it on one thread: the folder of its files."""
    folder = tmp_path_factory.mktemp("alone")
    lightshaft("render", fog, "-o", folder / "a.exr", *OPTIONS, "--threads", 1, "--report", folder / "a.json",
               "--partial-dir", folder / "partials")
    return folder


def environment(farm):
    return {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}


def submit(farm, scene, *options):
    return lightshaft("submit", scene, *(options or OPTIONS), env=environment(farm)).stdout.split()[0]


def samples(image):
    return [n for row in read(image)[0]["spp"] for n in row]


def test_tiles_that_need_more_get_more(alone):
    report = load(alone / "a.json")
    spp = samples(alone / "a.exr")

    assert report["stopped"] == "error" and report["adaptive"] and "bias" in report["note"]
    assert 64 <= min(spp) < max(spp)
    assert sum(spp) == report["samples"] and abs(sum(spp) / len(spp) - report["spp"]) < 1e-9 * report["spp"]
    points = report["convergence"]
    assert all(a["spp"] < b["spp"] and a["core_seconds"] <= b["core_seconds"] for a, b in zip(points, points[1:]))
    assert points[0]["spp"] == 2 and all(b["spp"] <= 2 * a["spp"] for a, b in zip(points, points[1:])), "a doubling without a checkpoint"
    assert points[-1]["spp"] == report["spp"] and points[-1]["relmse"] == report["relmse"]


def test_its_partials_merge_to_it_and_it_verifies(fog, alone):
    merged = digest(lightshaft("merge", alone / "partials", "-o", alone / "m.exr"))

    assert merged == load(alone / "a.json")["pixels_sha256"]
    lightshaft("verify", alone / "a.exr", "--scene", fog, "--tiles", 4)


def test_threads_and_a_child_process_do_not_matter(fog, alone, tmp_path):
    expected = load(alone / "a.json")["pixels_sha256"]

    assert digest(lightshaft("render", fog, "-o", tmp_path / "b.exr", *OPTIONS, "--threads", 3, "--isolate")) == expected


def test_a_farm_whose_workers_and_coordinator_are_killed(farm, fog, alone):
    dice = random.Random(3)
    farm.add_workers(3, fake=False)
    job = submit(farm, fog)
    for done in (10, 40, 70, 90):
        farm.wait_for_progress(job, done)
        dice.choice([w for w in farm.workers if w.alive()]).kill()
        farm.add_worker(fake=False)
        if done in (40, 90):
            farm.restart_coordinator()

    assert farm.pixels(job) == load(alone / "a.json")["pixels_sha256"]
    assert farm.report(job)["stopped"] == "error"


def test_half_the_target_later_is_half_the_target_at_once(farm, fog, tmp_path):
    at_once = digest(lightshaft("render", fog, "-o", tmp_path / "h.exr", "--size", SIZE, "--target-error", TARGET / 2))
    farm.add_workers(2, fake=False)
    job = submit(farm, fog)
    farm.pixels(job)

    assert "smaller" in lightshaft("extend", job, "--target-error", 2 * TARGET, env=environment(farm), code=1).stderr
    lightshaft("extend", job, "--target-error", TARGET / 2, env=environment(farm))

    assert farm.pixels(job) == at_once
    assert farm.job(job)["target_error"] == TARGET / 2


def test_more_samples_later_are_those_samples_at_once(farm, fog, alone, tmp_path):
    most = max(samples(alone / "a.exr")) + 30
    at_once = digest(lightshaft("render", fog, "-o", tmp_path / "s.exr", "--size", SIZE, "--spp", most))
    farm.add_workers(2, fake=False)
    job = submit(farm, fog)
    farm.pixels(job)

    lightshaft("extend", job, "--spp", most, env=environment(farm))

    assert farm.pixels(job) == at_once
    assert farm.report(job)["stopped"] == "spp"


def test_the_time_is_told_apart(alone):
    report = load(alone / "a.json")
    time = report["time"]

    assert set(time) == {"load", "build", "render", "transfer", "merge", "idle"}
    assert time["render"] == report["core_seconds"] > 0
    assert time["build"] > 0 and time["transfer"] > 0 and time["merge"] > 0 and min(time.values()) >= 0
