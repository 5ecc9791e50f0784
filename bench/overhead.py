#!/usr/bin/env python3
"""What the farm costs: a job on two one-thread workers of this machine against `lightshaft render --threads 2`.

usage: overhead.py [--scene SCENE.xml] [--size WxH] [--spp N] [--pairs 7]
Interleaved pairs, the order swapped from pair to pair; prints render_seconds of both, the median ratio, the coordinator's CPU
time as a share of the workers', the mean unit, the idle gaps that the workers saw, and whether the pixels are the same. Nothing
else should run meanwhile. A bench, not a test.
Without --scene the demo scene is generated with twenty-five times its steam, followed for 256 scatterings, the first 64 without
roulette. Units of the first two rounds, of two samples a pixel, are the shortest: their mean is measured by a render of these
alone. Choose --spp so that a job takes at least 30 s.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "support"))
from local_farm import LocalFarm, bin_dir  # noqa: E402


def demo_scene(folder):
    kit = ROOT / "scenes" / "steam_room"
    subprocess.run([sys.executable, kit / "make_steam.py", folder / "steam.vol", "--voxel", "0.05"], check=True, stdout=subprocess.DEVNULL)
    scene = folder / "steam_room.xml"
    subprocess.run([sys.executable, kit / "make_scene.py", scene], check=True)
    text = scene.read_text()
    for thin, thick in (('name="scale" value="2.4"', 'name="scale" value="60"'), ('name="max_depth" value="16"', 'name="max_depth" value="256"'),
                        ('name="rr_depth" value="5"', 'name="rr_depth" value="64"')):
        assert text.count(thin) == 1, f"the demo scene no longer has {thin}"
        text = text.replace(thin, thick)
    scene.write_text(text)
    return scene


def cpu_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def render_alone(scene, options, seed, folder, spp=None):
    report = folder / "alone.json"
    subprocess.run([bin_dir() / "lightshaft", "render", scene, *size_and_samples(options, spp), "--seed", str(seed), "--threads", "2", "--quiet",
                    "-o", folder / "alone.exr", "--report", report], check=True)
    return json.loads(report.read_text())


def rounds_of(spp):
    """Rounds of 2, 2, 4, 8, 16, 32 and then 64 samples."""
    rounds, sizes = 0, [2, 2, 4, 8, 16, 32]
    while spp > 0:
        spp -= sizes[rounds] if rounds < len(sizes) else 64
        rounds += 1
    return rounds


def size_and_samples(options, spp=None):
    return [*(["--size", options.size] if options.size else []), "--spp", str(spp or options.spp)]


def render_on_farm(farm, scene, options, seed):
    before = cpu_seconds(farm.coordinator.popen.pid)
    env = dict(os.environ, LIGHTSHAFT_URL=f"http://127.0.0.1:{farm.http}", LIGHTSHAFT_TOKEN=farm.token)
    out = subprocess.run([bin_dir() / "lightshaft", "submit", scene, *size_and_samples(options), "--seed", str(seed)], check=True, env=env,
                         stdout=subprocess.PIPE, text=True).stdout
    job = out.split()[0]
    subprocess.run([bin_dir() / "lightshaft", "watch", job], check=True, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return farm.report(job), cpu_seconds(farm.coordinator.popen.pid) - before


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--scene", type=pathlib.Path)
    args.add_argument("--size", default="256x192")
    args.add_argument("--spp", type=int, default=32)
    args.add_argument("--pairs", type=int, default=7)
    options = args.parse_args()
    ratios, shares = [], []
    with tempfile.TemporaryDirectory() as temporary, LocalFarm() as farm:
        folder = pathlib.Path(temporary)
        scene = options.scene or demo_scene(folder)
        farm.add_workers(2, threads=1, fake=False)
        farm.wait_for_workers(2)
        for pair in range(options.pairs):
            if pair % 2:
                one = render_alone(scene, options, pair, folder)
                many, coordinator = render_on_farm(farm, scene, options, pair)
            else:
                many, coordinator = render_on_farm(farm, scene, options, pair)
                one = render_alone(scene, options, pair, folder)
            ratios.append(many["render_seconds"] / one["render_seconds"])
            shares.append(coordinator / many["core_seconds"])
            tiles = len(farm.get(f"/api/v1/jobs/{many['job']}/tiles")["tiles"])
            units = tiles * rounds_of(many["spp"])
            same = many["pixels_sha256"] == one["pixels_sha256"]
            print(f"pair {pair + 1}: farm {many['render_seconds']:.2f} s, alone {one['render_seconds']:.2f} s, ratio {ratios[-1]:.4f}, "
                  f"coordinator CPU {100 * shares[-1]:.2f} % of the workers', {units} units of {1000 * many['core_seconds'] / units:.0f} ms, {'same pixels' if same else 'PIXELS DIFFER'}", flush=True)
        for worker in farm.workers:
            worker.terminate()
            print(*(f"{worker.name}: {line}" for line in worker.output().splitlines() if "gaps between units" in line), sep="\n")
        first = render_alone(scene, options, 0, folder, spp=4)
        print(f"units of the first two rounds: {1000 * first['core_seconds'] / (2 * tiles):.0f} ms on average")
    print(f"median ratio {statistics.median(ratios):.4f}, coordinator CPU {100 * statistics.median(shares):.2f} %")


if __name__ == "__main__":
    main()
