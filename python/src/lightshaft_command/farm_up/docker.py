"""Docker as an engine: workers are containers. `docker run` starts them, `docker ps` lists them, and signals drain and end them."""

import contextlib
import time
from collections.abc import Sequence
from dataclasses import dataclass, field

from lightshaft_command.farm_up import child
from lightshaft_command.farm_up.engine import Command, Unreadable, Worker, first_line, ids_of, keep_log, new_id, worker_name
from lightshaft_command.farm_up.numbers import read_number, read_whole
from lightshaft_command.programs import Problem

RUN_LIMIT = 600.0  # seconds allowed for `docker run`, which may fetch the image first
# The container's command waits at a named pipe for the farm's token. The pipe is in the container's /tmp, which is in memory. So the
# token is in no argument, in no file, and not in the environment that `docker inspect` shows; only the worker's own environment has
# it, which its user and root can read. This command and GIVE_TOKEN both try to make the pipe, since either may run first.
TAKE_TOKEN = (
    "mkfifo -m 600 /tmp/join-token 2>/dev/null; IFS= read -r LIGHTSHAFT_JOIN_TOKEN </tmp/join-token; "
    'export LIGHTSHAFT_JOIN_TOKEN; exec "$@"'
)
GIVE_TOKEN = "mkfifo -m 600 /tmp/join-token 2>/dev/null; exec cat >/tmp/join-token"
LISTED = '{{.Label "lightshaft.worker"}}|{{.State}}|{{.Label "lightshaft.started"}}|{{.Label "lightshaft.cores"}}'


@dataclass
class Options:
    worker: Command  # `program` is a path in the container image
    join_token: str
    image: str  # name of the container image, which deploy/images.sh builds
    drain_seconds: int = 120  # how long Docker lets a worker drain if another command stops its container
    logs: str = "."
    run: list[str] = field(default_factory=list)  # more options of `docker run`, one word each


class Docker:
    def __init__(self, options: Options):
        try:
            version = child.run(["docker", "version", "--format={{.Server.Version}}"])
        except Problem as problem:
            raise Problem(f"docker does not run here: {problem}") from None
        if version.code != 0:
            raise Problem(f"no Docker engine answers: {first_line(version.err)}")
        self.version = f"docker {first_line(version.out)}"
        self._options = options

    def workers(self) -> list[Worker]:
        lines = _run(["docker", "ps", "--all", "--filter", f"label=lightshaft.farm={self._options.worker.farm}", "--format", LISTED])
        workers, ended = parse_docker_ps(lines, time.time())
        for id in ended:
            self._remove(id)
        return workers

    def start(self, count: int) -> Sequence[str]:
        ids = [new_id() for _ in range(count)]
        for id in ids:
            try:
                _run(self._run_command_of(id), most_seconds=RUN_LIMIT)
                _run(["docker", "exec", "--interactive", self._container(id), "sh", "-c", GIVE_TOKEN], self._options.join_token + "\n")
            except Problem:
                self._remove(id)
                raise
        return ids

    def drain(self, workers: Sequence[Worker]) -> None:
        try:
            self._for_all(["docker", "kill", "--signal=TERM"], ids_of(workers, running=True))
        finally:
            self._for_all(["docker", "rm", "--force"], ids_of(workers, running=False))

    def kill(self, workers: Sequence[Worker]) -> None:
        self._for_all(["docker", "kill"], [w.id for w in workers])

    def _container(self, id: str) -> str:
        return "lightshaft-" + worker_name(self._options.worker.farm, id)

    def _run_command_of(self, id: str) -> list[str]:
        options, w = self._options, self._options.worker
        container = ["--detach", "--init", "--read-only", "--cap-drop=ALL", "--security-opt=no-new-privileges", "--tmpfs=/tmp:mode=1777,size=256m",
                     "--volume=lightshaft-cache:/cache", f"--name={self._container(id)}", f"--label=lightshaft.farm={w.farm}",
                     f"--label=lightshaft.worker={id}", f"--label=lightshaft.started={time.time():.0f}", f"--label=lightshaft.cores={w.threads}",
                     f"--cpus={w.threads}", f"--stop-timeout={options.drain_seconds}", *options.run]  # fmt: skip
        worker = [w.program, "--coordinator", w.coordinator, "--threads", str(w.threads), "--cache", "/cache", "--name", worker_name(w.farm, id), *w.options]
        return ["docker", "run", *container, "--entrypoint=sh", options.image, "-c", TAKE_TOKEN, "sh", *worker]

    def _remove(self, id: str) -> None:
        """Removes a container after saving its log."""
        with contextlib.suppress(Problem):
            log = child.run(["docker", "logs", self._container(id)])
            if log.code == 0:
                keep_log(self._options.logs, worker_name(self._options.worker.farm, id), log.out + log.err)
        with contextlib.suppress(Problem):
            child.run(["docker", "rm", "--force", self._container(id)])

    def _for_all(self, words: Sequence[str], ids: Sequence[str]) -> None:
        """Runs a command of Docker on several containers. It is no error if some of them have ended since they were listed.

        The command must not be repeated because of them: the other containers have received their signal, and a second SIGTERM ends a
        worker at once.
        """
        if not ids:
            return
        for line in child.run([*words, *map(self._container, ids)]).err.splitlines():
            if "No such container" not in line and "is not running" not in line:
                raise Problem(f"docker {words[1]}: {line}")


def _run(words: Sequence[str], text: str = "", most_seconds: float = 60.0) -> str:
    done = child.run(words, text, most_seconds)
    if done.code != 0:
        raise Problem(f"docker {words[1]}: {first_line(done.err) or f'exit code {done.code}; the container may have ended'}")
    return done.out


def parse_docker_ps(lines: str, unix_time: float) -> tuple[list[Worker], list[str]]:
    """The workers, and the ids of those that have ended; `unix_time` is now. Unreadable: a line is not in the format of LISTED."""
    workers: list[Worker] = []
    ended: list[str] = []
    for line in filter(None, lines.split("\n")):
        id, state, since, count = (*line.split("|"), "", "", "")[:4]
        started, cores = read_number(since), read_whole(count)
        if not id or started is None or not cores:
            raise Unreadable(f"docker ps answered '{line}'")
        if state in ("exited", "dead"):
            ended.append(id)
        elif state == "created":  # a failed `docker run` leaves a container that was created but not started
            workers.append(Worker(id, "stuck", 0.0, cores))
        else:
            workers.append(Worker(id, "running", max(0.0, unix_time - started), cores))
    return workers, ended
