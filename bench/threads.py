#!/usr/bin/env python3
"""How rendering scales with the threads of one machine.

usage: threads.py SCENE[@WxH]... [--spp N] [--threads 1,2,4,...] [--out PAGE.md]
Renders each scene with each number of threads, and checks that the pixels are the same. Columns:
  load, 1 thread and most   seconds from the start to the first ray (`load_seconds` of the report): reading, building and learning
  N threads                 samples a second of rendering (`render_seconds`), over those of the first number of threads
Needs a machine with as many free cores as threads.
"""
import argparse
import json
import os
import pathlib
import platform
import tempfile

from techniques import lightshaft


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor()


def rendered(given, spp, threads, folder):
    """The report of a render."""
    scene, _, size = given.partition("@")
    report = folder / "report.json"
    lightshaft("render", scene, "-o", folder / "out.exr", "--report", report, "--quiet", "--spp", spp, "--threads", threads,
               *(["--size", size] if size else []))
    return json.loads(report.read_text())


def row(given, spp, counts, folder):
    reports = [rendered(given, spp, threads, folder) for threads in counts]
    assert len({report["pixels_sha256"] for report in reports}) == 1, f"{given}: the pixels depend on the number of threads"
    first, last = reports[0], reports[-1]
    ratios = " | ".join(f"{first['render_seconds'] / report['render_seconds']:.2f}" for report in reports[1:])
    width, height = first["size"]
    return f"| {pathlib.Path(given.partition('@')[0]).stem}, {width}x{height} | {first['load_seconds']:.2f} | {last['load_seconds']:.2f} | {ratios} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--threads", type=lambda text: [int(n) for n in text.split(",")], default=[1, 2, 4, 8, 16])
    parser.add_argument("--out", type=pathlib.Path)
    asked = parser.parse_args()
    counts = asked.threads
    if len(counts) < 2 or min(counts) < 1:
        parser.error("--threads: two numbers at least, each at least 1")
    names = " | ".join(f"{n} threads" for n in counts[1:])
    lines = [f"| scene | load, {counts[0]} thread{'s' if counts[0] > 1 else ''} | load, {counts[-1]} threads | {names} |", "|---" * (2 + len(counts)) + "|"]
    print("\n".join(lines))
    with tempfile.TemporaryDirectory() as folder:
        for scene in asked.scenes:
            lines.append(row(scene, asked.spp, counts, pathlib.Path(folder)))
            print(lines[-1], flush=True)
    if asked.out:
        from denoised import publish  # needs numpy and OpenEXR
        publish("How rendering scales with threads", f"{{made}}, on a machine of {os.cpu_count()} cores ({processor()}). What the columns are: see the script. "
                "The pixels are the same bits for every number of threads.", lines, asked.out)


if __name__ == "__main__":
    main()
