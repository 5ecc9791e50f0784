"""The chaos suite: every storm of storms.py, again and again, with an image-hash check after each.

    tests/chaos/chaos.py [--seed S] [--repetitions N] [--only TEXT] [--write docs/measurements/chaos.md]

Ends with 1 if any image was another one, or a storm broke what it must not. A storm that cannot be made here says why.
"""

import argparse
import functools
import json
import os
import statistics
import subprocess
import sys
import time
import traceback

from chaos_kit import DELAY, FOG, SPEC, Asked, Storm
from local_farm import bin_dir
from storms import STORMS
from weather import Skip


def try_once(name, seed):
    with Storm(seed) as storm, STORMS[name](storm) as farm:
        return farm.finish()


@functools.cache
def expected_pixels(asked):
    """Of one fake worker that nothing happens to; where pixels are real, those of `lightshaft render`."""
    with Storm(0) as storm:
        if asked.real:
            return rendered_alone(storm.folder, asked.size)
        with storm.farm() as farm:
            farm.fast_worker()
            farm.submit_storm(size=asked.size)
            return farm.finish()[0]


def rendered_alone(folder, size):
    scene, report = folder / "fog.xml", folder / "report.json"
    scene.write_text(FOG)
    subprocess.run([str(part) for part in (bin_dir() / "lightshaft", "render", scene, "--spp", SPEC["spp"], "--seed", SPEC["seed"], "--size", size,
                                           "--report", report, "-o", folder / "fog.exr", "--quiet")], check=True, capture_output=True)
    return json.loads(report.read_text())["pixels_sha256"]


@functools.cache
def calm_seconds(asked):
    """Of three workers that nothing happens to, the middle one of three tries."""
    def once():
        with Storm(0, real=asked.real) as storm, storm.farm() as farm:
            farm.fast_workers(3)
            farm.wait_for_workers(3)
            farm.submit_storm(size=asked.size)
            return farm.finish()[2]
    return statistics.median(once() for _ in range(3))


def tries(name, seed, repetitions):
    """(tries that were right, [units rendered again at most], [seconds lost]), or a Skip."""
    right, again, lost = 0, [], []
    for k in range(repetitions):
        try:
            pixels, units, took, asked = try_once(name, f"{seed} {name} {k}")
        except Skip:
            raise
        except Exception:
            print(f"BROKEN: {name}, seed {seed}, repetition {k}", file=sys.stderr)
            traceback.print_exc()
            continue
        right += pixels == expected_pixels(asked)
        again.append(units)
        lost.append(max(0, took - calm_seconds(asked)))
    return right, again, lost


def line(name, right, count, again, lost):
    def both(values, form):
        return f"{form.format(statistics.median(values))} ({form.format(max(values))})" if values else "-"
    return f"| {name} | {count} | {right} | {both(again, '{:.0f}')} | {both(lost, '{:.1f}')} |"


PAGE = """# Storms

> Shown with fake workers (the real worker program, whose renderer makes pixels up) and one job at a time, except the storms "with real pixels". Workers that render, and many jobs open at once: [open-jobs.md](open-jobs.md).

`/usr/bin/python3 tests/chaos/chaos.py --seed {seed} --repetitions {repetitions} --write docs/measurements/chaos.md` wrote this page, commit {commit}, in {minutes:.0f} minutes on {cores} cores, with other work on the machine. Each storm has a farm of its own (coordinator and workers as processes, real sockets, disks and databases) and ends with the
same question: are the pixels those of one worker that nothing happened to? Workers are fake: their pixels are a pure function of the unit, so a unit that is lost, counted twice, swapped or folded out of order shows. In the storms "with real pixels" workers render fog, and the pixels must be those of `lightshaft render`. The job has {units} units of {delay} ms (1920 in the storm with audits of 1 %). What is random (who is killed, when, which bytes) follows from the seed.

*Units again, at most*: units that workers had in hand when they were lost, too slow or failed, and second results of a unit; not all of the former had been begun; after a takeover also what the dead owner had done. *Seconds lost*: beyond the {calm:.1f} s that three workers take for the job when nothing happens; what the storm itself lasts (a cut of 2 to 6 s, a coordinator frozen for 3 s, one worker instead of three) is in it. Median, and the worst in brackets.

| storm | repetitions | hash equal | units again, at most | seconds lost |
|---|---|---|---|---|
{table}

"Killed at STEP": the process kills itself with SIGKILL when it comes to that step of a unit's life for the n-th time, n random (`core/base/failpoint.h`). Workers behind bad networks are in a network namespace, and every packet of theirs passes through `tests/chaos/weather.py`; full disks are small file systems; the wall clock is libfaketime's.
A lease that is cut in its middle may still read as a shorter one: its other units wait for its deadline, ten seconds at least. A takeover takes some six seconds ([decisions/0024](../decisions/0024-several-coordinators.md)). "Older": Redis is killed and started with what it had saved before, as a replica that was behind.
{skipped}"""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--only", default="")
    parser.add_argument("--write")
    arguments = parser.parse_args()

    began = time.monotonic()
    rows, skipped, wrong = [], [], 0
    for name in STORMS:
        if arguments.only not in name:
            continue
        try:
            right, again, lost = tries(name, arguments.seed, arguments.repetitions)
        except Skip as why:
            skipped.append(f"- {name}: {why}")
            print(f"left out: {name}: {why}", flush=True)
            continue
        wrong += arguments.repetitions - right
        rows.append(line(name, right, arguments.repetitions, again, lost))
        print(rows[-1], flush=True)
    print(f"{len(rows)} storms, {wrong} tries went wrong, {len(skipped)} storms left out, {time.monotonic() - began:.0f} s")
    if arguments.write and not arguments.only:
        left_out = "\nLeft out, because they could not be made on that machine:\n\n" + "\n".join(skipped) + "\n" if skipped else ""
        commit = subprocess.run(["git", "rev-parse", "--short=8", "HEAD"], cwd=os.path.dirname(__file__), capture_output=True, text=True, check=True)
        with open(arguments.write, "w", encoding="utf-8") as out:
            out.write(PAGE.format(commit=commit.stdout.strip(), seed=arguments.seed, repetitions=arguments.repetitions, cores=os.cpu_count(),
                                  minutes=(time.monotonic() - began) / 60, units=48 * 5, delay=DELAY, calm=calm_seconds(Asked()), table="\n".join(rows), skipped=left_out))
    return 1 if wrong else 0


if __name__ == "__main__":
    assert SPEC["spp"] == 24  # five rounds of 48 tiles: what the page says
    sys.exit(main())
