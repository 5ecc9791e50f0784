"""Asks the coordinator, by `lightshaft jobs` and `lightshaft workers`.

These commands know addresses, tokens, certificates and proxies, and say what is wrong with them. They need no package of Python.
"""

import json
from typing import Any

from lightshaft_command.farm_up import child
from lightshaft_command.programs import Problem, Rejected, find

LIMIT = 600.0  # seconds; the commands have limits of their own


class Coordinator:
    def __init__(self, connection: list[str]):
        """`connection`: the options --to, --token-file and --ca as far as the user gave them."""
        self._program, self._connection = find("lightshaft"), connection

    def jobs(self) -> Any:
        return self._ask("jobs")

    def workers(self) -> Any:
        return self._ask("workers")

    def _ask(self, what: str) -> Any:
        done = child.run([self._program, what, "--json", *self._connection], most_seconds=LIMIT, ours=True)
        if done.code != 0:
            raise Rejected(done.code if done.code in (1, 2) else 1, done.err)
        try:
            return json.loads(done.out)
        except (ValueError, RecursionError):
            raise Problem(f"`lightshaft {what}` answered with no JSON") from None
