#!/usr/bin/env python3
"""The scenes of the public repositories in corpora.json: which load, which are refused, whether rightly, and what they show.

usage: corpora.py read FOLDER RECORDS [--only TEXT] [--render] [--blender ANSWERS]
       corpora.py tell FOLDER RECORDS
FOLDER holds the repositories as OWNER+NAME, each checked out at its commit. `read` reads every scene (every_scene.py) of the table's
formats, with --render renders at 32 x 24 pixels by 4 samples what loads, and appends a line of JSON for each file to RECORDS; files that
have one are not read again. --blender takes the output of `blender_scenes.py FOLDER --every`, whose lines become records. `tell` judges
each refusal (refusals.py) and writes the tables of docs/measurements/corpora.md and docs/measurements/corpora-refused.csv. It ends with 1 if a refusal is judged false or by no rule. A bench, not a test.
"""
import argparse
import collections
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile

import every_scene
import refusals

HERE = pathlib.Path(__file__).resolve().parent
PAGE = HERE.parent / "docs/measurements/corpora.md"
LIST = PAGE.with_name("corpora-refused.csv")
ENDINGS = {"pbrt-v4": (".pbrt",), "glTF": every_scene.GLTF, "Mitsuba XML": (".xml",), "Nori": (".xml",), "USD": every_scene.STAGES}
FORMATS = (*ENDINGS, "Blender")
SIZE, SAMPLES = "32x24", 4
MOST_KINDS = 9  # in the page; the list has all


def table():
    return json.loads((HERE / "corpora.json").read_text())


def folder_of(root, repository):
    return root / repository.replace("/", "+")


def dialect_of(text):
    """Of XML: the rule of docs/reference/scene-format.md, "Files of Nori"."""
    plain = every_scene.REMARKS.sub("", text)
    version = re.match(r"<scene\s[^>]*\bversion=", plain)
    nori = re.search(r"<(camera|mesh)\b", plain) and not (version and re.search(r"<(shape|sensor)\b", plain))
    return "Nori" if nori else "Mitsuba XML"


def scenes_of(row, root):
    """(format, file) of each scene of a repository that is no test and that no other includes."""
    folder = folder_of(root, row["repository"])
    at = subprocess.run(["git", "-C", str(folder), "rev-parse", "HEAD"], capture_output=True, text=True).stdout.strip()
    if at != row["commit"]:
        sys.exit(f"{folder}: is at {at or 'no commit'}, not at {row['commit']}")
    texts, included = every_scene.scenes_below(folder)
    for file, text in texts.items():
        form = next((f for f in row["formats"] if file.suffix in ENDINGS.get(f, ())), None)
        form = dialect_of(text) if form and file.suffix == ".xml" else form
        if form and not every_scene.is_fragment(file, text, included) and not every_scene.is_test(text):
            yield form, file


def record_of(file, root, render):
    with tempfile.TemporaryDirectory() as scratch:
        answer, made = every_scene.inspected(file, root, pathlib.Path(scratch))
        record = {"status": answer.status, "errors": answer.errors, "warnings": len(answer.warnings), "seconds": round(answer.seconds, 2)}
        if render and answer.status == 0:
            done, picture = every_scene.rendered(made, SIZE, SAMPLES, 1, pathlib.Path(scratch))
            said = [line.split("warning: ", 1)[1] for line in answer.warnings + done.warnings]
            record |= {"picture": picture, "said": said} if picture else {"picture": None, "said": [text for _, text in done.errors]}
            record["render_seconds"] = round(done.seconds, 2)
    return record


def records_in(path):
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def read(options):
    known = {(r["repository"], r["file"]) for r in records_in(options.records)}
    with options.records.open("a") as out:
        def write(**record):
            print(json.dumps(record), file=out, flush=True)

        for row in table():
            folder = folder_of(options.folder, row["repository"])
            for form, file in scenes_of(row, options.folder):
                name = str(file.relative_to(folder))
                if (row["repository"], name) not in known and options.only in str(file):
                    write(repository=row["repository"], format=form, file=name, **record_of(file, folder, options.render))
        for line in options.blender.read_text().splitlines() if options.blender else []:
            if line.startswith('{"file"'):
                answer = json.loads(line)
                folder, _, name = answer.pop("file").partition("/")
                if (folder.replace("+", "/"), name) not in known:
                    write(repository=folder.replace("+", "/"), format="Blender", file=name, **answer)


def judged(record, root):
    """Its outcome or verdict, and of each error: the place, the kind and the reason. What is judged false, or by no rule, is a problem."""
    if record["format"] == "Blender":
        return judged_blender(record)
    if record["status"] == 0:
        return "loads", [], []
    scene = folder_of(root, record["repository"]) / record["file"]
    found, problems = [], []
    for place, text in record["errors"]:
        if refusals.is_count(text):
            continue
        try:
            verdict, kind, reason = refusals.judge(refusals.Case(scene, place), text)
            found.append((verdict, re.sub(r"^.*?(\d+:\d+)$", r"\1", place.replace(str(scene.parent) + "/", "")), kind, reason))
        except (ValueError, AssertionError, OSError) as error:
            problems.append(f"{record['repository']}/{record['file']}: {error}")
    for verdict in refusals.VERDICTS:  # the first that one of its errors has
        if errors := [error[1:] for error in found if error[0] == verdict]:
            return verdict, errors, problems
    return "not judged", [], problems


def judged_blender(record):
    """By the words of the add-on alone: nothing else here reads .blend files. What loads once it is done as they advise is told."""
    verdict = record["verdict"]
    if verdict == "read":
        return "loads", [], []
    words = record["words"].replace("Error: ", "").strip()
    kind = re.sub(r"\"[^\"]*\"|'[^']*'|(?<=the file )\S.*(?= does not exist)", "...", words.splitlines()[0] if words else "no words")
    kind = re.split(r"(?<!\.)\. ", re.sub(r"\s+", " ", kind))[0][:90]
    if verdict in ("left out", "baked"):
        return refusals.OUTSIDE, [("", f"{kind} ({verdict}: loads)", "the add-on's words")], []
    if verdict == "failed":
        return refusals.INSIDE, [("", kind, "-")], []
    absent = verdict == "not opened" or re.search(r"does not exist|not found|no image\. Open|Git LFS|is packed but empty", record["words"] + record.get("still", ""), re.I)
    return (refusals.INCOMPLETE if absent else refusals.OUTSIDE), [("", kind, "-" if absent else "the add-on's words")], []


def shares(name, counts):
    """Of the files that lie inside the features: those that load, of all. Of Blender's the add-on alone says what lies inside."""
    if name == "Blender":
        return "-"
    inside = counts["loads"] + counts[refusals.INSIDE] + counts["not judged"]
    return f"{100 * counts['loads'] / inside:.1f} %" if inside else "-"


def table_of(rows):
    yield "| format | files | load | outside the features | the file is wrong | incomplete | inside, and refused | of those inside load |"
    yield "|---|---:|---:|---:|---:|---:|---:|---:|"
    for name, counts in rows.items():
        cells = [counts.total(), counts["loads"], *(counts[v] for v in refusals.VERDICTS[:3]), counts[refusals.INSIDE] + counts["not judged"]]
        yield f"| {name} | " + " | ".join(map(str, cells)) + f" | {shares(name, counts)} |"


def kinds_table(kinds):
    yield "| format | verdict | reasons, with the number of files that have them |"
    yield "|---|---|---|"
    for (form, verdict), counts in sorted(kinds.items()):
        yield f"| {form} | {verdict} | " + ", ".join(f"{kind.replace('|', '/')} ({count})" for kind, count in counts.most_common(MOST_KINDS)) + (
            f", and {len(counts) - MOST_KINDS} more" if len(counts) > MOST_KINDS else "") + " |"


def pictures_table(records):
    yield "| format | rendered | healthy | black, as a warning says | black | failed | not finite, or majorants violated |"
    yield "|---|---:|---:|---:|---:|---:|---:|"
    for form in ENDINGS:
        tried = [r for r in records if r["format"] == form and "picture" in r]
        ill = [(r["picture"] or (0, ["failed"]))[1] for r in tried]
        cells = [len(tried), ill.count([]), *(sum(kind in i for i in ill) for kind in (every_scene.BLACK_AS_TOLD, "black", "failed"))]
        yield f"| {form} | " + " | ".join(map(str, [*cells, 2 * len(tried) - sum(cells)])) + " |"


def repositories_table(files):
    yield "| repository (github.com) | commit | scenes |"
    yield "|---|---|---|"
    for row in table():
        told = ", ".join(f"{form} {files[row['repository'], form]}" for form in FORMATS if files[row["repository"], form])
        yield f"| {row['repository']} | {row['commit'][:12]} | {told or '-'} |"


def tell(options):
    records = records_in(options.records)
    counts, kinds, rows, problems = collections.defaultdict(collections.Counter), collections.defaultdict(collections.Counter), [], []
    for record in records:
        outcome, errors, wrong = judged(record, options.folder)
        problems += wrong
        counts[record["format"]][outcome] += 1
        if outcome == "loads":
            continue
        kinds[record["format"], outcome].update({kind for _, kind, _ in errors})
        place, kind, reason = errors[0] if errors else ("", "", "")
        more = len({k for _, k, _ in errors} - {kind})
        rows.append((record["format"], f"{record['repository']}/{record['file']}", outcome, place, kind + (f"; {more} more" if more else ""), reason))
    files = collections.Counter((r["repository"], r["format"]) for r in records)
    write_between("repositories", repositories_table(files))
    counts = {form: counts[form] for form in FORMATS if form in counts}
    write_between("counts", [*table_of(counts), "", *kinds_table(kinds), "", *pictures_table(records)])
    with LIST.open("w", newline="") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(("format", "file", "verdict", "place", "kind", "reason"))
        writer.writerows(sorted(rows))
    for problem in problems:
        print(problem)
    return 1 if problems else 0


def write_between(name, lines):
    """Replaces what stands in the page between the two remarks of this name."""
    begin, end = f"<!-- Made by bench/corpora.py: {name}. Do not edit. -->", f"<!-- End of {name}. -->"
    before, _, rest = PAGE.read_text().partition(begin)
    _, found, after = rest.partition(end)
    if not found:
        sys.exit(f"{PAGE} lacks the remarks about {name}")
    PAGE.write_text("\n".join([before + begin, "", *lines, "", end + after]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("step", choices=("read", "tell"))
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("records", type=pathlib.Path)
    parser.add_argument("--only", default="")
    parser.add_argument("--render", action="store_true")
    parser.add_argument("--blender", type=pathlib.Path)
    options = parser.parse_args()
    return read(options) if options.step == "read" else tell(options)


if __name__ == "__main__":
    sys.exit(main())
