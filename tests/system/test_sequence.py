"""A sequence of ten .vdb frames as one job: on two workers, through kills of the coordinator, to the pixels of `render`.

The volumes are written here with OpenVDB's own Python module (Debian: python3-openvdb).
"""

import json
import os

import pytest
from cli_kit import FOG, digest, fog_values, lightshaft, load
from local_farm import HttpError, wait_until

vdb = pytest.importorskip("pyopenvdb", reason="python3-openvdb is not installed")
numpy = pytest.importorskip("numpy")

N = 8
FRAMES = range(1, 11)
SPP = 16
PLACED = """<transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform>"""
OPTIONS = ("--spp", SPP, "--seed", 5)


@pytest.fixture(scope="module")
def smoke(tmp_path_factory):
    """smoke.xml and fog.0001.vdb to fog.0010.vdb: a fog that turns and thickens."""
    folder = tmp_path_factory.mktemp("smoke")
    still = numpy.array(fog_values(N), dtype=numpy.float32).reshape(N, N, N).transpose(2, 1, 0)
    for frame in FRAMES:
        grid = vdb.FloatGrid()
        grid.copyFromArray(numpy.ascontiguousarray(numpy.roll(still, frame, axis=0) * numpy.float32(1 + frame / 10)), tolerance=-1)
        grid.transform = vdb.createLinearTransform(voxelSize=2 / N)
        grid.transform.translate([-1 + 1 / N] * 3)
        grid.name, grid.gridClass = "density", vdb.GridClass.FOG_VOLUME
        vdb.write(str(folder / f"fog.{frame:04}.vdb"), grids=[grid])
    text = FOG.replace("fog.vol", "fog.####.vdb").replace(PLACED, "")
    assert text.count("fog.####.vdb") == 1
    (folder / "smoke.xml").write_text(text)
    return folder / "smoke.xml"


@pytest.fixture(scope="module")
def expected(smoke, tmp_path_factory):
    """{frame: pixels_sha256} of `lightshaft render --frames` on one thread."""
    folder = tmp_path_factory.mktemp("alone")
    said = lightshaft("render", smoke, "--frames", "1-10", "-o", folder / "out_####.exr", "--report", folder / "r_##.json",
                      "--threads", 1, *OPTIONS)
    assert sorted(p.name for p in folder.glob("out_*")) == [f"out_{frame:04}.exr" for frame in FRAMES]
    digests = {frame: load(folder / f"r_{frame:02}.json")["pixels_sha256"] for frame in FRAMES}
    assert [line.split()[1] for line in said.stdout.splitlines() if line.startswith("pixels")] == list(digests.values())
    assert len(set(digests.values())) == len(FRAMES)
    return digests


def environment(farm):
    return {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}


def submit(farm, scene, *more):
    return lightshaft("submit", scene, "--frames", "1-10", *OPTIONS, *more, env=environment(farm)).stdout.split()[0]


def pixels(farm, job):
    return {row["frame"]: row["pixels_sha256"] for row in farm.report(job)["frames"]}


def test_a_frame_is_the_scene_that_names_its_files(smoke, expected, tmp_path):
    """Rendered as a scene of its own, with the seed that the frame has."""
    alone = tmp_path / "seventh.xml"
    alone.write_text(smoke.read_text().replace("fog.####.vdb", str(smoke.parent / "fog.0007.vdb")))

    assert digest(lightshaft("render", alone, "-o", tmp_path / "a.exr", "--spp", SPP, "--seed", 5 + 7)) == expected[7]
    assert digest(lightshaft("render", smoke, "--frames", 7, "-o", tmp_path / "b.exr", *OPTIONS)) == expected[7]


def test_ten_frames_are_one_job_on_two_workers(farm, smoke, expected, tmp_path):
    farm.add_workers(2, fake=False)
    job = submit(farm, smoke, "--wait", "-o", tmp_path / "f_####.exr", "--report", tmp_path / "whole.json")

    assert [j["id"] for j in farm.get("/api/v1/jobs")["jobs"]] == [job]
    view = farm.job(job)
    assert view["state"] == "done" and view["progress"] == 1 and view["spp_done"] == SPP
    assert view["relmse_ci95"][0] < view["relmse"] < view["relmse_ci95"][1]
    assert (view["frames"]["range"], view["frames"]["total"], view["frames"]["done"]) == ("1-10", 10, 10)
    assert pixels(farm, job) == expected
    assert len(load(tmp_path / "whole.json")["frames"]) == 10
    for frame in FRAMES:
        image = farm.request("GET", f"/api/v1/jobs/{job}/image.exr?frame={frame}")
        assert image == (tmp_path / f"f_{frame:04}.exr").read_bytes()
        one = farm.get(f"/api/v1/jobs/{job}?frame={frame}")
        assert (one["id"], one["sequence"], one["frame"]) == (f"{job}-frame{frame}", job, frame)
    for what in ("image.png", "image.exr", "report.html", "tiles", "convergence.csv"):
        with pytest.raises(HttpError, match="1-10") as refused:
            farm.get(f"/api/v1/jobs/{job}/{what}")
        assert refused.value.status == 400
    with pytest.raises(HttpError, match="no frame 11"):
        farm.get(f"/api/v1/jobs/{job}?frame=11")

    shown = lightshaft("show", job, env=environment(farm)).stdout
    assert "1-10: 10 of 10 done" in shown
    lightshaft("fetch", job, "--frame", 3, "-o", tmp_path / "third.exr", env=environment(farm))
    assert (tmp_path / "third.exr").read_bytes() == (tmp_path / "f_0003.exr").read_bytes()
    lightshaft("fetch", job, "--html", tmp_path / "f_##.html", env=environment(farm))
    assert len(list(tmp_path.glob("f_??.html"))) == 10
    assert "--frame N" in lightshaft("fetch", job, "--html", tmp_path / "one.html", env=environment(farm), code=2).stderr
    assert "--frame N" in lightshaft("fetch", job, "-o", tmp_path / "one.exr", env=environment(farm), code=2).stderr


def test_the_coordinator_killed_in_the_middle(farm, smoke, expected):
    farm.add_workers(2, fake=False)
    job = submit(farm, smoke)
    total = farm.job(job)["units_total"]
    for part in (4, 2):
        before = farm.wait_for_progress(job, total // part)
        farm.restart_coordinator()
        after = farm.job(job)
        assert after["units_done"] >= before["units_done"], "what was accepted is lost"
        assert after["frames"]["total"] == 10

    farm.wait_for_job(job)

    assert pixels(farm, job) == expected


def test_cancelled_and_removed_as_a_whole(farm, smoke):
    farm.add_worker("--fake-delay", 20)
    job = submit(farm, smoke)
    wait_until(lambda: farm.job(job)["frames"]["done"] >= 2, "two frames are done")

    lightshaft("cancel", job, env=environment(farm))

    frames = farm.wait_for_job(job, ("cancelled",))["frames"]  # one whose image is being written is left to end
    assert frames["done"] >= 2 and frames["done"] + frames["cancelled"] == 10
    farm.restart_coordinator()
    assert farm.job(job)["state"] == "cancelled"
    farm.request("GET", f"/api/v1/jobs/{job}/image.exr?frame=1")
    farm.request("DELETE", f"/api/v1/jobs/{job}")
    assert farm.get("/api/v1/jobs")["jobs"] == []
    wait_until(lambda: list((farm.data / "jobs").glob(f"{job}*")) == [], "its folders are gone")


def test_a_frame_that_fails_does_not_keep_the_others_from_being_written(farm, smoke, tmp_path):
    for path in smoke.parent.iterdir():
        (tmp_path / path.name).symlink_to(path)
    (tmp_path / "fog.0002.vdb").unlink()
    (tmp_path / "fog.0002.vdb").write_bytes(b"no grid at all")
    farm.add_worker(fake=False)

    said = lightshaft("submit", tmp_path / "smoke.xml", "--frames", "1-3", *OPTIONS, "--wait", "-o", tmp_path / "o_##.exr",
                      "--report", tmp_path / "r_##.json", "--html", tmp_path / "h_##.html", env=environment(farm), code=1)

    assert sorted(path.name for path in tmp_path.iterdir() if path.name[1] == "_") == [
        "h_01.html", "h_03.html", "o_01.exr", "o_03.exr", "r_01.json", "r_03.json"]
    job = said.stdout.split()[0]
    assert "frame 2" in said.stderr
    assert f"1 of the frames are not done, and were not written: 2. If there is anything of them, this fetches it: lightshaft fetch {job} -o" in said.stderr
    watched = lightshaft("watch", job, env=environment(farm), code=1)
    assert f"2 of its frames are done: lightshaft fetch {job} -o out_####.exr" in watched.stderr


def test_a_missing_frame_is_named_before_anything_is_sent(farm, smoke, tmp_path):
    for path in smoke.parent.iterdir():
        if path.name not in ("fog.0004.vdb", "fog.0009.vdb"):
            (tmp_path / path.name).symlink_to(path)
    here = tmp_path / "smoke.xml"

    said = lightshaft("submit", here, "--frames", "1-10", "--to", "http://127.0.0.1:9", code=2).stderr
    assert 'frame 4: there is no file "fog.0004.vdb"' in said and 'frame 9: there is no file "fog.0009.vdb"' in said
    assert "smoke.xml:" in said and "cannot be reached" not in said
    assert "frame 4" in lightshaft("render", here, "--frames", "1-10", code=2, cwd=tmp_path).stderr

    # The same by hand: the coordinator names them, too, and takes nothing.
    import hashlib
    names = {p.name: p.read_bytes() for p in tmp_path.iterdir() if p.suffix == ".vdb"}
    for data in [here.read_bytes(), *names.values()]:
        farm.request("PUT", f"/api/v1/blobs/{hashlib.sha256(data).hexdigest()}", data, "application/octet-stream")
    body = {"scene": hashlib.sha256(here.read_bytes()).hexdigest(), "spec": {"frames": "1-10"},
            "assets": {name: hashlib.sha256(data).hexdigest() for name, data in names.items()}}
    with pytest.raises(HttpError) as refused:
        farm.request("POST", "/api/v1/jobs", json.dumps(body).encode())
    assert refused.value.status == 400
    assert "frame 4: " in str(refused.value) and "frame 9: " in str(refused.value) and "frame 5" not in str(refused.value)
    assert farm.get("/api/v1/jobs")["jobs"] == []


def test_hostile_ranges_are_refused(farm, smoke):
    for frames, says in (("1-1000000000", "9999999"), ("0-10000", "10000"), ("5-1", "before"), ("1..3", "FIRST-LAST")):
        with pytest.raises(HttpError, match=says) as refused:
            farm.submit("<scene version='3.0.0'/>", frames=frames)
        assert refused.value.status == 400
        assert says in lightshaft("submit", smoke, "--frames", frames, env=environment(farm), code=2).stderr
    assert "out_####.exr" in lightshaft("render", smoke, "--frames", "1-2", "-o", "out.exr", code=2).stderr


def test_a_bundle_of_frames(farm, smoke, expected, tmp_path):
    import zipfile
    farm.add_worker(fake=False)
    with zipfile.ZipFile(tmp_path / "smoke.zip", "w") as bundle:
        for path in sorted(smoke.parent.iterdir()):
            bundle.write(path, path.name)
        bundle.writestr("job.json", json.dumps({"frames": "1-10", "seed": 5}))

    job = lightshaft("submit", tmp_path / "smoke.zip", "--spp", SPP, "--frames", "2-3", "--wait", "-o", tmp_path / "o_#.exr", env=environment(farm)).stdout.split()[0]

    assert pixels(farm, job) == {frame: expected[frame] for frame in (2, 3)}
    assert (tmp_path / "o_2.exr").exists() and (tmp_path / "o_3.exr").exists()
