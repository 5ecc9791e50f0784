#!/usr/bin/env python3
"""Puts the faults of table.py into a copy of the sources, one at a time, and asks the named tests whether they find them.

usage: run.py [--only NUMBER,...] [--area NAME,...] [--jobs N] [--build-only] [--table PAGE.md]

All faults are compiled into one build of the copy, beside the right code, and chosen by LIGHTSHAFT_MUTANT (mutant.h): a run
of sixty costs one build of some forty files. The checkout itself is not touched: the copy and its build are in build/mutation,
with the results of earlier runs, which stay until their mutant is asked again. A test that takes ten times as long as without
a fault, and a minute more, has found it, too.
"""
import argparse
import concurrent.futures
import json
import os
import pathlib
import subprocess
import sys
import time

from table import AREAS, MUTANTS, area_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
COPY = ROOT / "build" / "mutation"
BIN = COPY / "build" / "release" / "bin"
RESULTS = COPY / "results.json"

GTEST = ("agent_test", "assemble_test", "bsdf_test", "cli_test", "domain_test", "http_api_test", "http_server_test",
         "image_test", "leave_out_test", "property_test", "render_test", "sampling_test", "service_test", "statistical_test", "store_test")


def command_of(test):
    """A test: a GoogleTest program, `program:FILTER` for a part of one, or the quick table of lightshaft validate."""
    program, _, chosen = test.partition(":")
    if program == "validate":
        return "lightshaft", [BIN / "lightshaft", "validate", "--quick", "--case", chosen or "*"]
    if program not in GTEST:
        sys.exit(f"table.py names {program}, which run.py does not know")
    return program, [BIN / program, "--gtest_fail_fast", "--gtest_brief=1", f"--gtest_filter={chosen or '*'}"]


def switched(mutant, old):
    """Source text that does `old`, or what the mutant does in its place."""
    if old.endswith(";"):
        return f"{{ if (::ls::kMutant == {mutant.number}) {{ {mutant.new} }} else {{ {old} }} }}"
    return f"(::ls::kMutant == {mutant.number} ? ({mutant.new}) : ({old}))"


def mutated(path, text):
    """The text of a file with all its mutants in it."""
    spans = []
    for mutant in (m for m in MUTANTS if m.file == path):
        before, _, rest = mutant.place.partition("«")
        old, _, after = rest.partition("»")
        if text.count(before + old + after) != 1:
            sys.exit(f"mutant {mutant.number}: its place is not in {path}, or not there alone")
        start = text.index(before + old + after) + len(before)
        spans.append((start, start + len(old), switched(mutant, old)))
    if not spans:
        return text
    for start, end, new in sorted(spans, reverse=True):
        text = text[:start] + new + text[end:]
    return '#include "tests/mutation/mutant.h"\n' + text


def copy_sources():
    """Files that are the same already keep their times, so that a second build is short."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True, capture_output=True).stdout
    paths = {p.decode() for p in listed.split(b"\0") if p and (ROOT / p.decode()).is_file()}
    for old in COPY.rglob("*"):
        inside = old.relative_to(COPY)
        if inside.parts[0] != "build" and old.is_file() and str(inside) not in paths and old != RESULTS:
            old.unlink()
    for path in paths:
        source, target = ROOT / path, COPY / path
        data = source.read_bytes()
        if any(m.file == path for m in MUTANTS):
            data = mutated(path, data.decode()).encode()
        if target.exists() and target.read_bytes() == data:
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
        target.chmod(source.stat().st_mode)


def build(programs):
    subprocess.run(["cmake", "--preset", "release", "-DLIGHTSHAFT_TESTS=ON"], cwd=COPY, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", "--preset", "release", "--target", *sorted(programs)], cwd=COPY, check=True)


def ask(test, number, limit):
    """Whether the test passes, its seconds, and what it says where it fails."""
    start = time.monotonic()
    try:
        done = subprocess.run([*map(str, command_of(test)[1])], cwd=COPY, capture_output=True, text=True, errors="replace", timeout=limit,
                              env={**os.environ, "LIGHTSHAFT_MUTANT": str(number)})
    except subprocess.TimeoutExpired as late:
        return False, time.monotonic() - start, failures((late.stdout or b"").decode(errors="replace")) or ["does not end"]
    seconds = time.monotonic() - start
    return done.returncode == 0, seconds, failures(done.stdout) or [f"ends with {done.returncode}"]


def failures(output):
    """The names of failed tests or cases."""
    names = []
    for line in output.splitlines():
        if line.startswith("[  FAILED  ]") and "." in line:
            name = line.removeprefix("[  FAILED  ] ").split(" ")[0].rstrip(",")
        elif " FAIL " in line:
            name = line.split()[0]
        else:
            continue
        if name not in names:
            names.append(name)
    return names


def tried(mutant, seconds):
    """What became of a mutant; `seconds`: of each test without a fault."""
    spent = 0
    for test in mutant.tests:
        passed, took, said = ask(test, mutant.number, 60 + 10 * seconds[test])
        spent += took
        if not passed:
            return {"killed_by": test, "failed": said, "seconds": round(spent, 1)}
    return {"killed_by": None, "failed": [], "seconds": round(spent, 1)}


def run(mutants, jobs):
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        tests = sorted({t for m in mutants for t in m.tests})
        seconds = {}
        for test, (passed, took, said) in zip(tests, pool.map(lambda t: ask(t, 0, None), tests)):
            print(f"{test} without a fault: {took:.1f} s", flush=True)
            if not passed:
                sys.exit(f"{test} fails without any fault: {said}")
            seconds[test] = took
        for m, result in zip(mutants, pool.map(lambda m: tried(m, seconds), mutants)):
            results[str(m.number)] = result
            RESULTS.write_text(json.dumps(results, indent=1))
            killer = result["killed_by"]
            print(f"{m.number:4} {'killed by ' + killer + ': ' + ', '.join(result['failed'][:3]) if killer else 'SURVIVED'} "
                  f"({result['seconds']:.0f} s)  {m.breaks}", flush=True)
    return results


def page(results, head):
    """The table, below the part of the page that is written by hand."""
    out = [head.rstrip(), "", "## The mutants", "", "| area | mutants | killed | survived |", "|---|---|---|---|"]
    asked = [m for m in MUTANTS if str(m.number) in results]
    for area in AREAS:
        of_area = [results[str(m.number)] for m in asked if area_of(m.number) == area]
        killed = sum(r["killed_by"] is not None for r in of_area)
        if of_area:
            out.append(f"| {area} | {len(of_area)} | {killed} | {len(of_area) - killed} |")
    for area in AREAS:
        rows = [m for m in asked if area_of(m.number) == area]
        if not rows:
            continue
        out += ["", f"### {area.capitalize()}", "", "| mutant | file | fault | found by |", "|---|---|---|---|"]
        for m in rows:
            r = results[str(m.number)]
            more = f" and {len(r['failed']) - 1} more" if len(r["failed"]) > 1 else ""
            found = f"{r['killed_by']}: `{r['failed'][0]}`{more}" if r["killed_by"] else "**survived**"
            out.append(f"| {m.number} | `{m.file}` | {m.breaks} | {found} |")
    return "\n".join(out) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="numbers of mutants, with commas between them")
    parser.add_argument("--area", default="", help="areas of mutants: " + ", ".join(AREAS))
    parser.add_argument("--jobs", type=int, default=1, help="mutants that are asked at once")
    parser.add_argument("--build-only", action="store_true")
    parser.add_argument("--table", type=pathlib.Path, help="the page whose tables are written anew")
    given = parser.parse_args()
    only, areas = [n for n in given.only.split(",") if n], [a for a in given.area.split(",") if a]
    mutants = [m for m in MUTANTS if (not only or str(m.number) in only) and (not areas or area_of(m.number) in areas)]
    copy_sources()
    build({command_of(t)[0] for m in mutants for t in m.tests})
    if given.build_only:
        return
    results = run(mutants, given.jobs)
    if given.table:
        head = given.table.read_text().partition("## The mutants")[0] if given.table.exists() else "# Mutants"
        given.table.write_text(page(results, head))


if __name__ == "__main__":
    main()
