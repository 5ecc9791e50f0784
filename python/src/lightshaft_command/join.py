"""`lightshaft join`: runs a worker on this machine for a farm on another one, until Ctrl-C."""

import os
import pathlib
import re
import sys
from collections.abc import Sequence

from lightshaft_command import enrolment
from lightshaft_command.children import Children, say
from lightshaft_command.console import Given
from lightshaft_command.state import claim, data_of, threads_of
from lightshaft_command.up import start_worker

VARIABLE = "LIGHTSHAFT_JOIN_CODE"


def hide_code(given: Given) -> None:
    """Restarts this program with the code in its environment, because every user of this machine can read its
    arguments."""
    os.environ[VARIABLE] = given.text("--code")
    words = [*given.words("--data", "--threads"), "--", *given.arguments]
    os.execv(sys.executable, [sys.executable, "-B", str(pathlib.Path(__file__).parent), "join", *words])


def write_secret(path: pathlib.Path, text: str) -> None:
    with open(path, "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
        file.write(text)


def run(words: Sequence[str]) -> int:
    given = Given(words)
    threads, (host,) = threads_of(given), given.arguments
    if given.text("--code"):
        hide_code(given)
    os.umask(0o077)
    code = enrolment.Code.read(os.environ.pop(VARIABLE, "") or input("the code that `lightshaft up --lan` printed: ").strip())
    joined = enrolment.join(host, code)
    home = data_of(given) / "joined" / re.sub(r"[^A-Za-z0-9.-]", "_", host)
    children = Children()
    try:
        with claim(home) as claimed:
            for name, text in (("ca.pem", joined.authority), ("worker.pem", joined.certificate), ("worker.key", joined.key)):
                write_secret(home / name, text)
            start_worker(children, threads, home, joined.address, code.token, home, "was drained by the farm")
            claimed.tell(joined.address)
            say(f"this machine renders for {joined.address} (log: {home / 'worker.log'})")
            say("press Ctrl-C to stop: the worker sends its results first; Ctrl-C again stops it at once")
            children.run(lambda: None)
            say("stopping")
            children.end()
            say("this machine has left the farm")
    finally:
        children.end()
    return 0
