"""What is made of the documents is what they say, and each difference is found."""

import json
import shutil
import subprocess
import sys
import tomllib
import zipfile

import pytest
from local_farm import ROOT

import lightshaft


def check(root):
    return subprocess.run(
        [sys.executable, root / "python/generate.py", "--check"], capture_output=True, text=True
    )


@pytest.fixture
def copy(tmp_path):
    """The documents and the package, in a folder of the test."""
    for name in ("coordinator/http/openapi.json", "docs/reference/mitsuba.md"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    shutil.copytree(ROOT / "python", tmp_path / "python", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def test_the_package_is_of_these_documents():
    done = check(ROOT)
    assert done.returncode == 0, done.stderr


def test_a_field_that_changes_its_type_is_found(copy):
    path = copy / "coordinator/http/openapi.json"
    document = json.loads(path.read_text())
    document["components"]["schemas"]["Job"]["properties"]["progress"]["type"] = "string"
    path.write_text(json.dumps(document))

    done = check(copy)

    assert done.returncode == 1 and "models.py" in done.stderr and "_plugins.py" not in done.stderr


def test_a_new_plugin_and_a_method_that_only_waits_are_found(copy):
    page = copy / "docs/reference/mitsuba.md"
    page.write_text(page.read_text().replace("| shape | `cube` |", "| shape | `cone` | 3 | read |  |\n| shape | `cube` |"))
    farm = copy / "python/src/lightshaft/farm.py"
    farm.write_text(farm.read_text().replace("def workers(", "def helpers("))

    done = check(copy)

    assert done.returncode == 1 and "_plugins.py" in done.stderr and "aio.py" in done.stderr


def test_the_wheel_is_pure_typed_and_of_the_programs_version():
    project = tomllib.loads((ROOT / "python/pyproject.toml").read_text())["project"]
    (wheel,) = (ROOT / "build/python/dist").glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()

    assert wheel.name == f"lightshaft-{project['version']}-py3-none-any.whl"
    assert "lightshaft/py.typed" in names and not any(name.endswith((".so", ".c")) for name in names)
    assert f"project(lightshaft VERSION {project['version']} " in (ROOT / "CMakeLists.txt").read_text()
    assert not lightshaft.__file__.startswith(str(ROOT / "python")), (
        "the tests are to use the wheel, not the sources"
    )
