#!/usr/bin/env python3
"""Measures how long a coordinator takes to accept scenes: a small one, a large one, and small ones beside four large ones of another user.

    bench/submissions.py                        of the release build
    LIGHTSHAFT_BIN=FOLDER bench/submissions.py  of other programs

Prints milliseconds by the clock: median, mean and maximum. The machine should be idle.
"""
import pathlib
import statistics
import sys
import threading
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from local_farm import SCENE, LocalFarm  # noqa: E402

SMALL = SCENE.encode()
BALL = '<shape type="sphere"><transform name="to_world"><translate x="1"/></transform></shape>\n'
LARGE = SCENE.replace("</scene>", BALL * (8_000_000 // len(BALL)) + "</scene>").encode()


def submit(farm, scene, token):
    """Milliseconds from the request to the job's id."""
    began = time.perf_counter()
    farm.request("POST", "/api/v1/jobs?spp=2", scene, "application/xml", token)
    return 1e3 * (time.perf_counter() - began)


def line(what, times):
    return f"{what}: {len(times)} submissions, median {statistics.median(times):.1f} ms, mean {statistics.mean(times):.1f} ms, maximum {max(times):.1f} ms"


def main():
    with LocalFarm() as farm:
        bob, mallory = farm.token_of("bob"), farm.token_of("mallory")
        print(line(f"{len(SMALL)} bytes", [submit(farm, SMALL, bob) for _ in range(200)]))
        print(line(f"{len(LARGE)} bytes", [submit(farm, LARGE, mallory) for _ in range(3)]))
        large = [threading.Thread(target=submit, args=(farm, LARGE, mallory)) for _ in range(4)]
        for thread in large:
            thread.start()
        beside = []
        while any(thread.is_alive() for thread in large):
            beside.append(submit(farm, SMALL, bob))
        print(line(f"{len(SMALL)} bytes, beside four of {len(LARGE)} bytes of another user", beside))


if __name__ == "__main__":
    main()
