#!/usr/bin/env python3
"""What scenes cost that learn something before the first sample: seconds, and the share of renders of 10, 60 and 600 seconds.

usage: learning.py SCENE[@WxH]... [--runs N] [--threads N] [--out PAGE.md]
Renders each scene with two samples, as it is and with all its techniques switched off, in turns. Columns:
  techniques  the techniques of the scene (`techniques` of the report); some learn nothing
  load        median seconds from the start to the first ray (`load_seconds` of the report) with them, on all threads
  learning    median of the differences to the run without them that came next, and the smallest and largest one
  10 s, ...   learning as a share of a render of so long, loading and all
What is learned depends on the scene, the depth limits and the frame's size, not on the number of samples (light_paths.h), so longer
renders learn no more. Needs a quiet machine.
"""
import argparse
import json
import pathlib
import statistics
import tempfile

from techniques import lightshaft, without

TIMES = (10, 60, 600)


def rendered(scene, size, threads, seed, folder):
    """The report of two samples."""
    report = folder / "report.json"
    lightshaft("render", scene, "-o", folder / "out.exr", "--report", report, "--quiet", "--spp", 2, "--seed", seed, "--threads", threads,
               *(["--size", size] if size else []))
    return json.loads(report.read_text())


def row(given, asked, folder):
    name, _, size = given.partition("@")
    scene = folder / "scene.xml"
    lightshaft("convert", name, scene)
    used = rendered(scene, size, asked.threads, 0, folder)["techniques"]
    plain = scene
    for technique in used:
        plain = without(plain, technique["off"])
    loads = [[rendered(file, size, asked.threads, seed, folder)["load_seconds"] for file in (scene, plain)] for seed in range(asked.runs)]
    differences = [ours - none for ours, none in loads]
    learning = statistics.median(differences)
    shares = " | ".join(f"{100 * max(0, learning) / t:.2g} %" for t in TIMES)
    return (f"| {pathlib.Path(name).stem}{', ' + size if size else ''} | {', '.join(t['name'] for t in used) or '-'} | "
            f"{statistics.median(ours for ours, _ in loads):.3f} | {learning:.3f} ({min(differences):.3f} to {max(differences):.3f}) | {shares} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--runs", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--out", type=pathlib.Path)
    asked = parser.parse_args()
    if asked.runs < 1:
        parser.error("--runs: at least one")
    lines = [f"| scene | techniques | load | learning | {' | '.join(f'{t} s' for t in TIMES)} |", "|---" * (4 + len(TIMES)) + "|"]
    print("\n".join(lines))
    for scene in asked.scenes:
        with tempfile.TemporaryDirectory() as folder:
            lines.append(row(scene, asked, pathlib.Path(folder)))
            print(lines[-1], flush=True)
    if asked.out:
        from denoised import publish  # needs numpy and OpenEXR
        publish("What learning costs", "{made}. What the columns are: see the script.", lines, asked.out)


if __name__ == "__main__":
    main()
