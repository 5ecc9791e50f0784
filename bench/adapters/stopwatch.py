"""What the adapters of race.py share: its clock, and the list of pictures that it reads."""
import argparse
import json
import pathlib
import time


def arguments(about):
    args = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("scene", type=pathlib.Path)
    args.add_argument("folder", type=pathlib.Path, help="where the pictures and their list go")
    args.add_argument("--time", type=float, required=True, help="seconds for the longest picture")
    args.add_argument("--clock", choices=("wall", "cpu"), default="wall", help="that they are counted by; cpu: over the threads")
    args.add_argument("--seed", type=int, default=0)
    args.add_argument("--threads", type=int, default=1)
    args.add_argument("--size", type=int, nargs=2, required=True, metavar=("W", "H"))
    return args


class Cost:
    """Wall seconds and CPU seconds of this process, with all its threads."""

    def __init__(self, wall=0., cpu=0.):
        self.wall, self.cpu = wall, cpu

    @staticmethod
    def now():
        return Cost(time.perf_counter(), time.process_time())

    def __add__(self, other):
        return Cost(self.wall + other.wall, self.cpu + other.cpu)

    def __sub__(self, other):
        return Cost(self.wall - other.wall, self.cpu - other.cpu)

    def __mul__(self, factor):
        return Cost(self.wall * factor, self.cpu * factor)

    def seconds(self, options):
        return self.wall if options.clock == "wall" else self.cpu / options.threads


def note(folder, image, spp, cost):
    """Adds a picture to the list."""
    line = {"image": image, "spp": spp, "seconds": cost.wall, "cpu_seconds": cost.cpu}
    with open(folder / "pictures.jsonl", "a") as file:
        file.write(json.dumps(line) + "\n")
