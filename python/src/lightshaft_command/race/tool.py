"""The program that measures pictures, draws plots and forecasts: `lightshaft race-tool` answers each line of JSON by one."""

import contextlib
import json
import math
import os
import pathlib
import subprocess
from collections.abc import Iterator, Sequence
from typing import Any

from lightshaft_command.programs import Problem, Usage
from lightshaft_command.race.model import Point


class Conversation:
    """A program that answers lines of JSON by lines of JSON. It has a session of its own, so that Ctrl-C reaches only this program."""

    def __init__(self, words: Sequence[str], errors: Any = None):
        try:
            self.process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, encoding="utf-8", errors="replace",
                                            start_new_session=True)  # fmt: skip
        except OSError as error:
            raise Problem(f"cannot start {words[0]}: {error.strerror}") from error

    def tell(self, request: Any) -> None:
        assert self.process.stdin
        with contextlib.suppress(BrokenPipeError):  # what is wrong shows in the missing answer
            self.process.stdin.write(json.dumps(request, ensure_ascii=False) + "\n")
            self.process.stdin.flush()

    def answer(self) -> Any:
        """None: the program has ended."""
        assert self.process.stdout
        line = self.process.stdout.readline()
        return json.loads(line) if line.endswith("\n") else None

    def close(self) -> None:
        self.process.kill()
        for pipe in (self.process.stdin, self.process.stdout, self.process.stderr):
            if pipe:
                with contextlib.suppress(OSError):
                    pipe.close()
        self.process.wait()


def _finite(x: float) -> float | None:
    return x if math.isfinite(x) else None  # JSON has no other numbers


class Tool:
    def __init__(self, program: str):
        self._talk = Conversation([program, "race-tool"])

    def _ask(self, what: str, **request: Any) -> Any:
        """Usage: what the program says is wrong."""
        self._talk.tell({"do": what, **request})
        answer = self._talk.answer()
        if answer is None:
            raise Problem("the program that measures images has ended; run it again")
        if "error" in answer:
            raise Usage(answer["error"])
        return answer

    def reference(self, files: Sequence[str | os.PathLike[str]], size: tuple[int, int], scenes: Sequence[str] = (), seeds: Sequence[int] = ()) -> tuple[str, float]:
        """Reads one or two reference pictures; what they are in words, and the noise of their mean.

        `scenes`, `seeds`: digests of scenes and the seeds that race. Usage: a picture has the noise of one of them.
        """
        answer = self._ask("reference", files=[os.fspath(file) for file in files], size=size, scenes=list(scenes), seeds=list(seeds))
        return answer["words"], answer["noise"]

    def reference_of_halves(self, halves: Sequence[tuple[str, str, float]], size: tuple[int, int]) -> float:
        """The means of halves A and of halves B, each with a weight, are the two reference pictures; the noise of their mean."""
        noise: float = self._ask("halves", halves=list(halves), size=size)["noise"]
        return noise

    def errors(self, picture: str | os.PathLike[str]) -> tuple[float, float]:
        """mse and relmse of a picture against the reference that was given last."""
        answer = self._ask("errors", picture=os.fspath(picture))
        return answer["mse"], answer["relmse"]

    def forecast(self, points: Sequence[Point], target: float) -> tuple[float, float, float] | None:
        """The core seconds until the estimated relMSE is `target`, with their 95 % interval."""
        rows = [[_finite(v) for v in (p.spp, p.cpu, *p.estimate)] for p in points if p.estimate]
        answer = self._ask("forecast", points=rows, target=_finite(target))["seconds"]
        return tuple(answer) if answer else None

    def plot(self, **plot: Any) -> tuple[str, str]:
        """An SVG element for the page, and a file of its own."""
        answer = self._ask("plot", **plot)
        return answer["element"], answer["file"]

    def document(self, title: str, css: str, body: str) -> str:
        """A whole page, with the style of plots."""
        page: str = self._ask("document", title=title, css=css, body=body)["page"]
        return page

    def close(self) -> None:
        self._talk.close()


@contextlib.contextmanager
def open_tool(program: str | pathlib.Path) -> Iterator[Tool]:
    tool = Tool(os.fspath(program))
    try:
        yield tool
    finally:
        tool.close()
