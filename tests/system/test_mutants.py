"""The faults of tests/mutation/table.py have places in the sources as they are."""

import pytest
from local_farm import ROOT

import run
import table


@pytest.mark.parametrize("path", sorted({mutant.file for mutant in table.MUTANTS}))
def test_every_place_is_there_once(path):
    text = (ROOT / path).read_text(encoding="utf-8")

    mutated = run.mutated(path, text)  # ends with a message where a place is not

    assert mutated.count("::ls::kMutant ==") == sum(mutant.file == path for mutant in table.MUTANTS)
