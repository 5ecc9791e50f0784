"""Runs the commands that are written in Python: python3 FOLDER/lightshaft_command up ..."""

import os
import pathlib
import signal
import sys

ENDS = (signal.SIGINT, signal.SIGTERM)


def _end(number: int, frame: object) -> None:
    os.write(2, b"lightshaft: stopping\n")
    os._exit(1)


# Until a command handles signals itself, nothing has begun that must be ended in order. The program `lightshaft` blocks them.
before = {number: signal.signal(number, _end) for number in ENDS if signal.getsignal(number) != signal.SIG_IGN}
signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDS)

# Python puts this folder at the head of the path when it runs it; the package lies in the folder above.
if not __package__:
    sys.path[0] = str(pathlib.Path(__file__).resolve().parent.parent)

from lightshaft_command.command import run

if sys.argv[1:2] in (["up"], ["join"]):  # others handle signals themselves from their beginning on
    for number, handler in before.items():
        signal.signal(number, handler)

sys.exit(run(sys.argv[1:]))
