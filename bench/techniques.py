#!/usr/bin/env python3
"""What each technique of a scene's integrator costs and brings: the scene as it is, and with one of them switched off in turn.

usage: techniques.py SCENE[@WxH]... [--seeds N] [--first SEED] [--spp N] [--threads N] [--denoise] [--json OUT.json] [--out PAGE.md]
`lightshaft inspect` says which techniques a scene uses and what switches each off (`techniques`; docs/reference/scene-format.md,
Integrators); one that it does not use has no row. All settings take turns, seed by seed, with equal samples. Columns:
  error      mean relMSE without the technique over that with it: what it brings. Each image's own estimate, from its two halves, is
             unbiased, so no reference is needed
  denoised   with --denoise, the same of the denoised layers
  seconds    mean core seconds with it over those without: what it costs
  work       the same of instructions, which do not depend on what else the machine does; - where it cannot count them
  efficiency 1 / (relMSE x core seconds) with it over that without
Intervals are of 95 %, by Student's t over the seeds (measured.py). Where single bright pixels carry the error, few seeds say little, and
the interval says so. Any scene that Lightshaft reads will do. `phase_only` switches off the flights near lamps with the directions.
"""
import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import tempfile

from measured import ROOT, ratio_of_means

BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
TYPES = {"true": "boolean", "false": "boolean"}


def lightshaft(*arguments):
    return subprocess.run([BIN / "lightshaft", *map(str, arguments)], check=True, capture_output=True, text=True).stdout


def without(scene, off):
    """A copy of a canonical scene beside it, whose integrator has this parameter alone set so."""
    name, value = off["parameter"], off["value"]
    kind = TYPES.get(value, "integer" if re.fullmatch(r"-?\d+", value) else "string")
    text = scene.read_text()
    begin = re.search(r'<integrator type="[a-z_]+"\s*(/?)>', text)
    assert begin, f"{scene}: no integrator"
    end = begin.end() if begin[1] else text.index("</integrator>", begin.end())
    inner = "" if begin[1] else re.sub(rf'<\w+ name="{name}"[^>]*/>\s*', "", text[begin.end():end])
    rest = text[end:] if begin[1] else text[end + len("</integrator>"):]
    head = text[:begin.start()] + re.sub(r"\s*/?>$", ">", begin[0])
    copy = scene.with_name(f"without-{name}.xml")
    copy.write_text(f'{head}{inner}<{kind} name="{name}" value="{value}"/></integrator>{rest}')
    return copy


def decided(scene):
    """The techniques that a canonical scene uses. From now on it says itself whether paths are shared: its copies would decide anew."""
    told = json.loads(lightshaft("inspect", scene, "--json"))
    if told["integrator"] == "volpath":
        sharing = any(t["name"] == "path_reuse" for t in told["techniques"])
        without(scene, {"parameter": "path_reuse", "value": "16" if sharing else "-1"}).replace(scene)
    return told["techniques"]


def rendered(scene, size, asked, seed, folder):
    """relMSE, core seconds, instructions (None: not counted), relMSE of the denoised layers (None: not asked for)."""
    report = folder / "report.json"
    lightshaft("render", scene, "-o", folder / "out.exr", "--report", report, "--quiet", "--spp", asked.spp, "--seed", seed, "--threads", asked.threads,
               *(["--size", size] if size else []), *(["--denoise"] if asked.denoise else []))
    told = json.loads(report.read_text())
    return told["relmse"], told["core_seconds"], told["instructions"].get("count"), told.get("denoised", {}).get("relmse")


def measured(name, asked, folder):
    """[{scene, technique, ...}], a row for each technique that the scene uses."""
    given, _, size = name.partition("@")
    scene = folder / "scene.xml"
    lightshaft("convert", given, scene)
    found = decided(scene)
    files = {"": scene, **{one["name"]: without(scene, one["off"]) for one in found}}
    for technique, file in files.items():
        left = {one["name"] for one in json.loads(lightshaft("inspect", file, "--json"))["techniques"]}
        assert technique not in left, f"{given}: {technique} is still used when it is switched off"
    runs = {technique: [] for technique in files}
    for seed in range(asked.first, asked.first + asked.seeds):
        for technique, file in files.items():
            runs[technique].append(rendered(file, size, asked, seed, folder))
    errors, seconds, work, denoised = ({t: [run[i] for run in of] for t, of in runs.items()} for i in range(4))
    cost = {t: [e * s for e, s in zip(errors[t], seconds[t])] for t in runs}
    ratio = ratio_of_means if asked.seeds > 1 else lambda a, b: (statistics.fmean(a) / statistics.fmean(b),) * 3
    for one in found:
        t = one["name"]
        yield {"scene": pathlib.Path(given).stem, "technique": t, "off": one["off"], "error": ratio(errors[t], errors[""]),
               "denoised": ratio(denoised[t], denoised[""]) if asked.denoise else None,
               "seconds": ratio(seconds[""], seconds[t]), "work": ratio(work[""], work[t]) if all(work[""] + work[t]) else None,
               "efficiency": ratio(cost[t], cost[""])}


def cell(figure):
    if figure is None:
        return "-"
    middle, low, high = figure
    return f"{middle:.2f}" + (f" ({low:.2f} to {high:.2f})" if low < high else "")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--denoise", action="store_true")
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path)
    asked = parser.parse_args()
    columns = ("error", *(["denoised"] if asked.denoise else []), "seconds", "work", "efficiency")
    lines, rows = [f"| scene | technique | switched off by | {' | '.join(columns)} |", "|---" * (3 + len(columns)) + "|"], []
    print("\n".join(lines))
    for name in asked.scenes:
        with tempfile.TemporaryDirectory() as folder:
            for row in measured(name, asked, pathlib.Path(folder)):
                rows.append(row)
                off = f"`{row['off']['parameter']}` {row['off']['value']}"
                lines.append(f"| {row['scene']} | {row['technique']} | {off} | " + " | ".join(cell(row[k]) for k in columns) + " |")
                print(lines[-1], flush=True)
    if asked.json:
        asked.json.write_text(json.dumps(rows, indent=2) + "\n")
    if asked.out:
        from denoised import publish  # needs numpy and OpenEXR
        publish("What each technique costs and brings", "{made}. What the columns are: see the script.", lines, asked.out)


if __name__ == "__main__":
    main()
