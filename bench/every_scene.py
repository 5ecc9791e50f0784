#!/usr/bin/env python3
"""Every scene file below a folder: does it load and render to a healthy picture, and what is said if not?

usage: every_scene.py DIR [--size WxH] [--spp N] [--threads N] [--only TEXT] [--markdown] [--inspect]
Each XML, .pbrt, .gltf, .glb and stage of USD is rendered small; with --inspect it is only read, and a table of the reasons for which
scenes are refused follows: a scene counts once for each kind of error that it has, without its names and numbers. Incomplete is a scene all of
whose errors are of what is not there. A scene that takes more than LIMIT seconds or MEMORY bytes has failed. Healthy is a picture that is finite, not black, and whose report counts no non-finite sample and no
majorant violation. Scenes whose root is a test (Nori's `ttest`, `chi2test`) are run by `lightshaft validate`. Files that others
include, and those without a sensor, are fragments: listed as such. What is refused is printed with the first error.
Exit status: 0 unless a render failed or was not healthy. Needs numpy and the OpenEXR package of PyPI, for stages the package
lightshaft[usd] too. A bench, not a test.
"""
import argparse
import collections
import dataclasses
import json
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time

import numpy as np

from agreement import BIN, load

LIMIT = 60
MEMORY = 12 << 30
MOST_SAMPLES = 1024
GLTF, STAGES = (".gltf", ".glb"), (".usd", ".usda", ".usdc", ".usdz")
SUFFIXES = (".xml", ".pbrt", *GLTF, *STAGES)
ABSENT = re.compile("there is no file|Git LFS|no object has the id|is not defined: give it")
SKY_ADVISED, DARK = "add -D environment=1", "the scene has no light"
BLACK_AS_TOLD = "black, as its warning says"
INCLUDES = re.compile(r'(?:<include[^>]*filename=|^\s*(?:Include|Import)\s+)"([^"]+)"', re.M)
REMARKS = re.compile(r"^[\ufeff\s]+|<\?.*?\?>\s*|<!DOCTYPE[^>]*>\s*|<!--.*?-->\s*", re.S)
ERROR = re.compile(r"^(?:(?P<place>\S.*?): )?error: (?P<text>.*)$")


@dataclasses.dataclass
class Answer:
    """What a command answered: its exit status (124: it took too long), its errors as (place, text), and what it warned of."""
    status: int
    errors: list
    warnings: list
    seconds: float


def limit_memory():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def ask(*command):
    begun = time.monotonic()
    try:
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True, errors="replace", timeout=LIMIT, preexec_fn=limit_memory)
        status, told = done.returncode, done.stderr.splitlines()
    except subprocess.TimeoutExpired:
        status, told = 124, [f"error: it took more than {LIMIT} s"]
    found = [(match["place"] or "", match["text"]) for match in map(ERROR.match, told) if match]
    if status and not found:
        found = [("", line) for line in told[-1:]] or [("", "no message")]
    return Answer(status, found, [line for line in told if "warning: " in line], time.monotonic() - begun)


def first_error(answer, scene):
    place, text = answer.errors[0]
    return f"{place}: {text}".replace(str(scene.parent) + os.sep, "")


def is_fragment(scene, text, included):
    if scene.suffix in GLTF or scene.suffix in STAGES:
        return False
    if scene.suffix == ".xml" and not re.match(r"<(?:scene|test)\b", REMARKS.sub("", text)):
        return True
    return scene.name in included or not re.search(r"^\s*Camera\b" if scene.suffix == ".pbrt" else r"<(sensor|camera|test|include)\b", text, re.M)


def is_test(text):
    return re.search(r"<test\b", REMARKS.sub("", text)) is not None


def scenes_below(folder):
    """Its scene files with their texts, and the names of the files that others include."""
    files = sorted(f for f in folder.rglob("*") if f.suffix in SUFFIXES and f.is_file())
    texts = {f: "" if f.suffix in STAGES else f.read_text(errors="replace") for f in files}
    return texts, {pathlib.PurePath(name).name for text in texts.values() for name in INCLUDES.findall(text)}


def inspected(scene, root, folder):
    """The answer to a scene that is read, and the scene that `lightshaft render` then takes. Stages may use all files of the root."""
    if scene.suffix in STAGES:
        return ask(sys.executable, "-m", "lightshaft.usd", scene, "-o", folder / "stage", "--allow", root), folder / "stage" / "scene.xml"
    return ask(BIN / "lightshaft", "inspect", scene, "--json"), scene


def outcome_of(answer):
    if answer.status == 0:
        return "loads"
    return "FAILED" if answer.status != 2 else "incomplete" if all(ABSENT.search(text) for _, text in answer.errors) else "refused"


def kinds_of(answer):
    return {re.sub(r'"[^"]*\.\w+"', '"FILE"', re.sub(r"(?<![\w.])-?\d[\d.e+-]*", "N", text)).strip() for _, text in answer.errors}


def rendered(scene, size, spp, threads, folder, sky=()):
    """The answer, and a picture's (mean, what is ill about it, samples a pixel): a black one is rendered again with more of these. A
    scene of glTF that has no light gets the sky that the warning of that advises."""
    out, report = folder / "out.exr", folder / "report.json"
    answer = ask(BIN / "lightshaft", "render", scene, "-o", out, "--float", "--spp", spp, "--size", size, "--threads", threads,
                 "--report", report, "--quiet", *sky)
    if not sky and any(SKY_ADVISED in line for line in answer.warnings):
        return rendered(scene, size, spp, threads, folder, ("-D", "environment=1"))
    if answer.status:
        return answer, None
    image, told = load(out), json.loads(report.read_text())
    ill = [f"{told[key]} {key}" for key in ("nonfinite_samples", "majorant_violations") if told.get(key)]
    ill += ["not finite"] if not np.isfinite(image).all() else []
    is_told = any(DARK in line for line in answer.warnings)
    if not image.any() and not is_told and spp < MOST_SAMPLES:  # a tiny light that few paths find
        again, picture = rendered(scene, size, 16 * spp, threads, folder, sky)
        return (again, picture) if picture else (answer, (0.0, ["black"], spp))
    black = [] if image.any() else [BLACK_AS_TOLD] if is_told else ["black"]
    return answer, (float(image.mean()), ill + black, spp)


def validated(scene):
    done = subprocess.run([str(BIN / "lightshaft"), "validate", str(scene)], capture_output=True, text=True, errors="replace")
    cases = [line for line in done.stdout.splitlines() if re.search(r"\b(pass|fail)\b", line)]
    good = sum(bool(re.search(r"\bpass\b", line)) for line in cases)
    return ("tests pass" if done.returncode == 0 else "TESTS FAIL"), f"{good} of {len(cases)} cases" if cases else done.stderr.strip()[:200]


def tried(scene, options, folder, reasons):
    answer, made = inspected(scene, options.folder, folder)
    outcome = outcome_of(answer)
    if outcome != "loads":
        reasons.update(kinds_of(answer))
        return outcome, first_error(answer, scene)
    if options.inspect:
        return outcome, f"{len(answer.warnings)} warnings"
    done, picture = rendered(made, options.size, options.spp, options.threads, folder)
    if not picture:
        return "FAILED", f"exit {done.status}: {first_error(done, scene)}"
    mean, ill, spp = picture
    samples = [] if spp == options.spp else [f"at {spp} samples a pixel"]
    return ("NOT HEALTHY" if ill else "renders"), ", ".join(ill + [f"mean {mean:.3g}", f"{len(answer.warnings)} warnings"] + samples)


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
    texts, included = scenes_below(options.folder)
    if options.markdown:
        print("| scene | outcome | |\n|---|---|---|")
    bad, outcomes, reasons = 0, collections.Counter(), collections.Counter()
    for scene, text in texts.items():
        if options.only not in str(scene):
            continue
        if is_fragment(scene, text, included):
            outcome = "fragment", "included by others"
        elif is_test(text):
            outcome = validated(scene)
        else:
            with tempfile.TemporaryDirectory() as folder:
                outcome = tried(scene, options, pathlib.Path(folder), reasons)
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
