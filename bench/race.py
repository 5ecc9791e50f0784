#!/usr/bin/env python3
"""Races integrators of ours and other programs: error against time, with pages and tables as `lightshaft compare` makes them.

usage: race.py SCENE.xml... --time SECONDS --report DIR [--program ADAPTER.json]... [--integrators A,B] [--clock wall|cpu] [--spp N]
               [--seeds K] [--seed N] [--threads N] [--size WxH] [--reference REF.exr[,REF2.exr] | --references DIR] [--strict] [--quiet]
Every entrant runs in a process of its own, seed after seed, each seed beginning with another, on the same cores. How, and what is
written: docs/guide/compare.md; adapters: docs/reference/compare.md. Scenes without a reference get one: a render of ours, as long as
all seeds of an entrant together. Needs the release build (target lightshaft). Ends with 1 if a program failed, which leaves the
others racing, and with 2 for what is wrong from the start.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "python" / "src"))

from lightshaft_command.programs import Problem  # noqa: E402
from lightshaft_command.race import pages  # noqa: E402
from lightshaft_command.race.machine import Others, machine_words, use_cores, warning_if_busy  # noqa: E402
from lightshaft_command.race.model import Conditions as RaceConditions  # noqa: E402
from lightshaft_command.race.model import Failure, Lane, Point, Race, Results  # noqa: E402
from lightshaft_command.race.scenes import names_of, references_in  # noqa: E402
from lightshaft_command.race.tool import open_tool  # noqa: E402
from racing import adapter  # noqa: E402
from racing.adapter import RaceError  # noqa: E402
from racing.racers import Conditions, Integrator, Program, next_turn  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
LIGHTSHAFT = BIN / "lightshaft"
MOST_ENTRANTS = 8  # that a plot can tell apart
MOST_SPP = 1 << 20  # of a reference that time limits


def told_by(*command):
    """What a program of ours prints. RaceError: what it says is wrong."""
    done = subprocess.run([*map(str, command)], text=True, capture_output=True)
    if done.returncode:
        raise RaceError(done.stderr.strip())
    return done.stdout


def references_of(options, name):
    if options.reference:
        return options.reference.split(",")
    return references_in(options.references, name) if options.references else []


class SceneRace:
    """The race on one scene. `folder` is its own, for what it need not keep."""

    def __init__(self, options, adapters, scene, name, folder, tool):
        self.options, self.name, self.folder, self.tool = options, name, folder, tool
        self.adapters = [a for a in adapters if not a.scenes or name in a.scenes]
        inspected = json.loads(told_by(LIGHTSHAFT, "inspect", scene, "--json", *options.strict))
        self.size = options.size or inspected["size"]
        self.integrators = options.integrators.split(",") if options.integrators else [inspected["integrator"]]
        self.references = [pathlib.Path(r).absolute() for r in references_of(options, name)]
        self.notes = []
        self.compare = [LIGHTSHAFT, "compare", *options.strict]
        self._try_out(scene)
        if not self.references:
            self._make_reference(scene)
        self.conditions = Conditions(scene.absolute(), options.time, options.clock, options.threads, self.size, options.spp, self.references)
        self.reference = self.tool.reference(self.references, self.size)

    def _try_out(self, scene):
        """Two samples by all of ours, so that what is wrong shows before hours of rendering."""
        given = ["--reference", ",".join(map(str, self.references))] if self.references else []
        told_by(*self.compare, scene, "--integrators", ",".join(self.integrators), "--time", self.options.time, "--clock", "cpu", "--spp", 2, "--seeds",
                self.options.seeds if given else max(2, self.options.seeds), "--seed", self.options.seed, "--threads", self.options.threads,
                "--size", f"{self.size[0]}x{self.size[1]}", "--quiet", "--report", self.folder / "tried", *given)

    def _make_reference(self, scene):
        seeds, seed = self.options.seeds, self.options.seed + self.options.seeds
        by = next((i for i in self.integrators if i != "path"), self.integrators[0])  # one that sees media
        image = self.folder / f"{self.name}.exr"
        told_by(LIGHTSHAFT, "render", scene, "-o", image, "--float", "--quiet", "--integrator", by, "--seed", seed, "--threads", self.options.threads,
                "--size", f"{self.size[0]}x{self.size[1]}", "--time", seeds * self.options.time, "--spp",
                seeds * self.options.spp if self.options.spp else MOST_SPP)
        self.references = [image]
        self.notes.append(f"No reference was given: {image.name} is a render by Lightshaft {by} with seed {seed}, as long as all seeds of an entrant.")

    def _measure(self, picture):
        mse, relmse = self.tool.errors(picture)
        return {"mse": mse, "relmse": relmse}

    def _racers(self, seed, names, failures):
        for entrant, name in enumerate(names):
            if entrant in failures:
                continue
            folder = self.folder / f"{entrant}-{seed}"
            folder.mkdir()
            actual = self.options.seed + seed
            if entrant < len(self.integrators):
                command = [*self.compare, "--integrators", self.integrators[entrant]]
                yield entrant, Integrator(command, name, actual, self.conditions, folder)
            else:
                yield entrant, Program(self.adapters[entrant - len(self.integrators)], actual, self.conditions, folder, self._measure)

    def _heat(self, seed, names, failures):
        """Runs the entrants with this seed to their ends; those that fail are added to `failures`."""
        running, done, lap = [*self._racers(seed, names, failures)], [], seed
        while (at := next_turn([racer.expected for _, racer in running], lap)) is not None:
            entrant, racer = running[at]
            try:
                racer.run()
            except (RaceError, Problem) as error:
                failures[entrant] = str(error)
                del running[at]
            lap += 1
        for entrant, racer in running:
            done.append(Lane(entrant, seed, [*self._points(racer.points)]))
            self.notes += [f"{names[entrant]}, seed {racer.seed}: {note}" for note in racer.notes]
        return done

    def _points(self, made):
        for point in made:
            seconds = point["wall"] if self.options.clock == "wall" else point["cpu"] / self.options.threads
            estimate = tuple(point["estimate"]) if "estimate" in point else None
            yield Point(point["spp"], point["wall"], point["cpu"], seconds, point is made[-1], estimate, point["mse"], point["relmse"])

    def run(self, told):
        names = [*(f"Lightshaft {i}" for i in self.integrators), *(a.name for a in self.adapters)]
        lanes, failures = [], {}
        for seed in range(self.options.seeds):
            told(f"{self.name}: seed {seed + 1} of {self.options.seeds}")
            lanes += self._heat(seed, names, failures)
        c = self.options
        return Race(self.name, RaceConditions(c.time, c.clock, c.threads, c.spp, tuple(self.size)), names, [lane for lane in lanes if lane.entrant not in failures],
                    [Failure(*failure) for failure in failures.items()], *self.reference, self.notes)


def whole(text):
    if int(text) < 1:
        raise ValueError
    return int(text)


def size(text):
    width, height = map(whole, text.split("x"))
    return [width, height]


def read_options():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("scenes", type=pathlib.Path, nargs="+", metavar="SCENE.xml")
    args.add_argument("--integrators", metavar="A,B", help="ours that race; default: the scene's")
    args.add_argument("--program", type=pathlib.Path, action="append", default=[], metavar="ADAPTER.json", help="another program that races")
    args.add_argument("--time", type=float, required=True, help="seconds that each entrant has for each seed, after loading")
    args.add_argument("--clock", choices=("wall", "cpu"), default="wall", help="cpu: CPU seconds over threads, for a busy machine")
    args.add_argument("--spp", type=whole, help="stop at so many samples if that comes first")
    args.add_argument("--seeds", type=whole, default=5, help="renders of each entrant (5)")
    args.add_argument("--seed", type=int, default=0, help="the first of them (0)")
    args.add_argument("--threads", type=whole, default=len(os.sched_getaffinity(0)), help="and cores, for everybody; default: all")
    args.add_argument("--size", type=size, metavar="WxH", help="of the images instead of the scene's")
    args.add_argument("--reference", metavar="REF.exr[,REF2.exr]", help="the right picture, or two that are independent of each other")
    args.add_argument("--references", type=pathlib.Path, metavar="DIR", help="of a set: a folder with NAME.exr, or NAME.0.exr and NAME.1.exr")
    args.add_argument("--report", type=pathlib.Path, required=True, metavar="DIR", help="the folder for page, plots and tables")
    args.add_argument("--strict", action="store_const", const=["--strict"], default=[], help="warnings of a scene are errors")
    args.add_argument("--quiet", action="store_true")
    return args.parse_args()


def checked(options):
    """The adapters. RaceError: the options make no race."""
    if options.reference and (len(options.scenes) > 1 or options.references):
        raise RaceError("--reference is of one scene; for several: --references DIR alone, with NAME.exr, or NAME.0.exr and NAME.1.exr")
    if options.references and not options.references.is_dir():
        raise RaceError(f"--references: there is no folder {options.references}")
    if len(options.program) + len((options.integrators or "the scene's").split(",")) > MOST_ENTRANTS:
        raise RaceError(f"at most {MOST_ENTRANTS} entrants in one race")
    if not LIGHTSHAFT.exists():
        raise RaceError(f"{LIGHTSHAFT} is not there: cmake --build build/release --target lightshaft")
    return [adapter.read(path) for path in options.program]


def main():
    options = read_options()

    def told(text):
        if not options.quiet:
            print(f"race.py: {text}", file=sys.stderr, flush=True)

    failed = False
    try:
        adapters = checked(options)
        use_cores(options.threads)
        if warning := warning_if_busy(options.clock):
            told(warning)
        options.report.mkdir(parents=True, exist_ok=True)
        others = Others()
        results = Results(machine_words(options.threads), -1., told_by(LIGHTSHAFT, "--version").strip(), options.seeds, options.seed)
        with open_tool(LIGHTSHAFT) as tool:
            for scene, name in zip(options.scenes, names_of(options.scenes)):
                with tempfile.TemporaryDirectory(prefix="lightshaft-race-") as folder:
                    os.environ["TMPDIR"] = folder  # a program that is killed leaves nothing behind
                    race = SceneRace(options, adapters, scene, name, pathlib.Path(folder), tool).run(told)
                for failure in race.failures:
                    print(f"race.py: {name}: {race.entrants[failure.entrant]}: {failure.why}", file=sys.stderr)
                    failed = True
                results.races.append(race)
                results.others = others.share()
                pages.write(options.report, results, tool)
                print("\n".join(pages.lines_of(race)), flush=True)
    except (RaceError, Problem, OSError) as error:
        print(f"race.py: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("race.py: told to stop", file=sys.stderr)
        return 1
    told(f"written: {options.report / 'index.html'}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
