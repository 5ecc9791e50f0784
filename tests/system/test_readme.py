"""README's shell blocks do what README says.

Every ```sh block is run as it stands, one after the other in one shell as a reader would, twice. Once in a folder that looks like
a checkout with the demo's farm running: build/demo/data is the data of a farm of this test, build/release/bin the programs under
test. Once beside `lightshaft up` as one with the wheel does, in a folder that has only farm/bin: with what README has him enter
in place of the block for the demo's farm, and with fewer samples. Two blocks are not run: the one of deploy/demo.sh and tests/run.sh, which install packages, build for minutes and run this
very test, and the one that installs a wheel, which fetches others (test_wheel.py installs it without them). Of those two scripts
only this is checked: they are there, may be executed, and their own list of flags (the comment at their top, and the usage that
an unknown flag prints) has each flag that README names.
"""

import os
import re
import subprocess
import tomllib

import exr_layers
import pytest
from local_farm import PATIENCE, ROOT, bin_dir, wait_until
from test_up import BLURS, Up, leaves_nothing  # noqa: F401

README = (ROOT / "README.md").read_text()
SCRIPTS = ("deploy/demo.sh", "tests/run.sh")  # not run here
WHEEL = "bin/pip install"  # not run here either
BLOCKS = re.findall(r"^```sh\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)
RUN = [block for block in BLOCKS if not any(part in block for part in (*SCRIPTS, WHEEL))]


def test_every_block_is_marked_as_one_of_the_shell():
    assert README.count("\n```") == 2 * len(BLOCKS), "a block of README is not marked ```sh, so that nobody runs it"
    assert len(RUN) == len(BLOCKS) - 2, "only the block of the two scripts and that of the wheel are not run"


@pytest.mark.parametrize("script", SCRIPTS)
def test_the_scripts_are_there_and_know_their_flags(script):
    path = ROOT / script
    named = {flag for part in re.findall(rf"{re.escape(script)}[^`\n]*", README) for flag in re.findall(r"--[a-z-]+", part)}

    usage = subprocess.run([path, "--no-such-flag"], cwd=ROOT, capture_output=True, text=True)

    assert os.access(path, os.X_OK)
    assert named and usage.returncode == 2
    described = "\n".join(line for line in path.read_text().splitlines()[:12] if line.startswith("#"))
    for flag in named:
        assert flag in usage.stderr and flag in described, f"README names {script} {flag}"


def test_the_block_of_the_wheel_names_what_there_is():
    block = next(block for block in BLOCKS if WHEEL in block)
    project = tomllib.loads((ROOT / "python/pyproject.toml").read_text())["project"]

    assert set(re.findall(r"\[(\w+)\]", block)) == {"denoise"} <= set(project["optional-dependencies"])
    usage = subprocess.run([bin_dir() / "lightshaft", "up", "--help"], capture_output=True, text=True)
    assert usage.returncode == 0
    for flag in re.findall(r"lightshaft up (--[a-z-]+)", README):
        assert flag in usage.stdout


def follow(blocks, folder, denoiser):
    """Runs the blocks; `denoiser`: the library that these find."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("LIGHTSHAFT_")}
    environment["LIGHTSHAFT_OIDN"] = denoiser

    run = subprocess.run(["bash", "-euo", "pipefail", "-c", "\n".join(blocks)], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                         capture_output=True, text=True, timeout=PATIENCE)

    assert run.returncode == 0, run.stdout + run.stderr
    assert (folder / "fog.png").read_bytes().startswith(b"\x89PNG")
    of_the_farm, of_one_process = (exr_layers.read(folder / name)[0] for name in ("fog.exr", "alone.exr"))
    assert {name: of_the_farm[name] for name in of_one_process} == of_one_process, "README: the same pixels"
    assert any(value > 0 for row in of_the_farm["R"] for value in row)
    return of_the_farm


@pytest.mark.slow
def test_the_blocks_run_as_they_stand(farm, tmp_path):
    checkout = tmp_path / "checkout"
    (checkout / "build" / "demo").mkdir(parents=True)
    (checkout / "build" / "release").mkdir()
    (checkout / "build" / "demo" / "data").symlink_to(farm.data)
    (checkout / "build" / "release" / "bin").symlink_to(farm.bin)
    farm.add_worker(fake=False)
    farm.wait_for_workers(1)

    layers = follow(RUN, checkout, "/no/denoiser")

    assert "denoised.R" not in layers


@pytest.mark.slow
def test_the_blocks_run_beside_the_farm_of_a_wheel_and_denoise(tmp_path, leaves_nothing):  # noqa: F811
    (tmp_path / "farm").mkdir()
    (tmp_path / "farm" / "bin").symlink_to(bin_dir())
    up = Up(tmp_path, environment={"LIGHTSHAFT_OIDN": str(BLURS)})
    up.said("first picture, .* after the start")
    to_enter = [up.said(r"(?m)^other terminals: *(export LIGHTSHAFT_URL=.*)$")[1], *re.findall(r"`(export PATH=[^`]*)`", README)]
    assert len(to_enter) == 2

    blocks = [block.replace("spp 64", "spp 4").replace("spp=64", "spp=4") for block in RUN if "build/demo" not in block]
    layers = follow([*to_enter, *blocks], tmp_path, str(BLURS))

    assert "denoised.R" in layers
    wait_until(lambda: [job["denoise"] for job in up.jobs()] == 3 * [True], "first picture, submitted job and that over HTTP are denoised")
    up.interrupt()
    up.ends()


def test_it_is_short():
    words = re.sub(r"<!-- the table.*?<!-- end of the table -->", "", README, flags=re.DOTALL).split()
    assert len(README.splitlines()) <= 120 and len(words) <= 900
