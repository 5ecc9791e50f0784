#!/usr/bin/env python3
"""What a farm renders of jobs with a target error that is no part of their images.

usage: wasted.py [--scenes DIR] [--seeds N] [--workers N]
DIR holds NAME.xml; without, the bench scenes are made. Renders each job of JOBS with --workers one-thread workers on this machine. Prints, for each, the core seconds
of all units over those of the image's own, and the seconds of the clock of all workers over these.
"""
import argparse
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import bench_scenes  # noqa: E402
from eta import submit  # noqa: E402
from local_farm import LocalFarm  # noqa: E402

JOBS = [("tint", "96x96", .00143), ("surface", "96x96", .000229), ("cloud", "96x96", .0018), ("tint", "256x192", .00328),
        ("surface", "256x192", .0003), ("surface", "512x384", .001)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=pathlib.Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    scenes = bench_scenes.scenes(options.scenes)
    print("| scene | size | target | seed | rendered / wanted | seconds x workers / wanted |\n|---|---|---|---|---|---|")
    with LocalFarm() as farm:
        farm.add_workers(options.workers, fake=False)
        for scene, size, target in JOBS:
            for seed in range(options.seeds):
                job = submit(farm, scenes / f"{scene}.xml", "--size", size, "--target-error", target, "--spp", 20000, "--seed", seed)
                view = farm.wait_for_job(job, patience=600)
                wanted = farm.report(job)["convergence"][-1]["core_seconds"]
                print(f"| {scene} | {size} | {target} | {seed} | {view['core_seconds'] / wanted:.2f} | "
                      f"{options.workers * view['elapsed_seconds'] / wanted:.2f} |", flush=True)


if __name__ == "__main__":
    main()
