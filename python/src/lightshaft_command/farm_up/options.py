"""The options of `lightshaft farm up`. The program `lightshaft` describes them (cli/commands/farm_up_command.cpp), checks the names, and
passes those that were given as words "--name=value"."""

import pathlib
import re
import stat
from collections.abc import Sequence

from lightshaft_command.console import Given
from lightshaft_command.farm_up import docker, kubernetes, loop, slurm, ssh
from lightshaft_command.farm_up.coordinator import Coordinator
from lightshaft_command.farm_up.costs import CORE_HOUR, Budgets
from lightshaft_command.farm_up.engine import Command, Engine
from lightshaft_command.farm_up.numbers import positive_option, whole_option
from lightshaft_command.farm_up.scaler import Limits
from lightshaft_command.files import check_folder
from lightshaft_command.programs import Usage, beside

MOST_SECONDS, MOST_HOURS, MOST_MINUTES = 1e7, 1e9, 60 * 24 * 365
MOST_SECRET = 4096  # bytes


def _whole(given: Given, name: str, default: int, most: int) -> int:
    return whole_option(name, given.text(name, str(default)), 1, most)


def _seconds(given: Given, name: str, default: int) -> float:
    return positive_option(name, given.text(name, str(default)), MOST_SECONDS)


def _budget(given: Given, name: str) -> float | None:
    return _core_seconds(name, given.text(name)) if given.flag(name) else None


def _core_seconds(option: str, hours: str) -> float:
    return positive_option(option, hours, MOST_HOURS) * CORE_HOUR


def read_budgets(given: Given) -> Budgets:
    budgets = Budgets(job=_budget(given, "--job-budget"))
    for text in given.all("--user-budget"):  # HOURS, for each user, or USER=HOURS
        user, sign, hours = text.rpartition("=")
        core_seconds = _core_seconds("--user-budget", hours)
        if sign:
            budgets.users[user] = core_seconds
        else:
            budgets.user = core_seconds
    return budgets


def read_settings(given: Given) -> loop.Settings:
    name = given.text("--name", "farm")
    if not re.fullmatch("[A-Za-z0-9_]{1,40}", name):  # it becomes part of the names of workers, Slurm jobs and files
        raise Usage(f"--name '{name}': letters, digits and _, at most 40 of them")
    limits = Limits(
        farm=name,
        most_workers=_whole(given, "--workers", 1, 10_000),
        threads=_whole(given, "--threads", 1, 1024),
        finish_in=_seconds(given, "--finish-in", 600),
        idle_seconds=_seconds(given, "--idle", 60),
        drain_seconds=_seconds(given, "--drain", 120),
        poll_seconds=_seconds(given, "--poll", 5),
        budget_core_seconds=_budget(given, "--budget"),
    )
    report = pathlib.Path(given.text("--report") or f"lightshaft-{name}.json")
    return loop.Settings(limits, read_budgets(given), report, given.flag("--until-done"), given.flag("--json"))


def read_join_token(file: str) -> str:
    """From a file that not everybody may read."""
    if not file:
        raise Usage("--join-token FILE is needed: DATA/join-token of the coordinator")
    try:
        with open(file, "rb") as token_file:
            if stat.S_IMODE(pathlib.Path(file).stat().st_mode) & stat.S_IROTH:
                raise Usage(f"--join-token: everybody on this machine may read {file}: chmod 600 it")
            words = token_file.read(MOST_SECRET).decode(errors="surrogateescape").split()
    except OSError:
        raise Usage(f"--join-token: {file} cannot be opened") from None
    if not words:
        raise Usage(f"--join-token: {file} has no token in it")
    return words[0]


def open_engine(given: Given, limits: Limits) -> Engine:
    name = given.text("--on")
    logs = pathlib.Path(given.text("--logs", "."))
    check_folder("--logs", logs)
    drain_seconds = int(limits.drain_seconds)

    def minutes() -> int:
        return _whole(given, "--minutes", 60, MOST_MINUTES)

    if name == "kubernetes":
        return kubernetes.Kubernetes(
            kubernetes.Options(limits.farm, given.text("--like", "deployment/worker"), limits.threads, drain_seconds, minutes(), str(logs),
                               given.all("--kubectl"), given.all("--worker-option")))  # fmt: skip
    token = read_join_token(given.text("--join-token"))
    if not given.text("--coordinator"):
        raise Usage("--coordinator HOST:PORT is needed: as workers reach it")
    usual = "lightshaft-worker" if name == "docker" else str(beside("lightshaft-worker"))
    worker = Command(limits.farm, given.text("--worker") or usual, given.text("--coordinator"), str(pathlib.Path(given.text("--join-token")).absolute()),
                     limits.threads, given.all("--worker-option"))  # fmt: skip
    log_folder = str(logs.absolute())
    if name == "slurm":
        return slurm.Slurm(slurm.Options(worker, minutes(), drain_seconds, log_folder, given.all("--sbatch")))
    if name == "docker":
        return docker.Docker(docker.Options(worker, token, given.text("--image", "lightshaft-worker:local"), drain_seconds, log_folder, given.all("--docker")))
    if not given.text("--machines"):
        raise Usage("--machines FILE is needed with --on ssh: one machine a line")
    return ssh.Ssh(ssh.Options(worker, token, ssh.read_machines(given.text("--machines")), given.text("--ssh-config"), log_folder))


def run(words: Sequence[str]) -> int:
    pause = loop.Pause()
    given = Given(words)
    settings = read_settings(given)
    engine = open_engine(given, settings.limits)
    loop.FarmUp(Coordinator(given.words("--to", "--token-file", "--ca")), engine, settings).run(pause)
    return 0
