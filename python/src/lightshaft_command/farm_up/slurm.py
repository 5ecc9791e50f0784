"""Slurm as an engine: workers are jobs. sbatch starts them as an array, squeue lists them, scancel drains and ends them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from lightshaft_command.farm_up import child
from lightshaft_command.farm_up.engine import Command, State, Unreadable, Worker, first_line, ids_of
from lightshaft_command.programs import Problem

MOST_IN_A_CALL = 500  # jobs that one call of scancel gets
# RESIZING and the like are listed too: a job that is not listed counts as ended.
STATES = "PENDING,CONFIGURING,RUNNING,COMPLETING,SUSPENDED,STOPPED,RESIZING,REQUEUED,REQUEUE_HOLD,SPECIAL_EXIT,SIGNALING"
# The job's script. The worker's command line is passed as arguments, so that no shell parses it. `exec` makes the worker the process
# that Slurm signals. The token is in a file that only its owner can read, since other users may see the arguments of a job. The cache
# is on the scratch disk that Slurm or the site gives the job; workers of one user on one machine share it.
SCRIPT = """#!/bin/sh
scratch=${SLURM_TMPDIR:-${TMPDIR:-/tmp}}
exec "$@-${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" --cache "$scratch/lightshaft-$(id -u)"
"""


@dataclass
class Options:
    worker: Command
    minutes: int = 60  # time limit of a worker's job
    drain_seconds: int = 120  # how long before the time limit Slurm signals the worker to drain
    logs: str = "."
    sbatch: list[str] = field(default_factory=list)  # more options of sbatch, one word each


class Slurm:
    def __init__(self, options: Options):
        try:
            version = child.run(["sbatch", "--version"])
        except Problem:
            version = child.Output(1, "", "")
        if version.code != 0:
            raise Problem("sbatch does not run here: run this on a machine that submits jobs to Slurm")
        self.version = first_line(version.out)
        self._options = options
        self._name = f"lightshaft-{options.worker.farm}"

    def workers(self) -> list[Worker]:
        return parse_squeue(_run(["squeue", "--me", "--noheader", "--array", f"--name={self._name}", f"--states={STATES}", "--format=%i|%T|%M|%C|%r"]))

    def start(self, count: int) -> Sequence[str]:
        options, w = self._options, self._options.worker
        job = ["--parsable", f"--job-name={self._name}", f"--array=1-{count}", "--ntasks=1", f"--cpus-per-task={w.threads}", f"--time={options.minutes}",
               f"--signal=B:TERM@{options.drain_seconds}", "--requeue", "--open-mode=append", "--export=NONE",
               f"--output={options.logs}/{self._name}-%A_%a.log", *options.sbatch]  # fmt: skip
        # The script appends the job's id to the name, which is the last word.
        worker = [w.program, "--coordinator", w.coordinator, "--threads", str(w.threads), "--token-file", w.token_file, *w.options, "--name", w.farm]
        started = _run(["sbatch", *job, "/dev/stdin", *worker], SCRIPT)
        id = re.split("[;\n]", started)[0]  # with --parsable, sbatch prints JOB or JOB;CLUSTER
        return [f"{id}_{task}" for task in range(1, count + 1)]

    def drain(self, workers: Sequence[Worker]) -> None:
        # With --batch only the worker itself gets the signal. With --state=PENDING, jobs that have started since they were listed are
        # left alone; they are drained after the next list.
        try:
            _scancel(["--batch", "--signal=TERM"], ids_of(workers, running=True))
        finally:
            _scancel(["--state=PENDING"], ids_of(workers, running=False))

    def kill(self, workers: Sequence[Worker]) -> None:
        _scancel([], [w.id for w in workers])


def _run(words: Sequence[str], text: str = "") -> str:
    done = child.run(words, text)
    if done.code != 0:
        raise Problem(f"{words[0]}: {first_line(done.err)}")
    return done.out


def _scancel(options: Sequence[str], jobs: Sequence[str]) -> None:
    for begin in range(0, len(jobs), MOST_IN_A_CALL):
        done = child.run(["scancel", *options, *jobs[begin : begin + MOST_IN_A_CALL]])
        # Jobs may have ended since they were listed, which is no error. The call must not be repeated: the other jobs have received
        # their signal, and a second SIGTERM stops a worker immediately.
        complaints = done.err.splitlines()
        only_ended = complaints and all("already completing or completed" in line or "Invalid job id" in line for line in complaints)
        if done.code != 0 and not only_ended:
            raise Problem(f"scancel: {first_line(done.err)}")


def _seconds_of(text: str) -> float | None:
    """Parses Slurm's [days-]hours:minutes:seconds, where leading parts may be missing."""
    if not re.fullmatch(r"([0-9]+-)?[0-9]+(:[0-9]+)*", text):
        return None
    days, _, clock = text.rpartition("-")
    seconds = 0
    for part in clock.split(":"):
        seconds = seconds * 60 + int(part)
    return int(days or 0) * 86400.0 + seconds


def parse_squeue(lines: str) -> list[Worker]:
    """Unreadable: a line does not have the format that Slurm.workers() requests."""
    return [_parse_job(line) for line in lines.split("\n") if line]


def _parse_job(line: str) -> Worker:
    id, state, time, cores, reason = (*line.split("|"), "", "", "", "")[:5]
    seconds, count = _seconds_of(time), re.fullmatch("[1-9][0-9]*", cores)
    if seconds is None or not count:
        raise Unreadable(f"squeue answered '{line}'")
    # Two kinds of jobs count as stuck, so that other workers are started instead: jobs that Slurm holds because several attempts to
    # start them failed, and jobs that Slurm delays by two minutes (BeginTime) after it has requeued them because their node was lost.
    pending_stuck = state == "PENDING" and ("requeued held" in reason or reason.startswith("JobHeld") or reason == "BeginTime")
    # A job that is being requeued is COMPLETING at first, and still occupies its cores.
    running = state in ("RUNNING", "COMPLETING", "SUSPENDED", "STOPPED", "SIGNALING")
    is_now: State = "stuck" if pending_stuck or state in ("REQUEUE_HOLD", "SPECIAL_EXIT") else "running" if running else "waiting"
    return Worker(id, is_now, seconds, int(count[0]))
