"""`lightshaft join`: runs a worker on this machine for a farm on another one, until Ctrl-C."""

import argparse
import os
import pathlib
import re
import sys

from lightshaft_command import enrolment
from lightshaft_command.children import Children, say
from lightshaft_command.state import claim
from lightshaft_command.up import start_worker

VARIABLE = "LIGHTSHAFT_JOIN_CODE"


def hide_code(args: argparse.Namespace) -> None:
    """Restarts this program with the code in its environment, because every user of this machine can read its
    arguments."""
    words = ["--data", str(args.data), *(["--threads", str(args.threads)] if args.threads else [])]
    os.environ[VARIABLE] = args.code
    os.execv(sys.executable, [sys.executable, "-B", str(pathlib.Path(__file__).parent), "join", args.host, *words])


def write_secret(path: pathlib.Path, text: str) -> None:
    with open(path, "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
        file.write(text)


def run(args: argparse.Namespace) -> int:
    if args.code:
        hide_code(args)
    code = enrolment.Code.read(os.environ.pop(VARIABLE, "") or input("the code that `lightshaft up --lan` printed: ").strip())
    joined = enrolment.join(args.host, code)
    home = args.data / "joined" / re.sub(r"[^A-Za-z0-9.-]", "_", args.host)
    children = Children()
    try:
        with claim(home) as claimed:
            for name, text in (("ca.pem", joined.authority), ("worker.pem", joined.certificate), ("worker.key", joined.key)):
                write_secret(home / name, text)
            start_worker(children, args, home, joined.address, code.token, home, "was drained by the farm")
            claimed.tell(joined.address)
            say(f"this machine renders for {joined.address} (log: {home / 'worker.log'})")
            say("Ctrl-C ends it, after the worker has sent its results; Ctrl-C again ends it at once")
            children.run(lambda: None)
            say("ending")
            children.end()
            say("this machine has left the farm")
    finally:
        children.end()
    return 0
