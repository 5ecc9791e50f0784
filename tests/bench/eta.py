#!/usr/bin/env python3
"""The time left that a farm tells against the time that was left.

usage: eta.py --scenes DIR [--names a,b,c] [--size WxH] [--samples N] [--seeds N] [--workers N]
DIR holds NAME.xml. Each scene is rendered to the error of --samples samples a pixel (of seed 1000), once for each seed, by a farm of
--workers one-thread workers on this machine, which needs as many cores and nothing else that runs. What the job's JSON says of the
time left when it has a new checkpoint (`eta_seconds`, with `eta_ci95` if it has one) is held against its end. Prints a line per
scene; exits with 1 if less than 90 % of the intervals hold the actual time, or there are fewer than 30.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from forecasts import NAMES, render  # noqa: E402
from local_farm import LocalFarm, bin_dir  # noqa: E402

LEAST, SHARE = 30, .9


def views(farm, job):
    """The job's JSON at each of its events, with the time at which it came."""
    request = urllib.request.Request(f"{farm.url()}/api/v1/jobs/{job}/events?last_event_id=0", headers={"Authorization": f"Bearer {farm.token}"})
    with urllib.request.urlopen(request, timeout=600) as stream:
        for line in stream:
            if line.startswith(b"data:"):
                view = json.loads(line[5:])
                if view.get("id") == job:
                    yield time.monotonic(), view


def told(farm, job):
    """[(time, eta, its interval)] at each new checkpoint, and the time of its end."""
    seen, relmse = [], None
    for now, view in views(farm, job):
        if view["state"] == "done":
            return seen, now
        if view["relmse"] not in (None, relmse) and view["eta_seconds"] is not None:
            relmse = view["relmse"]
            seen.append((now, view["eta_seconds"], view["eta_ci95"]))
    raise SystemExit(f"the events of job {job} ended before it was done")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=pathlib.Path, required=True)
    parser.add_argument("--names", default=NAMES)
    parser.add_argument("--size", default="96x96")
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--threads", type=int, default=2, help="of the first render, which finds the target")
    options = parser.parse_args()
    within = every = 0
    print("| scene | target relMSE | seconds a job | intervals | within | median actual / told |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name, LocalFarm() as farm:
        farm.add_workers(options.workers, fake=False)
        environment = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
        for scene in options.names.split(","):
            path = options.scenes / f"{scene}.xml"
            target = render(path, pathlib.Path(name), options, "--spp", options.samples, "--seed", 1000)["relmse"]
            ratios, held, count, seconds = [], 0, 0, 0
            for seed in range(options.seeds):
                began = time.monotonic()
                job = subprocess.run([bin_dir() / "lightshaft", "submit", path, "--size", options.size, "--target-error", str(target), "--spp",
                                      str(64 * options.samples), "--seed", str(seed)], env=environment, check=True, capture_output=True,
                                     text=True).stdout.split()[0]
                points, end = told(farm, job)
                seconds += (end - began) / options.seeds
                for now, eta, interval in points:
                    ratios.append((end - now) / eta if eta else 1)
                    if interval:
                        count += 1
                        held += interval[0] <= end - now <= interval[1]
            every, within = every + count, within + held
            print(f"| {scene} | {target:.3g} | {seconds:.0f} | {count} | {held} | {sorted(ratios)[len(ratios) // 2]:.2f} |", flush=True)
    print(f"\n{within} of {every} intervals held, {100 * within / max(1, every):.0f} %")
    return 0 if every >= LEAST and within >= SHARE * every else 1


if __name__ == "__main__":
    sys.exit(main())
