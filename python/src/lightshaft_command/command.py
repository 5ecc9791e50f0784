"""The options of `lightshaft up` and `lightshaft join`. Those of other commands are described by the program `lightshaft`."""

import argparse
import io
import os
import pathlib
import sys
from collections.abc import Callable

from lightshaft_command import join, up
from lightshaft_command.children import say
from lightshaft_command.console import note
from lightshaft_command.programs import Problem, Rejected, Usage
from lightshaft_command.state import usual

COMMANDS = ("up", "join")
DESCRIBED = ("farm up", "compare")  # by the program `lightshaft`
OLDEST = (3, 11)
MOST_THREADS = 256  # as the worker has it


def number(least: int, most: int) -> Callable[[str], int]:
    def read(text: str) -> int:
        if not text.isascii() or not text.isdigit() or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number from {least} to {most}")
        return int(text)

    return read


def parser() -> argparse.ArgumentParser:
    whole = argparse.ArgumentParser(prog="lightshaft", allow_abbrev=False)
    commands = whole.add_subparsers(dest="command", required=True)
    both = argparse.ArgumentParser(add_help=False)
    both.add_argument("--data", metavar="DIR", type=pathlib.Path, default=usual(), help="folder for everything that is stored (default: %(default)s)")
    both.add_argument("--threads", metavar="N", type=number(1, MOST_THREADS), help="number of units to render at once (default: one for each core)")

    text = "Starts a farm on this machine: a coordinator with its dashboard and a worker, until Ctrl-C. The first time it renders a picture."
    ups = commands.add_parser("up", parents=[both], description=text, help="a farm on this machine", allow_abbrev=False)
    ups.add_argument("--lan", action="store_true", help="let other machines join over TLS; prints the command for that")
    ups.add_argument("--name", metavar="HOST", action="append", default=[],
                     help="with --lan: another name or address by which others reach this machine; may be repeated")  # fmt: skip
    ups.add_argument("--port", metavar="N", type=number(0, 65535), help=f"port of the dashboard and of HTTP (default: {up.HTTP}, or another one if that is taken)")
    ups.add_argument("--no-browser", action="store_true", help="do not open the dashboard")
    ups.add_argument("--first-scene", metavar="FILE", type=pathlib.Path, help="scene of the first picture (default: the one that comes with Lightshaft)")

    text = "Starts a worker on this machine for the farm of another one, until Ctrl-C."
    joins = commands.add_parser("join", parents=[both], description=text, help="render for another machine's farm", allow_abbrev=False)
    joins.add_argument("host", metavar="HOST", help="the machine on which `lightshaft up --lan` runs")
    joins.add_argument("--code", metavar="CODE", help="the code that it printed; if it is missing, `join` asks for it")
    return whole


def run_described(words: list[str]) -> int:
    """A command of which the program `lightshaft` has described and checked the options, and whose errors look like those of the program."""
    from lightshaft_command.farm_up import options
    from lightshaft_command.race import compare

    if isinstance(sys.stdout, io.TextIOWrapper):  # names need not be text
        sys.stdout.reconfigure(errors="replace")
    try:
        return options.run(words[1:]) if words[0] == "farm up" else compare.run(words[1:])
    except Rejected as rejected:
        sys.stderr.write(rejected.shown)
        return rejected.code
    except Problem as problem:
        note(f"lightshaft: error: {problem}")
        return 2 if isinstance(problem, Usage) else 1
    except BrokenPipeError:  # whoever read the output has enough of it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        note(f"lightshaft: error: {error.filename or words[0]}: {error.strerror or error}")
        return 1


def run(words: list[str]) -> int:
    if sys.version_info < OLDEST:
        print(f"error: this needs Python 3.11 or later, but runs with {sys.version.split()[0]}", file=sys.stderr)
        return 1
    if words and words[0] in DESCRIBED:
        return run_described(words)
    whole = parser()
    args = whole.parse_args(words)
    if args.command == "up" and args.name and not args.lan:
        whole.error("--name needs --lan: otherwise only this machine can reach the farm")
    args.data = args.data.expanduser().absolute()
    os.umask(0o077)
    try:
        return up.run(args) if args.command == "up" else join.run(args)
    except Problem as problem:
        print(f"error: {problem}", file=sys.stderr)
        return 1
    except OSError as error:  # a full disk, a folder of another user
        print(f"error: {error.filename or args.data}: {error.strerror or error}", file=sys.stderr)
        return 1
    except (KeyboardInterrupt, EOFError):
        say("")
        return 1
