"""See run.sh. Prints a line for each thing that is so, and ends with 1 at the first that is not."""

import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import zipfile

import numpy

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from exr_layers import read  # noqa: E402
from local_farm import LocalFarm, bin_dir, wait_until  # noqa: E402

IN_ROOT = ROOT / "tests/mixed/in_root.sh"
PAGES = ROOT / "docs" / "measurements"
BENCH = ROOT / "build/bench"
PATIENCE = 1800  # qemu is slow
SCENES = ("shafts", "fogbox", "cloud", "spotfog", "tint", "surface")
SIZE, SPP, SEED = "64x48", 16, 7
# Where rounding makes a share f of the samples take other paths, these have values of their own, and the difference has 2 f of
# the noise's variance: this is f = 0.5 %. Another seed's image would be at 1.41.
FEW_OTHER_PATHS = 0.1
LIBRARIES = {"g++": "GCC", "libembree-dev": "Embree", "libopenvdb-dev": "OpenVDB", "libopenexr-dev": "OpenEXR", "libimath-dev": "Imath",
             "libtbb-dev": "oneTBB", "libgrpc++-dev": "gRPC", "libprotobuf-dev": "protobuf", "libc6": "glibc"}


class System:
    def __init__(self, name, words, mixed=None, root=None, build=None, versions_of=None):
        self.name, self.words = name, words
        self.within = [IN_ROOT, mixed / root, mixed / "build" / build] if mixed else []
        self.bin = pathlib.Path("/build/bin") if mixed else bin_dir()
        self.src = pathlib.Path("/src") if mixed else ROOT
        self.packages = mixed / (versions_of or root) / "var/lib/dpkg" if mixed else pathlib.Path("/var/lib/dpkg")
        self.rendered = {}

    def run(self, *arguments):
        """lightshaft; its output, and the seconds that it took."""
        start = time.monotonic()
        done = subprocess.run([*self.within, self.bin / "lightshaft", *arguments], capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(f"{self.name}: lightshaft {' '.join(map(str, arguments))}: {done.stderr or done.stdout}")
        return done.stdout, time.monotonic() - start

    def versions(self):
        listed = subprocess.run(["dpkg-query", f"--admindir={self.packages}", "-W", "-f", "${Package} ${Version}\n", *LIBRARIES], capture_output=True, text=True)
        # Without epoch, packaging and revision
        found = dict(line.split() for line in listed.stdout.splitlines() if len(line.split()) == 2)
        return {LIBRARIES[p]: re.sub(r"^\d+:|[+~-].*$", "", found.get(p, "?")) for p in LIBRARIES}


def so(condition, what):
    print(f"{'ok ' if condition else 'NOT SO'} {what}", flush=True)
    if not condition:
        raise SystemExit(1)


def bundle(scene, folder):
    """A bench scene with its grids, as a farm takes it."""
    text = (BENCH / f"{scene}.xml").read_text()
    path = folder / f"{scene}.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(f"{scene}.xml", text)
        for name in sorted(set(re.findall(r'"([^"]+\.vol)"', text))):
            archive.write(BENCH / name, name)
    return path.read_bytes()


def submit(farm, body, **spec):
    query = "&".join(f"{key}={value}" for key, value in {"size": SIZE, "spp": SPP, "seed": SEED, "float": "true", **spec}.items())
    return json.loads(farm.request("POST", f"/api/v1/jobs?{query}", body, "application/zip"))["id"]


def picture(farm, job, folder):
    farm.wait_for_job(job, patience=PATIENCE)
    report = farm.report(job)
    path = folder / f"{job}.exr"
    path.write_bytes(farm.request("GET", f"/api/v1/jobs/{job}/image.exr"))
    channels = read(path)[0]
    pixels, error = (numpy.array([channels[prefix + c] for c in "RGB"], dtype=numpy.float64) for prefix in ("", "stderr."))
    return {"sha": report["pixels_sha256"], "class": report["numeric_class"], "platform": report["platform"], "core_seconds": report["core_seconds"],
            "pixels": pixels, "stderr": error, "log": farm.request("GET", f"/api/v1/jobs/{job}/log").decode()}


def difference(a, b):
    """Of two pictures: the share of values that differ, and the difference's RMS over that of the noise of the second."""
    apart = a["pixels"] - b["pixels"]
    noise = numpy.sqrt(numpy.mean(b["stderr"] ** 2))
    return {"differ": float(numpy.mean(apart != 0)), "of_noise": float(numpy.sqrt(numpy.mean(apart ** 2)) / noise)}


def join(farm, systems):
    """Two workers of this machine and one of each other system; a function that says how many threads they have."""
    here, others = systems[0], systems[1:]
    for name in ("here-1", "here-2"):
        farm.add_worker(fake=False, threads=2, name=name)
    for system in others:
        farm.bin = system.bin
        system.worker = farm.add_worker(fake=False, within=system.within, name=system.name)
    farm.bin = here.bin
    wait_until(lambda: len(farm.get("/api/v1/workers")["workers"]) == 2 + len(others), "all workers join", PATIENCE)
    told = {w["name"]: w for w in farm.get("/api/v1/workers")["workers"]}
    for system in systems:
        worker = told["here-1" if system is here else system.name]
        system.numeric_class, system.platform = worker["numeric_class"], worker["platform"]
        print(f"    {system.words}: {system.numeric_class[:12]} {system.platform}")
    so(told["here-1"]["numeric_class"] == told["here-2"]["numeric_class"], "two workers of this machine are of one class")
    so(len({s.numeric_class for s in systems}) == len(systems), "each system is a class of its own")
    so(len({s.platform for s in systems}) == len(systems), "and each has its own platform")


def shares(farm, systems, body, folder):
    here, others = systems[0], systems[1:]
    workers, threads = 2 + len(others), 4 + len(others)
    job = submit(farm, body)
    view = wait_until(lambda: (v := farm.job(job)) and (v["class_share"] or v["state"] == "done") and v, "the job is pinned", PATIENCE)
    if view["class_share"]:
        so(view["class_share"] == {"workers": 2, "of_workers": workers, "threads": 4, "of_threads": threads, "share": 4 / threads},
           f"a job that asks for no class goes to the one that can be audited: {json.dumps(view['class_share'])}")
    image = picture(farm, job, folder)
    so(image["class"] == here.numeric_class, "and is rendered by it")
    so(f"2 of {workers} workers can take it, with 4 of {threads} threads" in image["log"], "and its log says what share of the farm can take it")


def compare(farm, systems, folder):
    for scene in SCENES:
        body = bundle(scene, folder)
        for system in systems:
            image = picture(farm, submit(farm, body, numeric_class=system.platform), folder)
            so((image["class"], image["platform"]) == (system.numeric_class, system.platform), f"{scene}: the job that asks for {system.platform} is rendered by it")
            if system is not systems[0]:
                so("1 of " in image["log"], "and by it alone")
                image["apart"] = difference(image, systems[0].rendered[scene])
                print(f"    {system.words}: {100 * image['apart']['differ']:.3g} % of values differ from those of {systems[0].words}, by {image['apart']['of_noise']:.3g} of the noise")
                so(image["apart"]["of_noise"] < FEW_OTHER_PATHS, "which is less than another path in one of 200 samples makes")
            system.rendered[scene] = image
    for system in systems:
        again = picture(farm, submit(farm, bundle("fogbox", folder), numeric_class=system.numeric_class[:12], priority=1), folder)
        so(again["sha"] == system.rendered["fogbox"]["sha"], f"{system.words} renders the same pixels again")


def refused(farm, systems):
    gone = systems[-1]
    gone.worker.kill()  # `unshare`, which ignores SIGTERM; the worker goes with it
    wait_until(lambda: any(w["name"] == gone.name and w["state"] == "lost" for w in farm.get("/api/v1/workers")["workers"]), f"{gone.name} is lost", PATIENCE)
    job = submit(farm, bundle("fogbox", farm.folder), numeric_class=gone.platform)
    wait_until(lambda: f"and the job asks for '{gone.platform}'" in (farm.job(job)["error"] or ""), "the job says what it waits for", PATIENCE)
    print(f"ok  without {gone.words}, a job that asks for it waits: {farm.job(job)['error']}")


def coordinators(systems, folder):
    """Each system's coordinator, with a worker of this machine: the pixels, and what it still has after a kill."""
    here = systems[0]
    for system in systems[1:]:
        with LocalFarm(folder / f"farm-{system.name}", bin=system.bin, within=system.within, allow_fake=False) as farm:
            farm.bin = here.bin
            farm.add_worker(fake=False, threads=2, name="here")
            job = submit(farm, bundle("fogbox", folder))
            image = picture(farm, job, folder)
            so(image["sha"] == here.rendered["fogbox"]["sha"], f"the coordinator of {system.words} merges the same pixels")
            so(b"Lightshaft" in farm.request("GET", "/"), "and serves the dashboard")
            farm.bin = system.bin
            farm.restart_coordinator()
            so(picture(farm, job, folder)["sha"] == image["sha"], "and after kill -9 it has them still")
            farm.bin = here.bin
            again = picture(farm, submit(farm, bundle("fogbox", folder)), folder)
            so(again["sha"] == image["sha"], "and takes the next job from the worker that stayed")


def programs(systems, folder):
    """What the command line says on each system: the pixels of the farm, and the table of known answers."""
    for system in systems:
        report = folder / f"{system.name}.json"
        system.run("render", system.src / "build/bench/fogbox.xml", "--size", SIZE, "--spp", str(SPP), "--seed", str(SEED), "--float", "--quiet",
                   "-o", folder / "alone.exr", "--report", report)
        so(json.loads(report.read_text())["pixels_sha256"] == system.rendered["fogbox"]["sha"], f"{system.words}: `lightshaft render` has the farm's pixels")
        text, seconds = system.run("validate", "--quick")
        system.validated = text.strip().splitlines()[-1]
        so(True, f"{system.words}: `lightshaft validate --quick`, {seconds:.0f} s: {system.validated}")


def page(systems, commit):
    here = systems[0]
    arm_alone = [s.name for s in systems[1:]] == ["arm64"]
    cpu = re.search(r"model name\s*:\s*(.*)", pathlib.Path("/proc/cpuinfo").read_text()).group(1)
    emulated = f"; the ARM programs run under qemu {qemu()}" if systems[-1].name == "arm64" else ""
    lines = ["# Pixels of a machine with ARM" if arm_alone else "# Pixels of unlike machines", "",
             f"Made by `tests/mixed/run.sh --write {' '.join(s.name for s in systems[1:])}` of commit {commit} on {cpu}{emulated}. What a farm does with "
             "such machines: [the guide](../guide/mixed-farms.md).", "", "## What each is built with", "",
             "| | " + " | ".join(s.words for s in systems) + " |", "|---|" + "---|" * len(systems)]
    versions = [s.versions() for s in systems]
    lines += [f"| {library} | " + " | ".join(v[library] for v in versions) + " |" for library in LIBRARIES.values()]
    lines += ["| platform | " + " | ".join(f"`{s.platform}`" for s in systems) + " |",
              "| numeric class | " + " | ".join(f"`{s.numeric_class[:12]}`" for s in systems) + " |",
              "| `lightshaft validate --quick` | " + " | ".join(s.validated for s in systems) + " |"]
    lines += ["", "## How far their pixels are apart", "",
              f"The bench scenes at {SIZE}, {SPP} samples per pixel, seed {SEED}, beside those of {here.words}: the share of float32 values that are not "
              "the same bits, and the root mean square of the differences over that of the image's own standard error. Another seed's image would be at "
              "1.41 of it.", "",
              "| scene | " + " | ".join(f"{s.words}: differ | of the noise" for s in systems[1:]) + " |", "|---|" + "---|---|" * (len(systems) - 1)]
    for scene in SCENES:
        apart = [s.rendered[scene]["apart"] for s in systems[1:]]
        lines.append(f"| {scene} | " + " | ".join(f"{100 * a['differ']:.3g} % | {a['of_noise']:.2g}" for a in apart) + " |")
    lines += ["", f"A farm of two workers of {here.words} with two threads each and one of each other system with one: a job that asks for no class is "
              f"rendered by the two, and says that 4 of {4 + len(systems) - 1} threads can take it; one that asks for a class by its platform has the bits of "
              "`lightshaft render` on that system. The coordinator of each system merges the same pixels from this machine's worker, keeps "
              "them through kill -9, and goes on. The script checks it.", ""]
    (PAGES / ("mixed-farms-arm64.md" if arm_alone else "mixed-farms.md")).write_text("\n".join(lines))


def qemu():
    return re.search(r"version (\S+)", subprocess.run(["qemu-aarch64-static", "--version"], capture_output=True, text=True, check=True).stdout).group(1)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("mixed", type=lambda text: pathlib.Path(text).resolve())
    parser.add_argument("--write", action="store_true", help="the page")
    parser.add_argument("systems", nargs="+", choices=("trixie", "noble", "arm64"), help="those that this machine is compared with")
    options = parser.parse_args()
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()
    subprocess.run([sys.executable, ROOT / "scenes/bench/make_bench.py", ROOT / "build/bench"], check=True, stdout=subprocess.DEVNULL)
    systems = [System("bookworm", "Debian 12"),
               System("trixie", "Debian 13", options.mixed, "trixie-amd64", "trixie-amd64"),
               System("noble", "Ubuntu 24.04", options.mixed, "noble-amd64", "noble-amd64"),
               System("arm64", "Debian 13, ARM", options.mixed, "trixie-arm64", "trixie-arm64", versions_of="trixie-amd64")]
    systems = systems[:1] + [s for s in systems[1:] if s.name in options.systems]
    with tempfile.TemporaryDirectory(prefix="lightshaft-mixed-") as folder:
        folder = pathlib.Path(folder)
        with LocalFarm(folder / "farm", allow_fake=False) as farm:
            join(farm, systems)
            shares(farm, systems, bundle("fogbox", folder), folder)
            compare(farm, systems, folder)
            refused(farm, systems)
        coordinators(systems, folder)
        programs(systems, folder)
    if options.write:
        page(systems, commit)


if __name__ == "__main__":
    os.umask(0o022)
    main()
