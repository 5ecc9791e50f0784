#!/usr/bin/env python3
"""The error of many seeds, with the techniques of decisions 27 and 31 (docs/decisions) and without.

usage: seeds.py SCENE.xml[@WxH]... [--seeds N] [--first SEED] [--spp N] [--reference-spp N] [--out PAGE.md]
Renders each scene with N seeds as by default, and with `camera_points` -1, `phase_only` and `light_vertices` -1 in its integrator; the two take turns.
The true relMSE is (x - ref0)(x - ref1) / (ref^2 + 0.01) against two references by default settings and seeds of their own: free of
the references' noise in the mean. Core seconds are CPU time of the units: only their ratio means something. Efficiency is 1 / (mean
relMSE x core seconds). Needs numpy and the OpenEXR package of PyPI.
"""
import argparse
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

from efficiency import BIN, ROOT, load, relmse

PLAIN = ('<integer name="camera_points" value="-1"/><boolean name="phase_only" value="true"/>'
         '<integer name="light_vertices" value="-1"/>')


def plain(scene):
    """A copy beside the scene, whose files have relative names."""
    text, count = re.subn(r'(<integrator type="volpath[a-z]*">)', r"\1" + PLAIN, scene.read_text())
    assert count == 1, f"{scene}: no integrator with parameters to add to"
    copy = scene.with_name(f"{scene.stem}.plain.xml")
    copy.write_text(text)
    return copy


def render(scene, folder, size, spp, seed):
    out, report = folder / "out.exr", folder / "report.json"
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--float", "--report", report, "--quiet", "--spp", str(spp), "--seed", str(seed),
                    *(["--size", size] if size else [])], check=True)
    return load(out), json.loads(report.read_text())


def rows(asked, folder):
    for named in asked.scenes:
        name, _, size = named.partition("@")
        scene = pathlib.Path(name)
        references = [render(scene, folder, size, asked.reference_spp, 10**6 + i)[0] for i in (0, 1)]
        settings = {"by default": scene, "without": plain(scene)}
        errors, seconds = {s: [] for s in settings}, {s: [] for s in settings}
        for seed in range(asked.first, asked.first + asked.seeds):
            for setting, file in settings.items():
                image, told = render(file, folder, size, asked.spp, seed)
                errors[setting].append(relmse(image, *references))
                seconds[setting].append(told["core_seconds"])
        settings["without"].unlink()
        efficiency = {s: 1 / (statistics.mean(errors[s]) * statistics.mean(seconds[s])) for s in settings}
        for s in settings:
            median = statistics.median(errors[s])
            yield (f"| {scene.stem} | {s} | {statistics.mean(errors[s]):.3g} | {median:.3g} | {max(errors[s]):.3g} | {max(errors[s]) / median:.2f} "
                   f"| {sum(e > 3 * median for e in errors[s])} | {statistics.mean(seconds[s]) / statistics.mean(seconds['without']):.2f} "
                   f"| {efficiency[s] / efficiency['without']:.2f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--reference-spp", type=int, default=1024)
    parser.add_argument("--out", type=pathlib.Path)
    asked = parser.parse_args()
    head = ("| scene | settings | mean relMSE | median | largest | largest over median | seeds above 3 medians | core seconds, over without | efficiency, over without |\n"
            "|---|---|---|---|---|---|---|---|---|")
    print(head)
    lines = [head]
    with tempfile.TemporaryDirectory() as folder:
        for row in rows(asked, pathlib.Path(folder)):
            print(row, flush=True)
            lines.append(row)
    if asked.out:
        commit = subprocess.run(["git", "log", "-1", "--format=%h"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
        given = [re.sub(r".*/", "", a) if ".xml" in a else a for a in sys.argv[1:]]
        given[given.index("--out"):given.index("--out") + 2] = []
        asked.out.write_text("# The error of many seeds\n\nEach scene by default, and without what [decision 27](../decisions/0027-light-along-camera-segments.md) "
                             f"and [decision 31](../decisions/0031-connections-to-light-vertices.md) add. Made by `bench/seeds.py {' '.join(given)}`, commit {commit}; what the columns are: see the script.\n\n" + "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
