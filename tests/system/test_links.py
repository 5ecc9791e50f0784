"""tests/lint/links.py finds links that lead nowhere, and nothing in this repository."""

import subprocess
import sys

import pytest
from local_farm import ROOT


def check(folder, **files):
    for name, text in {"docs/README.md": "# Index\n\n[Page](guide/page.md)\n", "docs/guide/page.md": "# Page\n\n## One `word`, two\n", **files}.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    subprocess.run(["git", "init", "-q", folder], check=True)
    return subprocess.run([sys.executable, "-B", ROOT / "tests" / "lint" / "links.py", folder], capture_output=True, text=True)


def test_this_repository_has_none():
    run = subprocess.run([sys.executable, "-B", ROOT / "tests" / "lint" / "links.py"], capture_output=True, text=True)

    assert run.returncode == 0, run.stdout


def test_links_that_lead_somewhere_pass(tmp_path):
    run = check(tmp_path, **{
        "README.md": "[docs](docs) ![x](docs/guide/page.md) [there](docs/guide/page.md#one-word-two) [here](#a-heading) [out](https://no.where)\n"
                     "## A heading\n```\n[code](nowhere.md)\n```\n`[code](nowhere.md)`\n",
        "a.py": "# docs/guide/page.md says how.\n"})

    assert run.returncode == 0, run.stdout


@pytest.mark.parametrize("name, text, said", [
    ("README.md", "[x](docs/gone.md)", "README.md:1: a link to docs/gone.md"),
    ("docs/guide/b.md", "\n[x](page.md#three)", "docs/guide/b.md:2: a link to page.md#three"),
    ("docs/guide/b.md", "![x](../images/gone.png)", "a link to ../images/gone.png"),
    ("SECURITY.md", "[a `b` [c]](#nothing)", "a link to #nothing"),
    ("a.h", "// In docs/page.md.\n", "a.h:1: names docs/page.md"),
    ("README.md", "As `docs/guide/gone.md` says", "names docs/guide/gone.md"),
    ("docs/guide/b.md", "# A page of which the index says nothing", "docs/guide/b.md: docs/README.md has no line"),
])
def test_others_are_named_with_their_line(tmp_path, name, text, said):
    run = check(tmp_path, **{name: text})

    assert run.returncode == 1 and said in run.stdout, run.stdout
