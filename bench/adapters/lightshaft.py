#!/usr/bin/env python3
"""Adapter of race.py for another build of Lightshaft: one picture, and what it cost after loading.

usage: lightshaft.py SCENE IMAGE.exr TIMES.json --spp N --seed N --threads N --size WxH
Runs the `lightshaft` that PATH finds first.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("scene")
    args.add_argument("image")
    args.add_argument("times", type=pathlib.Path)
    for option in ("--spp", "--seed", "--threads", "--size"):
        args.add_argument(option, required=True)
    options = args.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        report = pathlib.Path(folder) / "report.json"
        done = subprocess.run(["lightshaft", "render", options.scene, "-o", options.image, "--float", "--quiet", "--report", report, "--spp", options.spp,
                               "--seed", options.seed, "--threads", options.threads, "--size", options.size])
        if done.returncode:
            return done.returncode
        told = json.loads(report.read_text())
    options.times.write_text(json.dumps({"seconds": told["render_seconds"], "cpu_seconds": told["core_seconds"]}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
