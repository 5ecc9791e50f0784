"""The package is typed: its own code is, and editors see a setting that there is none of."""

import subprocess
import sys

import pytest
from local_farm import ROOT

SETTINGS = (
    "--strict",
    "--config-file",
    ROOT / "python/pyproject.toml",
    "--cache-dir",
    ROOT / "build/python/mypy",
)


def mypy(*arguments):
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *SETTINGS, *arguments], capture_output=True, text=True
    )
    return done.returncode, done.stdout


@pytest.mark.parametrize("package", ["lightshaft", "lightshaft_command"])
def test_the_package_keeps_its_types(package):
    code, complaints = mypy("-p", package)
    assert code == 0, complaints


@pytest.mark.parametrize(
    "line, complaint",
    [
        (
            'farm.submit("a.xml", spp=4, size=(8, 8), aov=["depth"]).wait(progress=True).image().mean()',
            None,
        ),
        ('farm.submit({"type": "scene"}, assets={"a": b""}, target_error=1e-3).view["relmse_ci95"]', None),
        ('farm.submit("a.xml", spq=3)', "spq"),
        ('farm.submit("a.xml", spp="many")', "spp"),
        ('farm.jobs()[0].view["progres"]', "progres"),
    ],
)
def test_users_code_is_checked(tmp_path, line, complaint):
    (tmp_path / "user.py").write_text(f"import lightshaft\n\nfarm = lightshaft.Farm()\n{line}\n")

    code, told = mypy(tmp_path / "user.py")

    assert (code == 0) == (complaint is None) and (complaint or "Success") in told, told
