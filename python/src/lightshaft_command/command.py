"""The options of `lightshaft up` and `lightshaft join`."""

import argparse
import os
import pathlib
import sys
from collections.abc import Callable

from lightshaft_command import join, up
from lightshaft_command.children import say
from lightshaft_command.programs import Problem
from lightshaft_command.state import usual

COMMANDS = ("up", "join")
OLDEST = (3, 11)
MOST_THREADS = 256  # as the worker has it


def number(least: int, most: int) -> Callable[[str], int]:
    def read(text: str) -> int:
        if not text.isascii() or not text.isdigit() or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"'{text}' is no number from {least} to {most}")
        return int(text)

    return read


def parser() -> argparse.ArgumentParser:
    whole = argparse.ArgumentParser(prog="lightshaft", allow_abbrev=False)
    commands = whole.add_subparsers(dest="command", required=True)
    both = argparse.ArgumentParser(add_help=False)
    both.add_argument("--data", metavar="DIR", type=pathlib.Path, default=usual(), help="folder of all that stays (default: %(default)s)")
    both.add_argument("--threads", metavar="N", type=number(1, MOST_THREADS), help="units rendered at once (default: one for each core)")

    text = "Starts a farm on this machine: a coordinator with its dashboard and a worker, until Ctrl-C. The first time it renders a picture."
    ups = commands.add_parser("up", parents=[both], description=text, help="a farm on this machine", allow_abbrev=False)
    ups.add_argument("--lan", action="store_true", help="also for other machines, over TLS; prints the line by which one joins")
    ups.add_argument("--name", metavar="HOST", action="append", default=[],
                     help="with --lan: a name or address by which others call this machine, besides its own; may be repeated")  # fmt: skip
    ups.add_argument("--port", metavar="N", type=number(0, 65535), help=f"of the dashboard and of HTTP (default: {up.HTTP}, or another one if that is taken)")
    ups.add_argument("--no-browser", action="store_true", help="do not open the dashboard")
    ups.add_argument("--first-scene", metavar="FILE", type=pathlib.Path, help="scene of the first picture instead of the one that comes with Lightshaft")

    text = "Starts a worker on this machine for the farm of another one, until Ctrl-C."
    joins = commands.add_parser("join", parents=[both], description=text, help="renders for another machine's farm", allow_abbrev=False)
    joins.add_argument("host", metavar="HOST", help="the machine on which `lightshaft up --lan` runs")
    joins.add_argument("--code", metavar="CODE", help="the code that it printed; without this option it is asked for")
    return whole


def run(words: list[str]) -> int:
    if sys.version_info < OLDEST:
        print(f"error: Python 3.11 or later is needed, and this is {sys.version.split()[0]}", file=sys.stderr)
        return 1
    whole = parser()
    args = whole.parse_args(words)
    if args.command == "up" and args.name and not args.lan:
        whole.error("--name is for --lan: without that only this machine reaches the farm")
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
