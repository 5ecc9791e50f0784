"""The template that renders a scene, a task for each frame, run by the real `openjd`."""

import subprocess

import pytest
from cli_kit import FOG, digest, fog_values, lightshaft, load, vol_bytes
from local_farm import bin_dir, wait_until
from openjd_job import OPENJD, template_file

N = 8


@pytest.fixture
def render(run, tmp_path):
    def render(scene, *options, **parameters):
        return run("render", *options, **{"Scene": scene, "OutputFolder": tmp_path / "out", "Program": bin_dir() / "lightshaft", "Threads": 1, **parameters})

    return render


@pytest.fixture
def smoke(tmp_path):
    """smoke.xml with fog.01.vol to fog.03.vol: a fog that thickens."""
    for frame in (1, 2, 3):
        (tmp_path / f"fog.{frame:02}.vol").write_bytes(vol_bytes([value * frame for value in fog_values(N)], N, N, N))
    (tmp_path / "smoke.xml").write_text(FOG.replace("fog.vol", "fog.##.vol"))
    return tmp_path / "smoke.xml"


def test_openjd_finds_the_template_valid():
    checked = subprocess.run([OPENJD, "check", template_file("render")], capture_output=True, text=True)

    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_the_frames_are_those_of_render(smoke, render, tmp_path):
    lightshaft("render", smoke, "--frames", "1-3", "--spp", 8, "--seed", 5, "-o", tmp_path / "alone_#.exr", "--report", tmp_path / "alone_#.json")

    job = render(smoke, Frames="1-3", Samples=8, Seed=5)

    assert job.wait() == 0, job.output()
    for frame in (1, 2, 3):
        assert (tmp_path / f"out/image_{frame:04}.exr").exists()
        assert load(tmp_path / f"out/image_{frame:04}.json")["pixels_sha256"] == load(tmp_path / f"alone_{frame}.json")["pixels_sha256"]
    percents = [float(percent) for percent in job.said("progress")]
    assert percents.count(100) == 3 and all(0 <= percent <= 100 for percent in percents)
    assert job.said("status")[-1].startswith("done 8.0 spp")


def test_a_picture_without_frames_has_the_pixels_of_render(fog, render, tmp_path):
    alone = digest(lightshaft("render", fog, "-o", tmp_path / "alone.exr", "-D", "density=4"))

    job = render(fog, OutputName="fog", MoreOptions="-D density=4")

    assert job.wait() == 0, job.output()
    assert load(tmp_path / "out/fog.json")["pixels_sha256"] == alone
    assert (tmp_path / "out/fog.exr").exists()


@pytest.mark.parametrize("before, after, words", [('name="density" value="2"', 'name="densely" value="2"', "scene.xml:"),
                                                  ("fog.vol", "mist.vol", "mist.vol")])
def test_a_wrong_scene_fails_the_task_and_says_where(fog, render, before, after, words):
    scene = fog.parent / "scene.xml"
    scene.write_text(fog.read_text().replace(before, after))

    job = render(scene)

    assert job.wait() != 0
    assert any(words in failure for failure in job.said("fail")), job.output()


def test_a_cancelled_frame_keeps_what_there_was(fog, render, tmp_path):
    job = render(fog, Samples=20_000)
    wait_until(lambda: "1" in job.said("progress"), "a hundredth is rendered")

    job.cancel()

    assert "holds what there was" in job.output()
    assert (tmp_path / "out/image_0000.exr").exists()
    report = load(tmp_path / "out/image_0000.json")
    assert report["stopped"] == "user" and 0 < report["spp"] < 20_000
