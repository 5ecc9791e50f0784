"""Stages as their own files at the coordinator, which lets the package read them in a sandbox (--usd-python)."""

import hashlib
import io
import json
import subprocess
import sys
import tarfile
import zipfile

import pytest
from local_farm import HttpError, LocalFarm, bin_dir
from stage_kit import Gf, UsdGeom, UsdUtils, bind, colours, exr, path_of, png, preview, square, stage_from_front, texture

SPEC = {"spp": 4, "size": [24, 24]}


@pytest.fixture(scope="module")
def local_farm(tmp_path_factory):
    with LocalFarm(tmp_path_factory.mktemp("farm"), flags=["--usd-python", sys.executable]) as farm:
        farm.add_worker(fake=False)
        farm.wait_for_workers(1)
        yield farm
        assert list((farm.data / "stages").iterdir()) == [], "no file of a stage is left"


@pytest.fixture
def stage(tmp_path):
    return stage_from_front(tmp_path)


def put(farm, content):
    digest = hashlib.sha256(content).hexdigest()
    farm.request("PUT", f"/api/v1/blobs/{digest}", content, "application/octet-stream")
    return digest


def upload(farm, name, content, files=None, **spec):
    """Submits a stage and its files as the dashboard does. Returns the answer."""
    body = {"name": name, "scene": put(farm, content), "assets": {key: put(farm, value) for key, value in (files or {}).items()}, "spec": {**SPEC, **spec}}
    return json.loads(farm.request("POST", "/api/v1/jobs", json.dumps(body).encode()))


def refusal(*arguments, **spec):
    with pytest.raises(HttpError) as refused:
        upload(*arguments, **spec)
    return refused.value.status, json.loads(refused.value.body)["detail"]


def pixels(farm, job):
    farm.wait_for_job(job)
    return farm.report(job)["pixels_sha256"]


def textured(stage, place):
    """A square with an image that lies at `place`, as seen from the stage."""
    made = square(stage)
    bind(made, preview(stage, "/look", diffuseColor=texture(stage, "/look/image", place)))
    return made


@pytest.fixture
def image(tmp_path):
    return png(tmp_path / "wood.png", [[(255, 0, 0), (0, 255, 0)], [(0, 0, 255), (255, 255, 255)]])


# The package itself has submitted the same stage.
@pytest.mark.parametrize("name", ["shot.usda", "shot.usdc", "shot.USD"])
def test_the_pixels_are_those_of_the_package(farm, local_farm, stage, image, name):
    textured(stage, "./wood.png")
    by_package = farm.submit(path_of(stage), spp=4, size=(24, 24)).wait()
    file = path_of(stage).with_name("other.usdc" if name.endswith("c") else "other.usda")
    stage.GetRootLayer().Export(str(file))

    answer = upload(local_farm, name, file.read_bytes(), {"wood.png": image.read_bytes()})

    assert pixels(local_farm, answer["id"]) == local_farm.report(by_package.id)["pixels_sha256"]
    assert local_farm.job(answer["id"])["name"] == name


def test_images_that_are_computed_with_are_those_of_the_package(farm, local_farm, stage, tmp_path):
    light = exr(tmp_path / "light.exr", [[(0.5, 0.25, 2.0)] * 40] * 20)
    made = square(stage)
    bind(made, preview(stage, "/look", diffuseColor=texture(stage, "/look/image", "light.exr", scale=(0.5, 0.25, 0.125, 1))))
    by_package = farm.submit(path_of(stage), spp=4, size=(24, 24)).wait()

    answer = upload(local_farm, "shot.usda", path_of(stage).read_bytes(), {"light.exr": light.read_bytes()})

    assert pixels(local_farm, answer["id"]) == local_farm.report(by_package.id)["pixels_sha256"]


def test_files_above_the_stage_and_layers_are_found(local_farm, stage, image, tmp_path):
    colours(square(stage), [(0.2, 0.4, 0.8)], "constant")
    part = path_of(stage).read_bytes()
    shot = '#usda 1.0\n(\n    subLayers = [@./empty.usda@, @../../parts/room.usda@]\n)\n'
    files = {"../../parts/room.usda": part, "empty.usda": b"#usda 1.0\n", "above_the_stage/notes.txt": b"nobody reads this"}

    answer = upload(local_farm, "shot.usda", shot.encode(), files)

    plain = upload(local_farm, "room.usda", part)
    assert pixels(local_farm, answer["id"]) == pixels(local_farm, plain["id"])


def test_packages_and_archives_are_read(local_farm, stage, image, tmp_path):
    textured(stage, "wood.png")
    package = tmp_path / "shot.usdz"
    assert UsdUtils.CreateNewUsdzPackage(str(path_of(stage)), str(package))
    packed, tarred = io.BytesIO(), io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive, tarfile.open(fileobj=tarred, mode="w") as tar:
        for file in (path_of(stage), image):
            archive.write(file, f"show/{file.name}")
            tar.add(file, file.name)

    jobs = [upload(local_farm, "shot.usdz", package.read_bytes())["id"]]
    for kind, content in (("application/zip", packed), ("application/x-tar", tarred)):
        jobs.append(json.loads(local_farm.request("POST", "/api/v1/jobs?spp=4&size=24x24", content.getvalue(), kind))["id"])

    assert len({pixels(local_farm, job) for job in jobs}) == 1


def test_time_samples_are_frames(farm, local_farm, stage):
    colours(square(stage), [(0, 0, 0)], "constant")
    move = UsdGeom.Xform.Define(stage, "/world").AddTranslateOp()
    move.Set(Gf.Vec3d(-0.25, 0, 0), 3)
    move.Set(Gf.Vec3d(0.25, 0, 0), 7)
    by_package = farm.submit(path_of(stage), spp=4, size=(24, 24), frames="3-7x2").wait()

    answer = upload(local_farm, "shot.usda", path_of(stage).read_bytes(), frames="3-7x2")

    farm.job(answer["id"]).wait()
    ours, theirs = ([frame.report()["pixels_sha256"] for frame in job.frames()] for job in (farm.job(answer["id"]), by_package))
    assert ours == theirs and len(set(ours)) == 3


def test_what_is_left_out_is_told(local_farm, stage):
    square(stage)
    stage.DefinePrim("/world/hair", "BasisCurves")

    answer = upload(local_farm, "shot.usda", path_of(stage).read_bytes())

    assert any("/world/hair" in warning and "BasisCurves" in warning for warning in answer["warnings"]), answer["warnings"]
    assert local_farm.job(answer["id"])["warnings"] == answer["warnings"]


def test_faults_are_told_by_the_prim_and_name_no_folder_of_the_farm(local_farm, stage, tmp_path):
    textured(stage, "textures/oak.png")

    status, told = refusal(local_farm, "shot.usda", path_of(stage).read_bytes())

    assert status == 400 and told.startswith("shot.usda: ") and "/look/image" in told and "textures/oak.png" in told
    assert str(local_farm.data) not in told
    assert "is no stage" in refusal(local_farm, "shot.usdc", b"PXR-USDC" + bytes(80))[1]
    assert "is no stage" in refusal(local_farm, "shot.usda", b"#usda 1.0\ndef {")[1]


# Files that the coordinator's machine has, and that nobody has sent.
@pytest.mark.parametrize("path", ["/etc/passwd", "../../../../../../../../../../etc/passwd"])
def test_a_stage_reads_no_file_that_was_not_sent(local_farm, stage, path):
    textured(stage, path)
    image_refused, told_of_image = refusal(local_farm, "shot.usda", path_of(stage).read_bytes())
    layer_refused, told_of_layer = refusal(local_farm, "shot.usda", f"#usda 1.0\n(\n    subLayers = [@{path}@]\n)\n".encode())

    assert image_refused == layer_refused == 400
    assert f"the asset @{path}@ is not found" in told_of_image and f"@{path}@ is not found" in refusal(local_farm, "s.usda", path_of(stage).read_bytes().replace(b"passwd", b"nothing"))[1].replace("nothing", "passwd"), "nobody learns what the machine has"
    assert "/etc/passwd@" in told_of_layer and "root:" not in told_of_layer


@pytest.mark.parametrize("name, words", [
    ("/etc/passwd", "has an absolute name"), ("a/../../" + "../" * 40 + "x", "is too many folders up"), ("a\\b.png", "backslash"), ("x/..", "is no name"),
    ("shot.usda", "is there twice"), ("b" * 300 + ".png", "more than 200 bytes"), ("./wood.png", "is there twice"), ("wood.png/inner.png", "is a folder of another file, too")])
def test_names_of_files_lead_nowhere_else(local_farm, stage, image, name, words):
    square(stage)

    status, told = refusal(local_farm, "shot.usda", path_of(stage).read_bytes(), {name: image.read_bytes(), "wood.png": b"x"})

    assert status < 500 and words in told, told
    assert str(local_farm.data) not in told


def stand_in(folder, script):
    """A Python that runs a shell script in place of the package, once it has been asked for its folders."""
    program = folder / "python"
    program.write_text(f'#!/bin/sh\nif [ "$3" = -c ]; then exec {sys.executable} "$@"; fi\n{script}\n')
    program.chmod(0o755)
    return program


# A stage has taken the package over: what it then does costs this submission only.
@pytest.mark.parametrize("script, words", [
    (f"exec {sys.executable} -c 'import ctypes; ctypes.string_at(0)'", "crashed"), ("exit 4", "cannot be read"), ("echo broken >&2; exit 1", "broken"), ("exit 0", "the archive is empty"),
    ("echo no tar >&3", "bundle"), ("printf 'first line\\nsecond \\033[2J line' >&3; exit 2", "shot.usda: first line\nsecond")])
def test_whatever_happens_to_the_package_is_told(tmp_path, script, words):
    with LocalFarm(tmp_path / "farm", flags=["--usd-python", stand_in(tmp_path, script)]) as farm:
        status, told = refusal(farm, "shot.usda", b"#usda 1.0\n")

        assert status == 400 and words in told and "\x1b" not in told
        assert json.loads(farm.request("GET", "/api/v1/jobs"))["jobs"] == []


def test_a_full_disk_is_no_fault_of_the_stage(tmp_path):
    with LocalFarm(tmp_path / "farm", flags=["--usd-python", stand_in(tmp_path, "exit 3")]) as farm:
        status, told = refusal(farm, "shot.usda", b"#usda 1.0\n")

    assert status == 507 and "free some space" in told


def test_the_package_writes_and_starts_nothing(tmp_path):
    mark = tmp_path / "mark"
    script = f"(echo > {mark}) 2>/dev/null && exit 0\n/bin/true & wait; /bin/ls / >/dev/null && exit 0\nprintf 'it cannot' >&3; exit 2"
    with LocalFarm(tmp_path / "farm", flags=["--usd-python", stand_in(tmp_path, script)]) as farm:
        _, told = refusal(farm, "shot.usda", b"#usda 1.0\n")

    assert not mark.exists()
    assert "Cannot fork" in told or "it cannot" in told or "cannot be read" in told


def test_without_the_option_stages_are_refused(tmp_path):
    with LocalFarm(tmp_path / "farm") as farm:
        status, told = refusal(farm, "shot.usda", b"#usda 1.0\n")

    assert status == 400 and "--usd-python" in told and "python3 -m lightshaft.usd" in told


@pytest.mark.parametrize("python, words", [("/usr/bin/python3", "No module named 'lightshaft'"), ("/nowhere/python", "No such file"), ("/bin/false", "failed")])
def test_a_python_without_the_package_is_told_at_the_start(tmp_path, python, words):
    command = [bin_dir() / "lightshaft-coordinator", "--http", "127.0.0.1:0", "--grpc", "127.0.0.1:0", "--data", tmp_path / "data", "--usd-python", python]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60)

    assert ended.returncode != 0
    assert f"--usd-python {python}: " in ended.stderr and words in ended.stderr and "pip install 'lightshaft[usd]'" in ended.stderr, ended.stderr
