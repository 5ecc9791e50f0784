#!/usr/bin/env python3
"""Every scene file below a folder: does it load and render to a healthy picture, and what is said if not?

usage: every_scene.py DIR [--size WxH] [--spp N] [--threads N] [--only TEXT] [--markdown] [--inspect]
Each XML, .pbrt, .gltf and .glb is rendered small; with --inspect it is only read, and a table of the reasons for which scenes are
refused follows: a scene counts once for each kind of error that it has, without its names and numbers. Incomplete is a scene all of
whose errors are of what is not there. A scene that takes more than LIMIT seconds has failed. Healthy is a picture that is finite, not black, and whose report counts no non-finite sample and no
majorant violation. Scenes whose root is a test (Nori's `ttest`, `chi2test`) are run by `lightshaft validate`. Files that others
include, and those without a sensor, are fragments: listed as such. What is refused is printed with the first error.
Exit status: 0 unless a render failed or was not healthy. Needs numpy and the OpenEXR package of PyPI. A bench, not a test.
"""
import argparse
import collections
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np

from agreement import BIN, load


LIMIT = 60
ABSENT = re.compile("there is no file|Git LFS|no object has the id|is not defined: give it")


def run(*command):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, errors="replace")


def first_error(text, scene):
    lines = [line for line in text.splitlines() if "error:" in line] or text.splitlines() or ["no message"]
    return lines[0].replace(str(scene.parent) + os.sep, "").strip()


def is_fragment(scene, text, included):
    if scene.suffix in (".gltf", ".glb"):
        return False
    return scene.name in included or not re.search(r"^\s*Camera\b" if scene.suffix == ".pbrt" else r"<(sensor|camera|test|include)\b", text, re.M)


def validated(scene):
    done = run(BIN / "lightshaft", "validate", scene)
    cases = [line for line in done.stdout.splitlines() if re.search(r"\b(pass|fail)\b", line)]
    good = sum(bool(re.search(r"\bpass\b", line)) for line in cases)
    return ("tests pass" if done.returncode == 0 else "TESTS FAIL"), f"{good} of {len(cases)} cases" if cases else first_error(done.stderr, scene)


def rendered(scene, options, folder, spp):
    out, report = folder / "out.exr", folder / "report.json"
    done = run(BIN / "lightshaft", "render", scene, "-o", out, "--float", "--spp", spp, "--size", options.size, "--threads",
               options.threads, "--report", report, "--quiet")
    if done.returncode == 2:
        return "refused", first_error(done.stderr, scene)
    if done.returncode:
        return "FAILED", f"exit {done.returncode}: {first_error(done.stderr, scene)}"
    image, told = load(out), json.loads(report.read_text())
    if not image.any() and spp < 4096:  # a tiny light that few paths find
        return rendered(scene, options, folder, 16 * spp)
    ill = [f"{told[key]} {key}" for key in ("nonfinite_samples", "majorant_violations") if told.get(key)]
    ill += ["not finite"] if not np.isfinite(image).all() else ["black"] if not image.any() else []
    samples = [] if spp == options.spp else [f"at {spp} samples a pixel"]
    warnings = sum("warning:" in line for line in done.stderr.splitlines())
    return ("NOT HEALTHY" if ill else "renders"), ", ".join(ill + [f"mean {image.mean():.3g}", f"{warnings} warnings"] + samples)


def inspected(scene, reasons):
    done = run("timeout", LIMIT, BIN / "lightshaft", "inspect", scene, "--json")
    if done.returncode == 0:
        return "loads", f"{sum('warning:' in line for line in done.stderr.splitlines())} warnings"
    errors = [line.split("error:", 1)[1] for line in done.stderr.splitlines() if "error:" in line] or [first_error(done.stderr, scene)]
    for kind in {re.sub(r'"[^"]*\.\w+"', '"FILE"', re.sub(r"(?<![\w.])-?\d[\d.e+-]*", "N", error)).strip() for error in errors}:
        reasons[kind] += 1
    incomplete = all(ABSENT.search(error) for error in errors)
    outcome = "FAILED" if done.returncode != 2 else "incomplete" if incomplete else "refused"
    return outcome, first_error(done.stderr, scene)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--size", default="48x36")
    parser.add_argument("--spp", type=int, default=4)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--inspect", action="store_true")
    options = parser.parse_args()
    files = sorted(f for ending in ("xml", "pbrt", "gltf", "glb") for f in options.folder.rglob(f"*.{ending}"))
    texts = {f: f.read_text(errors="replace") for f in files}
    included = {pathlib.PurePath(name).name for text in texts.values() for name in re.findall(r'(?:<include[^>]*filename=|^\s*(?:Include|Import)\s+)"([^"]+)"', text, re.M)}
    if options.markdown:
        print("| scene | outcome | |\n|---|---|---|")
    bad, outcomes, reasons = 0, collections.Counter(), collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        for scene in files:
            if options.only not in str(scene):
                continue
            if is_fragment(scene, texts[scene], included):
                outcome = "fragment", "included by others"
            elif re.search(r"<test\b", texts[scene]):
                outcome = validated(scene)
            elif options.inspect:
                outcome = inspected(scene, reasons)
            else:
                outcome = rendered(scene, options, pathlib.Path(folder), options.spp)
            bad += outcome[0].isupper()
            outcomes[outcome[0]] += 1
            cells = (str(scene.relative_to(options.folder)), *outcome)
            print("| " + " | ".join(c.replace("|", "\\|") for c in cells) + " |" if options.markdown else "  ".join(cells), flush=True)
    print("\n" + ", ".join(f"{count} {outcome}" for outcome, count in outcomes.most_common()))
    for kind, count in reasons.most_common():
        print(f"{count:5} {kind}")
    sys.exit(bad > 0)


if __name__ == "__main__":
    main()
