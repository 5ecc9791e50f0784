"""The shell blocks of the guides for newcomers do what the pages say: they run as they stand, in the order in which a reader
meets them, in one shell and in a folder that looks like a checkout with the demo's farm running."""

import os
import re
import subprocess

import exr_layers
import pytest
from local_farm import PATIENCE, ROOT

PAGES = ("first-hour", "noisy", "coming-from")
TEXT = {page: (ROOT / f"docs/guide/{page}.md").read_text() for page in PAGES}
BLOCKS = [block for page in PAGES for block in re.findall(r"^```sh\n(.*?)^```$", TEXT[page], re.MULTILINE | re.DOTALL)]


@pytest.mark.slow
def test_the_blocks_run_as_they_stand(farm, tmp_path):
    (tmp_path / "build" / "demo").mkdir(parents=True)
    (tmp_path / "build" / "release").mkdir()
    (tmp_path / "build" / "demo" / "data").symlink_to(farm.data)
    (tmp_path / "build" / "release" / "bin").symlink_to(farm.bin)
    farm.add_worker(fake=False)
    farm.wait_for_workers(1)
    environment = {name: value for name, value in os.environ.items() if not name.startswith("LIGHTSHAFT_")}

    run = subprocess.run(["bash", "-euo", "pipefail", "-c", "\n".join(BLOCKS)], cwd=tmp_path, env=environment, stdin=subprocess.DEVNULL,
                         capture_output=True, text=True, timeout=PATIENCE)

    assert run.returncode == 0, run.stdout + run.stderr
    assert (tmp_path / "quick.png").read_bytes().startswith(b"\x89PNG")
    assert exr_layers.read(tmp_path / "lamp v1.exr")[0].keys() >= {"R", "G", "B"}
    assert "verdict" in run.stdout
    assert (tmp_path / "flicker_0020.exr").stat().st_size > 0
    assert "late" in run.stdout.splitlines()[-1]


FOLLOWED = (*PAGES, "add-a-machine")  # by these tests; the commands of the last are run by test_up.py


@pytest.mark.parametrize("page", FOLLOWED)
def test_the_list_of_pages_has_it(page):
    assert f"(guide/{page}.md)" in (ROOT / "docs/README.md").read_text()


def test_every_command_that_a_page_names_is_there():
    known = subprocess.run([os.environ.get("LIGHTSHAFT_CLI", ROOT / "build/release/bin/lightshaft"), "--help"], capture_output=True,
                           text=True, check=True).stdout
    commands = set(re.findall(r"^  ([a-z]+) ", known, re.MULTILINE))

    texts = [(ROOT / f"docs/guide/{page}.md").read_text() for page in FOLLOWED]
    named = {name for text in texts for name in re.findall(r"lightshaft ([a-z]+)", text)}

    assert len(named) > 10 and named <= commands, named - commands


def test_the_options_of_the_farm_in_one_command_are_there():
    program = os.environ.get("LIGHTSHAFT_CLI", ROOT / "build/release/bin/lightshaft")
    known = set()
    for command in ("up", "join", "doctor", "workers", "farm up", "worker", "submit"):
        told = subprocess.run([program, *command.split(), "--help"], capture_output=True, text=True).stdout
        known |= set(re.findall(r"--[a-z][a-z-]*", told))
    told = subprocess.run([ROOT / "build/release/bin/lightshaft-coordinator", "--help"], capture_output=True, text=True).stdout
    known |= set(re.findall(r"--[a-z][a-z-]*", told))

    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", (ROOT / "docs/guide/add-a-machine.md").read_text()))

    assert len(named) > 6 and named <= known, named - known
