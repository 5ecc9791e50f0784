"""The files with the results of races: tables for programs (CSV), a page for people (HTML), the same in Markdown, and a plot for each scene."""

import html
import math
import os
import pathlib
import re
from collections.abc import Sequence
from typing import Any, NamedTuple

from lightshaft_command.files import write_file
from lightshaft_command.race.forecasts import Prediction, predictions_of
from lightshaft_command.race.model import Race, Results
from lightshaft_command.race.numbers import ABSENT, figure, given, sample_count
from lightshaft_command.race.summary import Estimate, curve_of, rows_of
from lightshaft_command.race.tool import Tool

TITLE = "Error against time"
IDLE_SHARE = 0.05  # the background activity of an otherwise idle system takes at most this share of all cores' time
HEAVY_SPREAD = 4
CSS = """
:root { color-scheme: light dark; --ink: #1c2024; --quiet: #5f6a74; --line: #d5dbe0; --paper: #fff; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6eaee; --quiet: #9aa6b1; --line: #39424a; --paper: #14181c; } }
body { margin: 0 auto; max-width: 72rem; padding: 1.5rem; font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); }
h1 { font-size: 1.6rem; } h2 { font-size: 1.2rem; margin-top: 2.2rem; }
p { max-width: 60rem; } .quiet { color: var(--quiet); font-size: .9rem; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .9rem; }
th, td { text-align: left; padding: .25rem .8rem .25rem 0; border-bottom: 1px solid var(--line); white-space: nowrap; }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 28rem), 1fr)); gap: 1.5rem; }
.plots svg { width: 100%; height: auto; }
"""
WIDE_WORDS = (
    "relMSE is the mean of (x - truth)² / (truth² + 0.01) at the end, efficiency 1 / (relMSE × seconds). Both are geometric means over "
    "the seeds with 95 % intervals by Student's t over their logarithms. Slope: s of relMSE ~ seconds⁻ˢ, 1 for independent samples, more "
    "where samples are spread better than by chance. The last column is how many times as efficient the first entrant is, seed by seed. "
    f"'Tail': the largest error of the seeds is more than {HEAVY_SPREAD} times the smallest, so that a few pixels decide, and the geometric "
    "mean is kind."
)


class Table(NamedTuple):
    head: list[str]
    rows: list[list[str]]


def _plural(n: int, what: str) -> str:
    return f"{n} {what}{'' if n == 1 else 's'}"


def with_interval(e: Estimate | None) -> str:
    """ "0.123 (0.11 to 0.14)"; only the value if the interval is unbounded."""
    if e is None:
        return ABSENT
    return f"{figure(e.value)} ({figure(e.lo)} to {figure(e.hi)})" if math.isfinite(e.hi) else figure(e.value)


def busy(results: Results) -> bool:
    """Whether other programs used so much of the machine that wall times are unreliable."""
    return results.others > IDLE_SHARE


def _clock_words(race: Race) -> str:
    return ("wall seconds on " if race.conditions.clock == "wall" else "CPU seconds a thread, on ") + _plural(race.conditions.threads, "thread")


def _paragraphs_before(results: Results) -> list[str]:
    """What was done, and on which machine."""
    if not results.races:
        return []
    c = results.races[0].conditions
    limit = f" or {c.most_spp} samples a pixel" if c.most_spp is not None else ""
    first, last = results.first_seed, results.first_seed + results.seeds - 1
    seeds = f"The seed is {first}" if results.seeds == 1 else f"The seeds are {first} to {last}"
    out = [
        f"Each entrant has {given(c.time)} s{limit} ({_clock_words(results.races[0])}) for each of {_plural(results.seeds, 'seed')}, after loading the "
        f"scene; those of one seed take turns on the same cores. {seeds}. The machine: {results.machine}. {results.build}."
    ]
    if results.others < 0:
        out.append("How busy the machine was with other things is not known.")
    else:
        begin = "The machine was busy with other things, too:" if busy(results) else "Nothing else ran:"
        out.append(f"{begin} other programs and the system had {100 * results.others:.1f} % of its cores' time meanwhile.")
    if busy(results) and c.clock == "cpu":
        out.append(
            "CPU seconds do not count the time that others had the cores, but caches and memory were shared with them: ratios hold better than seconds."
        )
    elif busy(results):
        out.append("Wall seconds on a busy machine say little: use --clock cpu, or wait until it is quiet.")
    return out


def _summary_table(results: Results) -> Table:
    table = Table(["scene", "entrant", "samples", "seconds", "relMSE", "efficiency", "slope", "first over this"], [])
    for race in results.races:
        for row in rows_of(race):
            tail = " tail" if row.spread > HEAVY_SPREAD else ""
            table.rows.append([race.scene, race.entrants[row.entrant], sample_count(row.spp), figure(row.seconds), with_interval(row.relmse) + tail,
                               with_interval(row.efficiency), with_interval(row.slope), with_interval(row.ratio) if row.entrant else ""])  # fmt: skip
    return table


Forecasts = list[tuple[Race, list[Prediction]]]


def _forecast_table(forecasts: Forecasts) -> Table:
    table = Table(["scene", "entrant", "predictions", "within their interval", "predicted over actual, median"], [])
    for race, predictions in forecasts:
        for entrant, name in enumerate(race.entrants):
            own = [p for p in predictions if p.entrant == entrant]
            ratios = sorted(p.predicted / p.actual for p in own if p.actual)
            if own:
                share = 100 * sum(p.within() for p in own) / len(own)
                table.rows.append([race.scene, name, str(len(own)), f"{share:.0f} %", figure(ratios[len(ratios) // 2]) if ratios else ABSENT])
    return table


def _forecast_words(forecasts: Forecasts) -> str:
    """Empty if nothing was predicted."""
    every = [p for _, predictions in forecasts for p in predictions]
    if not every:
        return ""
    within = sum(p.within() for p in every)
    return (
        "At each doubling of their samples our renders were asked how much longer they would need to a half, a quarter and an eighth of the error "
        f"they estimated then. {within} of {len(every)} answers hold the actual core seconds in their 95 % interval "
        f"({100 * within / len(every):.1f} %). Counted are those whose interval ends within the race."
    )


def _remarks_on(race: Race) -> list[str]:
    """About the reference, notes and failures."""
    width, height = race.conditions.size
    failed = [f"{race.entrants[f.entrant]} failed: {f.why}" for f in race.failures]
    if not race.lanes:
        return [*failed, *race.notes]
    against = f"{width} × {height} pixels. Measured against {race.reference}."
    if race.reference_noise > 0:
        against += f" Their mean has a relMSE of {figure(race.reference_noise)} itself, which is not counted as anybody's error."
    below = sum(not p.relmse > 0 for lane in race.lanes for p in lane.points)
    hidden = [f"{_plural(below, 'picture')} cannot be measured: the reference's own noise is larger than their error."] if below else []
    return [against, *hidden, *failed, *race.notes]


def file_name(scene: str) -> str:
    """The name of a scene, made safe in a path."""
    return re.sub("[^A-Za-z0-9_-]", lambda m: "_" * len(os.fsencode(m[0])), scene) or "_"


def _plot(race: Race, tool: Tool) -> tuple[str, str]:
    curves = []
    for entrant, name in enumerate(race.entrants):
        points = []
        for at in curve_of(race, entrant):
            band = at.relmse.lo > 0 and math.isfinite(at.relmse.hi)
            points.append([at.seconds, at.relmse.value, at.relmse.lo if band else 0.0, at.relmse.hi if band else 0.0])
        if points:
            curves.append({"name": name, "points": points})
    clock = _clock_words(race)
    return tool.plot(id=f"race-{file_name(race.scene)}", title=f"{race.scene}: error against time", summary=f"relMSE over {clock}, with 95 % bands over the seeds",
                     x_title=clock, y_title="relMSE", curves=curves)  # fmt: skip


# ---- tables for programs ----


def _field(value: str | float | None) -> str:
    """A field of a CSV table, in quotes where RFC 4180 requires them; empty for None and what is not finite."""
    if isinstance(value, str):
        return '"' + value.replace('"', '""') + '"' if re.search('[,"\r\n]', value) else value
    return f"{value:.6g}" if value is not None and math.isfinite(value) else ""


def _csv(head: str, rows: Sequence[Sequence[Any]]) -> str:
    """`head`: columns. A whole number is written with all its digits; an Estimate fills three fields: the value, and the interval."""
    lines = [head]
    for row in rows:
        lines.append(",".join(str(cell) if isinstance(cell, int) else ",".join(map(_field, cell)) if isinstance(cell, tuple) else _field(cell) for cell in row))
    return "\n".join(lines) + "\n"


NOTHING = (None, None, None)


def points_csv(results: Results) -> str:
    rows = [
        [race.scene, race.entrants[lane.entrant], results.first_seed + lane.seed, p.spp, p.wall, p.cpu, p.seconds, p.relmse,
         math.sqrt(p.mse) if p.mse > 0 else None, p.estimate or NOTHING, int(p.last)]
        for race in results.races for lane in race.lanes for p in lane.points
    ]  # fmt: skip
    return _csv("scene,entrant,seed,spp,wall_seconds,cpu_seconds,seconds,relmse,rmse,estimated_relmse,estimated_lo,estimated_hi,last", rows)


def summary_csv(results: Results) -> str:
    rows = [
        [race.scene, race.entrants[row.entrant], row.seeds, row.spp, row.seconds, row.relmse or NOTHING, row.efficiency or NOTHING, row.slope or NOTHING,
         row.ratio or NOTHING, row.spread]
        for race in results.races for row in rows_of(race)
    ]  # fmt: skip
    head = "scene,entrant,seeds,spp,seconds,relmse,relmse_lo,relmse_hi,efficiency,efficiency_lo,efficiency_hi,slope,slope_lo,slope_hi,ratio,ratio_lo,ratio_hi,spread"
    return _csv(head, rows)


def forecasts_csv(results: Results, forecasts: Forecasts) -> str:
    rows = [
        [race.scene, race.entrants[p.entrant], results.first_seed + p.seed, p.spp, p.spent, p.target, p.predicted, p.lo, p.hi, p.actual, int(p.within())]
        for race, predictions in forecasts for p in predictions
    ]  # fmt: skip
    return _csv("scene,entrant,seed,spp,spent,target,predicted,lo,hi,actual,within", rows)


# ---- pages for people ----


def _plain(text: str) -> str:
    """Markdown: characters that are markup are escaped, and a line break becomes a space."""
    return re.sub(r"([\\`*_\[\]<>|#])", r"\\\1", text).replace("\n", " ")


def _markdown_table(table: Table) -> str:
    lines = ["| " + " | ".join(map(_plain, row)) + " |" for row in [table.head, *table.rows]]
    lines.insert(1, "|" + "---|" * len(table.head))
    return "\n".join(lines) + "\n"


def markdown(results: Results, forecasts: Forecasts) -> str:
    out = f"# {TITLE}\n\n" + "".join(_plain(text) + "\n\n" for text in _paragraphs_before(results))
    out += _markdown_table(_summary_table(results)) + "\n" + _plain(WIDE_WORDS) + "\n"
    table = _forecast_table(forecasts)
    if table.rows:
        out += f"\n## Predicted and actual\n\n{_plain(_forecast_words(forecasts))}\n\n{_markdown_table(table)}"
    for race in results.races:
        name = _plain(race.scene)
        out += f"\n## {name}\n\n![{name}: error against time]({file_name(race.scene)}.svg)\n\n"
        out += "".join(_plain(text) + "\n\n" for text in _remarks_on(race))
    predictions = ", every prediction in forecasts.csv" if table.rows else ""
    return f"{out}\nEvery point is in points.csv, the first table in summary.csv{predictions}. How it is done: `lightshaft compare --help` and the page about it.\n"


def _escaped(text: str) -> str:
    # Characters that could forge lines or reorder letters become spaces.
    return html.escape("".join(c if c.isprintable() or c == "\n" else " " for c in text)).replace("&#x27;", "&#39;")


def _html_table(table: Table) -> str:
    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{_escaped(cell)}</{tag}>" for cell in cells) + "</tr>\n"

    body = "".join(row(cells, "td") for cells in table.rows)
    return f'<div class="wide"><table>\n<thead>{row(table.head, "th")}</thead>\n<tbody>\n{body}</tbody></table></div>\n'


def _paragraph(text: str, kind: str = "") -> str:
    return f"<p{kind}>{_escaped(text)}</p>\n"


QUIET = ' class="quiet"'


def html_page(results: Results, forecasts: Forecasts, elements: Sequence[str], tool: Tool) -> str:
    body = f"<h1>{TITLE}</h1>\n" + "".join(map(_paragraph, _paragraphs_before(results)))
    body += _html_table(_summary_table(results)) + _paragraph(WIDE_WORDS, QUIET)
    table = _forecast_table(forecasts)
    if table.rows:
        body += "<h2>Predicted and actual</h2>\n" + _paragraph(_forecast_words(forecasts)) + _html_table(table)
    body += '<div class="plots">\n'
    for race, element in zip(results.races, elements, strict=True):
        remarks = "".join(_paragraph(text, QUIET) for text in _remarks_on(race))
        body += f"<section><h2>{_escaped(race.scene)}</h2>\n{element}\n{remarks}</section>\n"
    return tool.document(TITLE, CSS, body + "</div>\n")


def files_of(results: Results, tool: Tool) -> dict[str, str]:
    """The contents of all files, by their names."""
    forecasts = [(race, predictions_of(race, tool)) for race in results.races]
    plots = [_plot(race, tool) for race in results.races]
    files = {
        "points.csv": points_csv(results),
        "summary.csv": summary_csv(results),
        "forecasts.csv": forecasts_csv(results, forecasts),
        "report.md": markdown(results, forecasts),
        "index.html": html_page(results, forecasts, [element for element, _ in plots], tool),
    }
    return files | {f"{file_name(race.scene)}.svg": file for race, (_, file) in zip(results.races, plots, strict=True)}


def write(folder: pathlib.Path, results: Results, tool: Tool) -> None:
    for name, text in files_of(results, tool).items():
        write_file(folder / name, text)


def lines_of(race: Race) -> list[str]:
    """What the terminal shows of a race."""
    lines = []
    for row in rows_of(race):
        line = (f"{race.scene}: {race.entrants[row.entrant]}: {row.spp:.4g} samples in {row.seconds:.3g} s, relMSE {with_interval(row.relmse)}, "
                f"efficiency {with_interval(row.efficiency)}")  # fmt: skip
        lines.append(f"{line}; {race.entrants[0]} is {with_interval(row.ratio)} times as efficient" if row.ratio else line)
    return lines
