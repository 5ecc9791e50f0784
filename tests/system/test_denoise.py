"""Denoised layers end to end, with a stand-in for Open Image Denoise (tests/support/fake_oidn.cpp): by the command and on a farm."""

import base64
import json
import os
import re
import shutil

import pytest
from cli_kit import digest, lightshaft
from exr_layers import read, read_header, write
from local_farm import SCENE, HttpError, LocalFarm, bin_dir

LIBRARY = bin_dir().parent / "fake_oidn" / "blurs.so"
WITH = {"LIGHTSHAFT_OIDN": str(LIBRARY)}


def render(scene, out, *flags, env=WITH, code=0):
    return lightshaft("render", scene, "-o", out, "--spp", 12, *flags, env={**os.environ, **env}, code=code)


def picture_of(page):
    """The picture of a report (the first image of the page), and its caption."""
    found = re.search(r'<figure><div class="image"><img [^>]*src="data:image/png;base64,([^"]*)"></div><figcaption>([^<]*)<', page)
    return base64.b64decode(found[1]), found[2]


def test_the_command_adds_layers_and_tells_their_error(fog, tmp_path):
    plain = digest(render(fog, tmp_path / "plain.exr"))

    done = render(fog, tmp_path / "out.exr", "--denoise", "--report", tmp_path / "report.json", "--html", tmp_path / "report.html")

    assert digest(done) == plain
    figures = json.loads((tmp_path / "report.json").read_text())["denoised"]
    assert figures["by"] == "Open Image Denoise 2.99.7" and figures["relmse_ci95"][0] <= figures["relmse"] <= figures["relmse_ci95"][1]
    assert f", denoised relMSE {figures['relmse']:.3g} (" in done.stderr
    assert "relMSE, denoised" in (tmp_path / "report.html").read_text()
    rows, strings, types = read(tmp_path / "out.exr")
    assert {types[f"denoised.{c}"] for c in "RGB"} == {"e"} and rows["denoised.R"] != rows["R"]
    assert strings["lightshaft:denoised_by"] == figures["by"]
    assert json.loads(strings["lightshaft:job"])["aov"] == ["denoising_albedo", "denoising_normal"]
    # As a PNG it is the denoised image.
    render(fog, tmp_path / "plain.png")
    render(fog, tmp_path / "out.png", "--denoise")
    assert (tmp_path / "out.png").read_bytes() != (tmp_path / "plain.png").read_bytes()
    # And so it is in the report; without denoising the image itself.
    shown, caption = picture_of((tmp_path / "report.html").read_text())
    assert shown == (tmp_path / "out.png").read_bytes() and caption.startswith("Denoised;")
    render(fog, tmp_path / "plain.exr", "--html", tmp_path / "plain.html")
    assert picture_of((tmp_path / "plain.html").read_text()) == ((tmp_path / "plain.png").read_bytes(), "As it was rendered.")
    # The same image again, from other threads and a child process: guides and denoised layers, too.
    render(fog, tmp_path / "again.exr", "--denoise", "--threads", 1, "--isolate")
    assert read(tmp_path / "again.exr")[0] == rows


def test_where_there_is_no_library_nothing_is_rendered(fog, tmp_path):
    done = render(fog, tmp_path / "out.exr", "--denoise", env={"LIGHTSHAFT_OIDN": "/no/such/folder"}, code=1)

    assert "/no/such/folder" in done.stderr and "deploy/install-denoiser.sh" in done.stderr
    assert not (tmp_path / "out.exr").exists()


def test_verify_finds_a_denoised_value_that_was_changed(fog, tmp_path):
    image = tmp_path / "out.exr"
    render(fog, image, "--denoise")
    assert "as sealed" in lightshaft("verify", "--scene", fog, image, "--tiles", 1).stdout
    rows, _, _ = read(image)
    changed = {**rows, "denoised.G": [tuple(2 * v for v in row) for row in rows["denoised.G"]]}

    write(image, read_header(image.read_bytes())[0], changed)

    done = lightshaft("verify", "--scene", fog, image, "--tiles", 1, code=1)
    assert "layer denoised.G" in done.stdout + done.stderr


def test_on_a_farm_image_picture_and_report_have_it(fog, tmp_path):
    library = tmp_path / "oidn.so"
    shutil.copy(LIBRARY, library)
    with LocalFarm(tmp_path / "farm", environment={"LIGHTSHAFT_OIDN": str(library)}) as farm:
        farm.add_workers(2)
        job, plain = farm.submit(SCENE, spp=16, denoise="true"), farm.submit(SCENE, spp=16)
        for wanted in (job, plain):
            farm.wait_for_job(wanted)

        assert farm.job(job)["denoise"] is True and farm.job(plain)["denoise"] is False
        image = tmp_path / "image.exr"
        image.write_bytes(farm.request("GET", f"/api/v1/jobs/{job}/image.exr"))
        assert read(image)[1]["lightshaft:denoised_by"] == farm.report(job)["denoised"]["by"] == "Open Image Denoise 2.99.7"
        assert "denoised" not in farm.report(plain)
        to = ("--to", f"http://127.0.0.1:{farm.http}", "--token-file", farm.data / "token")
        waited = lightshaft("submit", fog, *to, "--spp", 16, "--denoise", "--wait")
        denoised = farm.report(waited.stdout.split()[0])["denoised"]
        assert f"denoised relMSE {denoised['relmse']:.3g} (" in waited.stderr
        assert "denoised" not in lightshaft("submit", fog, *to, "--spp", 16, "--wait").stderr
        picture = farm.request("GET", f"/api/v1/jobs/{job}/image.png?layer=denoised")
        assert picture.startswith(b"\x89PNG") and picture != farm.request("GET", f"/api/v1/jobs/{job}/image.png")
        lightshaft("fetch", job, *to, "-o", tmp_path / "image.png")
        assert (tmp_path / "image.png").read_bytes() == picture

        def report_page(of):
            return picture_of(farm.request("GET", f"/api/v1/jobs/{of}/report.html").decode())

        assert report_page(job)[0] == picture and report_page(job)[1].startswith("Denoised;")
        assert report_page(plain) == (farm.request("GET", f"/api/v1/jobs/{plain}/image.png"), "As it was rendered.")
        for path, status, words in ((f"/api/v1/jobs/{plain}/image.png?layer=denoised", 409, "was submitted without"),
                                    (f"/api/v1/jobs/{job}/image.png?layer=depth", 400, "'layer' must be")):
            with pytest.raises(HttpError) as refused:
                farm.request("GET", path)
            assert refused.value.status == status and words in str(refused.value)

        # The library goes away, and the coordinator starts anew: what was made stays, new jobs are refused with the reason.
        library.unlink()
        farm.restart_coordinator()
        assert read(image)[0]["denoised.R"] and farm.request("GET", f"/api/v1/jobs/{job}/image.exr") == image.read_bytes()
        with pytest.raises(HttpError) as refused:
            farm.submit(SCENE, spp=16, denoise="true")
        assert refused.value.status == 409 and "deploy/install-denoiser.sh" in str(refused.value)
        assert report_page(job) == (farm.request("GET", f"/api/v1/jobs/{job}/image.png"), "As it was rendered.")


def test_a_target_error_of_the_denoised_layers_is_one_image_wherever_it_is_rendered(fog, tmp_path):
    target = ("--size", "96x64", "--target-error", 0.03, "--target-layer", "denoised")

    def rendered(name, *flags):
        done = lightshaft("render", fog, "-o", tmp_path / f"{name}.exr", *target, *flags, "--report", tmp_path / f"{name}.json",
                          env={**os.environ, **WITH})
        return done, json.loads((tmp_path / f"{name}.json").read_text())

    done, report = rendered("a", "--threads", 1, "--html", tmp_path / "a.html")
    checks = report["denoised_checks"]
    assert report["stopped"] == "error" and report["target_layer"] == "denoised" and report["denoised"]["relmse"] == checks[-1]["relmse"]
    assert all(c["at_most"] <= 0.03 for c in checks[-2:]) and len(checks) >= 2
    assert "target 0.03 for the denoised layers" in done.stderr
    assert "of the denoised layers" in (tmp_path / "a.html").read_text()
    assert rendered("b", "--threads", 2, "--isolate")[1]["pixels_sha256"] == report["pixels_sha256"]

    with LocalFarm(tmp_path / "farm", environment={"LIGHTSHAFT_OIDN": str(LIBRARY)}) as farm:
        farm.add_workers(2, fake=False)
        to = ("--to", f"http://127.0.0.1:{farm.http}", "--token-file", farm.data / "token")
        job = lightshaft("submit", fog, *to, *target, "--wait").stdout.split()[0]
        assert farm.report(job)["pixels_sha256"] == report["pixels_sha256"] and farm.report(job)["denoised_checks"] == checks
        assert farm.job(job)["target_layer"] == "denoised" and farm.job(job)["denoised_check"] == checks[-1]
        assert "target relMSE, denoised" in lightshaft("show", job, *to).stdout
        lightshaft("extend", job, "--target-error", 0.02, *to)
        farm.wait_for_job(job)
        smaller = lightshaft("render", fog, "-o", tmp_path / "c.exr", "--size", "96x64", "--target-error", 0.02, "--target-layer", "denoised",
                             env={**os.environ, **WITH})
        assert farm.report(job)["pixels_sha256"] == digest(smaller)


@pytest.mark.parametrize(("flags", "words"), [
    (("--target-layer", "denoised"), "give that, too"),
    (("--target-error", 0.1, "--target-layer", "clean"), "raw or denoised")])
def test_a_target_layer_that_means_nothing_is_refused(fog, tmp_path, flags, words):
    assert words in lightshaft("render", fog, "-o", tmp_path / "out.exr", *flags, code=2).stderr


def test_a_target_of_the_denoised_layers_is_refused_where_there_is_no_library(fog, tmp_path):
    done = lightshaft("render", fog, "-o", tmp_path / "out.exr", "--target-error", 0.1, "--target-layer", "denoised",
                      env={**os.environ, "LIGHTSHAFT_OIDN": "/no/such/folder"}, code=1)

    assert "deploy/install-denoiser.sh" in done.stderr and not (tmp_path / "out.exr").exists()
