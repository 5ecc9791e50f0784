#!/usr/bin/env python3
"""The time left that a farm tells against the time that was left.

usage: eta.py [--scenes DIR] [--names a,b,c] [--size WxH] [--samples N] [--seeds N] [--workers N]
       eta.py --more [--seeds N]
DIR holds NAME.xml; without, the bench scenes are made. Each scene is rendered to the error of --samples samples a pixel (of seed 1000), once for each seed, by a farm of
--workers one-thread workers on this machine, which needs as many cores and nothing else that runs. What the job's JSON says of the
time left when it has a new checkpoint (`eta_seconds`, with `eta_ci95` if it has one) is held against its end. Prints a line per
scene. With --more a worker whose renderer only sleeps (--fake) begins a job, and at one of its checkpoints eight more like it join:
what was told for these (`eta_with_8_more_ci95`) is held against the end. Exits with 1 if less than 90 % of the intervals hold the actual time, or there are fewer than 30.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import bench_scenes  # noqa: E402
from forecasts import NAMES, render  # noqa: E402
from local_farm import SCENE, LocalFarm, bin_dir  # noqa: E402

LEAST, SHARE = 30, .9
# Of --more: units of 64 samples take .4 s, and all of them 120 s of one worker. Such farms sleep: some fit on one machine.
MORE_SIZE, MORE_TARGET, MORE_SAMPLE_SECONDS, MORE_CHECKPOINTS, MORE_AT_ONCE = "256x192", .0003, 6e-6, (1, 2, 3, 4, 6, 8), 3


def views(farm, job):
    """The job's JSON at each of its events, with the time at which it came."""
    request = urllib.request.Request(f"{farm.url()}/api/v1/jobs/{job}/events?last_event_id=0", headers={"Authorization": f"Bearer {farm.token}"})
    with urllib.request.urlopen(request, timeout=600) as stream:
        for line in stream:
            if line.startswith(b"data:"):
                view = json.loads(line[5:])
                if view.get("id") == job:
                    if view["state"] in ("failed", "cancelled"):
                        raise SystemExit(f"job {job} is {view['state']}: {view['error']}")
                    yield time.monotonic(), view
    raise SystemExit(f"the events of job {job} ended before it was done")


def checkpoints(farm, job, figure):
    """The time and the job's JSON at each new checkpoint whose view has this figure, and at its end."""
    relmse = None
    for now, view in views(farm, job):
        fresh = view["relmse"] not in (None, relmse) and view[figure] is not None
        if fresh:
            relmse = view["relmse"]
        if fresh or view["state"] == "done":
            yield now, view
        if view["state"] == "done":
            return


def submit(farm, scene, *flags):
    environment = {**os.environ, "LIGHTSHAFT_URL": f"{farm.url()}/", "LIGHTSHAFT_TOKEN": farm.token}
    return subprocess.run([bin_dir() / "lightshaft", "submit", scene, *map(str, flags)], env=environment, check=True, capture_output=True,
                          text=True).stdout.split()[0]


def told(farm, job):
    """[(time, eta, its interval)] at each new checkpoint, and the time of its end."""
    *seen, (end, _) = checkpoints(farm, job, "eta_seconds")
    return [(now, view["eta_seconds"], view["eta_ci95"]) for now, view in seen], end


def told_for_more(scene, checkpoint, seed):
    """What was told for eight more workers at this checkpoint, its interval, and what they took from there."""
    sleeps = ("--fake-sample-seconds", MORE_SAMPLE_SECONDS)
    with LocalFarm() as farm:
        farm.add_worker(*map(str, sleeps))
        job = submit(farm, scene, "--size", MORE_SIZE, "--target-error", MORE_TARGET, "--spp", 20000, "--seed", seed)
        told_at, view_told = None, None
        for number, (now, view) in enumerate(checkpoints(farm, job, "eta_with_8_more_ci95"), 1):
            if view["state"] == "done":
                assert told_at, f"the job was done before checkpoint {checkpoint}"
                return view_told["eta_with_8_more"], view_told["eta_with_8_more_ci95"], now - told_at
            if number == checkpoint:
                view_told = view
                farm.add_workers(8, *map(str, sleeps))
                farm.wait_for_workers(9)
                told_at = time.monotonic()  # the start of processes is none of what is told


def scenes(options):
    folder = bench_scenes.scenes(options.scenes)
    within = every = 0
    print("| scene | target relMSE | seconds a job | intervals | within | median actual / told |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name, LocalFarm() as farm:
        farm.add_workers(options.workers, fake=False)
        for scene in options.names.split(","):
            path = folder / f"{scene}.xml"
            target = render(path, pathlib.Path(name), options, "--spp", options.samples, "--seed", 1000)["relmse"]
            ratios, held, count, seconds = [], 0, 0, 0
            for seed in range(options.seeds):
                began = time.monotonic()
                job = submit(farm, path, "--size", options.size, "--target-error", target, "--spp", 64 * options.samples, "--seed", seed)
                points, end = told(farm, job)
                seconds += (end - began) / options.seeds
                for now, eta, interval in points:
                    ratios.append((end - now) / eta if eta else 1)
                    if interval:
                        count += 1
                        held += interval[0] <= end - now <= interval[1]
            every, within = every + count, within + held
            print(f"| {scene} | {target:.3g} | {seconds:.0f} | {count} | {held} | {sorted(ratios)[len(ratios) // 2]:.2f} |", flush=True)
    return within, every


def more(seeds):
    print("| seed | checkpoint | seconds told | taken |\n|---|---|---|---|")
    within, ratios = 0, []
    with tempfile.TemporaryDirectory() as name, concurrent.futures.ThreadPoolExecutor(MORE_AT_ONCE) as pool:
        scene = pathlib.Path(name) / "scene.xml"
        scene.write_text(SCENE)
        asked = [(seed, checkpoint) for seed in range(seeds) for checkpoint in MORE_CHECKPOINTS]
        answers = pool.map(lambda one: told_for_more(scene, one[1], one[0]), asked)
        for (seed, checkpoint), (eta, interval, actual) in zip(asked, answers):
            within += interval[0] <= actual <= interval[1]
            ratios.append(actual / eta)
            print(f"| {seed} | {checkpoint} | {eta:.1f} ({interval[0]:.1f} to {interval[1]:.1f}) | {actual:.1f} |", flush=True)
    return within, len(ratios), sorted(ratios)[len(ratios) // 2]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=pathlib.Path)
    parser.add_argument("--more", action="store_true")
    parser.add_argument("--names", default=NAMES)
    parser.add_argument("--size", default="96x96")
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--threads", type=int, default=2, help="of the first render, which finds the target")
    options = parser.parse_args()
    if options.more:
        within, every, ratio = more(options.seeds)
        print(f"median actual / told {ratio:.2f}")
    else:
        within, every = scenes(options)
    print(f"\n{within} of {every} intervals held, {100 * within / max(1, every):.0f} %")
    return 0 if every >= LEAST and within >= SHARE * every else 1


if __name__ == "__main__":
    sys.exit(main())
