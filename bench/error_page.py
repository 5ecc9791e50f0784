#!/usr/bin/env python3
"""The tables of docs/measurements/error.md: how often the stated intervals of the error hold.

usage: error_page.py [--threads 2] [--share 1] [--only SCENE...] [--targets] [--jobs] [--write PAGE.md]
Prints the table of whole images of scene files, or writes it between the marks of the page; with --targets also that of jobs that stop
at a target and of denoised layers (error_targets.py), with --jobs those of small jobs and of denominators (`error_coverage 100`, 25
minutes of CPU time). Renders are kept below build/error and serve again, so that the tables are made again in seconds when an
estimator has changed, and in turns: empty that folder when the renderer or a scene has changed. --share 0.1 renders a tenth of the
images, to try. All of it takes an hour of CPU time. Needs python3-numpy, and the release build of `rendered_coverage`,
`error_coverage` and `lightshaft`; --targets also Open Image Denoise (deploy/install-denoiser.sh) and the OpenEXR package of PyPI.
"""
import argparse
import pathlib
import subprocess
import sys

import bench_scenes
import error_scenes

ROOT = bench_scenes.ROOT
BIN = ROOT / "build" / "release" / "bin"
WORK = ROOT / "build" / "error"
# Scene, side of the images in pixels, samples, first seed, images, and with how many images each is paired.
CELLS = [
    ("shafts", 64, 64, 281001, 100, 8),
    ("surface", 64, 64, 283001, 50, 16), ("surface", 256, 32, 284001, 8, 8),
    ("spotfog", 64, 64, 285001, 60, 8),
    ("fogbox", 64, 64, 286001, 30, 16), ("fogbox", 256, 16, 287001, 6, 6),
    ("tint", 64, 64, 288001, 30, 16), ("cloud", 64, 16, 289001, 20, 16),
    ("bath", 64, 64, 290001, 16, 16), ("sky_room", 64, 64, 291001, 60, 8), ("fire", 64, 64, 292001, 60, 8), ("lamps", 64, 64, 293001, 60, 8)]


def marks(table):
    return f"<!-- {table} of bench/error_page.py -->\n", f"<!-- end of {table} -->\n"


def make_scenes():
    """The path of each scene by its name."""
    folder = bench_scenes.scenes()
    error_scenes.make(WORK)
    subprocess.run([sys.executable, ROOT / "scenes" / "bath" / "make_bath.py", WORK / "bath", "--setting", "sketch"], check=True, stdout=subprocess.DEVNULL)
    own = {name: WORK / f"{name}.xml" for name in error_scenes.ALL}
    return {**{p.stem: p for p in folder.glob("*.xml")}, **own, "bath": WORK / "bath" / "bath.xml"}


def images_table(options):
    paths, lines = make_scenes(), []
    for name, side, spp, seed, images, pairs in CELLS:
        if options.only and name not in options.only:
            continue
        images = max(4, round(options.share * images))
        kept = WORK / "kept" / f"{name}-{side}-{spp}"
        numbers = side, spp, images, seed, min(pairs, images), options.threads
        out = subprocess.run([BIN / "rendered_coverage", paths[name], *map(str, numbers), kept], check=True, stdout=subprocess.PIPE, text=True).stdout
        head, rule, *rows = out.splitlines()
        new = rows if lines else [head, rule, *rows]
        print(*new, sep="\n", flush=True)
        lines += new
    return lines


def jobs_tables(options):
    """The table of small jobs, and that of denominators; whether the promises of the page hold."""
    run = subprocess.run([BIN / "error_coverage", "100", str(options.threads), "", "7001"], stdout=subprocess.PIPE, text=True)
    print(run.stdout, end="")
    jobs, mean, denominators = run.stdout.split("\n\n")
    return jobs.splitlines(), denominators.splitlines(), run.returncode == 0


def between(text, table, lines):
    begin, end = marks(table)
    head, rest = text.split(begin, 1)
    return head + begin + "\n".join(lines) + "\n" + end + rest.split(end, 1)[1]


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--threads", type=int, default=2)
    args.add_argument("--share", type=float, default=1)
    args.add_argument("--only", nargs="*")
    args.add_argument("--targets", action="store_true")
    args.add_argument("--jobs", action="store_true")
    args.add_argument("--write", type=pathlib.Path)
    options = args.parse_args()
    tables, right = {"images": images_table(options)}, True
    if options.targets:
        import error_targets  # only here, as it needs OpenEXR
        tables["targets"] = error_targets.table(make_scenes(), WORK, options.only, options.share, options.threads)
    if options.jobs:
        tables["jobs"], tables["denominators"], right = jobs_tables(options)
    if options.write:
        text = options.write.read_text()
        for table, lines in tables.items():
            text = between(text, table, lines)
        options.write.write_text(text)
    sys.exit(0 if right else 1)


if __name__ == "__main__":
    main()
