"""lightshaft compare: integrators race."""

import csv
import math
import os
import re
import shutil
import signal
import subprocess
import sys

import pytest

from cli_kit import bin_dir, lightshaft, write_fog
from exr_layers import read, write_rgb
from local_farm import PATIENCE, ROOT


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def compare(folder, *arguments, code=0, quiet=True):
    return lightshaft("compare", write_fog(folder), "--size", "48x32", "--threads", "1", "--clock", "cpu", "--report", folder / "out",
                      *(["--quiet"] if quiet else []), *arguments, code=code)


def test_integrators_of_ours_race_with_intervals(tmp_path):
    done = compare(tmp_path, "--integrators", "volpath,volpath_distant_mis", "--time", "60", "--spp", "64", "--seeds", "3")
    out = tmp_path / "out"

    points = rows(out / "points.csv")
    assert {p["entrant"] for p in points} == {"Lightshaft volpath", "Lightshaft volpath_distant_mis"}
    assert [float(p["spp"]) for p in points if p["entrant"] == "Lightshaft volpath" and p["seed"] == "0"] == [2, 4, 8, 16, 32, 64]
    # What the other seeds say of a picture and what it says of itself are the same error: within a factor, over six points.
    logs = [math.log(float(p["relmse"]) / float(p["estimated_relmse"])) for p in points if float(p["spp"]) >= 8]
    assert abs(sum(logs) / len(logs)) < .35, logs
    summary = rows(out / "summary.csv")
    assert float(summary[1]["ratio_lo"]) < float(summary[1]["ratio"]) < float(summary[1]["ratio_hi"])
    assert float(summary[0]["efficiency"]) == pytest.approx(1 / (float(summary[0]["relmse"]) * float(summary[0]["seconds"])), rel=1e-4)
    assert "times as efficient" in done.stdout
    page = (out / "index.html").read_text()
    assert page.count("<svg") == 1 and "<script" not in page and "Lightshaft volpath_distant_mis" in page
    assert (out / "fog.svg").stat().st_size < 100_000
    assert "![fog: error against time](fog.svg)" in (out / "report.md").read_text()
    assert rows(out / "forecasts.csv") is not None


def test_time_ends_a_race(tmp_path):
    compare(tmp_path, "--time", "0.3", "--seeds", "2")
    points = rows(tmp_path / "out" / "points.csv")

    # Nothing else ends it: no number of samples is set. A round begins only while time is left.
    assert [p["seed"] for p in points if p["last"] == "1"] == ["0", "1"]
    before_the_last = [float(p["seconds"]) for p in points if p["last"] == "0"]
    assert all(seconds < .3 for seconds in before_the_last), before_the_last


def test_the_pictures_are_those_of_render(tmp_path):
    """Measured against its own picture, which does not say whose it is, a race of the same seed has no error."""
    scene = write_fog(tmp_path)
    lightshaft("render", scene, "-o", tmp_path / "r.exr", "--float", "--quiet", "--spp", "16", "--size", "48x32", "--seed", "5")
    write_rgb(tmp_path / "plain.exr", read(tmp_path / "r.exr")[0])
    compare(tmp_path, "--time", "60", "--spp", "16", "--seeds", "1", "--seed", "5", "--reference", tmp_path / "plain.exr")

    last = [p for p in rows(tmp_path / "out" / "points.csv") if p["last"] == "1"][0]
    assert float(last["relmse"]) == 0


def test_a_reference_with_the_noise_of_a_racer_is_refused(tmp_path):
    lightshaft("render", write_fog(tmp_path), "-o", tmp_path / "ref.exr", "--quiet", "--spp", "8", "--size", "48x32", "--seed", "8")
    race = ("--reference", tmp_path / "ref.exr", "--time", "60", "--spp", "4", "--seeds", "2")

    told = compare(tmp_path, *race, "--seed", "7", code=2)
    assert "ref.exr was rendered from this scene with seed 8" in told.stderr and "--seed 9" in told.stderr

    compare(tmp_path, *race, "--seed", "9")
    assert "ref.exr, less its own noise by its layers of errors" in (tmp_path / "out" / "report.md").read_text()


def test_a_race_that_nobody_could_judge_is_not_run(tmp_path):
    """References are given, but none is of this scene."""
    (tmp_path / "refs").mkdir()
    told = compare(tmp_path, "--references", tmp_path / "refs", "--time", "600", "--seeds", "1", code=2, quiet=False)

    assert "two seeds at least" in told.stderr
    blind = compare(tmp_path, "--integrators", "path", "--time", "600", "--seeds", "2", code=2, quiet=False)
    assert "sees all of the scene" in blind.stderr
    for refused in (told, blind):
        assert "seed 1 of" not in refused.stderr, "a seed was begun"
    assert not (tmp_path / "out" / "points.csv").exists()


def test_wrong_use_is_told_before_anything_is_rendered(tmp_path):
    scene = write_fog(tmp_path)
    start = ["compare", scene, "--time", "1", "--report", tmp_path / "out"]
    for arguments, said in ((["--integrators", "volpth"], "volpth"), (["--seeds", "1"], "--seeds 1 needs a --reference"),
                            (["--reference", tmp_path / "none.exr"], "none.exr"), (["--clock", "sun"], "--clock"),
                            (["--threads", "9999"], "--threads")):
        done = lightshaft(*start, *arguments, code=2)
        assert said in done.stderr, done.stderr
    assert not (tmp_path / "out" / "points.csv").exists()


def test_a_set_of_scenes_has_one_table(tmp_path):
    (tmp_path / "b").mkdir()
    first = write_fog(tmp_path)
    shutil.copy(write_fog(tmp_path / "b"), tmp_path / "b" / "scene.xml")
    refs = tmp_path / "refs"
    refs.mkdir()
    for k in (0, 1):
        lightshaft("render", first, "-o", refs / f"fog.{k}.exr", "--quiet", "--spp", "4", "--size", "32x16", "--seed", 90 + k)
    lightshaft("compare", first, tmp_path / "b" / "scene.xml", "--size", "32x16", "--threads", "1", "--clock", "cpu", "--time", "60", "--spp", "4", "--seeds", "2",
               "--references", refs, "--report", tmp_path / "out", "--quiet")

    assert [row["scene"] for row in rows(tmp_path / "out" / "summary.csv")] == ["fog", "b"]
    assert (tmp_path / "out" / "b.svg").exists()
    fog, b = (tmp_path / "out" / "report.md").read_text().split("## b\n")
    assert "fog.0.exr and fog.1.exr, two independent references" in fog and "pictures of all other seeds" in b


SHORT = ("--time", "60", "--spp", "2", "--seeds", "2")


def test_entrants_are_called_as_the_user_called_them(tmp_path):
    compare(tmp_path, "--integrators", "volpath,volpathmis", *SHORT)

    assert [row["entrant"] for row in rows(tmp_path / "out" / "summary.csv")] == ["Lightshaft volpath", "Lightshaft volpathmis"]


@pytest.mark.parametrize("integrators, told, ranked", [
    (["volpath"], [], []),
    (["volpath", "path"], ["the others are not measured: without --reference"], []),
    (["volpath", "volpath_distant_mis"], [], ["Lightshaft volpath_distant_mis"]),
])
def test_an_entrant_that_is_killed_is_named_and_the_report_is_written(tmp_path, integrators, told, ranked):
    """A program that stands for `lightshaft` kills the lanes of one entrant."""
    program = tmp_path / "lightshaft"
    program.write_text(f"""#!/bin/sh
case "$*" in race-lane*--integrator=volpath" "*) kill -9 $$;; esac
exec {bin_dir() / "lightshaft"} "$@"
""")
    program.chmod(0o755)
    (tmp_path / "out").mkdir()
    done = subprocess.run([sys.executable, "-B", ROOT / "python" / "src" / "lightshaft_command", "compare", "--time=60", "--spp=2", "--seeds=2", "--size=48x32",
                           "--threads=1", "--clock=cpu", f"--report={tmp_path / 'out'}", *(f"--integrators={i}" for i in integrators), "--quiet=true", "--",
                           write_fog(tmp_path)], capture_output=True, text=True, env={**os.environ, "LIGHTSHAFT_PROGRAMS": str(tmp_path)})

    assert done.returncode == 1
    first, *others = done.stderr.splitlines()
    assert first == "lightshaft: error: fog: Lightshaft volpath: its process was killed by signal 9"
    assert len(others) == len(told) and all(words in line for words, line in zip(told, others))
    assert "Lightshaft volpath failed: its process was killed by signal 9" in (tmp_path / "out" / "report.md").read_text()
    assert [row["entrant"] for row in rows(tmp_path / "out" / "summary.csv")] == ranked


def test_scenes_may_have_any_name(tmp_path):
    scene = write_fog(tmp_path)
    for name in (b"--x.xml", b"fo\xffg.xml"):
        shutil.copy(scene, os.fsencode(tmp_path) + b"/" + name)
    done = subprocess.run([bin_dir() / "lightshaft", "compare", "--size", "48x32", "--threads", "1", "--clock", "cpu", "--report", "out", *SHORT, "--",
                           b"--x.xml", b"fo\xffg.xml"], cwd=tmp_path, capture_output=True)  # fmt: skip

    assert done.returncode == 0, done.stderr
    assert b"--x: Lightshaft volpath: 2 samples" in done.stdout and b"fo?g: Lightshaft volpath: 2 samples" in done.stdout
    assert (tmp_path / "out" / "fo_g.svg").exists() and "fo?g" in (tmp_path / "out" / "report.md").read_text()


def test_a_flag_that_is_false_is_not_given(tmp_path):
    assert "seed 1 of 2" in compare(tmp_path, *SHORT, "--quiet=false", quiet=False).stderr
    assert "seed 1 of 2" not in compare(tmp_path, *SHORT, "--quiet=true", quiet=False).stderr


@pytest.mark.parametrize("command", [["compare", "fog.xml", "--time", "60", "--report", "out"], ["farm", "up", "--on", "ssh"]])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_the_command_starts_ends_it_without_a_traceback(tmp_path, command, number):
    def wait_for_python():
        signal.signal(number, signal.SIG_DFL)  # a shell in the background lets its programs ignore SIGINT
        signal.pthread_sigmask(signal.SIG_BLOCK, [number])
        os.kill(os.getpid(), number)

    write_fog(tmp_path)
    done = subprocess.run([bin_dir() / "lightshaft", *command], cwd=tmp_path, preexec_fn=wait_for_python, capture_output=True, text=True, timeout=PATIENCE)

    assert (done.returncode, done.stderr) == (1, "lightshaft: stopping\n")


@pytest.mark.slow
def test_interrupting_keeps_what_was_done(tmp_path):
    scene = write_fog(tmp_path)
    shutil.copy(scene, tmp_path / "long.xml")
    out = tmp_path / "out"
    run = subprocess.Popen([bin_dir() / "lightshaft", "compare", scene, tmp_path / "long.xml", "--size", "48x32", "--threads", "1", "--time", "3", "--clock", "cpu",
                            "--seeds", "2", "--report", out], stderr=subprocess.PIPE, text=True, env={**os.environ, "TMPDIR": str(tmp_path)})
    for line in run.stderr:
        if re.search("long: seed 1", line):
            run.send_signal(2)
            break
    rest = run.stderr.read()
    assert run.wait(timeout=PATIENCE) == 1
    assert "long: seed 2" not in rest, "another seed was begun"
    assert [row["scene"] for row in rows(out / "summary.csv")] == ["fog"]
    assert not list(tmp_path.glob("lightshaft-race-*")), "pictures were left behind"
