#!/usr/bin/env python3
"""How a ray's way through steam is searched for light: exponential, equi-angular, both, and the default integrator.

usage: distances.py [--spp N] [--voxel SIZE] [--threads N] [--keep DIR] [--picture OUT.jpg]
Renders the demo scene by its sun and window, and by a lamp in the steam instead of the sun, with `volpath` and with each setting
of `volpath_distant_mis`, at the same samples a pixel. Prints relMSE with its 95 % interval (the renderer's own estimate, which
needs no reference), core seconds, and efficiency 1 / (relMSE x core seconds) over that of `exponential`. --keep keeps the pictures,
in which the settings differ by noise alone; --picture makes one of docs/measurements/distances.md of them: the lamp by `exponential`, `mis` and
`volpath` (needs numpy and, of PyPI, OpenEXR and mitsuba, which writes the JPEG). A bench, not a test.
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
LAMP = ('<emitter type="point"><point name="position" x="0.6" y="1.7" z="0.4"/>'
        '<rgb name="intensity" value="7, 5.5, 3.5"/></emitter>')
SETTINGS = [("volpath", ""), ("exponential", "power"), ("equiangular", "power"), ("mis", "power"), ("mis", "balance")]


def demo(folder, voxel):
    kit = ROOT / "scenes" / "steam_room"
    subprocess.run([sys.executable, kit / "make_steam.py", folder / "steam.vol", "--voxel", voxel], check=True, stdout=subprocess.DEVNULL)
    subprocess.run([sys.executable, kit / "make_scene.py", folder / "sun.xml"], check=True)
    text = (folder / "sun.xml").read_text()
    lamp, count = re.subn(r'<emitter type="directional">.*?</emitter>', LAMP, text)
    assert count == 1, "the demo scene no longer has one sun"
    (folder / "lamp.xml").write_text(lamp)


def with_integrator(scene, distance, heuristic):
    text = scene.read_text()
    if distance == "volpath":
        return scene
    chosen = f'<string name="distance" value="{distance}"/><string name="heuristic" value="{heuristic}"/>'
    text, count = re.subn(r'<integrator type="volpath">', f'<integrator type="volpath_distant_mis">{chosen}', text)
    assert count == 1, "the demo scene no longer has the integrator volpath"
    out = scene.with_name(f"{scene.stem}_{distance}_{heuristic}.xml")
    out.write_text(text)
    return out


def render(scene, out, args):
    report = out.with_suffix(".json")
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--spp", str(args.spp), "--size", args.size, "--threads",
                    str(args.threads), "--report", report, "--quiet"], check=True)
    return json.loads(report.read_text())


def picture(folder, out):
    """Side by side, a strip of black between; sRGB after an exposure that shows the steam, every pixel as four."""
    import numpy as np
    from agreement import load
    parts = []
    for name in ("exponential_power", "mis_power", "volpath_default"):
        linear = np.clip(load(folder / f"lamp_{name}.exr") * .35, 0, 1)
        parts += [np.where(linear <= .0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - .055), np.zeros((linear.shape[0], 4, 3))]
    image = (np.concatenate(parts[:-1], 1) * 255 + .5).astype(np.uint8)
    image = image.repeat(2, 0).repeat(2, 1)
    import mitsuba
    mitsuba.set_variant("scalar_rgb")
    mitsuba.Bitmap(image).write(str(out), quality=88)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--size", default="240x160")
    parser.add_argument("--voxel", default="0.05")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--picture", type=pathlib.Path)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(args.keep or temporary).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        demo(folder, args.voxel)
        for light in ("sun", "lamp"):
            print(f"{light}, {args.size}, {args.spp} samples a pixel")
            print(f"{'distance':<14}{'heuristic':<11}{'relMSE':>10}  {'95 %':<20}{'core s':>9}{'efficiency':>12}")
            rows = []
            for distance, heuristic in SETTINGS:
                scene = with_integrator(folder / f"{light}.xml", distance, heuristic)
                rows.append((distance, heuristic, render(scene, folder / f"{light}_{distance}_{heuristic or 'default'}.exr", args)))
            base = 1 / (rows[1][2]["relmse"] * rows[1][2]["core_seconds"])
            for distance, heuristic, r in rows:
                low, high = r["relmse_ci95"]
                ratio = 1 / (r["relmse"] * r["core_seconds"]) / base
                print(f"{distance:<14}{heuristic:<11}{r['relmse']:>10.3g}  {f'{low:.3g} to {high:.3g}':<20}"
                      f"{r['core_seconds']:>9.1f}{ratio:>12.2f}", flush=True)
        if args.picture:
            picture(folder, args.picture.resolve())


if __name__ == "__main__":
    main()
