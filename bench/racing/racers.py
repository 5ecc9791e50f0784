"""Who takes part in a race, with one seed on one scene: an integrator of ours, or a program by its adapter. And who runs next."""
import csv
import pathlib
import re
import shutil
from typing import NamedTuple

from racing import adapter, program
from racing.adapter import RaceError

EXTRA_TIME = 4  # times the race's seconds that a run may take, beyond those for loading
GROWTH = 4
FULL = .7  # a run that fills this share of the time is the last: a next one could not be much longer
MOST_OF_TIME = 1.15  # no run is planned for more than this share of the time, because costs are estimates
MOST_RUNS = 12  # for a program whose cost does not grow with its samples


class Conditions(NamedTuple):
    """The same for all."""
    scene: pathlib.Path
    time: float
    clock: str
    threads: int
    size: tuple
    most_spp: int | None
    references: list


def next_turn(turns, lap):
    """The index of the one that runs next: of `turns`, the expected seconds of each one's next run, or None where it is done. The
    shortest first, since then the middle of a long run lies in the middle of the others' runs; among equals the first counting
    cyclically from `lap`, so that each seed begins with another. None: all are done."""
    waiting = [i for k in range(len(turns)) if turns[i := (k + lap) % len(turns)] is not None]
    return min(waiting, key=lambda i: turns[i], default=None)


def next_run(past, first, time, most_spp):
    """Samples and expected seconds of the next run of a program that starts anew for each picture; None: there is none. `past` are (spp,
    seconds) of its runs. Each run has four times the samples of the one before, and the last as many as fill `time`. Runs are taken to
    cost a constant and so much a sample: a line through the last two."""
    most = most_spp or 1 << 31
    if not past:
        return min(first, most), 0.
    spp, seconds = past[-1]
    if seconds >= FULL * time or spp >= most or len(past) >= MOST_RUNS:
        return None
    per_sample, start = seconds / spp, 0.
    if len(past) > 1:
        slope = (seconds - past[-2][1]) / (spp - past[-2][0])
        if slope > 0:
            per_sample = min(slope, per_sample)
        start = max(0., seconds - per_sample * spp)
    grown = min(GROWTH * spp, most)
    if start + per_sample * grown <= FULL * time:
        return grown, start + per_sample * grown
    filling = min(most, int(max(0., (time - start) / per_sample)))
    if filling <= spp or start + per_sample * filling > MOST_OF_TIME * time:
        return None
    return filling, start + per_sample * filling


class Integrator:
    """One of ours, in a process that renders the rounds of a job until its time is up and measures a picture after each."""

    def __init__(self, command, name, seed, conditions, folder):
        self.command, self.name, self.seed, self.conditions, self.folder = command, name, seed, conditions, folder
        self.expected = conditions.time
        self.points, self.notes = [], []

    def run(self):
        self.expected = None
        c = self.conditions
        limit = ["--spp", c.most_spp] if c.most_spp else []
        process = program.run([*map(str, [*self.command, c.scene, "--time", c.time, "--clock", c.clock, "--threads", c.threads, "--size",
                                          f"{c.size[0]}x{c.size[1]}", "--reference", ",".join(map(str, c.references)), "--seeds", 1,
                                          "--seed", self.seed, "--quiet", "--report", self.folder, *limit])],
                              adapter.EXTRA_SECONDS + EXTRA_TIME * c.time)
        with open(self.folder / "points.csv", newline="") as file:
            self.points = [self._point(row, process) for row in csv.DictReader(file)]
        report = re.sub(r"\\(.)", r"\1", (self.folder / "report.md").read_text())
        self.notes = re.findall(rf"^{re.escape(self.name)}, seed 0: (.*)$", report, re.M)

    def _point(self, row, process):
        claim = adapter.Made("", 0, float(row["wall_seconds"]), float(row["cpu_seconds"]))
        cost = adapter.plausible(claim, process, self.conditions.clock)
        return {"spp": float(row["spp"]), "wall": cost.wall, "cpu": cost.cpu, "relmse": float(row["relmse"]),
                "mse": float(row["rmse"]) ** 2 if row["rmse"] else -1.,
                "estimate": [float(row[f"estimated_{end}"]) for end in ("relmse", "lo", "hi")]}


class Program:
    """Another program. `measure` tells the errors of a picture."""
    notes = ()

    def __init__(self, its_adapter, seed, conditions, folder, measure):
        self.adapter, self.seed, self.conditions, self.folder, self.measure = its_adapter, seed, conditions, folder, measure
        self.points, self.past = [], []
        self.spp, self.expected = (None, conditions.time) if its_adapter.lists else next_run([], its_adapter.first_spp, conditions.time,
                                                                                            conditions.most_spp)

    def run(self):
        if self.adapter.lists:
            self._run_for_all()
            self.expected = None
        else:
            seconds = self._run_for_one()
            self.past.append((self.spp, seconds))
            following = next_run(self.past, self.adapter.first_spp, self.conditions.time, self.conditions.most_spp)
            self.spp, self.expected = following or (None, None)

    def _run(self, **more):
        c = self.conditions
        width, height = map(str, c.size)
        values = {"scene": str(c.scene), "seed": str(self.seed), "size": f"{width}x{height}", "width": width, "height": height,
                  "threads": str(c.threads), "adapter": str(self.adapter.folder), "clock": c.clock, "time": f"{c.time:g}", "spp": "", "image": "",
                  "folder": str(self.folder), "times": str(self.folder / "times"), **more}
        return program.run(self.adapter.filled(values), self.adapter.most_seconds + EXTRA_TIME * c.time)

    def _take(self, image, spp, cost):
        self.points.append({"spp": spp, "wall": cost.wall, "cpu": cost.cpu, **self.measure(image)})
        image.unlink()

    def _run_for_all(self):
        made_in = self.folder / "made"
        made_in.mkdir()
        process = self._run(folder=str(made_in))
        listed = made_in / "pictures.jsonl"
        if not listed.is_file():
            raise RaceError(f"it has not written {listed.name}")
        try:
            made = adapter.pictures(adapter.text_of(listed))
        except RaceError as error:
            raise RaceError(f"{listed.name}: {error}") from None
        for claim in made:
            self._take(made_in / claim.image, claim.spp, adapter.plausible(claim, process, self.conditions.clock))
        shutil.rmtree(made_in)

    def _run_for_one(self):
        image, told = self.folder / "image.exr", self.folder / "times"
        told.unlink(missing_ok=True)
        cost = self._run(spp=str(self.spp), image=str(image))
        if told.exists():
            try:
                claim = adapter.times(adapter.text_of(told))
            except RaceError as error:
                raise RaceError(f"its file of times: {error}") from None
            cost = adapter.plausible(claim, cost, self.conditions.clock)
        self._take(image, float(self.spp), cost)
        return cost.seconds(self.conditions.clock, self.conditions.threads)
