#!/usr/bin/env python3
"""The README's table of figures, from the races of one run (docs/measurements/benchmarks/races): errors and efficiency beside other programs'.

usage: measured.py [--races DIR] [--write README.md]
Prints the table, or writes it between the marks of a page. Every figure is computed from points.csv, the picture at the end of each
seed: relMSE over the seeds by its arithmetic mean, which the seeds with fireflies decide, and by its geometric mean, which hides
them; and how many times as efficient (1 / (relMSE x seconds)) we are as another program, by both means. Intervals are of 95 %, by
Student's t: of arithmetic means over the seeds' values, of geometric ones over their logarithms, of ratios over what each seed adds
to the logarithm of the ratio, since entrants share a seed's turn of the machine. tests/system/test_measured.py holds README to it.
"""
import argparse
import csv
import json
import math
import pathlib
import statistics

ROOT = pathlib.Path(__file__).resolve().parents[1]
RACES = ROOT / "docs" / "measurements" / "benchmarks" / "races"
BEGIN, END = "<!-- the table of bench/measured.py -->\n", "<!-- end of the table -->\n"
# Of Student's t, two-sided 95 %, by degrees of freedom from 1.
T = (12.7062, 4.30265, 3.18245, 2.77645, 2.57058, 2.44691, 2.36462, 2.30600, 2.26216, 2.22814, 2.20099, 2.17881, 2.16037, 2.14479,
     2.13145, 2.11991, 2.10982, 2.10092, 2.09302)
OURS, OTHERS = "Lightshaft", ("Mitsuba 3", "Cycles")


def half_width(values):
    """Of the interval of their mean."""
    return T[len(values) - 2] * statistics.stdev(values) / math.sqrt(len(values))


def arithmetic(values):
    mean, half = statistics.fmean(values), half_width(values)
    return mean, max(0., mean - half), mean + half


def geometric(values):
    logs = [math.log(v) for v in values]
    mean, half = statistics.fmean(logs), half_width(logs)
    return math.exp(mean), math.exp(mean - half), math.exp(mean + half)


def ratio_of_means(theirs, ours):
    """mean(theirs) / mean(ours), paired by seed: to first order a seed moves the logarithm by its share of either mean."""
    a, b = statistics.fmean(theirs), statistics.fmean(ours)
    half = half_width([x / a - y / b for x, y in zip(theirs, ours)])
    return a / b, a / b * math.exp(-half), a / b * math.exp(half)


def ratio_of_geometric_means(theirs, ours):
    return geometric([x / y for x, y in zip(theirs, ours)])


def read(races):
    """{scene: {entrant: {seed: (relMSE, seconds, samples)}}} at the end of each race."""
    found = {}
    with open(races / "points.csv", newline="") as file:
        for point in csv.DictReader(file):
            if point["last"] == "1":
                lane = found.setdefault(point["scene"], {}).setdefault(point["entrant"], {})
                lane[point["seed"]] = tuple(float(point[key]) for key in ("relmse", "seconds", "spp"))
    return found


def cell(figure):
    middle, low, high = figure
    return f"{middle:.3g} ({low:.3g}–{high:.3g})"


def against(lanes, program):
    """Both ratios to this program, by the one of its integrators that does best by the arithmetic mean."""
    (ours,) = [lane for name, lane in lanes.items() if name.startswith(OURS)]
    ratios = []
    for name, lane in lanes.items():
        seeds = sorted(set(lane) & set(ours))
        if name.startswith(program) and len(seeds) > 1:
            theirs_cost, ours_cost = ([of[s][0] * of[s][1] for s in seeds] for of in (lane, ours))
            ratios.append((ratio_of_means(theirs_cost, ours_cost), ratio_of_geometric_means(theirs_cost, ours_cost)))
    return " / ".join(map(cell, min(ratios))) if ratios else "-"


def table(races=RACES):
    run, report = json.loads((races / "run.json").read_text()), (races / "report.md").read_text().splitlines()
    about = next(line for line in report if line.startswith("Each entrant"))
    others = next((line for line in report if "other programs" in line.lower()), "")
    lines = [f"`{run['command']}`, commit {run['commit']}. {about} {others}".rstrip(), "",
             "| scene | relMSE, arithmetic mean | relMSE, geometric mean | " +
             " | ".join(f"efficiency over that of {name}, arithmetic / geometric" for name in OTHERS) + " |",
             "|---" * (3 + len(OTHERS)) + "|"]
    for scene, lanes in sorted(read(races).items()):
        (ours,) = [[point[0] for point in lane.values()] for name, lane in lanes.items() if name.startswith(OURS)]
        lines.append(f"| {scene} | {cell(arithmetic(ours))} | {cell(geometric(ours))} | " + " | ".join(against(lanes, program) for program in OTHERS) + " |")
    return "\n".join(lines) + "\n"


def between(text):
    """What stands between the marks."""
    return text.split(BEGIN, 1)[1].split(END, 1)[0]


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--races", type=pathlib.Path, default=RACES)
    args.add_argument("--write", type=pathlib.Path)
    options = args.parse_args()
    made = table(options.races)
    if options.write is None:
        print(made, end="")
        return
    head, rest = options.write.read_text().split(BEGIN, 1)
    options.write.write_text(head + BEGIN + made + END + rest.split(END, 1)[1])


if __name__ == "__main__":
    main()
