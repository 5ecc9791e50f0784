"""`lightshaft validate` without a file: the table of stiff and extreme cases passes, by its quick bands in every run."""

import json

import pytest
from cli_kit import lightshaft


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    out = tmp_path_factory.mktemp("table") / "table.json"
    lightshaft("validate", "--quick", "--json", out)
    return json.loads(out.read_text())


def test_every_case_passes_with_figures_of_its_own(table):
    assert table["failed"] == 0 and table["passed"] == len(table["cases"]) > 0
    for case in table["cases"]:
        assert case["verdict"] == "pass" and case["nonfinite"] == 0
        assert case["kind"] in ("exact", "statistical") and case["about"] and case["rows"], case["name"]


def test_cases_are_chosen_by_prefix_or_glob(tmp_path):
    out = tmp_path / "one.json"
    lightshaft("validate", "--case", "N01-*/grid/volpath", "--json", out)
    assert [case["name"] for case in json.loads(out.read_text())["cases"]] == ["N01-no-extinction/grid/volpath"]
    assert "no such case" in lightshaft("validate", "--case", "nothing", code=2).stderr
