#!/usr/bin/env python3
"""Writes the page of the validation table (measurements/stability.md below the folder given) and its plots.

    lightshaft validate --json TABLE.json
    scenes/validate/stability_page.py TABLE.json docs

The page is of one whole run by one build, which it names: several tables, a table of chosen cases (--case) and one that does
not name its build are refused.
"""
import json
import math
import pathlib
import re
import sys

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 320, 70, 20, 34, 46
SERIES = ("#1f6f8b", "#c8553d", "#6a994e", "#7b5ea7", "#b8860b", "#444444")


class Plot:
    """Axes of one drawing; log: of each axis."""

    def __init__(self, title, x, y, x_range, y_range, log_x=True, log_y=True):
        self.parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="12">',
                      f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
                      f'<text x="{LEFT}" y="20" font-size="14" font-weight="bold">{title}</text>']
        self.log_x, self.log_y = log_x, log_y
        self.x_range = [self.scale(v, log_x) for v in x_range]
        self.y_range = [self.scale(v, log_y) for v in y_range]
        self.labels = 0
        self.axis(x, y)

    @staticmethod
    def scale(value, log):
        return math.log10(value) if log else value

    def x(self, value):
        lo, hi = self.x_range
        return LEFT + (self.scale(value, self.log_x) - lo) / (hi - lo) * (WIDTH - LEFT - RIGHT)

    def y(self, value):
        lo, hi = self.y_range
        share = (self.scale(value, self.log_y) - lo) / (hi - lo)
        return HEIGHT - BOTTOM - min(1, max(0, share)) * (HEIGHT - TOP - BOTTOM)

    def ticks(self, limits, log):
        lo, hi = limits
        if log:
            step = max(1, math.ceil((hi - lo) / 9))
            return [(10.0 ** k, f"1e{k}") for k in range(math.ceil(lo), math.floor(hi) + 1, step)]
        return [(lo + (hi - lo) * i / 4, f"{lo + (hi - lo) * i / 4:g}") for i in range(5)]

    def axis(self, x, y):
        bottom = HEIGHT - BOTTOM
        for value, text in self.ticks(self.x_range, self.log_x):
            p = self.x(value)
            self.parts.append(f'<path d="M{p:.1f} {TOP}V{bottom}" stroke="#e4e4e4"/><text x="{p:.1f}" y="{bottom + 16}" text-anchor="middle">{text}</text>')
        for value, text in self.ticks(self.y_range, self.log_y):
            p = self.y(value)
            self.parts.append(f'<path d="M{LEFT} {p:.1f}H{WIDTH - RIGHT}" stroke="#e4e4e4"/><text x="{LEFT - 6}" y="{p + 4:.1f}" text-anchor="end">{text}</text>')
        self.parts.append(f'<rect x="{LEFT}" y="{TOP}" width="{WIDTH - LEFT - RIGHT}" height="{bottom - TOP}" fill="none" stroke="#888"/>')
        self.parts.append(f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 10}" text-anchor="middle">{x}</text>')
        self.parts.append(f'<text transform="translate(16 {(TOP + bottom) / 2}) rotate(-90)" text-anchor="middle">{y}</text>')

    def point(self, x, y, colour, lo=None, hi=None):
        if lo is not None:
            self.parts.append(f'<path d="M{self.x(x):.1f} {self.y(lo):.1f}V{self.y(hi):.1f}" stroke="{colour}" stroke-opacity=".6"/>')
        self.parts.append(f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="3" fill="{colour}"/>')

    def line(self, points, colour, dash=""):
        path = "L".join(f"{self.x(x):.1f} {self.y(y):.1f}" for x, y in points)
        self.parts.append(f'<path d="M{path}" fill="none" stroke="{colour}" stroke-dasharray="{dash}"/>')

    def label(self, text, colour):
        x, y = WIDTH - RIGHT - 8, TOP + 16 + 15 * self.labels
        self.labels += 1
        self.parts.append(f'<text x="{x}" y="{y}" text-anchor="end" fill="{colour}">{text}</text>')

    def save(self, file):
        file.write_text("\n".join([*self.parts, "</svg>"]) + "\n")


def relative_error(case):
    return abs(case["got"] - case["expected"]) / abs(case["expected"])


def least(value, floor=1e-9):
    return max(value, floor)


def error_by_depth(cases, file):
    """Relative error and what chance makes of it (a standard error), by optical depth."""
    subjects = (("N02-emission", "light given off"), ("N67-emission", "light given off"), ("N02-sunlit", "sun, scattered once"),
                ("N02-lamplit", "lamp, scattered once"), ("N05-shadow", "shadow rays"), ("7.2-slab", "slabs"), ("N17-white", "slabs"),
                ("N03-semi-infinite", "endless media"))
    names = list(dict.fromkeys(name for _, name in subjects))
    plot = Plot("Relative error by optical depth (bars: one standard error)", "optical depth", "|got - expected| / expected", (1e-13, 1e7), (1e-9, 1e-1))
    for name in names:
        plot.label(name, SERIES[names.index(name)])
    for case in cases:
        for prefix, name in subjects:
            found = re.match(re.escape(prefix) + r".*?-(?:slab-|ramp-)?(?:a[\d.]+-(?:g-?[\d.]+-)?)?(?:tau)?([\d.]+(?:e[+-]?\d+)?)(?=[-/])", case["name"])
            if not found or not case["expected"] or float(found[1]) <= 0:
                continue
            error = case["stderr"] / abs(case["expected"])
            plot.point(float(found[1]), least(relative_error(case)), SERIES[names.index(name)], least(error), least(max(error, relative_error(case))))
    plot.line([(1e-13, 3e-3), (1e7, 3e-3)], "#888", "4 4")
    plot.save(file)


def error_by_scale(cases, file):
    plot = Plot("Relative error by the scale of lengths (extinction x length kept)", "scale of lengths", "|got - expected| / expected", (1e-9, 1e7), (1e-7, 1e-1))
    names = ("homogeneous", "grid")
    for name, colour in zip(names, SERIES):
        plot.label(name, colour)
    for case in cases:
        found = re.match(r"N04-sigma-.*-over-([\d.e+-]+)/(\w+)/", case["name"])
        if found:
            error = case["stderr"] / case["expected"]
            plot.point(float(found[1]), least(relative_error(case), 1e-7), SERIES[names.index(found[2])], least(error, 1e-7), least(error, 1e-7))
    plot.line([(1e-9, 3e-3), (1e7, 3e-3)], "#888", "4 4")
    plot.save(file)


def fluence(cases, file):
    plot = Plot("The light of a glowing ball in an endless medium of albedo c (lines: exact)", "mean free paths from its middle", "mean radiance", (.1, 100), (1e-6, 1))
    albedos = {}
    for case in cases:
        found = re.match(r"7\.6e-fluence-c([\d.]+)-r([\d.]+)/", case["name"])
        if found:
            albedos.setdefault(found[1], []).append((float(found[2]), case))
    for (c, points), colour in zip(albedos.items(), SERIES):
        plot.label(f"c = {c}", colour)
        plot.line([(r, case["expected"]) for r, case in points], colour)
        for r, case in points:
            plot.point(r, case["got"], colour)
    plot.save(file)


def all_z(cases, file):
    """Distances of statistical figures from their answers, in standard errors, against the normal law."""
    z = sorted(abs(c["got"] - c["expected"]) / c["stderr"] for c in cases if c["kind"] == "statistical" and c["stderr"] > 2e-5 * abs(c["expected"]))
    plot = Plot(f"How often a figure is further off than z standard errors ({len(z)} figures)", "z", "share of the figures", (0, 5), (1e-3, 1), log_x=False)
    plot.line([(i / 20, least(math.erfc(i / 20 / math.sqrt(2)), 1e-3)) for i in range(101)], "#888", "4 4")
    plot.label("normal law", "#888")
    for i, value in enumerate(z):
        plot.point(min(value, 5), (len(z) - i) / len(z), SERIES[0])
    plot.save(file)


def number(value):
    return "-" if value is None else f"{value:.6g}"


def band(case):
    return "exact" if case["kind"] == "exact" else f"{100 * case['band']:.3g} %"


def subject(case):
    """The row of the list, and what is asked: without the values that it is asked at."""
    return re.split(r"-(?=[a-z])", case["name"], maxsplit=1)[0]


def wide_bands(cases):
    """The cases that say why their band is wider, by subject: how many, how wide, and what the usual band would take."""
    groups = {}
    for case in cases:
        if case.get("why_band"):
            groups.setdefault((subject(case), case["why_band"], case["band"]), []).append(case)
    lines = ["### Rows with a wider band than .3 %, and why", "",
             f"{sum(map(len, groups.values()))} of {sum(c['kind'] == 'statistical' for c in cases)} statistical figures. What a narrower "
             "band takes grows with the square: the last column is what .3 % would, by the paths that were taken.", "",
             "| cases | figures | band | why | paths | at .3 % |", "|---|---|---|---|---|---|"]
    for (_, why, width), members in groups.items():
        names = [re.sub(r"/(red|green|blue)$", "", c["name"]) for c in members]
        paths = sum({name: c["paths"] for name, c in zip(names, members)}.values())
        shown = names[0] if len(set(names)) == 1 else f"{names[0]} to {names[-1]}"
        lines.append(f"| {shown} | {len(members)} | {100 * width:.3g} % | {why} | {paths:.1e} | {paths * (width / .003) ** 2:.1e} |")
    return [*lines, ""]


def page(table):
    cases = table["cases"]
    bands = sorted(case["band"] for case in cases if case["kind"] == "statistical")
    how = "lightshaft validate --quick --json TABLE.json` (without `--quick`: narrower bands and the longest cases, too)" if table["left_out"] else "lightshaft validate --json TABLE.json`"
    lines = ["# Stiff and extreme cases", "",
             f"Made by `{how} and `scenes/validate/stability_page.py TABLE.json docs`; what the verdicts mean "
             "stands in [validation](../design/validation.md).", "",
             f"One run with seed {table['seed']}, by build `{table['build']}` in numeric class `{table['numeric_class']}`.", "",
             f"**{table['passed']} of {table['passed'] + table['failed']} figures pass**, {sum(c['nonfinite'] for c in cases)} samples went wrong, "
             f"{sum(c['paths'] for c in cases):.3g} paths. "
             f"Half of the intervals had to lie within {100 * bands[len(bands) // 2]:.2g} % of the answer, the widest within {100 * bands[-1]:.2g} %.", "",
             "z is the distance from the answer in units of both what chance and what float32 (and an answer that is known to some digits) may do: "
             "sqrt(standard error^2 + allowance^2). Wrong: samples that were rejected or negative. Seconds: by the clock, of the attempt that counts, on all cores.", "",
             "![Error by depth](../images/stability-depth.svg)", "![Error by scale](../images/stability-scale.svg)",
             "![Fluence](../images/stability-fluence.svg)", "![z](../images/stability-z.svg)", ""]
    groups = {}
    for case in cases:
        groups.setdefault((subject(case), case["about"]), []).append(case)
    lines += wide_bands(cases)
    for (row, about), members in groups.items():
        lines += [f"### {row}: {about}", "", "| case | expected | got | standard error | z | band | wrong | seconds | verdict |",
                  "|---|---|---|---|---|---|---|---|---|"]
        lines += [f"| {c['name']} | {number(c['expected'])} | {number(c['got'])} | {c['stderr']:.1e} | {c['z']:.2f} | {band(c)} | "
                  f"{c['nonfinite']} | {c['seconds']:.1f} | {c['verdict']} |" for c in members]
        lines.append("")
    return "\n".join(lines[:-1]) + "\n"


# What a constant of docs/reference/constants.md does where it does most, by the case that asks for it.
MEASURED = (
    ("forced roulette: `kForcedRouletteDepth`, `kLastSurvival`", "N17-white-slab-256/homogeneous/volpath"),
    ("", "N17-white-slab-64/grid/volpath"),
    ("", "7.1-normal-to-normal-a1/homogeneous/volpath"),
    ("rays of a path: `kMaxSegments`; none is cut off by a thousand interfaces", "N42-500-plates-of-glass"),
    ("rays leave surfaces by `0x1p-20`", "N39-closed-box-0.0001"),
    ("", "N39-closed-box-1e+06"),
    ("", "N39-closed-box-shifted"),
    ("", "N42-null-interfaces"),
    ("the same, a quarter of a mean free path and more of the medium", "N03-semi-infinite-a.9-1e+06/homogeneous/volpath"),
    ("", "N03-semi-infinite-a.9-1e+06/grid/distant-mis"),
    ("rays leave shapes met in double by `0x1p-28` of a size", "N39-closed-sphere-1"),
    ("points kept from edges by `0x1p-22`; leaks of 12 million rays", "N39-leaks"),
    ("the world's middle: `kFewBits`", "N24-sphere-of-1e5-at-1e7/homogeneous/volpath"),
    ("", "N24-square-of-1e5-at-1e7/grid/distant-mis"),
    ("bounds of grids: `kInflate`", "N09-equal-values-0.1/grid/volpath"),
    ("", "N08-bound-1e+06-times-too-high/grid/volpath"),
    ("dense cells: `kExactDepth`", "N10-hot-voxel-1e+06/grid/volpath"),
    ("", "N10-hot-voxel-1e+06/grid/shadow"),
    ("dark shadow rays: `kRouletteDepth`, `kRouletteTransmittance`", "N05-shadow-ramp-8/grid/volpath"),
    ("directions along voxels: `kParallel`", "N12-axis-along-edges/grid/volpath"),
    ("", "N12-all-but-an-axis/grid/shadow"),
    ("thin stretches: `kThinDepth`", "N02-sunlit-1e-12/homogeneous/distant-mis"),
    ("thin glow: `1e-14`", "N02-emission-1e-12/grid/volpath"),
    ("least distance of lamps: `1e-7`, `1e-6` of the way", "N22-passing-a-lamp-at-0.0001/homogeneous/distant-mis"),
    ("", "N22-lamp-at-0.01-beside-0.5-of-1/homogeneous/distant-equiangular"),
    ("", "N22-lamp-at-1e+06-beside-0.5-of-1/homogeneous/distant-equiangular"),
    ("trees of lights: `kTreeFrom`, `kTableShare`", "N30-1000-lamps-of-1e-20-to-1e20"),
    ("roughness: `kSpecularAlpha` (twice of it)", "N34-ggx-alpha-0.002-peak"),
    ("", "N34-beckmann-alpha-0.002-tail"),
    ("", "N38-furnace-0.001-ggx"),
)


def measured(cases):
    """Rows of the table of docs/reference/constants.md; of what the table of cases leaves out, none."""
    found = {case["name"]: case for case in cases}
    rows, what = [], ""
    for constant, name in MEASURED:
        what = constant or what
        case = found.get(name)
        if case is None:
            continue
        off, unit = case["got"] - case["expected"], abs(case["expected"]) or 1
        error = case["stderr"] / unit
        effect = f"{off / unit:+.1e} +- {error:.1e}" if error > 1e-9 else f"{off / unit:+.1e}" if off else "0"
        rows.append(f"| {what} | {name} | {number(case['expected'])} | {number(case['got'])} | {effect} |")
        what = ""
    return rows


def update_constants(cases, file):
    begin, end = "| constant | case | answer | got | effect, relative |\n|---|---|---|---|---|\n", "\n<!-- end of what was measured -->"
    text = file.read_text()
    head, rest = text.split(begin, 1)
    file.write_text(head + begin + "\n".join(measured(cases)) + end + rest.split(end, 1)[1])


def read_table(files):
    """The one table there is, or the end of the program: rows of several runs say nothing of any one build."""
    if len(files) != 1:
        sys.exit(f"stability_page.py: the page is of one run: give one table, not {len(files)}")
    table = json.loads(pathlib.Path(files[0]).read_text())
    lacking = [key for key in ("build", "numeric_class", "seed") if key not in table]
    if lacking:
        sys.exit(f"stability_page.py: {files[0]} does not say its {', '.join(lacking)}: run `lightshaft validate --json` again")
    if table.get("only"):
        sys.exit(f"stability_page.py: {files[0]} has the cases {table['only']} alone: run the whole table")
    return table


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    table, docs = read_table(sys.argv[1:-1]), pathlib.Path(sys.argv[-1])
    for folder in ("images", "measurements"):
        (docs / folder).mkdir(parents=True, exist_ok=True)
    for draw, name in ((error_by_depth, "depth"), (error_by_scale, "scale"), (fluence, "fluence"), (all_z, "z")):
        draw(table["cases"], docs / "images" / f"stability-{name}.svg")
    (docs / "measurements" / "stability.md").write_text(page(table))
    constants = docs / "reference" / "constants.md"
    if constants.exists():
        update_constants(table["cases"], constants)


if __name__ == "__main__":
    main()
