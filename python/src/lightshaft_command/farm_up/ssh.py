"""ssh as an engine: workers run on a list of machines, one on each, for sites without Slurm, Docker or Kubernetes.

A worker lives as long as its ssh connection: when the connection breaks, or `farm up` ends, it delivers its results and ends.
"""

import pathlib
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass

from lightshaft_command.farm_up import child
from lightshaft_command.farm_up.engine import Command, Worker, worker_name
from lightshaft_command.programs import Problem, Usage

# The script that runs on the machine, the same for every worker. From standard input it reads the worker's command line, one word on
# each line up to an empty line, and then the token. So no shell parses the words, and no list of processes shows the token. When
# standard input ends, because `farm up` closed it or the connection broke, the script signals the worker to deliver its results and
# end.
REMOTE = """sh -c 'set --
while IFS= read -r word && [ -n "$word" ]; do set -- "$@" "$word"; done
IFS= read -r LIGHTSHAFT_JOIN_TOKEN
export LIGHTSHAFT_JOIN_TOKEN
exec 3<&0
"$@" </dev/null 3<&- & worker=$!
(while read -r word; do :; done; kill -TERM "$worker") <&3 >/dev/null 2>&1 & reader=$!
exec 3<&-
wait "$worker"; code=$?
kill "$reader" 2>/dev/null
exit "$code"'"""


@dataclass
class Options:
    worker: Command  # its token_file is not used: the token is sent through the connection
    join_token: str
    machines: list[str]  # names for ssh: HOST, USER@HOST or a name in its configuration
    config: str = ""  # ssh's configuration file; empty: the default one
    logs: str = "."


@dataclass
class _Running:
    id: str
    ssh: child.LongCommand
    since: float


class Ssh:
    def __init__(self, options: Options):
        try:
            version = child.run(["ssh", "-V"], most_seconds=10.0)
        except Problem:
            version = child.Output(1, "", "")
        if version.code != 0:
            raise Problem("ssh does not run here: install an OpenSSH client")
        self.version = re.split("[,\n]", version.err)[0]
        self._options = options
        self._running: dict[str, _Running] = {}  # by machine
        self._next = self._count = 0

    def workers(self) -> list[Worker]:
        self._running = {machine: r for machine, r in self._running.items() if not r.ssh.ended()}
        now = time.monotonic()
        return [Worker(r.id, "running", now - r.since, self._options.worker.threads) for _, r in sorted(self._running.items())]

    def start(self, count: int) -> Sequence[str]:
        """Tries the machines in turn, so that one that is down does not get every attempt."""
        machines = self._options.machines
        ids: list[str] = []
        for _ in machines:
            if len(ids) == count:
                break
            machine = machines[self._next % len(machines)]
            self._next += 1
            if machine not in self._running:
                ids.append(self._start_on(machine))
        return ids

    def drain(self, workers: Sequence[Worker]) -> None:
        for ssh in self._of(workers):
            ssh.close_input()

    def kill(self, workers: Sequence[Worker]) -> None:
        for ssh in self._of(workers):
            ssh.kill()

    def _of(self, workers: Sequence[Worker]) -> list[child.LongCommand]:
        ids = {w.id for w in workers}
        return [r.ssh for r in self._running.values() if r.id in ids]

    def _start_on(self, machine: str) -> str:
        options, w = self._options, self._options.worker
        self._count += 1
        id = f"{machine}-{self._count}"
        remote = [w.program, "--coordinator", w.coordinator, "--name", worker_name(w.farm, id), "--threads", str(w.threads), *w.options]
        for word in remote:
            if not word or "\n" in word:
                raise Usage(f"'{word}' cannot be a word of a worker's command over ssh")
        config = ["-F", options.config] if options.config else []
        words = ["ssh", "-T", "-o", "BatchMode=yes", "-o", "ConnectTimeout=15", "-o", "ServerAliveInterval=15", *config, "--", machine, REMOTE]
        text = "".join(f"{line}\n" for line in (*remote, "", options.join_token))
        log = f"{options.logs}/{worker_name(w.farm, machine)}.log"
        self._running[machine] = _Running(id, child.LongCommand(words, text, log), time.monotonic())
        return id


def read_machines(file: str) -> list[str]:
    """Reads a list of machines, one per line; # begins a comment.

    Usage: a line is not a machine's name (the message has file and line), the list is empty, or a name occurs twice.
    """
    try:
        lines = pathlib.Path(file).read_text(errors="surrogateescape").split("\n")
    except OSError:
        raise Usage(f"{file}: cannot be read") from None
    machines: list[str] = []
    for number, line in enumerate(lines, 1):
        name = line.partition("#")[0].strip(" \t\r")
        if not name:
            continue
        if not re.fullmatch(r"(?!-)[A-Za-z0-9@.\-_:\[\]%]+", name):
            raise Usage(f"{file}:{number}: error: '{name}' is no machine's name: HOST or USER@HOST, one a line")
        if name in machines:
            raise Usage(f"{file}:{number}: error: '{name}' is named twice")
        machines.append(name)
    if not machines:
        raise Usage(f"{file}: names no machines")
    return machines
