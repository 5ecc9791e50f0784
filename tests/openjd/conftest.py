import pytest
from openjd_job import OpenjdJob


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
