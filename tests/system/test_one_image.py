"""One heterogeneous scene, one pixels_sha256: whatever machine park renders it and whatever happens meanwhile."""

import os
import random

import pytest
from cli_kit import digest, lightshaft
from local_farm import LocalFarm

SPP = 300  # rounds 2, 2, 4, 8, 16, 32, 64, 64, 64 and a cut one of 44


@pytest.fixture(scope="module")
def expected(fog, tmp_path_factory):
    """The digest of `lightshaft render` on one thread."""
    return digest(lightshaft("render", fog, "-o", tmp_path_factory.mktemp("alone") / "a.exr", "--spp", SPP, "--threads", 1))


def submit(farm, scene):
    env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
    return lightshaft("submit", scene, "--spp", SPP, env=env).stdout.split()[0]


def finished(farm, job):
    """The digest; the job must have ended healthy."""
    pixels = farm.pixels(job)
    assert farm.report(job)["nonfinite_samples"] == 0
    return pixels


@pytest.mark.parametrize("workers, threads", [(1, 1), (1, 2), (2, 1), (5, 1)])
def test_workers_and_threads(farm, fog, expected, workers, threads):
    farm.add_workers(workers, threads=threads, fake=False)

    assert finished(farm, submit(farm, fog)) == expected


def test_workers_killed_at_random(farm, fog, expected):
    dice = random.Random(7)
    farm.add_workers(3, fake=False)
    job = submit(farm, fog)
    total = farm.job(job)["units_total"]
    for kill in range(5):
        farm.wait_for_progress(job, total * (kill + 1) // 8)
        dice.choice([w for w in farm.workers if w.alive()]).kill()
        farm.add_worker(fake=False)

    assert finished(farm, job) == expected


def test_the_coordinator_killed_twice(farm, fog, expected):
    farm.add_workers(2, fake=False)
    job = submit(farm, fog)
    total = farm.job(job)["units_total"]
    for part in (4, 2):
        before = farm.wait_for_progress(job, total // part)["units_done"]
        farm.restart_coordinator()
        assert farm.job(job)["units_done"] >= before, "what was accepted is lost"

    assert finished(farm, job) == expected


@pytest.mark.sanitized
def test_a_farm_that_loses_a_worker(fog):
    """Small, for sanitizer builds, whose numeric class is their own: two jobs of one scene agree."""
    with LocalFarm() as farm:
        env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
        farm.add_worker(fake=False)
        quiet = lightshaft("submit", fog, "--spp", 10, env=env).stdout.split()[0]
        expected = finished(farm, quiet)
        farm.add_worker(fake=False)
        disturbed = lightshaft("submit", fog, "--spp", 10, env=env).stdout.split()[0]
        farm.wait_for_progress(disturbed, 1)
        farm.workers[0].kill()
        assert finished(farm, disturbed) == expected


def test_a_farm_and_its_partials(fog, tmp_path):
    """Render, its merged partials and a farm agree."""
    few = ("--spp", 10)
    alone = digest(lightshaft("render", fog, "-o", tmp_path / "a.exr", *few, "--threads", 2, "--partial-dir", tmp_path / "partials"))
    merged = digest(lightshaft("merge", tmp_path / "partials", "-o", tmp_path / "m.exr"))
    with LocalFarm() as farm:
        farm.add_worker(fake=False)
        env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
        job = lightshaft("submit", fog, *few, env=env).stdout.split()[0]
        assert {alone, merged} == {finished(farm, job)}


def test_the_settings_of_an_integrator_travel_in_the_scene(fog, farm, tmp_path):
    few = ("--spp", 10)

    def variant(name, settings):
        path = fog.with_name(f"{name}.xml")
        text = fog.read_text()
        assert text.count('<integrator type="volpath"/>') == 1
        path.write_text(text.replace('<integrator type="volpath"/>', f'<integrator type="volpath_distant_mis">{settings}</integrator>'))
        return path

    def alone(scene, *flags):
        return digest(lightshaft("render", scene, "-o", tmp_path / "a.exr", *few, *flags))

    near = variant("near", '<string name="distance" value="equiangular"/>')
    both = variant("both", "")
    assert len({alone(fog), alone(near), alone(both)}) == 3
    assert alone(fog, "--integrator", "volpath_distant_mis") == alone(both)
    farm.add_workers(2, fake=False)
    env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
    for scene in (near, both):
        job = lightshaft("submit", scene, *few, env=env).stdout.split()[0]
        assert finished(farm, job) == alone(scene)
