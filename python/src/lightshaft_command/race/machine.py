"""The machine that a race runs on: its cores, and how busy other programs keep it."""

import os
import pathlib
import resource

from lightshaft_command.programs import Usage

IDLE_LOAD = 0.5


def use_cores(count: int) -> None:
    """Restricts this program, and all that it starts, to `count` of its cores."""
    there = sorted(os.sched_getaffinity(0))
    if count > len(there):
        raise Usage(f"--threads {count}: there are {len(there)} cores, and a race with more threads than cores is none")
    os.sched_setaffinity(0, there[:count])


def machine_words(cores: int) -> str:
    """ "AMD EPYC 7B13, 2 of 8 cores"."""
    lines = pathlib.Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
    names = [line.split(": ", 1)[1] for line in lines if line.startswith("model name") and ": " in line]
    return f"{names[0].strip() if names else 'a processor that does not tell its name'}, {cores} of {os.sysconf('SC_NPROCESSORS_ONLN')} cores"


def warning_if_busy(clock: str) -> str:
    load = os.getloadavg()[0]
    if clock == "cpu" or load <= IDLE_LOAD:
        return ""
    return f"the machine is busy or just was (load average {load:.1f}): wall seconds of a busy one say little; --clock cpu counts CPU seconds"


class Others:
    """The share of the time of all cores that other programs have had since it was made; -1: unknown.

    Programs that this one has started count as its own after they have ended.
    """

    def __init__(self) -> None:
        self._start = self._taken()

    @staticmethod
    def _taken() -> tuple[float, float, float]:
        # "cpu user nice system idle iowait irq softirq steal ...", in ticks, over all cores: proc(5).
        ticks = [int(t) for t in pathlib.Path("/proc/stat").read_text().splitlines()[0].split()[1:9]]
        own = sum(u.ru_utime + u.ru_stime for u in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))
        tick = os.sysconf("SC_CLK_TCK")
        return sum(ticks) / tick, (sum(ticks) - ticks[3] - ticks[4]) / tick, own

    def share(self) -> float:
        total, busy, own = (now - then for now, then in zip(self._taken(), self._start, strict=True))
        return min(1.0, max(0.0, (busy - own) / total)) if total > 0 else -1.0
