"""A video of a sequence, made by the real ffmpeg of a real coordinator, over HTTP and by the command line."""

import json
import os
import shutil
import subprocess

import pytest
from cli_kit import lightshaft
from local_farm import SCENE, HttpError, LocalFarm, wait_until

pytestmark = pytest.mark.skipif(not shutil.which("ffmpeg"), reason="ffmpeg is not installed (apt-get install ffmpeg)")


def sequence(farm, frames="1-3", **spec):
    query = "&".join(f"{key}={value}" for key, value in {"spp": 2, "size": "65x33", "frames": frames, **spec}.items())
    return json.loads(farm.request("POST", f"/api/v1/jobs?{query}", SCENE.encode(), "application/xml"))["id"]


def make(farm, job, **asked):
    return json.loads(farm.request("POST", f"/api/v1/jobs/{job}/video", json.dumps(asked).encode()))


def made(farm, job):
    def over():
        video = farm.get(f"/api/v1/jobs/{job}/video")
        return video if video["state"] in ("ready", "failed") else None
    return wait_until(over, "the video of the sequence")


def refusal(farm, *request):
    with pytest.raises(HttpError) as refused:
        farm.request(*request)
    return refused.value


def facts(file):
    told = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-of", "json", file], capture_output=True, check=True)
    return json.loads(told.stdout)["streams"][0]


def pictures(file, folder):
    """The mean red, green and blue of each picture, as ffmpeg reads them."""
    raw = folder / "raw"
    subprocess.run(["ffmpeg", "-v", "error", "-i", file, "-vf", "scale=1:1", "-f", "rawvideo", "-pix_fmt", "rgb24", "-y", raw], check=True)
    data = raw.read_bytes()
    return [tuple(data[i:i + 3]) for i in range(0, len(data), 3)]


def test_a_video_has_the_finished_frames_in_order_at_the_rate_that_was_asked(farm, tmp_path):
    farm.add_workers(2)
    job = sequence(farm)
    assert farm.get(f"/api/v1/jobs/{job}/video")["state"] == "none"
    farm.wait_for_job(job)

    asked = make(farm, job, fps=12.5, exposure=-1)
    assert asked["frames"] == 3 and asked["state"] in ("waiting", "making")
    video = made(farm, job)

    assert video["state"] == "ready" and video["frames_done"] == 3 and video["error"] is None, video
    data = farm.request("GET", f"/api/v1/jobs/{job}/video.mp4")
    assert len(data) == video["bytes"]
    (tmp_path / "a.mp4").write_bytes(data)
    stream = facts(tmp_path / "a.mp4")
    assert (stream["codec_name"], stream["nb_read_frames"], stream["r_frame_rate"]) == ("h264", "3", "25/2")
    assert (stream["width"], stream["height"]) == (66, 34), "even, as H.264 needs it"
    # Another exposure is another brightness: fake pixels are around middle grey
    make(farm, job, fps=12.5, exposure=2)
    assert made(farm, job)["exposure"] == 2
    (tmp_path / "b.mp4").write_bytes(farm.request("GET", f"/api/v1/jobs/{job}/video.mp4"))
    assert sum(map(sum, pictures(tmp_path / "b.mp4", tmp_path))) > sum(map(sum, pictures(tmp_path / "a.mp4", tmp_path)))


def test_what_makes_no_video_is_refused_with_the_reason(farm):
    single = farm.submit(SCENE, spp=2, size="32x32")
    assert refusal(farm, "POST", f"/api/v1/jobs/{single}/video", b"{}").status == 409
    job = sequence(farm, size="32x32")
    assert "no frame" in str(refusal(farm, "POST", f"/api/v1/jobs/{job}/video", b"{}"))
    assert refusal(farm, "GET", f"/api/v1/jobs/{job}/video.mp4").status == 409
    for wrong in (b'{"fps": 0}', b'{"fps": 1e9}', b'{"fps": "fast"}', b'{"exposure": 33}', b'{"layer": "depth"}', b'{"size": 4}', b"[]"):
        assert refusal(farm, "POST", f"/api/v1/jobs/{job}/video", wrong).status == 400, wrong
    assert refusal(farm, "POST", "/api/v1/jobs/j-none/video", b"{}").status == 404
    farm.add_worker()
    farm.wait_for_job(job)
    assert "denoise" in str(refusal(farm, "POST", f"/api/v1/jobs/{job}/video", b'{"layer": "denoised"}'))


def test_a_machine_without_ffmpeg_says_how_to_install_it(tmp_path):
    with LocalFarm(environment={**os.environ, "PATH": str(tmp_path)}) as farm:
        farm.add_worker()
        job = sequence(farm, size="32x32")
        farm.wait_for_job(job)
        refused = refusal(farm, "POST", f"/api/v1/jobs/{job}/video", b"{}")
        assert refused.status == 409 and "apt-get install ffmpeg" in str(refused)


def test_the_command_line_waits_for_the_video_and_it_goes_with_its_job(farm, tmp_path):
    farm.add_worker()
    job = sequence(farm, frames="1-4x3", size="48x32")
    farm.wait_for_job(job)
    environment = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
    lightshaft("video", job, "-o", tmp_path / "out.mp4", "--fps", 10, env=environment)
    assert facts(tmp_path / "out.mp4")["nb_read_frames"] == "2"

    assert list(farm.folder.rglob("video.mp4"))
    farm.request("DELETE", f"/api/v1/jobs/{job}")
    wait_until(lambda: not list(farm.folder.rglob("video.mp4")), "the removal of the video")
    assert refusal(farm, "GET", f"/api/v1/jobs/{job}/video").status == 404
