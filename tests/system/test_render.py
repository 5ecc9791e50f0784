"""`lightshaft render` and `merge`: one digest for one scene, however it is computed, and a report that says what it cost."""

import json
import os
import pty
import signal
import subprocess

import pytest
from cli_kit import digest, lightshaft, load, png_size
from local_farm import PATIENCE, bin_dir, wait_until

CONTRACT = {"spp", "samples", "load_seconds", "render_seconds", "core_seconds", "peak_rss_bytes", "rmse", "relmse",
            "relmse_ci95", "nonfinite_samples", "pixels_sha256", "features_used", "features_left_out", "numeric_class",
            "stopped", "convergence"}
POINT = {"seconds", "core_seconds", "spp", "rmse", "relmse", "relmse_ci95"}
SPP = 12  # rounds of 2, 2, 4 and a cut one of 4


def render(scene, folder, *flags, spp=SPP, **options):
    return lightshaft("render", scene, "-o", folder / "out.exr", "--spp", spp, *flags, **options)


@pytest.fixture(scope="module")
def expected(fog, tmp_path_factory):
    """The digest from one thread."""
    return digest(render(fog, tmp_path_factory.mktemp("one"), "--threads", 1))


@pytest.mark.parametrize("flags", [("--threads", "2"), ("--threads", "3"), ("--isolate", "--threads", "2")], ids=" ".join)
def test_threads_and_isolation_do_not_change_the_pixels(fog, expected, tmp_path, flags):
    assert digest(render(fog, tmp_path, *flags)) == expected


def test_another_seed_changes_them(fog, expected, tmp_path):
    assert digest(render(fog, tmp_path, "--seed", 1)) != expected


def test_the_output_type_does_not(fog, expected, tmp_path):
    assert digest(render(fog, tmp_path, "--float")) == expected


def test_merged_partials_are_the_image(fog, expected, tmp_path):
    kept = tmp_path / "partials"
    assert digest(render(fog, tmp_path, "--threads", 2, "--partial-dir", kept)) == expected

    files = sorted(kept.glob("*.exr"), reverse=True)
    merged = lightshaft("merge", *files, "-o", tmp_path / "merged.exr", "--report", tmp_path / "merged.json")

    assert digest(merged) == expected
    assert load(tmp_path / "merged.json")["pixels_sha256"] == expected
    assert digest(lightshaft("merge", kept, "-o", tmp_path / "merged.exr")) == expected


def test_an_image_that_ends_in_png_is_one(fog, expected, tmp_path):
    shown, merged, kept = tmp_path / "out.PNG", tmp_path / "merged.png", tmp_path / "partials"

    assert digest(lightshaft("render", fog, "-o", shown, "--spp", SPP, "--partial-dir", kept)) == expected
    assert digest(lightshaft("merge", kept, "-o", merged)) == expected

    assert png_size(shown.read_bytes()) == (72, 40)
    assert shown.read_bytes() == merged.read_bytes()


@pytest.mark.parametrize("command", ["render", "merge", "submit", "fetch"])
def test_an_image_of_another_format_is_refused_at_once(fog, tmp_path, command):
    image = tmp_path / "out.jpg"

    refused = lightshaft(command, fog, "-o", image, env={**os.environ, "LIGHTSHAFT_URL": "http://127.0.0.1:9"}, code=2)

    assert f"-o {image}: an image is written as .exr (all layers) or .png (8-bit colours)" in refused.stderr
    assert not image.exists()


def test_merge_names_a_gap(fog, tmp_path):
    kept = tmp_path / "partials"
    render(fog, tmp_path, "--partial-dir", kept)
    next(kept.glob("*-round-00001.exr")).unlink()

    refused = lightshaft("merge", kept, "-o", tmp_path / "merged.exr", code=2)

    assert "merge: " in refused.stderr and not (tmp_path / "merged.exr").exists()


def test_samples_continue_over_a_cut_round(fog, tmp_path):
    """12 samples, then 24 into the same folder: the cut round is replaced by the full one; what is folded is a 24 image."""
    kept = tmp_path / "partials"
    render(fog, tmp_path, "--partial-dir", kept, spp=12)
    cut = {p.name: p.read_bytes() for p in kept.iterdir()}
    one_shot = digest(render(fog, tmp_path, "--partial-dir", kept, spp=24))
    full = {p.name: p.read_bytes() for p in kept.iterdir()}

    same = [name for name in cut if cut[name] == full[name]]

    assert digest(lightshaft("merge", kept, "-o", tmp_path / "merged.exr")) == one_shot
    # Of the rounds of the 12 image all but the cut one stand unchanged in the 24 image.
    assert same == [name for name in cut if "round-00003" not in name] and len(same) == len(cut) * 3 // 4


def test_the_report_has_all_of_the_contract(fog, expected, tmp_path):
    report = tmp_path / "report.json"
    render(fog, tmp_path, "--report", report, "--quiet")
    figures = load(report)

    assert CONTRACT <= figures.keys()
    assert figures["spp"] == SPP and figures["samples"] == SPP * 72 * 40 and figures["stopped"] == "spp"
    assert figures["pixels_sha256"] == expected and figures["nonfinite_samples"] == 0
    assert figures["load_seconds"] > 0 and figures["render_seconds"] > 0 and figures["core_seconds"] > 0
    assert figures["peak_rss_bytes"] > 1 << 20
    executed = figures["instructions"]  # by the processor's counter, which most virtual machines lack
    assert executed.get("uncounted") if "count" not in executed else executed["per_sample"] > 500
    low, high = figures["relmse_ci95"]
    assert 0 < low <= figures["relmse"] <= high
    assert [p["spp"] for p in figures["convergence"]] == [2, 4, 8, 12]
    assert all(POINT <= p.keys() for p in figures["convergence"])
    assert "true_rmse" not in figures


def test_the_report_comes_as_a_page_of_its_own(fog, tmp_path):
    page = tmp_path / "report.html"
    render(fog, tmp_path, "--report", tmp_path / "report.json", "--html", page, "--quiet")
    text, figures = page.read_text(), load(tmp_path / "report.json")

    assert figures["name"] == fog.name and f"<h1>{fog.name}</h1>" in text
    assert figures["pixels_sha256"] in text and "src=\"data:image/png;base64,iVBOR" in text
    assert "<script" not in text and "http://" not in text.replace("http://www.w3.org/2000/svg", "") and "https://" not in text


def test_a_page_that_cannot_be_written_is_told_before_rendering(fog, tmp_path):
    said = lightshaft("render", fog, "-o", tmp_path / "out.exr", "--spp", SPP, "--html", tmp_path / "no" / "such.html", code=2).stderr

    assert "--html" in said and not (tmp_path / "out.exr").exists()


def test_a_reference_gives_the_true_error(fog, tmp_path):
    reference = tmp_path / "reference.exr"
    lightshaft("render", fog, "-o", reference, "--spp", SPP, "--float")
    said = render(fog, tmp_path, "--reference", reference, "--report", tmp_path / "same.json").stderr
    render(fog, tmp_path, "--seed", 1, "--reference", reference, "--report", tmp_path / "other.json")
    same, other = load(tmp_path / "same.json"), load(tmp_path / "other.json")

    # The reference is this very image in float32, and its own noise is taken away from no difference at all.
    assert same["true_rmse"] == 0 and same["true_flip"] < 1e-4
    assert same["reference"]["below_noise"] and same["reference"]["rmse_below_noise"]
    assert same["reference"]["same_seed"] and same["verdict_kind"] != "bias_floor" and "shares this job's seed" in said
    assert not other["reference"]["same_seed"] and not other["true_relmse_below_noise"]
    # Two independent images of one variance: their difference has twice the squared error, of which the reference's layers of
    # errors take one half away. A factor 2 is wide for 72 * 40 * 3 values.
    assert other["rmse"] / 2 < other["true_rmse"] < other["rmse"] * 2
    assert .5 < other["reference"]["noise_rmse"] / other["rmse"] < 2
    assert other["reference"]["relmse"] == other["true_relmse"] == other["convergence"][-1]["true_relmse"]
    assert all(p["true_rmse"] > 0 for p in other["convergence"])
    flips = [p["true_flip"] for p in other["convergence"] if p["true_flip"] is not None]
    assert flips == sorted(flips, reverse=True) and flips[-1] == other["true_flip"] and 0 < flips[-1] < flips[0] < 1


def test_a_reference_of_another_size_is_refused(fog, tmp_path):
    lightshaft("render", fog, "-o", tmp_path / "small.exr", "--spp", 2, "--size", "20x10")

    refused = render(fog, tmp_path, "--reference", tmp_path / "small.exr", code=2)

    assert "20 x 10" in refused.stderr and "72 x 40" in refused.stderr


def test_a_target_error_stops_the_job_and_its_partials_merge_to_it(fog, tmp_path):
    report, kept = tmp_path / "report.json", tmp_path / "partials"
    done = lightshaft("render", fog, "-o", tmp_path / "out.exr", "--size", "40x32", "--target-error", 0.05, "--spp", 100_000,
                      "--report", report, "--partial-dir", kept)

    figures = load(report)
    assert figures["stopped"] == "error" and 64 <= figures["spp"] < 100_000
    assert digest(lightshaft("merge", kept, "-o", tmp_path / "merged.exr")) == digest(done) == figures["pixels_sha256"]


def test_a_time_budget_stops_the_job_and_says_so(fog, tmp_path):
    report = tmp_path / "report.json"
    lightshaft("render", fog, "-o", tmp_path / "out.exr", "--time", 0.5, "--report", report, "--quiet")

    assert load(report)["stopped"] == "time"


def test_one_sample_is_replayed(fog):
    first = lightshaft("render", fog, "--pixel", "30,20", "--sample", 7)
    again = lightshaft("render", fog, "--pixel", "30,20", "--sample", 7, "--threads", 1)
    other = lightshaft("render", fog, "--pixel", "30,20", "--sample", 8)

    assert first.stdout == again.stdout and first.stdout.startswith("pixel 30,20 sample 7: ")
    assert first.stdout.split(":")[1] != other.stdout.split(":")[1]
    assert "72 x 40" in lightshaft("render", fog, "--pixel", "72,0", "--sample", 0, code=2).stderr


@pytest.mark.parametrize("flags", [(), ("--isolate",)], ids=["in process", "isolated"])
def test_ctrl_c_writes_what_there_is(fog, tmp_path, flags):
    partials_kept = tmp_path / "partials"
    process = subprocess.Popen([bin_dir() / "lightshaft", "render", fog, "-o", tmp_path / "out.exr", "--spp", "1000000", "--report",
                                tmp_path / "report.json", "--partial-dir", partials_kept, *flags], stderr=subprocess.PIPE, text=True,
                               start_new_session=True)
    try:
        wait_until(lambda: partials_kept.is_dir() and len(list(partials_kept.iterdir())) > 10, "ten units are rendered")
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to its child, too
        _, said = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()

    assert process.returncode == 1 and "interrupted" in said and "out.exr" in said
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["stopped"] == "user" and 0 < report["spp"] < 1_000_000
    assert (tmp_path / "out.exr").stat().st_size > 0


def test_progress_is_shown_on_a_terminal_only(fog, tmp_path):
    command = [bin_dir() / "lightshaft", "render", fog, "-o", tmp_path / "out.exr", "--spp", "256"]
    terminal, inside = pty.openpty()
    try:
        with subprocess.Popen(command, stderr=inside, stdout=subprocess.DEVNULL) as shown:
            os.close(inside)
            seen = b""
            while chunk := read_terminal(terminal):
                seen += chunk
            assert shown.wait(60) == 0
    finally:
        os.close(terminal)
    plain = subprocess.run(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, timeout=PATIENCE, check=True)

    assert b" % [" in seen and b"relMSE" in seen.split(b"out.exr: ")[0]
    assert b"[" not in plain.stderr and plain.stderr.count(b"\n") == 1


def read_terminal(terminal):
    try:
        return os.read(terminal, 65536)
    except OSError:  # the other end is closed
        return b""
