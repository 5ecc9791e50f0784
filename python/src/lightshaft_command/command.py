"""The commands that are written in Python. The program `lightshaft` describes their options, checks the names, and passes those that
were given as words "--name=value"."""

import importlib
import io
import os
import sys

from lightshaft_command.console import note
from lightshaft_command.programs import Problem, Rejected, Usage

MODULES = {"up": "up", "join": "join", "farm up": "farm_up.options", "compare": "race.compare"}  # each has run(words)
OLDEST = (3, 11)


def run(words: list[str]) -> int:
    if sys.version_info < OLDEST:
        note(f"lightshaft: error: this needs Python 3.11 or later, but runs with {sys.version.split()[0]}")
        return 1
    if isinstance(sys.stdout, io.TextIOWrapper):  # names need not be text
        sys.stdout.reconfigure(errors="replace")
    try:
        code: int = importlib.import_module(f"lightshaft_command.{MODULES[words[0]]}").run(words[1:])
        return code
    except Rejected as rejected:
        sys.stderr.write(rejected.shown)
        return rejected.code
    except Problem as problem:
        for line in f"lightshaft: error: {problem}".split("\n"):
            note(line)
        return 2 if isinstance(problem, Usage) else 1
    except BrokenPipeError:  # whoever read the output has enough of it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:  # a full disk, a folder of another user
        note(f"lightshaft: error: {error.filename or words[0]}: {error.strerror or error}")
        return 1
    except (KeyboardInterrupt, EOFError):
        note("")
        return 1
