"""A scene and its files in one archive, as zipfile and tarfile write them: the same job as by blobs, or refused by entry."""

import io
import json
import os
import tarfile
import zipfile

import pytest
from cli_kit import FOG, fog_values, lightshaft, vol_bytes, write_fog
from local_farm import HttpError, LocalFarm

SPP = 6


@pytest.fixture(scope="module")
def farm(tmp_path_factory):
    with LocalFarm(tmp_path_factory.mktemp("farm")) as farm:
        farm.add_worker(fake=False)
        yield farm


def files(n=12):
    return {"fog.xml": FOG.encode(), "fog.vol": vol_bytes(fog_values(n), n, n, n)}


def zip_of(entries, method=zipfile.ZIP_DEFLATED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, data in entries.items():
            archive.writestr(name, data)
    return out.getvalue()


def tar_of(entries, mode="w"):
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode=mode) as archive:
        for name, data in entries.items():
            member = tarfile.TarInfo(name)
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))
    return out.getvalue()


def send(farm, body, kind, query=""):
    return json.loads(farm.request("POST", "/api/v1/jobs" + query, body, kind))["id"]


def refused(farm, body, kind="application/zip"):
    with pytest.raises(HttpError) as error:
        send(farm, body, kind)
    problem = json.loads(str(error.value).split(": ", 1)[1])
    return error.value.status, problem


def environment(farm):
    return {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}


def test_every_way_in_gives_the_same_pixels(farm, tmp_path):
    by_blobs = lightshaft("submit", write_fog(tmp_path), "--spp", SPP, env=environment(farm)).stdout.strip()
    expected = farm.pixels(by_blobs)
    told = {**files(), "job.json": json.dumps({"scene": "fog.xml", "spp": SPP}).encode(), "other.xml": b"not this one"}
    folder = {f"bath/{name}": data for name, data in told.items()}
    query = f"?spp={SPP}"

    jobs = [send(farm, zip_of(files()), "application/zip", query),
            send(farm, zip_of(files(), zipfile.ZIP_STORED), "application/zip", query),
            send(farm, tar_of(files()), "application/x-tar", query),
            send(farm, tar_of(files(), "w:gz"), "application/gzip", query),
            send(farm, zip_of(told), "application/zip"),
            send(farm, tar_of(folder), "application/x-tar")]

    assert [farm.pixels(job) for job in jobs] == [expected] * len(jobs)


def test_the_command_sends_a_bundle_as_it_is(farm, tmp_path):
    bundle = tmp_path / "bath.zip"
    bundle.write_bytes(zip_of({**files(), "job.json": b'{"spp": 2, "seed": 9}'}))

    job = lightshaft("submit", bundle, "--spp", 4, "-D", "density=1", "--wait", env=environment(farm)).stdout.split()[0]

    assert farm.job(job)["spp"] == 4
    alone = lightshaft("render", write_fog(tmp_path), "-o", tmp_path / "a.exr", "--spp", 4, "--seed", 9, "-D", "density=1").stdout
    assert farm.pixels(job) in alone
    assert "twice" in lightshaft("submit", bad_bundle(tmp_path), env=environment(farm), code=2).stderr
    assert "no such file" in lightshaft("submit", tmp_path / "none.zip", env=environment(farm), code=2).stderr


def bad_bundle(folder):
    path = folder / "bad.tar"
    path.write_bytes(tar_of({"fog.xml": b"", "a": b"1", "./a": b"2"}))
    return path


def test_a_wrong_scene_in_a_bundle_is_refused_with_places(farm):
    wrong = {**files(), "fog.xml": FOG.replace("gridvolume", "gridvolme").encode()}

    status, problem = refused(farm, zip_of(wrong))

    assert status == 400
    place = problem["diagnostics"][0]
    assert (place["file"], place["line"]) == ("fog.xml", 1 + FOG[:FOG.index("gridvolume")].count("\n"))
    missing = {"fog.xml": FOG.encode()}
    assert "fog.vol" in json.dumps(refused(farm, zip_of(missing))[1]["diagnostics"])


def test_hostile_archives_are_refused_by_entry_and_leave_nothing(farm):
    def stored():
        return sorted(p for p in (farm.data / "blobs").rglob("*") if p.is_file())

    before = stored()
    fresh = {"fog.xml": FOG.encode() + b"<!-- fresh -->", "fog.vol": os.urandom(1000)}
    link = io.BytesIO()
    with tarfile.open(fileobj=link, mode="w") as archive:
        member = tarfile.TarInfo("fog.vol")
        member.type, member.linkname = tarfile.SYMTYPE, "/etc/passwd"
        archive.addfile(member)
    whole = zip_of(fresh)
    for body, kind, says in (
            (zip_of({**fresh, "../evil": b"x"}), "application/zip", "../evil"),
            (tar_of({**fresh, "/evil": b"x"}), "application/x-tar", "/evil"),
            (link.getvalue(), "application/x-tar", "fog.vol"),
            (zip_of({**fresh, "bomb": bytes(200 << 20)}), "application/zip", "bomb"),
            (tar_of({**fresh, "bomb": bytes(100 << 20)}, "w:gz"), "application/gzip", "bomb"),
            (whole[:-100], "application/zip", "zip"),
            (whole, "application/x-tar", "tar"),
            (b"", "application/zip", "empty")):
        status, problem = refused(farm, body, kind)
        assert status == 400 and says in problem["detail"], problem
    assert stored() == before
    assert list((farm.data / "spool").iterdir()) == []
    assert farm.get("/api/v1/jobs") is not None
