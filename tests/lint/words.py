#!/usr/bin/env python3
"""Whether identifiers use the field's words: none has a word that means something to nobody outside of this project.

usage: words.py            checks the C++ files of the repository; ends with 1 and a line for each violation
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]

# A part of an identifier, and what to use instead.
WORDS = {
    "say": "print, report", "says": "print, report", "said": "reply, reported", "tell": "send, report, notify", "tells": "send, report, notify",
    "told": "sent, reported, notified", "telling": "sending, reporting", "untold": "unreported", "book": "table, registry", "barred": "quarantined",
    "distrust": "quarantine", "distrusted": "quarantined", "liar": "faulty", "kit": "builder", "glow": "medium emission", "glows": "emits", "veil": "null transmission",
    "veils": "null transmission", "matte": "cryptomatte", "mattes": "cryptomattes", "elsewhere": "the place meant", "hungry": "wanting work",
    "steered": "adaptive", "foreseen": "predicted, speculative", "chore": "background write", "chores": "background writes",
    "awaited": "missing", "dormant": "unloaded", "witness": "voter", "witnesses": "voters", "patiently": "with retries", "outlook": "eta",
    "believe": "validate, trust", "believed": "validated", "heed": "apply", "intake": "admission", "stretch": "optical depth", "cage": "sandbox",
    "caged": "sandboxed", "mouthful": "allocation chunk", "misbehave": "inject fault", "unwell": "unhealthy",
    "lend": "lease", "lent": "leased", "sick": "unhealthy", "patience": "retry policy, time limit",
}
# (identifier, file): why it stays.
ALLOWED = {
    ("say", "common/scene/analysis/needs.cpp"): "adds a sentence to a text for people",
    ("say", "worker/render/vdb/vdb_module.cpp"): "writes a message to the standard error stream",
    ("said", "common/report/log_plot.cpp"): "numbers that the drawing's text already has",
    ("glows", "worker/render/world/world_build.cpp"): "a local name",
    ("outlook", "common/report/job_curves.cpp"): "the forecast beyond the curve, as its plot calls it",
    ("outlook", "common/report/job_sections.h"): "the forecast beyond the curve, as its plot calls it",
    ("kTellingSamples", "common/image/error/error_estimate.cpp"): "samples from which the halves tell the error",
    ("said", "worker/render/media/vdb_reply.cpp"): "what the other process replied",
    ("said", "coordinator/store/redis/redis_link.cpp"): "Redis' own words",
}

TOKEN = re.compile(r'(R"(\w*)\(.*?\)\2"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'|//[^\n]*|/\*.*?\*/|#include[^\n]*)|([A-Za-z_]\w*)', re.S)
PART = re.compile(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])")


def violations(path, text):
    """[(line, identifier, word)] of one file: each identifier once, where it is first."""
    found = {}
    for token in TOKEN.finditer(text):
        name = token[3]
        if not name or name in found:
            continue
        word = next((part.lower() for part in PART.findall(name) if part.lower() in WORDS), None)
        if word and (name, path) not in ALLOWED:
            found[name] = (text.count("\n", 0, token.start()) + 1, name, word)
    return list(found.values())


def main():
    listed = subprocess.run(["git", "ls-files", "*.h", "*.cpp"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split()
    bad = used = 0
    for path in (p for p in listed if not p.startswith("tests/")):
        text = (ROOT / path).read_text(encoding="utf-8")
        used += sum(allowed == path and re.search(rf"\b{name}\b", text) is not None for name, allowed in ALLOWED)
        for line, name, word in violations(path, text):
            print(f"{path}:{line}: '{name}': not '{word}' but {WORDS[word]}")
            bad += 1
    if used < len(ALLOWED):
        print("tests/lint/words.py allows identifiers that are gone: take them off its list")
        bad += 1
    if not bad:
        print("identifiers use the field's words")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
