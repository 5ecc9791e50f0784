import pathlib
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/support"), str(ROOT / "tests/system")]

from cli_kit import write_fog  # noqa: E402
from local_farm import LocalFarm  # noqa: E402
from openjd_job import OpenjdJob  # noqa: E402


@pytest.fixture
def farm(tmp_path):
    with LocalFarm(tmp_path / "farm") as farm:
        yield farm


@pytest.fixture
def fog(tmp_path):
    return write_fog(tmp_path)


@pytest.fixture
def run(tmp_path):
    """Runs a template with parameters; ends what a failed test leaves behind."""
    jobs = []

    def run(template, *options, **parameters):
        jobs.append(OpenjdJob(template, tmp_path / f"openjd-{len(jobs)}.log", *options, **parameters))
        return jobs[-1]

    yield run
    for job in jobs:
        job.abandon()
