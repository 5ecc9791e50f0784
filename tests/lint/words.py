#!/usr/bin/env python3
"""Checks that identifiers and texts use the field's words instead of words that only this project uses.

usage: words.py            checks identifiers in C++, and texts (string literals) in C++, Python, JSON and JavaScript;
                           prints each violation and ends with 1 if there is one
"""
import ast
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
    ("say", "core/scene/analysis/needs.cpp"): "adds a sentence to a text for people",
    ("say", "worker/render/vdb/vdb_module.cpp"): "writes a message to the standard error stream",
    ("said", "util/report/log_plot.cpp"): "numbers that the drawing's text already has",
    ("glows", "worker/render/world/world_build.cpp"): "a local name",
    ("outlook", "util/report/job_curves.cpp"): "the forecast beyond the curve, as its plot calls it",
    ("outlook", "util/report/job_sections.h"): "the forecast beyond the curve, as its plot calls it",
    ("kTellingSamples", "core/image/error/error_estimate.cpp"): "samples from which the halves tell the error",
    ("said", "worker/render/media/vdb_reply.cpp"): "what the other process replied",
    ("said", "coordinator/store/redis/redis_link.cpp"): "Redis' own words",
}

# Phrases that texts for users must not have, and their replacements.
PHRASES = {
    r"\blen[dt]s?\b": "leased",
    r"\b(?:is|are|was|were|be|been|being) told\b": "notified, sent; 'the worker does not know'",
    r"\bhand(?:s|ed|ing)? (?:it |them )?in\b": "submit (a job), deliver (a result)",
    r"\bwhose (?:it is|they are)\b": "its owner",
    r"\b(?:go|goes|went|gone|going) on\b": "continue",
    r"\bat most so many\b": "largest number of",
    r"\banew\b": "again",
    r"\bnought\b": "0",
    r"\w,? say(?=$|[.;)])": "for example",
    r"\bmakes? (?:its |their )?pixels up\b": "invents pixels",
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


LITERAL = re.compile(r'"((?:\\.|[^"\\\n])*)"')
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.S)


def texts_of(path, text):
    """[(line, text)] of the string literals of one file; adjacent ones of C++ and Python are one text."""
    if path.endswith(".py"):
        return [(node.lineno, node.value) for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    if path.endswith((".cpp", ".h")):
        # Comments are blanked out, but not what looks like one within a literal.
        text = re.sub(LITERAL.pattern + "|" + COMMENT.pattern, lambda m: m[0] if m[0].startswith('"') else re.sub(r"[^\n]", " ", m[0]), text, flags=re.S)
        groups = re.finditer(r'"(?:\\.|[^"\\\n])*"(?:\s+"(?:\\.|[^"\\\n])*")*', text)
        return [(text.count("\n", 0, m.start()) + 1, "".join(LITERAL.findall(m[0]))) for m in groups]
    if path.endswith(".js"):
        text = COMMENT.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)
        return [(text.count("\n", 0, m.start()) + 1, m[1] or m[2] or "") for m in re.finditer(LITERAL.pattern + r"|`([^`]*)`", text)]
    return [(text.count("\n", 0, m.start()) + 1, m[1]) for m in LITERAL.finditer(text)]


def bad_texts(path, text):
    """[(line, phrase, what to say instead)] of one file."""
    found = []
    for line, literal in texts_of(path, text):
        for pattern, instead in PHRASES.items():
            for match in re.finditer(pattern, literal, re.IGNORECASE):
                found.append((line, match[0], instead))
    return found


# Programs and pages that users meet, not tests and tools.
TEXTS = re.compile(r"^(blender|cli|common|compare|coordinator|core|formats|python/src|util|validation|web/static|worker)/.*\.(cpp|h|py|json|js)$")


def main():
    listed = subprocess.run(["git", "ls-files", "*.h", "*.cpp"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split()
    bad = used = 0
    for path in (p for p in listed if not p.startswith(("tests/", "bench/"))):
        text = (ROOT / path).read_text(encoding="utf-8")
        used += sum(allowed == path and re.search(rf"\b{name}\b", text) is not None for name, allowed in ALLOWED)
        for line, name, word in violations(path, text):
            print(f"{path}:{line}: '{name}': not '{word}' but {WORDS[word]}")
            bad += 1
    files = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.splitlines()
    for path in filter(TEXTS.match, files):
        for line, phrase, instead in bad_texts(path, (ROOT / path).read_text(encoding="utf-8")):
            print(f"{path}:{line}: '{phrase}': not so in a text for users, but {instead}")
            bad += 1
    if used < len(ALLOWED):
        print("tests/lint/words.py allows identifiers that are gone: take them off its list")
        bad += 1
    if not bad:
        print("identifiers and texts use the field's words")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
