#!/usr/bin/env python3
"""Compares docs/reference/mitsuba.md with the plugins of an installed Mitsuba 3, and what is read with its pictures.

usage: mitsuba_plugins.py [--render]
Run it with an interpreter that has the mitsuba package. Names that only one side has are printed, and make it end with 1. With --render
small scenes, each about one plugin or parameter that is read by way of a conversion, are rendered by both, and their means compared:
within 4 standard errors of the difference, of 16 renders with other seeds each. Needs numpy and the OpenEXR package of PyPI. A bench, not a test.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
SEEDS, SPP = 16, 64
# Mitsuba's spectral modes divide by an integral of the observer's y of 106.75026 nm (MI_CIE_Y_NORMALIZATION of its spectrum.h); that of
# its table, and of ours, every 5 nm with straight lines between, is 106.85703 nm.
NORMALISATION = 106.85702833 / 106.75025940
WAVELENGTHS = 16  # times as many samples where Mitsuba draws wavelengths


def listed():
    """The names that the page has of Mitsuba 3."""
    page = (ROOT / "docs/reference/mitsuba.md").read_text()
    return {name for name, of in re.findall(r"^\| \w+ \| `(\w+)` \| ([\w.]+) \|", page, re.MULTILINE) if of == "3"}


def installed(package):
    names = {file.stem for file in (package / "plugins").glob("*.so")}
    for file in (package / "python").rglob("*.py"):
        if "test" not in file.relative_to(package).parts[1:-1]:
            names |= set(re.findall(r"""mi\.register_\w+\(\s*['"](\w+)['"]""", file.read_text()))
    return names


VIEW = """<sensor type="perspective"><transform name="to_world"><lookat origin="0, 1, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/><rfilter type="box"/></film></sensor>"""
PATH = '<integrator type="path"/>'
SKY = '<emitter type="constant"/>'
LAMP = '<emitter type="point"><point name="position" x="1" y="2" z="2"/>{}</emitter>'
BALL = '<shape type="sphere"><bsdf type="diffuse">{}</bsdf></shape>'
PAIRS = '<string name="wavelengths" value="380, 500, 620, 760"/><string name="values" value="0.1, 0.7, 0.3, 0.5"/>'
EVENLY = '<float name="wavelength_min" value="380"/><float name="wavelength_max" value="760"/><string name="values" value="0.1, 0.7, 0.3, 0.5"/>'
ROOM = ('<shape type="cube"><boolean name="flip_normals" value="true"/><transform name="to_world"><scale value="5"/></transform>'
        '<bsdf type="diffuse"><rgb name="reflectance" value="0.8"/></bsdf></shape>' + LAMP.format('<float name="intensity" value="30"/>'))
GREY = '<rgb name="reflectance" value="0.5"/>'
# For each scene: its objects, and the variant of Mitsuba that renders it.
SCENES = {
    "rawconstant of one number": (SKY + BALL.format('<texture type="rawconstant" name="reflectance"><float name="value" value="0.3"/></texture>'), "scalar_rgb"),
    "rawconstant of three": (SKY + BALL.format('<texture type="rawconstant" name="reflectance"><vector name="value" value="0.2, 0.5, 0.7"/></texture>'), "scalar_rgb"),
    "d65 of a lamp": (LAMP.format('<spectrum type="d65" name="intensity"><float name="scale" value="20"/></spectrum>') + BALL.format(GREY), "scalar_rgb"),
    "d65 with a colour": (LAMP.format('<spectrum type="d65" name="intensity"><rgb name="color" value="9, 6, 3"/></spectrum>') + BALL.format(GREY), "scalar_rgb"),
    "blackbody": (LAMP.format('<spectrum type="blackbody" name="intensity"><float name="temperature" value="5500"/></spectrum>') + BALL.format('<spectrum name="reflectance" value="0.5"/>'), "scalar_spectral"),
    "irregular of a lamp": (LAMP.format(f'<spectrum type="irregular" name="intensity">{PAIRS}</spectrum>') + BALL.format('<spectrum name="reflectance" value="0.5"/>'), "scalar_spectral"),
    "regular of a lamp": (LAMP.format(f'<spectrum type="regular" name="intensity">{EVENLY}</spectrum>') + BALL.format('<spectrum name="reflectance" value="0.5"/>'), "scalar_spectral"),
    "prb without a depth": ('<integrator type="prb"/>' + ROOM, "llvm_ad_rgb"),
    "prbvolpath without a depth": ('<integrator type="prbvolpath"/>' + ROOM, "llvm_ad_rgb"),
    "direct_projective": ('<integrator type="direct_projective"/>' + ROOM, "llvm_ad_rgb"),
}


def ours(np, scene, folder):
    import OpenEXR
    means = []
    for seed in range(SEEDS):
        out = folder / "ours.exr"
        subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--float", "--spp", str(SPP), "--seed", str(seed), "--quiet"],
                       check=True, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        means.append(OpenEXR.File(str(out)).channels()["RGB"].pixels.mean(axis=(0, 1), dtype=np.float64))
    return np.array(means)


def theirs(np, mi, scene, variant):
    mi.set_variant(variant)
    loaded = mi.load_file(str(scene))
    spp = SPP * WAVELENGTHS if "spectral" in variant else SPP
    return np.array([np.asarray(mi.render(loaded, spp=spp, seed=1000 + seed), dtype=np.float64)[..., :3].mean(axis=(0, 1))
                     for seed in range(SEEDS)])


def render(mi):
    import numpy as np
    wrong = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for title, (objects, variant) in SCENES.items():
            scene = folder / "scene.xml"
            scene.write_text(f'<scene version="3.0.0">{"" if "<integrator" in objects else PATH}{objects}{VIEW}</scene>')
            try:
                a, b = ours(np, scene, folder), theirs(np, mi, scene, variant)
                a *= NORMALISATION if "spectral" in variant else 1
            except Exception as error:  # of either program
                print(f"{title}: {type(error).__name__}: {str(error).strip().splitlines()[-1][:150]}")
                wrong += 1
                continue
            apart = a.mean(axis=0) / b.mean(axis=0) - 1
            error = np.sqrt(a.var(axis=0, ddof=1) / a.mean(axis=0) ** 2 + b.var(axis=0, ddof=1) / b.mean(axis=0) ** 2) / np.sqrt(SEEDS)
            # 2e-5: what single precision leaves of sums of so many samples.
            agrees = bool((np.abs(apart) <= 4 * error + 2e-5).all())
            wrong += not agrees
            print(f"{title}: {'agrees' if agrees else 'DIFFERS'} " + ", ".join(f"{100 * x:+.3f} ± {100 * e:.3f} %" for x, e in zip(apart, error)))
    return wrong


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--render", action="store_true")
    options = parser.parse_args()
    import mitsuba as mi
    there, page = installed(pathlib.Path(mi.__file__).parent), listed()
    for name in sorted(there - page):
        print(f"Mitsuba {mi.__version__} has the plugin {name}, which the page does not name")
    for name in sorted(page - there):
        print(f"the page names {name}, which Mitsuba {mi.__version__} does not have")
    wrong = render(mi) if options.render else 0
    return 1 if there != page or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
