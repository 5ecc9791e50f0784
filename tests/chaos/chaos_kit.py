"""What the storms share: a farm whose loss of work is measured, and disks that can be full."""

import dataclasses
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from local_farm import SCENE, HttpError, LocalFarm, wait_until  # noqa: E402
from weather import Skip, as_root, need_root  # noqa: E402

SPEC = dict(spp=24, seed=5, size="256x192")  # 48 tiles of 5 rounds
DELAY = 15  # milliseconds a unit
# What is rendered where pixels are real: light in fog, in the same units.
FOG = SCENE.replace('<shape type="sphere"><bsdf type="diffuse"/></shape>', """<shape type="cube">
    <bsdf type="null"/>
    <medium name="interior" type="homogeneous"><rgb name="sigma_t" value="1, .8, .6"/><rgb name="albedo" value=".9, .8, .7"/>
      <phase type="hg"><float name="g" value=".5"/></phase></medium>
  </shape>
  <shape type="sphere"><float name="radius" value=".3"/><bsdf type="diffuse"/></shape>""")


@dataclasses.dataclass(frozen=True)
class Asked:
    """What the pixels of a storm's job follow from."""
    size: str = SPEC["size"]
    real: bool = False  # rendered, rather than made up by fake workers


class ChaosFarm(LocalFarm):
    """Counts the units that may have been rendered again, through restarts of the coordinator: what it knew when it was seen last
    stays counted."""

    def __init__(self, *arguments, real=False, **options):
        self.real = real  # workers that render
        self._again_before, self._again = 0, 0
        self.done_seen = 0  # units of the storm's job
        super().__init__(*arguments, **options)

    def start_coordinator(self):
        self._again_before, self._again = self._again_before + self._again, 0
        super().start_coordinator()

    def figures(self):
        text = self.request("GET", "/metrics").decode()
        return {line.rsplit(" ", 1)[0]: float(line.rsplit(" ", 1)[1]) for line in text.splitlines() if not line.startswith("#")}

    def again(self):
        """Units that workers had when they were lost or too slow, or failed on, and second results of a unit."""
        try:
            now = self.figures()
            self._again = int(sum(now[f'lightshaft_units_freed_total{{cause="{c}"}}'] for c in ("worker lost", "deadline passed", "failed")) +
                              sum(now[f'lightshaft_results_total{{verdict="{v}"}}'] for v in ("equal", "differing", "unwanted")))
        except (OSError, HttpError):
            pass  # it is away
        return self._again_before + self._again

    def fast_worker(self, *flags, **options):
        delay = () if self.real else ("--fake-delay", DELAY)
        return self.add_worker(*delay, *flags, fake=not self.real, **options)

    def fast_workers(self, count, *flags, **options):
        return [self.fast_worker(*flags, **options) for _ in range(count)]

    def submit_storm(self, **spec):
        self.storm_began = time.monotonic()
        self.asked = Asked(spec.get("size", SPEC["size"]), self.real)
        self.storm_job = self.submit(FOG if self.real else SCENE, **dict(SPEC, **spec))
        self.total = self.job(self.storm_job)["units_total"]
        return self.storm_job

    def until_share(self, share):
        """Waits for this share of the job's units, or its end."""
        def come():
            self.again()
            try:
                view = self.job(self.storm_job)
            except (OSError, HttpError):
                return False
            self.done_seen = view["units_done"]
            return view["units_done"] >= share * self.total or view["state"] in ("done", "failed", "cancelled")
        wait_until(come, f"{share:.0%} of the job")

    def goes_on_with(self, other):
        """This coordinator has taken the storm's job over from the other one, and begins again what that one had done."""
        for name in ("storm_began", "asked", "storm_job", "total"):
            setattr(self, name, getattr(other, name))
        self._again_before += other._again_before + other._again + other.done_seen

    def finish(self):
        """(pixels_sha256, units rendered again at most, seconds, what was asked) of the storm's job."""
        self.until_share(1)
        pixels = self.pixels(self.storm_job)
        return pixels, self.again(), time.monotonic() - self.storm_began, self.asked


class SmallDisk:
    """A file system of few bytes."""

    def __init__(self, folder, megabytes):
        need_root("a small file system")
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        try:
            as_root("mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", self.folder)
        except subprocess.CalledProcessError as error:
            raise Skip(f"cannot mount a tmpfs here: {error.stderr.strip()}") from None

    def __enter__(self):
        return self

    def __exit__(self, *error):
        subprocess.run(["umount", "-l", self.folder], capture_output=True)

    def fill(self, leave=0):
        """Leaves `leave` bytes free."""
        with open(self.folder / "filler", "wb") as out:
            try:
                while shutil.disk_usage(self.folder).free > leave:
                    out.write(b"\0" * max(1, min(1 << 16, shutil.disk_usage(self.folder).free - leave)))
                    out.flush()
            except OSError:
                pass

    def free(self):
        (self.folder / "filler").unlink()


def flip_bytes(path, dice, count=8):
    """Damages a file in place."""
    data = bytearray(path.read_bytes())
    for _ in range(count):
        data[dice.randrange(len(data))] ^= 1 << dice.randrange(8)
    path.write_bytes(data)


def after(seconds):
    """Lets real time pass while a storm rages: the storm is this time."""
    end = time.monotonic() + seconds
    wait_until(lambda: time.monotonic() >= end, "time passes", seconds + 60)


class Storm:
    """One try of one storm, with a farm of its own."""

    def __init__(self, seed, **farm_options):
        self.dice = random.Random(seed)
        self._folder = tempfile.TemporaryDirectory(prefix="lightshaft-chaos-", ignore_cleanup_errors=True)
        self.folder = pathlib.Path(self._folder.name)
        self._options = farm_options

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._folder.cleanup()

    def render(self):
        """From now on its farms have workers that render."""
        self._options["real"] = True

    def farm(self, name="farm", **options):
        return ChaosFarm(self.folder / name, **dict(self._options, **options))
