#!/usr/bin/env python3
"""Lays out what the site is built from: every Markdown page of the repository, and the files that they link to, where they are.

    docs/site/stage.py FOLDER

So a link means the same on the site and in the repository. The site's navigation is docs/README.md: its sections and rows.
"""
import pathlib
import re
import shutil
import subprocess
import sys

import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
LINK = re.compile(r"\]\(([^)#\s]+)")
ROW = re.compile(r"^\| \[([^\]]+)\]\(([^)]+)\) \| (.*?) \|$")
LEFT_OUT = re.compile(r"^(docs/site/|tests/fuzz/corpus/)")


def pages():
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    return [name for name in listed.stdout.split() if not LEFT_OUT.match(name)]


def linked(page):
    """Files that the page links to: images, and sources, which the site shows as they are."""
    for target in LINK.findall((ROOT / page).read_text()):
        file = (ROOT / page).parent / target
        if "://" not in target and file.is_file():
            yield file.resolve().relative_to(ROOT).as_posix()


def navigation():
    """[{section: [{title: page}]}] of the index."""
    sections = [{"Lightshaft": [{"Lightshaft": "README.md"}]}]
    for line in (ROOT / "docs" / "README.md").read_text().splitlines():
        if line.startswith("## "):
            sections.append({line[3:]: []})
        row = ROW.match(line)
        if row:
            title, target, about = row.groups()
            page = (ROOT / "docs" / target).resolve().relative_to(ROOT).as_posix()
            next(iter(sections[-1].values())).append({f"{title}. {about}" if title.isdigit() else title.replace("`", ""): page})
    sections[0]["Lightshaft"].append({"Index of the docs": "docs/README.md"})
    return sections


def main():
    out = pathlib.Path(sys.argv[1])
    shutil.rmtree(out / "pages", ignore_errors=True)
    for page in pages():
        for name in [page, *linked(page)]:
            (out / "pages" / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, out / "pages" / name)
    shutil.copyfile(ROOT / "docs" / "site" / "site.css", out / "pages" / "site.css")
    settings = (ROOT / "docs" / "site" / "mkdocs.yml").read_text()
    (out / "mkdocs.yml").write_text(settings + "\n" + yaml.safe_dump({"nav": navigation()}, allow_unicode=True, sort_keys=False))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main()
