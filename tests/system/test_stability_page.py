"""The page of the validation table is of one whole run, and names its build."""

import json
import subprocess
import sys

import pytest
from local_farm import ROOT

TABLE = {
    "cases": [
        {"name": "N01-zeros/homogeneous/volpath", "expected": 0, "got": 0, "stderr": 0, "z": 0, "verdict": "pass", "nonfinite": 0, "seconds": .1,
         "rows": "N1", "about": "nothing", "kind": "exact", "tolerance": 0, "paths": 1},
        {"name": "N02-emission-1/grid/volpath", "expected": 1, "got": 1.001, "stderr": .001, "z": 1, "verdict": "pass", "nonfinite": 0, "seconds": .1,
         "rows": "N2", "about": "light given off", "kind": "statistical", "band": .003, "paths": 1000},
    ],
    "passed": 2, "failed": 0, "left_out": [],
    "build": "b" * 64, "numeric_class": "c" * 64, "seed": 17,
}


def write_page(folder, *tables):
    files = []
    for k, table in enumerate(tables):
        files.append(folder / f"{k}.json")
        files[-1].write_text(json.dumps(table))
    docs = folder / "docs"
    run = subprocess.run([sys.executable, "-B", ROOT / "scenes" / "validate" / "stability_page.py", *files, docs], capture_output=True, text=True)
    return run, docs / "measurements" / "stability.md"


def test_the_page_names_the_build_the_class_and_the_seed(tmp_path):
    run, page = write_page(tmp_path, TABLE)

    assert run.returncode == 0, run.stderr
    assert all(word in page.read_text() for word in ("b" * 64, "c" * 64, "seed 17"))


def test_rows_of_two_runs_make_no_page(tmp_path):
    run, page = write_page(tmp_path, TABLE, TABLE)

    assert run.returncode != 0 and "one run" in run.stderr
    assert not page.exists()


@pytest.mark.parametrize("lacking", ["build", "numeric_class", "seed"])
def test_a_table_that_does_not_name_its_build_makes_no_page(tmp_path, lacking):
    run, page = write_page(tmp_path, {key: value for key, value in TABLE.items() if key != lacking})

    assert run.returncode != 0 and lacking in run.stderr
    assert not page.exists()


def test_a_part_of_the_table_makes_no_page(tmp_path):
    run, page = write_page(tmp_path, {**TABLE, "only": "N02"})

    assert run.returncode != 0 and "N02" in run.stderr
    assert not page.exists()
