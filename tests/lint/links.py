#!/usr/bin/env python3
"""Checks the links of the repository's pages, without a network.

    tests/lint/links.py [FOLDER]      default: this checkout

In every Markdown file that git knows: each relative link and image leads to a file or folder that is there, each #anchor to a
heading of its page. In every text file: each path below docs/ that is named (`docs/guide/error.md`, or a folder) is
there. docs/README.md, the index, links to every page of docs.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
LINK = re.compile(r"!?\[(?:[^\]\[]|\[[^\]]*\])*\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)")
MENTION = re.compile(r"(?<![\w./-])docs/[\w./-]*\w")
FENCE = re.compile(r"^(```|~~~).*?^\1\s*$", re.MULTILINE | re.DOTALL)
SKIPPED = re.compile(r"^(tests/fuzz/corpus/|tests/system/test_links\.py$)")  # inputs of fuzzers; the test of this program
MADE_UP = {"docs/a.md"}  # of the test of what a build's name depends on
INDEX = "docs/README.md"
INDEXED = re.compile(r"^docs/(?!README\.md$)(?!measurements/benchmarks/(?!README)).*\.md$")  # a race's report hangs on the page of races


def without_code(text):
    """The text with code blanked out: what stands in it is no link."""
    def blank(match):
        return re.sub(r"[^\n]", " ", match[0])

    return re.sub(r"(`+)(?!`)[^\n]*?(?<!`)\1(?!`)", blank, FENCE.sub(blank, text))


def anchors(text):
    """The names by which headings are reached: GitHub's rule, which mkdocs is told to follow."""
    found = {}
    for match in re.finditer(r"^#{1,6} +(.*?)(?: +#+)?$", FENCE.sub("", text), re.MULTILINE):
        title = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", match[1])
        slug = re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")
        found[slug] = found.get(slug, -1) + 1
        if found[slug]:
            found[f"{slug}-{found[slug]}"] = 0
    return set(found)


def place(text, at):
    return text.count("\n", 0, at) + 1


def broken_links(root, pages):
    """`pages`: {path: text} of the Markdown files."""
    known = {path: anchors(text) for path, text in pages.items()}
    for path, text in pages.items():
        for match in LINK.finditer(without_code(text)):
            target = match[1]
            if re.match(r"[a-z][a-z0-9+.-]*:", target):
                continue
            file, _, anchor = target.partition("#")
            there = (root / path).parent / file if file else root / path
            where = f"{path}:{place(text, match.start())}"
            if not there.exists():
                yield f"{where}: a link to {target}, which is not there"
                continue
            name = there.resolve().relative_to(root.resolve()).as_posix()
            if anchor and name in known and anchor not in known[name]:
                yield f"{where}: a link to {target}: {name} has no such heading"


def broken_mentions(root, texts):
    """`texts`: {path: text} of all files."""
    for path, text in texts.items():
        for match in MENTION.finditer(text):
            named = match[0].rstrip("/.")
            if named not in MADE_UP and not (root / named).exists():
                yield f"{path}:{place(text, match.start())}: names {named}, which is not there"


def not_in_the_index(root, pages):
    linked = set()
    for match in LINK.finditer(without_code(pages.get(INDEX, ""))):
        linked.add(((root / INDEX).parent / match[1].partition("#")[0]).resolve())
    for path in pages:
        if INDEXED.match(path) and (root / path).resolve() not in linked:
            yield f"{path}: {INDEX} has no line for it"


def texts_of(root):
    found = {}
    for name in subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=root, capture_output=True,
                               text=True, check=True).stdout.split("\0"):
        if name and not SKIPPED.match(name) and (root / name).is_file():
            data = (root / name).read_bytes()
            if b"\0" not in data:
                found[name] = data.decode(errors="replace")
    return found


def faults(root):
    texts = texts_of(root)
    pages = {path: text for path, text in texts.items() if path.endswith(".md")}
    yield from broken_links(root, pages)
    yield from broken_mentions(root, texts)
    yield from not_in_the_index(root, pages)


def main():
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT
    found = list(faults(root))
    for fault in found:
        print(fault)
    if not found:
        print("every link and every path below docs/ leads somewhere")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
