"""Short versions of tests/chaos/chaos.py, every storm once, and of tests/chaos/hours.py, some faults at once on a small farm."""

import json

import pytest
from chaos import expected_pixels, try_once
from storms import STORMS
from weather import Skip


@pytest.mark.slow
@pytest.mark.parametrize("name", STORMS)
def test_the_image_is_the_same_after(name):
    try:
        pixels, _, _, asked = try_once(name, f"7 {name}")
    except Skip as why:
        pytest.skip(str(why))
    assert pixels == expected_pixels(asked)


@pytest.mark.slow
def test_a_shared_farm_gets_through_faults_of_every_kind_at_once(tmp_path):
    """Half a minute: too short for what grows and for shares, which the page of an hour tells."""
    pytest.importorskip("grpc", reason="python3-grpcio is not installed")
    import hours
    record = hours.Record(tmp_path / "record.jsonl")

    hours.run(hours.read_options(["--minutes", ".5", "--workers", "20", "--jobs", "10", "--faults", "24"]), tmp_path, record)

    told = [json.loads(line) for line in (tmp_path / "record.jsonl").read_text().splitlines()]
    assert [line for line in told if line["kind"] == "wrong"] == []
    assert sum(line["kind"] == "hash" for line in told) >= 5 and sum(line["kind"] == "fault ends" for line in told) >= 3
