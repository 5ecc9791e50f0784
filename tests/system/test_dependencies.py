"""docs/reference/dependencies.md names what deploy/packages.txt installs, all of it and nothing else (its versions are those of one machine)."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_lists_every_package():
    lines = (ROOT / "deploy/packages.txt").read_text().splitlines()
    packages = [line.split()[0] for line in lines if line and line[0] not in "#["]
    listed = re.findall(r"^\| `([^`]+)` \| \S+ \|", (ROOT / "docs/reference/dependencies.md").read_text(), re.MULTILINE)
    assert listed == packages, "deploy/dependencies.sh > docs/reference/dependencies.md writes it anew"
