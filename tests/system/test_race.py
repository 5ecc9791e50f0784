"""bench/race.py: a program that is none of ours races with us, well-behaved or not."""

import csv
import json
import os
import pathlib
import re
import select
import shutil
import signal
import subprocess
import sys

import pytest
from cli_kit import bin_dir, lightshaft, write_fog
from local_farm import PATIENCE, ROOT, wait_until

from racing import adapter, program
from racing.adapter import Cost, Made, RaceError
from racing.racers import next_run, next_turn

ADAPTERS = ROOT / "bench" / "adapters"


# ---- adapters, and what is believed of a program's claims ----

WHOLE = {"name": "Other", "command": ["other", "{scene}", "-n", "{spp}", "-o={image}"], "first_spp": 8, "scenes": ["fog"]}


def parsed(**keys):
    return adapter.parse(json.dumps(keys), pathlib.Path("folder"))


def test_adapters_are_read_and_filled_once():
    read = parsed(**WHOLE)
    assert (read.name, read.lists, read.first_spp, read.scenes, read.most_seconds) == ("Other", False, 8, ["fog"], 300)
    filled = read.filled({"scene": "a b {spp}.xml", "spp": "16", "image": "o.exr"})
    assert filled == ["other", "a b {spp}.xml", "-n", "16", "-o=o.exr"]
    assert parsed(name="a", command=["x", "{scene}", "{time}", "{folder}"]).lists


COMMAND = ["x", "{scene}", "{spp}", "{image}"]


@pytest.mark.parametrize("keys, said", [
    ({"name": "a", "comand": []}, "unknown key 'comand'"), ({"command": COMMAND}, "'name'"),
    ({"name": "a", "command": "x {scene}"}, "'command' must be an array"), ({"name": "a", "command": []}, "'command' must be an array"),
    ({"name": "a", "command": ["x", "{scene}", "{image}", "{sp}"]}, "has {sp}"),
    ({"name": "a", "command": ["x", "{scene"]}, "a brace that is not closed"),
    ({"name": "a", "command": ["x", "{spp}", "{image}"]}, "needs {scene}"), ({"name": "a", "command": ["x", "{scene}"]}, "either {spp}"),
    ({"name": "a", "command": ["{scene}", "{spp}", "{time}"]}, "either {spp}"),
    ({"name": "a", "command": ["x", "{scene}", "{time}"]}, "{folder}"), ({"name": "a", "command": ["x", "{scene}", "{spp}"]}, "{image}"),
    ({"name": "a", "command": COMMAND, "most_seconds": -1}, "'most_seconds'"),
    ({"name": "a", "command": COMMAND, "first_spp": 1.5}, "'first_spp'"), ({"name": "a", "command": COMMAND, "scenes": "fog"}, "'scenes'")])
def test_adapters_are_refused_with_the_key_that_is_wrong(keys, said):
    with pytest.raises(RaceError, match=re.escape(said)):
        parsed(**keys)


def test_a_file_that_is_no_adapter_is_named(tmp_path):
    (tmp_path / "list.json").write_text("[]")
    with pytest.raises(RaceError, match="list.json: an adapter is a JSON object"):
        adapter.read(tmp_path / "list.json")
    with pytest.raises(RaceError, match="none.json.*No such file"):
        adapter.read(tmp_path / "none.json")


GOOD = '{"image": "0.exr", "spp": 4, "seconds": 0.5}\n'


def test_lists_of_pictures_are_read_line_by_line():
    first, second = adapter.pictures(GOOD + '\n{"image": "1.exr", "spp": 16, "seconds": 2, "cpu_seconds": 3.5}\n')
    assert first == Made("0.exr", 4, .5, None) and second == Made("1.exr", 16, 2, 3.5)


@pytest.mark.parametrize("lines, said", [
    ("", "names no picture"), (GOOD + "nonsense\n", "line 2: this is no JSON object"), (GOOD + GOOD, "line 2: 'spp' must rise"),
    ('{"image": "0.exr", "spp": 4, "seconds": -1}', "'seconds'"), ('{"image": "0.exr", "spp": "4", "seconds": 1}', "'spp'"),
    ('{"image": "0.exr", "spp": NaN, "seconds": 1}', "'spp'"), ('{"image": "0.exr", "spp": 4, "seconds": 1, "cpu_seconds": 0}', "'cpu_seconds'"),
    *((json.dumps({"spp": 4, "seconds": 1, "image": image}), "without a folder") for image in ("../0.exr", "/etc/passwd", "..", "", "a/b.exr")),
    ("".join(json.dumps({"image": "0.exr", "seconds": 1, "spp": k + 1}) + "\n" for k in range(adapter.MOST_PICTURES + 1)), "more than")])
def test_lists_of_pictures_are_refused_with_their_line(lines, said):
    with pytest.raises(RaceError, match=re.escape(said)):
        adapter.pictures(lines)


def test_claims_of_more_time_than_the_process_had_are_not_believed():
    def believed(seconds, cpu, clock):
        return adapter.plausible(Made("", 4, seconds, cpu), Cost(10, 18), clock)

    assert believed(9, 17, "cpu") == Cost(9, 17)
    assert believed(9, None, "wall").wall == 9
    for claim, said in (((11, 17, "wall"), "ran for 10 s"), ((9, 25, "wall"), "CPU seconds"), ((9, None, "cpu"), "--clock cpu")):
        with pytest.raises(RaceError, match=said):
            believed(*claim)


# ---- programs ----

def shell(script, most=PATIENCE):
    return program.run(["sh", "-c", script], most)


def test_a_program_costs_wall_and_cpu_time():
    busy = shell("i=0; while [ $i -lt 100000 ]; do i=$((i+1)); done")
    assert 0 < busy.cpu <= busy.wall + .1, "one thread; clocks of different grain"


@pytest.mark.parametrize("script, said", [
    ("echo starting; echo 'no such light' >&2; echo; exit 3", "sh ended with exit code 3; its last words: no such light"),
    ("kill -SEGV $$", "sh died of signal 11"),
    ("i=0; while [ $i -lt 3000 ]; do echo 'a line of some length that says nothing at all'; i=$((i+1)); done; exit 1",
     "its last words: a line of some length that says nothing at all"),
    ('echo "token [$LIGHTSHAFT_TOKEN]"; exit 1', "token []")])
def test_a_program_that_fails_is_quoted(script, said, monkeypatch):
    monkeypatch.setenv("LIGHTSHAFT_TOKEN", "secret")
    with pytest.raises(RaceError, match=re.escape(said)):
        shell(script)


def test_a_program_that_does_not_exist_is_named():
    with pytest.raises(RaceError, match="lightshaft-no-such-program cannot be started"):
        program.run(["lightshaft-no-such-program"], PATIENCE)


def test_a_program_that_does_not_end_is_ended_with_what_it_started(tmp_path):
    pid = tmp_path / "pid"
    with pytest.raises(RaceError, match="more than 0.2 s.*mine"):
        shell(f"tail -f /dev/null & echo $! > {pid}; echo mine; wait", .2)
    assert ends(int(pid.read_text()))


def test_a_program_that_leaves_a_child_behind_has_ended_and_so_does_the_child(tmp_path):
    pid = tmp_path / "pid"
    shell(f"tail -f /dev/null & echo $! > {pid}; exit 0")
    assert ends(int(pid.read_text()))


def ends(pid):
    """True if a process that was killed is gone, or a zombie that nobody has waited for."""
    try:
        with open(os.pidfd_open(pid), "rb", buffering=0) as process:
            return bool(select.select([process], [], [], PATIENCE)[0])
    except ProcessLookupError:
        return True


# ---- who runs next, and for how many samples ----

def order(lengths, lap):
    turns, out = list(lengths), []
    while (at := next_turn(turns, lap)) is not None:
        out.append(at)
        turns[at] = None
        lap += 1
    return out


def test_each_seed_begins_with_another():
    assert [order([3, 3, 3], seed) for seed in range(3)] == [[0, 1, 2], [1, 2, 0], [2, 0, 1]]
    assert order([3, 3], 0) + order([3, 3], 1) == [0, 1, 1, 0], "a machine that grows slower does so for both"
    assert order([], 5) == []


def runs(start, per_sample, time, most=1 << 20):
    """Samples of the runs of a program with this cost."""
    past = []
    while (run := next_run(past, 4, time, most)) and len(past) < 100:
        past.append((run[0], start + per_sample * run[0]))
    return [spp for spp, _ in past]


def test_runs_grow_fourfold_and_fill_the_time():
    assert runs(2, .5, 100) == [4, 16, 64, 196]  # 2 + 196 / 2 = 100
    assert runs(0, 10, 20) == [4]
    assert len(runs(1, 0, 100, 1 << 60)) <= 12
    assert runs(0, .001, 100, 30) == [4, 16, 30] and runs(0, .001, 100, 2) == [2]


def test_short_runs_come_before_and_a_long_one_between_those_of_the_whole_time():
    past, done = [], []
    lists, whole = 100., 100.  # seconds expected of two entrants that run once
    expected = next_run(past, 4, 100, None)
    turns = [lists, expected[1], whole]
    lap = 0
    while (at := next_turn(turns, lap)) is not None:
        done.append(at)
        if at == 1:
            past.append((expected[0], .5 * expected[0]))
            expected = next_run(past, 4, 100, None)
        turns[at] = expected[1] if at == 1 and expected else None
        lap += 1
    assert done[:3] == [1, 1, 1] and sorted(done[3:]) == [0, 1, 2]


# ---- races ----

# A program that "renders" by running ours: what an adapter calls.
OTHER = """import json, subprocess, sys
ours, scene, image, times, spp, seed, size = sys.argv[1:8]
report = times + ".report"
subprocess.run([ours, "render", scene, "-o", image, "--float", "--quiet", "--spp", spp, "--seed", str(1000 + int(seed)), "--threads", "1",
                "--size", size, "--report", report], check=True)
told = json.load(open(report))
json.dump({"seconds": told["render_seconds"], "cpu_seconds": told["core_seconds"]}, open(times, "w"))
"""


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def adapter_file(folder, command, **more):
    path = folder / "adapter.json"
    path.write_text(json.dumps({"name": "Other", "command": command, **more}))
    return path


def other(folder):
    (folder / "other.py").write_text(OTHER)
    return adapter_file(folder, [sys.executable, "{adapter}/other.py", str(bin_dir() / "lightshaft"), "{scene}", "{image}", "{times}", "{spp}",
                                 "{seed}", "{size}"], first_spp=2)


def race_command(folder, *arguments):
    return [*map(str, [ROOT / "bench" / "race.py", *arguments, "--threads", 1, "--clock", "cpu", "--report", folder / "out"])]


def race(folder, *arguments, code=0, scenes=()):
    done = subprocess.run(race_command(folder, write_fog(folder), *scenes, "--size", "48x32", *arguments), text=True, capture_output=True,
                          timeout=PATIENCE, env={**os.environ, "LIGHTSHAFT_BIN": str(bin_dir()), "TMPDIR": str(folder)})
    assert done.returncode == code, f"exit code {done.returncode}, not {code}\n{done.stdout}\n{done.stderr}"
    assert not list(folder.glob("lightshaft-race-*")), "pictures were left behind"
    return done


def test_another_program_races(tmp_path):
    done = race(tmp_path, "--program", other(tmp_path), "--time", "0.5", "--seeds", "2", "--seed", "7")
    points = rows(tmp_path / "out" / "points.csv")

    theirs = [p for p in points if p["entrant"] == "Other" and p["seed"] == "8"]
    assert [p["last"] for p in theirs] == ["0"] * (len(theirs) - 1) + ["1"]
    assert [float(p["spp"]) for p in theirs] == sorted(float(p["spp"]) for p in theirs) and theirs[0]["spp"] == "2"
    ours = [p for p in points if p["entrant"] == "Lightshaft volpath" and p["seed"] == "8"]
    assert [p["spp"] for p in ours[:4]] == ["2", "4", "8", "16"] and all(p["estimated_relmse"] for p in ours)
    summary = {row["entrant"]: row for row in rows(tmp_path / "out" / "summary.csv")}
    # It is ours behind a wrapper: as efficient, as far as two seeds tell.
    assert .2 < float(summary["Other"]["ratio"]) < 5
    assert "times as efficient" in done.stdout
    report = (tmp_path / "out" / "report.md").read_text()
    assert "No reference was given" in report and "The seeds are 7 to 8" in report and "48 × 32 pixels" in report
    assert (tmp_path / "out" / "index.html").read_text().count("<svg") == 1 and (tmp_path / "out" / "fog.svg").exists()
    assert rows(tmp_path / "out" / "forecasts.csv") is not None


def test_the_same_picture_has_the_same_error_whoever_renders_it(tmp_path):
    """An entrant that gives our picture of the same seed, measured against the same references."""
    for k in (0, 1):
        lightshaft("render", write_fog(tmp_path), "-o", tmp_path / f"r{k}.exr", "--float", "--quiet", "--spp", "32", "--size", "48x32", "--seed", 90 + k)
    path = other(tmp_path)
    (tmp_path / "other.py").write_text(OTHER.replace("1000 + ", ""))
    race(tmp_path, "--program", path, "--time", "60", "--spp", "8", "--seeds", "1", "--reference", f"{tmp_path}/r0.exr,{tmp_path}/r1.exr")

    points = rows(tmp_path / "out" / "points.csv")
    ours, theirs = ({p["spp"]: p for p in points if p["entrant"] == name} for name in ("Lightshaft volpath", "Other"))
    assert sorted(theirs) == ["2", "8"]
    for spp in theirs:
        assert theirs[spp]["relmse"] == ours[spp]["relmse"] and theirs[spp]["rmse"] == ours[spp]["rmse"]
    assert "r0.exr and r1.exr, two independent references" in (tmp_path / "out" / "report.md").read_text()


BAD = {
    "exits": (["sh", "-c", "echo no licence; exit 7", "{scene}", "{spp}", "{image}"], "exit code 7; its last words: no licence"),
    "hangs": (["sh", "-c", "tail -f /dev/null", "{scene}", "{spp}", "{image}"], "ran for more than"),
    "writes nothing": (["true", "{scene}", "{spp}", "{image}"], "exr"),
    "writes nonsense": (["sh", "-c", "echo hello > $0", "{image}", "{scene}", "{spp}"], "exr"),
    "has no program": (["no-such-program-here", "{scene}", "{spp}", "{image}"], "cannot be started"),
    "lists nothing": (["true", "{scene}", "{time}", "{folder}"], "has not written pictures.jsonl"),
    "lists what is elsewhere": (["sh", "{adapter}/lists.sh", "{folder}", "{scene}", "{time}"], "line 1: 'image' must be"),
}


@pytest.mark.parametrize("kind", BAD)
def test_a_faulty_program_is_out_and_the_race_goes_on(tmp_path, kind):
    command, said = BAD[kind]
    (tmp_path / "lists.sh").write_text("echo '{\"image\": \"../x.exr\", \"spp\": 1, \"seconds\": 0.1}' > $1/pictures.jsonl\n")
    done = race(tmp_path, "--program", adapter_file(tmp_path, command, most_seconds=1), "--time", "0.1", "--seeds", "2", code=1)

    assert said in done.stderr and "Other" in done.stderr
    assert [row["entrant"] for row in rows(tmp_path / "out" / "summary.csv")] == ["Lightshaft volpath"]
    assert "Other failed:" in (tmp_path / "out" / "report.md").read_text()


def test_a_picture_of_another_size_is_refused(tmp_path):
    lightshaft("render", write_fog(tmp_path), "-o", tmp_path / "small.exr", "--quiet", "--spp", "2", "--size", "40x32")
    path = adapter_file(tmp_path, ["sh", "-c", f"cp {tmp_path}/small.exr $0", "{image}", "{scene}", "{spp}"])
    done = race(tmp_path, "--program", path, "--time", "0.1", "--seeds", "2", code=1)

    assert "is 40 x 32 pixels, and the race is one of 48 x 32" in done.stderr, done.stderr


def test_a_program_races_only_on_its_scenes_and_a_set_has_one_table(tmp_path):
    (tmp_path / "b").mkdir()
    shutil.copy(write_fog(tmp_path / "b"), tmp_path / "b" / "scene.xml")
    command = json.loads(other(tmp_path).read_text())["command"]
    race(tmp_path, "--program", adapter_file(tmp_path, command, scenes=["b"]), "--time", "60", "--spp", "4", "--seeds", "1",
         scenes=[tmp_path / "b" / "scene.xml"])

    assert [(row["scene"], row["entrant"]) for row in rows(tmp_path / "out" / "summary.csv")] == [
        ("fog", "Lightshaft volpath"), ("b", "Lightshaft volpath"), ("b", "Other")]
    assert (tmp_path / "out" / "fog.svg").exists() and (tmp_path / "out" / "b.svg").exists()


def test_wrong_use_is_told_before_anything_is_rendered(tmp_path):
    lightshaft("render", write_fog(tmp_path), "-o", tmp_path / "ref.exr", "--quiet", "--spp", "4", "--size", "48x32", "--seed", "8")
    for arguments, said in ((["--integrators", "volpth"], "volpth"), (["--reference", tmp_path / "none.exr"], "none.exr"),
                            (["--program", tmp_path / "none.json"], "No such file"), (["--integrators", "path"], "sees all of the scene"),
                            (["--program", adapter_file(tmp_path, ["x", "{scene}"])], "either {spp}"), (["--size", "0x3"], "--size"),
                            (["--references", tmp_path / "none"], "there is no folder"), (["--time", "-1"], "--time"),
                            (["--reference", tmp_path / "ref.exr", "--seed", "7", "--seeds", "2"], "rendered from this scene with seed 8")):
        done = race(tmp_path, "--time", "600", *arguments, code=2)
        assert said in done.stderr and "seed 1 of" not in done.stderr, done.stderr
    assert not (tmp_path / "out" / "points.csv").exists()


@pytest.mark.slow
def test_interrupting_keeps_what_was_done_and_ends_the_program(tmp_path):
    scene, out, pid = write_fog(tmp_path), tmp_path / "out", tmp_path / "pid"
    shutil.copy(scene, tmp_path / "long.xml")
    path = adapter_file(tmp_path, ["sh", "-c", f"echo $$ > {pid}.new; mv {pid}.new {pid}; exec tail -f /dev/null", "{scene}", "{spp}", "{image}"], scenes=["long"])
    run = subprocess.Popen(race_command(tmp_path, scene, tmp_path / "long.xml", "--size", "48x32", "--time", "1", "--seeds", "2", "--program", path),
                           stderr=subprocess.PIPE, text=True, env={**os.environ, "LIGHTSHAFT_BIN": str(bin_dir()), "TMPDIR": str(tmp_path)},
                           preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))  # what a shell starts in the background ignores it
    wait_until(lambda: pid.exists() or run.poll() is not None, "the program has begun")
    hanging = int(pid.read_text())
    run.send_signal(signal.SIGINT)
    rest = run.stderr.read()
    assert run.wait(timeout=PATIENCE) == 1
    assert "told to stop" in rest and ends(hanging)
    assert [row["scene"] for row in rows(out / "summary.csv")] == ["fog"]
    assert not list(tmp_path.glob("lightshaft-race-*")), "pictures were left behind"


def test_mitsuba_gets_an_llvm_library_that_it_can_work_with(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(ADAPTERS)
    import llvm_library

    def newest_of(*names):
        folder = tmp_path / "_".join(names)
        folder.mkdir()
        for name in names:
            (folder / name).touch()
        path = llvm_library.newest([str(folder)])
        return path and path.removeprefix(f"{folder}/")

    debian = ["libLLVM-14.0.6.so.1", "libLLVM-14.so.1", "libLLVM-15.so", "libLLVM-15.so.1"]
    assert newest_of(*debian) is None
    assert newest_of(*debian, "libLLVM.so.19.1") == "libLLVM.so.19.1"
    assert newest_of("libLLVM-9.so.1", "libLLVM-17.so.1") == "libLLVM-17.so.1"
    assert newest_of("libLLVM.so.22.1", "libLLVM.so.19.1", "libLLVMSPIRVLib.so.99") == "libLLVM.so.22.1"
    assert newest_of("libLLVM.so") is None
