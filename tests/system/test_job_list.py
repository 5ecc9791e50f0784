"""The list of jobs in pages, small pictures and the same scene once more, of a real coordinator."""

import json
import os

import pytest
from cli_kit import lightshaft, png_size
from local_farm import SCENE, HttpError


def test_pages_of_hundreds_of_jobs_follow_one_another_without_gaps(farm):
    ids = [farm.submit(SCENE, spp=2, name=f"scene-{n}.xml") for n in range(120)]
    farm.request("PATCH", f"/api/v1/jobs/{ids[7]}", b'{"state": "cancelled"}')

    pages = [farm.get(f"/api/v1/jobs?sort=-submitted&limit=50&offset={offset}") for offset in (0, 50, 100)]

    assert [len(page["jobs"]) for page in pages] == [50, 50, 20]
    assert all(page["total"] == 120 for page in pages)
    listed = [job["id"] for page in pages for job in page["jobs"]]
    assert sorted(listed) == sorted(ids)
    times = [job["submitted_unix"] for page in pages for job in page["jobs"]]
    assert times == sorted(times, reverse=True)
    assert farm.get("/api/v1/jobs?state=cancelled")["jobs"][0]["id"] == ids[7]
    assert {job["id"] for job in farm.get("/api/v1/jobs")["jobs"]} == set(ids), "without parameters all, as ever"


def test_held_jobs_are_listed_and_counted_on_their_own(farm):
    first, queued = farm.submit(SCENE, spp=2), farm.submit(SCENE, spp=2)
    held = farm.submit(SCENE, spp=2, after=first)
    frames = json.loads(farm.request("POST", f"/api/v1/jobs?spp=2&frames=1-2&after={first}", SCENE.encode(), "application/xml"))["id"]
    paused = farm.submit(SCENE, spp=2, after=first)
    farm.request("PATCH", f"/api/v1/jobs/{paused}", b'{"state": "paused"}')

    def ids(query):
        return [job["id"] for job in farm.get(f"/api/v1/jobs?{query}")["jobs"]]

    assert ids("state=held") == [held, frames]
    assert ids("state=queued") == [first, queued, held, frames], "held is no state of its own"
    assert ids("state=paused,held") == [held, frames, paused]
    assert {farm.job(job)["state"] for job in (held, frames)} == {"queued"}
    page = farm.get("/api/v1/jobs?state=held&limit=1")
    assert page["total"] == 2 and len(page["jobs"]) == 1
    assert page["states"] == {"queued": 4, "held": 2, "running": 0, "paused": 1, "done": 0, "failed": 0, "cancelled": 0}
    listed = lightshaft("jobs", "--to", farm.url(), "--state", "held", env=dict(os.environ, LIGHTSHAFT_TOKEN=farm.token)).stdout
    assert held in listed and queued not in listed
    with pytest.raises(HttpError) as refused:
        farm.get("/api/v1/jobs?state=holding")
    assert refused.value.status == 400 and "held" in refused.value.body

    farm.add_worker()
    farm.wait_for_job(frames)
    assert ids("state=held") == [] and farm.get("/api/v1/jobs")["states"]["held"] == 0


def test_a_scene_is_rendered_again_with_more_samples_also_after_a_restart(farm):
    farm.add_worker()
    first = farm.submit(SCENE, spp=4)
    pixels = farm.pixels(first)
    farm.restart_coordinator()

    same = json.loads(farm.request("POST", f"/api/v1/jobs/{first}/again", b"{}"))["id"]
    more = json.loads(farm.request("POST", f"/api/v1/jobs/{first}/again", b'{"spp": 16}'))["id"]

    assert farm.pixels(same) == pixels, "the same scene, seed and samples"
    assert farm.pixels(more) != pixels and farm.job(more)["spp"] == 16
    farm.request("DELETE", f"/api/v1/jobs/{first}")
    with pytest.raises(HttpError) as gone:
        farm.request("POST", f"/api/v1/jobs/{first}/again", b"{}")
    assert gone.value.status == 404


def test_a_sequence_or_one_of_its_frames_is_rendered_again(farm):
    sequence = json.loads(farm.request("POST", "/api/v1/jobs?spp=2&frames=1-2", SCENE.encode(), "application/xml"))["id"]
    whole = json.loads(farm.request("POST", f"/api/v1/jobs/{sequence}/again", b"{}"))["id"]
    assert farm.job(whole)["frames"]["range"] == "1-2"
    one = json.loads(farm.request("POST", f"/api/v1/jobs/{sequence}/again?frame=2", b"{}"))["id"]
    assert farm.job(one)["frames"] is None


def test_small_pictures_are_those_of_the_image_in_memory_and_on_the_disk(farm):
    job = farm.submit(SCENE, spp=4, size="1000x600")
    assert png_size(farm.request("GET", f"/api/v1/jobs/{job}/thumbnail.png")) == (125, 75)
    farm.add_worker()
    farm.wait_for_job(job)
    made = farm.request("GET", f"/api/v1/jobs/{job}/thumbnail.png")
    assert png_size(made) == (125, 75)
    farm.restart_coordinator()
    assert farm.request("GET", f"/api/v1/jobs/{job}/thumbnail.png") == made
    assert [file.read_bytes() for file in (farm.data / "jobs" / job).glob("thumbnail-*.png")] == [made]
