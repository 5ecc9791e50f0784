"""Collects what cannot be rendered from a stage, by the paths of its prims."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from ..errors import Diagnostic, StageRejected

MOST_TOLD = 20  # errors at once, as the farm does


class Problems:
    """Collects errors and warnings. A problem that many prims share is reported once, with the first of them."""

    def __init__(self) -> None:
        self._warned: dict[str, dict[str, None]] = {}
        self._errors: dict[tuple[str, str], None] = {}

    def warn(self, prim: object, text: str) -> None:
        self._warned.setdefault(text, {})[_path(prim)] = None

    def error(self, prim: object, text: str) -> None:
        self._errors[(_path(prim), text)] = None

    @contextlib.contextmanager
    def reading(self, prim: object) -> Iterator[None]:
        """Reports an error of the prim if its values cannot be used: files may contain values of any type."""
        try:
            yield
        except (TypeError, ValueError, LookupError, AttributeError, ArithmeticError, RuntimeError) as error:
            self.error(prim, f"one of its values has another type than its schema requires: {error}")

    @property
    def warnings(self) -> list[str]:
        told = []
        for text, prims in self._warned.items():
            first = next(iter(prims))
            more = f" (and {len(prims) - 1} more)" if len(prims) > 1 else ""
            told.append(f"{first}{more}: warning: {text}")
        return told

    def raise_errors(self) -> None:
        """Raises StageRejected if there are errors. The message has only as many of them as a person reads."""
        if self._errors:
            found = [Diagnostic(text=text, path=path) for path, text in self._errors]
            if len(found) > MOST_TOLD:
                rest = f"{len(found) - MOST_TOLD} more errors are not shown"
                found[MOST_TOLD:] = [Diagnostic(text=rest, path="the stage")]
            raise StageRejected("the stage cannot be rendered", diagnostics=found)


def _path(prim: object) -> str:
    get_path = getattr(prim, "GetPath", None)
    return str(get_path() if get_path else prim)
