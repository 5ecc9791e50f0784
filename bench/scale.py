#!/usr/bin/env python3
"""What a coordinator can carry: units per second, CPU per unit, latencies and memory with 10 to 2,000 workers, memory of an UHD
film, and the time of a restart with a million units.

usage: scale.py [--json OUT] [growth|peak|film|saturated|restart ...]      all of them unless told otherwise
Workers are streams of one process (scale_load), which hands in partials of 32 x 32 pixels, 25 KB each, in the time that units
shall take; the coordinator is the real one on a disk. Build first: lightshaft-coordinator lightshaft-worker scale_load.
A bench, not a test.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from local_farm import SCENE, LocalFarm, bin_dir  # noqa: E402

RATE = 500  # units a second of the growth curve, whatever the number of workers


def cpu_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory(pid):
    """Resident bytes: now, and at most so far."""
    lines = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines() if ":" in line)
    return [int(lines[key].split()[0]) * 1024 for key in ("VmRSS", "VmHWM")]


def drive(farm, workers, seconds=15, unit_ms=0, units=None, warm_up=None):
    """Loads the farm; what scale_load measured, and what the coordinator spent meanwhile."""
    pid = farm.coordinator.popen.pid
    args = [bin_dir() / "scale_load", "--coordinator", f"127.0.0.1:{farm.grpc}", "--workers", str(workers), "--seconds", str(seconds),
            "--warm-up", str(3 + workers / 200 if warm_up is None else warm_up), "--unit-ms", str(unit_ms)]
    args += ["--units", str(units)] if units else []
    load = subprocess.Popen(args, stdout=subprocess.PIPE, text=True, env=dict(os.environ, LIGHTSHAFT_JOIN_TOKEN=farm.join_token))
    assert load.stdout.readline() == "begin\n", "the load did not begin"
    accepted = lambda: sum(job["units_done"] for job in farm.get("/api/v1/jobs")["jobs"])  # noqa: E731
    before, done = cpu_seconds(pid), accepted()
    measured = json.loads(load.stdout.readline())
    measured["coordinator_cpu"] = cpu_seconds(pid) - before
    measured["accepted"] = accepted() - done  # each once, unlike what was acknowledged: copies of slow units come twice
    measured["resident"], measured["peak"] = memory(pid)
    load.wait()
    measured["workers"] = workers
    measured["rate"] = measured["accepted"] / measured["seconds"]
    measured["cpu_per_unit"] = measured["coordinator_cpu"] / max(1, measured["accepted"])
    return measured


def row(m):
    ms = {key: [1000 * m[key][q] for q in ("p50", "p99")] for key in ("ack", "dispatch", "gap")}
    print(f"{m['workers']:6} workers  {m['rate']:7.0f} units/s  {1e6 * m['cpu_per_unit']:6.0f} us of CPU a unit  "
          f"durable {ms['ack'][0]:6.1f} / {ms['ack'][1]:6.1f} ms  "
          f"dispatch {ms['dispatch'][0]:6.1f} / {ms['dispatch'][1]:6.1f} ms  "
          f"gap {ms['gap'][0]:5.1f} / {ms['gap'][1]:6.1f} ms  {m['resident'] / 2**20:6.0f} MiB  load {os.getloadavg()[0]:.1f}", flush=True)


def scene(width, height):
    text = SCENE.replace('name="width" value="96"', f'name="width" value="{width}"')
    return text.replace('name="height" value="64"', f'name="height" value="{height}"')


def growth():
    """One farm and job for each number of workers, at the same rate of units."""
    found = []
    for workers in (10, 30, 100, 300, 1000, 2000):
        with LocalFarm() as farm:
            farm.submit(scene(1920, 1080), spp=60000)
            found.append(drive(farm, workers, unit_ms=1000 * workers / RATE))
            row(found[-1])
    return found


def peak():
    """As many units as the machine carries: workers that need no time."""
    found = []
    for workers in (10, 100, 1000):
        with LocalFarm() as farm:
            farm.submit(scene(1920, 1080), spp=60000)
            found.append(drive(farm, workers))
            row(found[-1])
    return found


def film():
    """An UHD film: the coordinator's memory after as many results as make one to forty rounds of all tiles."""
    with LocalFarm() as farm:
        pid = farm.coordinator.popen.pid
        empty = memory(pid)[0]
        job = farm.submit(scene(3840, 2160), spp=60000)
        found = {"empty": empty}
        for rounds in (1, 5, 10, 20, 40):
            tiles = 120 * 68
            while (done := farm.job(job)["units_done"]) < rounds * tiles:  # some come twice, some are lost with their workers
                drive(farm, 50, seconds=60, units=rounds * tiles - done + 500, warm_up=0)
            found[rounds] = memory(pid)
            print(f"UHD, {rounds} rounds: {found[rounds][0] / 2**20:.0f} MiB, at most {found[rounds][1] / 2**20:.0f}; empty {empty / 2**20:.0f} MiB", flush=True)
        return found


def saturated():
    """An UHD film and workers that need no time: what memory is at most while results come faster than they are folded."""
    found = []
    for workers in (10, 100, 1000):
        with LocalFarm() as farm:
            farm.submit(scene(3840, 2160), spp=60000)
            found.append(drive(farm, workers, seconds=30))
            row(found[-1])
            print(f"UHD, {workers} workers without rest: {found[-1]['peak'] / 2**20:.0f} MiB at most", flush=True)
    return found


def restart():
    """A million units, of strips of 32 pixels so that they fit on a disk, then kill -9 and a new start."""
    with LocalFarm() as farm:
        job = farm.submit(scene(1, 32768), spp=977 * 64)
        while (before := farm.job(job)["units_done"]) < 1_000_000:
            made = drive(farm, 100, seconds=120, units=1_000_500 - before, warm_up=0)
        resident = memory(farm.coordinator.popen.pid)[0]
        found = {"units": before, "rate": made["rate"], "cpu_per_unit": made["cpu_per_unit"], "resident": resident, "starts": []}
        for _ in range(3):
            begin = time.monotonic()
            farm.restart_coordinator()
            took = time.monotonic() - begin
            pid = farm.coordinator.popen.pid
            found["starts"].append({"seconds": took, "cpu_seconds": cpu_seconds(pid), "resident": memory(pid)[0]})
            after = farm.job(job)["units_done"]
            assert after >= before, (before, after)
            print(f"restart with {after} units: {took:.2f} s, {found['starts'][-1]['cpu_seconds']:.2f} s of CPU, "
                  f"{found['starts'][-1]['resident'] / 2**20:.0f} MiB, load {os.getloadavg()[0]:.1f}", flush=True)
        return found


def main():
    parts = {"growth": growth, "peak": peak, "film": film, "saturated": saturated, "restart": restart}
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--json", type=pathlib.Path)
    args.add_argument("parts", nargs="*", help=", ".join(parts))
    options = args.parse_args()
    found = {name: parts[name]() for name in options.parts or parts}
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
