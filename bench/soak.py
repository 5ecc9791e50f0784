"""Half an hour (or --minutes) of one coordinator and three workers under jobs that come, are looked at, paused, cancelled, finished
and removed, workers that are killed and come back, and event streams that open and close: nothing of memory, open files and
threads may grow.

    bench/soak.py [--minutes 30] [--seed 1] [--real] [--json OUT]

Every figure is read from /proc every five seconds while the farm works. After the first third, in which caches fill, the medians of
the second and of the last third are compared: files and threads may differ by 2, memory by 3 % (allocators keep some holes), each.
Workers of this soak are not among those killed. Every finished job's pixels are compared. Ends with 1 if something has grown.
"""

import argparse
import json
import pathlib
import random
import statistics
import sys
import threading
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from local_farm import SCENE, HttpError, LocalFarm, wait_until  # noqa: E402
from processes import family  # noqa: E402


def figures(pid):
    """Of a process and its children: resident bytes, open files, threads."""
    total = {"memory": 0, "files": 0, "threads": 0}
    for one in family(pid):
        status = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{one}/status").read_text().splitlines() if ":" in line)
        total["memory"] += int(status["VmRSS"].split()[0]) * 1024
        total["threads"] += int(status["Threads"])
        total["files"] += sum(1 for _ in pathlib.Path(f"/proc/{one}/fd").iterdir())
    return total


class Sampler(threading.Thread):
    def __init__(self, processes):
        super().__init__(daemon=True)
        self.processes, self.samples, self.ended = processes, {p.name: [] for p in processes}, threading.Event()

    def run(self):
        while not self.ended.wait(5):
            for process in self.processes:
                try:
                    self.samples[process.name].append(figures(process.popen.pid))
                except (OSError, KeyError):
                    pass  # a child that ended while it was looked at


def watch(farm, job):
    """Opens an event stream, reads its beginning, and leaves."""
    request = urllib.request.Request(f"http://127.0.0.1:{farm.http}/api/v1/jobs/{job}/events", headers={"Authorization": f"Bearer {farm.token}"})
    with urllib.request.urlopen(request, timeout=60) as stream:
        stream.readline()


def one_turn(farm, dice, expected, real):
    seed = dice.randrange(4)
    job = farm.submit(SCENE, spp=24, seed=seed, size="128x96" if real else "256x192")
    watch(farm, job)
    for path in ("", "/tiles", "/log", "/image.png", "/report", "/convergence.csv"):
        farm.request("GET", f"/api/v1/jobs/{job}{path}")
    fate = dice.random()
    if fate < .2:
        farm.request("PATCH", f"/api/v1/jobs/{job}", b'{"state": "cancelled"}')
    elif fate < .4:
        for state in ("paused", "running"):
            try:
                farm.request("PATCH", f"/api/v1/jobs/{job}", json.dumps({"state": state}).encode())
            except HttpError:
                pass  # it has ended meanwhile
    if farm.wait_for_job(job, states=("done", "cancelled"))["state"] == "done":
        pixels = farm.pixels(job)
        assert expected.setdefault(seed, pixels) == pixels, f"seed {seed} has other pixels than before"
    farm.request("DELETE", f"/api/v1/jobs/{job}")


def growth(samples):
    """{figure: (median of the second third, of the last)}"""
    third = len(samples) // 3
    return {key: tuple(statistics.median(s[key] for s in part) for part in (samples[third:2 * third], samples[2 * third:])) for key in samples[0]}


def has_grown(key, before, after):
    return after > before * 1.03 if key == "memory" else after > before + 2


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--real", action="store_true", help="with the renderer instead of the fake one")
    parser.add_argument("--json")
    arguments = parser.parse_args()
    dice, expected, turns, kills = random.Random(arguments.seed), {}, 0, 0
    flags = [] if arguments.real else ["--fake-delay", 4]
    with LocalFarm() as farm:
        steady = farm.add_workers(2, *flags, fake=not arguments.real)
        mortal = farm.add_worker(*flags, fake=not arguments.real)
        farm.wait_for_workers(3)
        sampler = Sampler([farm.coordinator, *steady])
        sampler.start()
        end = time.monotonic() + 60 * arguments.minutes
        while time.monotonic() < end:
            one_turn(farm, dice, expected, arguments.real)
            turns += 1
            if turns % 20 == 0:
                mortal.kill()
                farm.workers.remove(mortal)
                mortal.start()  # the same name and cache
                farm.workers.append(mortal)
                kills += 1
        sampler.ended.set()
        sampler.join()
        assert all(p.alive() for p in sampler.processes)
        wait_until(lambda: farm.get("/api/v1/jobs")["jobs"] == [], "no job is left")
    grown, rows = [], {}
    print(f"{turns} jobs, a worker killed {kills} times, {len(expected)} images, each the same every time")
    print("| process | figure | second third | last third |\n|---|---|---|---|")
    for name, samples in sampler.samples.items():
        assert len(samples) >= 9, "too short to say anything"
        rows[name] = growth(samples)
        for key, (before, after) in rows[name].items():
            scale = 2**20 if key == "memory" else 1
            print(f"| {name} | {key}{' (MiB)' if key == 'memory' else ''} | {before / scale:.1f} | {after / scale:.1f} |")
            if has_grown(key, before, after):
                grown.append(f"{name}: {key}")
    if arguments.json:
        pathlib.Path(arguments.json).write_text(json.dumps({"jobs": turns, "kills": kills, "minutes": arguments.minutes, "figures": rows}))
    print("grown: " + ", ".join(grown) if grown else "nothing has grown")
    return 1 if grown else 0


if __name__ == "__main__":
    sys.exit(main())
