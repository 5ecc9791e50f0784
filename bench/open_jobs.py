#!/usr/bin/env python3
"""Many jobs open at once, with workers that render: units a second beside a farm with one job, and whether every job ends.

usage: open_jobs.py [--jobs 1,65,500,5000] [--seconds 30] [--workers 2] [--to-the-end] [--page OUT.md] [ROW ...]
Rows (all of them unless told otherwise):
  one-user     all jobs are one user's; handed in before the first worker starts
  many-users   the same jobs, of 20 users in turn
  restless     as one-user; every other second a worker is killed with kill -9 or drained, and another one started
  big-worlds   jobs with a mesh of 180,000 triangles each, of which a worker keeps two; at most 65; handed in by one user
Each row has a farm of its own. A job has four tiles of 32 x 32 pixels in five rounds, 20 units; a job
that is alone has 1,280 of them. Units are counted from the first result on,
for --seconds or until all jobs have ended; with --to-the-end until all have ended. If nothing is accepted for a minute while jobs are open,
the farm stands still and the program ends with 1. Build first: lightshaft-coordinator lightshaft-worker.
tests/system/test_open_jobs.py runs short rows.
"""
import argparse
import contextlib
import dataclasses
import io
import json
import os
import pathlib
import random
import struct
import subprocess
import sys
import threading
import time
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from local_farm import SCENE, LocalFarm, wait_until  # noqa: E402

JOB = dict(size="64x64", spp=32)  # 4 tiles, rounds of 2, 2, 4, 8 and 16 samples: 20 units
ALONE = dict(JOB, size="512x512")  # the one job of a farm with one job: as many units as 64 such jobs
MOST_BIG = 65  # jobs with big worlds: their meshes are 3 MB each
STANDS_STILL = 60  # seconds without a result
SIDE = 300  # points along each side of a big world's mesh
FLAGS = ["--http-requests-per-second", "0"]


class StandsStill(AssertionError):
    pass


def mesh(number):
    """A wavy square of 2 (SIDE - 1)^2 triangles in binary PLY, another one for each number."""
    points = b"".join(struct.pack("<3f", x / SIDE - .5, y / SIDE - .5, ((x * 7 + y * 13 + number * 29) % 31) / 310)
                      for y in range(SIDE) for x in range(SIDE))
    faces = b"".join(struct.pack("<B3i", 3, a, a + 1, a + SIDE) + struct.pack("<B3i", 3, a + 1, a + SIDE + 1, a + SIDE)
                     for y in range(SIDE - 1) for a in range(y * SIDE, y * SIDE + SIDE - 1))
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {SIDE * SIDE}\nproperty float x\nproperty float y\nproperty float z\n"
              f"element face {2 * (SIDE - 1) ** 2}\nproperty list uchar int vertex_indices\nend_header\n")
    return header.encode() + points + faces


def big_world(number):
    """A scene and its mesh as a ZIP archive."""
    scene = SCENE.replace('<shape type="sphere">', '<shape type="ply"><string name="filename" value="mesh.ply"/>')
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("scene.xml", scene)
        archive.writestr("mesh.ply", mesh(number))
    return out.getvalue()


@dataclasses.dataclass
class Row:
    """What a farm with so many open jobs did."""
    name: str
    jobs: int
    units: int = 0
    seconds: float = 0
    ended: int = 0
    handed_back: int = 0  # units that workers gave back

    def rate(self):
        return self.units / self.seconds if self.seconds else 0


class Farm(LocalFarm):
    def figures(self):
        text = self.request("GET", "/metrics").decode()
        return {line.rsplit(" ", 1)[0]: float(line.rsplit(" ", 1)[1]) for line in text.splitlines() if not line.startswith("#")}

    def accepted(self):
        return int(self.figures()['lightshaft_results_total{verdict="accepted"}'])

    def ended(self, jobs):
        """How many of the jobs are done; any other end is an error."""
        listed = self.get("/api/v1/jobs?limit=1")
        failed = self.get("/api/v1/jobs?limit=1&state=failed")
        assert failed["total"] == 0, failed
        assert listed["total"] == jobs, listed["total"]
        return self.get("/api/v1/jobs?limit=1&state=done")["total"]

    def user(self, name):
        return json.loads(self.request("POST", "/api/v1/tokens", json.dumps({"role": "submit", "user": name}).encode()))["token"]

    def hand_in(self, number, job, token=None, big=False):
        body, kind = (big_world(number), "application/zip") if big else (SCENE.encode(), "application/xml")
        query = "&".join(f"{key}={value}" for key, value in dict(job, seed=number).items())
        self.request("POST", f"/api/v1/jobs?{query}", body, kind, token)


class Restless:
    """Workers come and go: each call after the first of a second kills or drains one and starts another."""

    def __init__(self, farm, seed=1):
        self.farm, self.dice, self.next = farm, random.Random(seed), 0

    def __call__(self):
        if time.monotonic() < self.next:
            return
        self.next = time.monotonic() + 2
        worker = self.dice.choice([w for w in self.farm.workers if w.alive()])
        worker.kill() if self.dice.random() < .5 else worker.terminate()
        self.farm.workers.remove(worker)
        self.farm.add_worker(fake=False)


def measure(name, jobs, seconds=None, workers=2, users=1, restless=False, big=False):
    """One farm. `seconds`: None: until all jobs have ended."""
    with contextlib.ExitStack() as stack:
        farm = stack.enter_context(Farm(flags=FLAGS))
        tokens = [farm.user(f"user-{n}") for n in range(users)] if users > 1 else [None]
        for number in range(jobs):
            farm.hand_in(number, JOB if jobs > 1 else ALONE, tokens[number % len(tokens)], big)
        farm.add_workers(workers, fake=False)
        first = wait_until(farm.accepted, "the first unit is rendered")
        begin = last_change = time.monotonic()
        seen, disturb = first, Restless(farm) if restless else lambda: None
        row = Row(name, jobs)
        while True:
            disturb()
            now, accepted = time.monotonic(), farm.accepted()
            if accepted != seen:
                seen, last_change = accepted, now
            row.units, row.seconds = accepted - first, now - begin
            row.ended = farm.ended(jobs)
            if row.ended == jobs or (seconds and row.seconds >= seconds):
                break
            if now - last_change > STANDS_STILL:
                raise StandsStill(f"{name}, {jobs} jobs: {row.ended} are done, and nothing was accepted for {STANDS_STILL} s")
            threading.Event().wait(.2)  # looking costs the farm little
        row.handed_back = int(farm.figures()['lightshaft_units_freed_total{cause="returned"}'])
        return row


def show(row, one):
    return (f"| {row.name} | {row.jobs:,} | {row.units:,} | {row.seconds:.0f} | {row.rate():.0f} | {row.rate() / one.rate():.2f} | "
            f"{row.ended:,} | {row.handed_back} |")


ROWS = {"one-user": {}, "many-users": {"users": 20}, "restless": {"restless": True}, "big-worlds": {"big": True}}
HEAD = "| row | open jobs | units | seconds | units/s | beside one job | ended | units given back |\n|---|---|---|---|---|---|---|---|"


def page(options, found, command):
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()
    loads = os.getloadavg()
    text = (ROOT / "docs/measurements/open-jobs.md").read_text().split("<!-- table -->")[0] if (ROOT / "docs/measurements/open-jobs.md").exists() else ""
    return (f"{text}<!-- table -->\n`{command}`, commit {commit}, load average {loads[2]:.0f} on {os.cpu_count()} cores at the end. "
            f"{options.workers} workers of one thread.\n\n{HEAD}\n" + "\n".join(found) + "\n")


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--jobs", default="1,65,500,5000")
    args.add_argument("--seconds", type=float, default=30)
    args.add_argument("--workers", type=int, default=2)
    args.add_argument("--to-the-end", action="store_true")
    args.add_argument("--page", type=pathlib.Path)
    args.add_argument("rows", nargs="*", metavar="ROW", help=", ".join(ROWS))
    options = args.parse_args()
    found = []
    print(HEAD, flush=True)
    for name in options.rows or ROWS:
        one = None
        for jobs in map(int, options.jobs.split(",")):
            if name == "big-worlds" and jobs > MOST_BIG:
                continue
            row = measure(name, jobs, None if options.to_the_end else options.seconds, options.workers, **ROWS[name])
            one = one or row
            found.append(show(row, one))
            print(found[-1], flush=True)
    if options.page:
        options.page.write_text(page(options, found, "bench/open_jobs.py " + " ".join(sys.argv[1:])))


if __name__ == "__main__":
    main()
