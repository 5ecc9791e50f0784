"""The options that the program `lightshaft` passes to commands in Python, and what these print."""

import contextlib
import sys
from collections.abc import Sequence


def note(text: str) -> None:
    """Prints a line to stderr. Characters that terminals obey become spaces."""
    with contextlib.suppress(OSError):  # nobody may read it any more
        print("".join(c if c.isprintable() else " " for c in text), file=sys.stderr, flush=True)


class Given:
    """Options as words "--name=value", and other arguments behind "--". The program has checked the names."""

    def __init__(self, words: Sequence[str]):
        self._values: dict[str, list[str]] = {}
        end = words.index("--") if "--" in words else len(words)
        self.arguments = list(words[end + 1 :])
        for word in words[:end]:
            name, _, value = word.partition("=")
            self._values.setdefault(name, []).append(value)

    def text(self, name: str, default: str = "") -> str:
        return self._values.get(name, [default])[-1]

    def all(self, name: str) -> list[str]:
        return self._values.get(name, [])

    def flag(self, name: str) -> bool:
        return name in self._values

    def words(self, *names: str) -> list[str]:
        """The options of these names, for another command."""
        return [f"{name}={value}" for name in names for value in self.all(name)]
