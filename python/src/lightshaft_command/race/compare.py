"""`lightshaft compare`. The program `lightshaft` describes and checks the options (cli/commands/compare_command.cpp)."""

import contextlib
import os
import pathlib
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from types import FrameType
from typing import NoReturn

from lightshaft_command.console import Given, note
from lightshaft_command.programs import Problem, Rejected, Usage, find
from lightshaft_command.race import pages
from lightshaft_command.race.judge import NoJudge, check_that_it_judges_itself, judge
from lightshaft_command.race.lanes import LaneProcess, Racer, options_of, run_lanes
from lightshaft_command.race.machine import Others, machine_words, use_cores, warning_if_busy
from lightshaft_command.race.model import Conditions, Failure, Race, Results
from lightshaft_command.race.scenes import names_of, references_in
from lightshaft_command.race.tool import Tool, open_tool

USUAL_SEEDS = 5


class SceneRace:
    """The race on one scene. `folder` is for its pictures."""

    def __init__(self, given: Given, conditions: Conditions, seeds: int, first_seed: int, program: str, tool: Tool, scene: str, name: str, folder: pathlib.Path):
        self._given, self._seeds, self._first_seed, self._program, self._tool = given, seeds, first_seed, program, tool
        self._scene, self._folder, self._asked = scene, folder, conditions
        self._integrators = given.all("--integrators") or [""]
        self._race = Race(name, conditions, [])
        self.unmeasured = ""  # why there are no results
        self._first: dict[int, LaneProcess] = {}  # lanes of the first seed, which have read the scene

    def run(self) -> Race:
        with contextlib.ExitStack() as stack:
            for entrant in range(len(self._integrators)):
                self._first[entrant] = self._start(entrant, 0)
                stack.callback(self._first[entrant].close)
            try:
                self._race_on()
            except NoJudge as problem:  # perhaps only because of those that failed
                if not self._race.failures:
                    raise
                if len(self._race.failures) < len(self._integrators):
                    self.unmeasured = f"the others are not measured: {problem}"
                    self._race.notes.append(self.unmeasured)
            return self._race

    def _race_on(self) -> None:
        race = self._race
        whole = self._line_up()
        lanes = run_lanes(len(self._integrators), self._seeds, self._make, self._begins, race.failures)
        judge(race, lanes, whole, self._seeds, self._tool)

    def _start(self, entrant: int, seed: int) -> LaneProcess:
        options = options_of(self._asked, self._integrators[entrant], self._first_seed + seed, self._given.words("--define", "--strict"))
        return LaneProcess(self._program, self._scene, options, f"{entrant}-{seed}", self._folder)

    def _line_up(self) -> list[bool]:
        """Finds what is wrong before hours of rendering; whether each entrant sees all of the scene."""
        race = self._race
        race.entrants = [f"Lightshaft {integrator}".rstrip() for integrator in self._integrators]
        whole = [False] * len(self._integrators)
        scenes: list[str] = []
        for entrant, lane in self._first.items():
            try:
                answer = lane.ready()
            except Rejected:
                raise
            except Problem as problem:
                race.failures.append(Failure(entrant, str(problem)))
                continue
            if not self._integrators[entrant]:
                race.entrants[entrant] += f" {answer['integrator']}"
            race.conditions = race.conditions._replace(size=tuple(answer["size"]))
            whole[entrant] = answer["whole"]
            scenes.append(answer["scene"])
        if not scenes:
            return whole
        files: Sequence[str | pathlib.Path] = self._given.all("--reference")
        if folder := self._given.text("--references"):
            files = references_in(pathlib.Path(folder), race.scene)
        if not files:
            check_that_it_judges_itself(whole, self._seeds)
            return whole
        seeds = range(self._first_seed, self._first_seed + self._seeds)
        try:
            race.reference, race.reference_noise = self._tool.reference(files, race.conditions.size, scenes, seeds)
        except Usage as problem:
            raise Usage(f"--reference: {problem}") from None
        return whole

    def _make(self, entrant: int, seed: int) -> Racer:
        if lane := self._first.pop(entrant, None) if seed == 0 else None:
            return lane
        lane = self._start(entrant, seed)
        try:
            lane.ready()
        except BaseException:
            lane.close()
            raise
        return lane

    def _begins(self, seed: int) -> None:
        if not self._given.flag("--quiet"):
            note(f"lightshaft: {self._race.scene}: seed {seed + 1} of {self._seeds}")


def _compare(given: Given) -> int:
    seeds, first_seed = int(given.text("--seeds", str(USUAL_SEEDS))), int(given.text("--seed", "0"))
    threads = int(given.text("--threads") or len(os.sched_getaffinity(0)))
    size = given.text("--size", "0x0").split("x")
    most_spp = int(given.text("--spp")) if given.flag("--spp") else None
    conditions = Conditions(float(given.text("--time")), given.text("--clock", "wall"), threads, most_spp, (int(size[0]), int(size[1])))
    report, program = pathlib.Path(given.text("--report")), find("lightshaft")
    use_cores(threads)
    if warning := warning_if_busy(conditions.clock):
        note(f"lightshaft: warning: {warning}")
    others = Others()
    build = subprocess.run([program, "--version"], stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
    results = Results(machine_words(threads), -1.0, build, seeds, first_seed)
    failed = False
    with open_tool(program) as tool:
        for scene, name in zip(given.arguments, names_of(given.arguments), strict=True):
            with tempfile.TemporaryDirectory(prefix="lightshaft-race-") as folder:
                scene_race = SceneRace(given, conditions, seeds, first_seed, program, tool, scene, name, pathlib.Path(folder))
                race = scene_race.run()
            for failure in race.failures:
                note(f"lightshaft: error: {name}: {race.entrants[failure.entrant]}: {failure.why}")
                failed = True
            if scene_race.unmeasured:
                note(f"lightshaft: error: {name}: {scene_race.unmeasured}")
            for line in pages.lines_of(race):
                print(line, flush=True)
            results.races.append(race)
            results.others = others.share()
            pages.write(report, results, tool)
    if not given.flag("--quiet"):
        note(f"lightshaft: written: {report / 'index.html'}")
    return 1 if failed else 0


def _stop(number: int, frame: FrameType | None) -> NoReturn:
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.SIG_DFL)
    note("lightshaft: stopping; once more ends at once")
    raise KeyboardInterrupt


def run(words: Sequence[str]) -> int:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _stop)
    try:
        return _compare(Given(words))
    except KeyboardInterrupt:
        note("lightshaft: error: told to stop")
        return 1
