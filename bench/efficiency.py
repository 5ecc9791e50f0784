#!/usr/bin/env python3
"""Agreement with references, and efficiency 1 / (relMSE x wall seconds) beside Mitsuba 3, on scenes that both load.

usage: efficiency.py [--scenes DIR] [--names a,b,c] [--spp N] [--mitsuba-spp N] [--no-mitsuba]
DIR holds NAME.xml and refs/NAME.0.exr, refs/NAME.1.exr (two independent references); without, the bench scenes are made and measured. Ours and Mitsuba's renders are taken in
turns, two seeds each, two threads, after load (Mitsuba: after a warm-up render). relMSE is (x - ref0)(x - ref1) / (ref^2 + 0.01):
free of the references' own noise. Agreement: blocks of 16 x 16 pixels, z from both sides' noise and a floor of 0.3 %.
Needs numpy and the OpenEXR package of PyPI; Mitsuba's part needs the mitsuba package and an LLVM library (Debian: libllvm19).
Seconds of one machine mean nothing on another: quote ratios.
"""
import argparse
import json
import os
import pathlib
import subprocess
import tempfile
import time

import numpy as np
import OpenEXR

import bench_scenes

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
NAMES = "shafts,fogbox,cloud,spotfog,tint,surface"


def load(path):
    channels = OpenEXR.File(str(path)).channels()
    for key in ("RGB", "RGBA"):
        if key in channels:
            return np.asarray(channels[key].pixels, dtype=np.float64)[..., :3]
    return np.stack([np.asarray(channels[c].pixels, dtype=np.float64) for c in "RGB"], -1)


def relmse(x, r0, r1):
    r = (r0 + r1) / 2
    return float(((x - r0) * (x - r1) / (r * r + .01)).mean())


def blocks(a, n=16):
    h, w = a.shape[0] // n * n, a.shape[1] // n * n
    return a[:h, :w].reshape(h // n, n, w // n, n, 3).mean((1, 3))


def agreement(a0, a1, b0, b1):
    a, b = blocks((a0 + a1) / 2), blocks((b0 + b1) / 2)
    variance = (blocks((a0 - a1) ** 2) + blocks((b0 - b1) ** 2)) / 4 / 256
    z = (a - b) / np.sqrt(variance + (3e-3 * np.abs(b) + 1e-6) ** 2)
    mean_a, mean_b = ((a0 + a1) / 2).mean((0, 1)), ((b0 + b1) / 2).mean((0, 1))
    pixels = a0.shape[0] * a0.shape[1]
    error = np.sqrt((((a0 - a1) ** 2).sum((0, 1)) + ((b0 - b1) ** 2).sum((0, 1))) / 4) / pixels / mean_b
    return mean_a / mean_b, error, float((np.abs(z) > 4).mean())


def ours(scene, spp, folder):
    seconds, images = [], []
    for seed in (0, 1):
        out, report = folder / f"ours.{seed}.exr", folder / "report.json"
        subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--float", "--spp", str(spp), "--seed", str(seed), "--threads", "2",
                        "--report", report, "--quiet"], check=True)
        seconds.append(json.loads(report.read_text())["render_seconds"])
        images.append(load(out))
    return np.mean(seconds), images


class Mitsuba:
    def __init__(self):
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1")
        import mitsuba
        self.mi = mitsuba
        mitsuba.set_variant("llvm_ad_rgb")

    def render(self, scene, spp, integrator):
        loaded = self.mi.load_file(str(scene))
        root = next(line for line in scene.read_text().splitlines() if "<integrator" in line)
        depth = int(root.split('name="max_depth" value="')[1].split('"')[0])
        plugin = self.mi.load_dict({"type": integrator, "max_depth": depth, "rr_depth": 5})
        self.mi.render(loaded, spp=1, seed=99, integrator=plugin).numpy()
        seconds, images = [], []
        for seed in (0, 1):
            start = time.time()
            images.append(np.asarray(self.mi.render(loaded, spp=spp, seed=seed, integrator=plugin).numpy(), dtype=np.float64)[..., :3])
            seconds.append(time.time() - start)
        return np.mean(seconds), images


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--scenes", type=pathlib.Path)
    args.add_argument("--names", default=NAMES)
    args.add_argument("--spp", type=int, default=64)
    args.add_argument("--mitsuba-spp", type=int, default=16)
    args.add_argument("--no-mitsuba", action="store_true")
    options = args.parse_args()
    scenes = bench_scenes.scenes(options.scenes)
    mitsuba = None if options.no_mitsuba else Mitsuba()
    for name in options.names.split(","):
        scene = scenes / f"{name}.xml"
        r0, r1 = map(load, bench_scenes.references(scenes, name))
        with tempfile.TemporaryDirectory() as temporary:
            seconds, images = ours(scene, options.spp, pathlib.Path(temporary))
        error = np.mean([relmse(x, r0, r1) for x in images])
        ratio, noise, outside = agreement(*images, r0, r1)
        efficiency = 1 / (error * seconds)
        print(f"{name}: mean ratio {' '.join(f'{x:.4f}' for x in ratio)} (+- {' '.join(f'{x:.4f}' for x in noise)}), |z| > 4: {100 * outside:.2f} %")
        print(f"  lightshaft            {options.spp:4d} spp  {seconds:7.2f} s  relMSE {error:9.4g}  efficiency {efficiency:9.4g}", flush=True)
        if mitsuba is None:
            continue
        best = 0
        for integrator in (("path",) if name == "surface" else ("volpath", "volpathmis")):
            s, rendered = mitsuba.render(scene, options.mitsuba_spp, integrator)
            e = np.mean([relmse(x, r0, r1) for x in rendered])
            best = max(best, 1 / (e * s))
            print(f"  mitsuba {integrator:12s}  {options.mitsuba_spp:4d} spp  {s:7.2f} s  relMSE {e:9.4g}  efficiency {1 / (e * s):9.4g}", flush=True)
        print(f"  ratio to Mitsuba's best: {efficiency / best:.1f}", flush=True)


if __name__ == "__main__":
    main()
