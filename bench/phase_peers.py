#!/usr/bin/env python3
"""Renders fog of several phase functions with Lightshaft and with Mitsuba 3, and compares the images.

usage: phase_peers.py [--spp N] [--size N]
Prints a table: for each phase function and each of five directions of view the means of both images and by how many standard
errors, of both together, they differ. Needs the mitsuba package (scalar_rgb).
"""
import argparse
import math
import pathlib
import subprocess
import sys
import tempfile

import mitsuba
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
TABLE = ", ".join(f"{.2 + math.exp(3 * c) / 10 + .5 * (abs(c + .7) < .06):.6f}" for c in np.linspace(-1, 1, 181))
PHASES = {
    "rayleigh": '<phase type="rayleigh"/>',
    "tabphase": f'<phase type="tabphase"><string name="values" value="{TABLE}"/></phase>',
    "tabphase, two values": '<phase type="tabphase"><string name="values" value="0, 1"/></phase>',
    "blendphase": '<phase type="blendphase"><float name="weight" value="0.3"/><phase type="rayleigh"/>'
    '<phase type="hg"><float name="g" value="0.7"/></phase></phase>',
}
# A ball of fog in the light of a sun along +z, seen at these angles to the light
VIEWS = (0, 45, 90, 135, 180)


def scene(phase, angle, size, spp):
    a = math.radians(angle)
    # Light that goes on along (sin a, 0, cos a) reaches a camera on that side
    origin = f"{4 * math.sin(a):.9f}, 0, {4 * math.cos(a):.9f}"
    return f"""<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="-1"/></integrator>
  <sensor type="perspective"><float name="fov" value="24"/>
    <transform name="to_world"><lookat origin="{origin}" target="0, 0, 0" up="0, 1, 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="{spp}"/></sampler>
    <film type="hdrfilm"><integer name="width" value="{size}"/><integer name="height" value="{size}"/>
      <rfilter type="box"/></film></sensor>
  <emitter type="directional"><vector name="direction" x="0" y="0" z="1"/><rgb name="irradiance" value="3, 3, 3"/></emitter>
  <shape type="sphere"><bsdf type="null"/>
    <medium name="interior" type="homogeneous"><float name="sigma_t" value="1.5"/><float name="albedo" value="0.9"/>{phase}</medium>
  </shape></scene>"""


def ours(text, folder, seeds=8):
    """Neighbouring pixels share paths, so the error is that of the means of several images."""
    (folder / "fog.xml").write_text(text)
    means = []
    for seed in range(seeds):
        command = [ROOT / "build/release/bin/lightshaft", "render", folder / "fog.xml", "-o", folder / "fog.exr", "--float", "--quiet"]
        subprocess.run([*command, "--seed", str(seed)], check=True)
        image = mitsuba.Bitmap(str(folder / "fog.exr"))
        channels = [i for i, field in enumerate(image.struct_()) if field.name in "RGB"]
        means.append(np.array(image, copy=False)[..., channels].mean())
    return np.mean(means), np.std(means, ddof=1) / math.sqrt(seeds)


def theirs(text, seeds=16):
    loaded = mitsuba.load_string(text)
    means = [np.array(mitsuba.render(loaded, seed=seed)).mean() for seed in range(seeds)]
    return np.mean(means), np.std(means, ddof=1) / math.sqrt(seeds)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--spp", type=int, default=64)
    options.add_argument("--size", type=int, default=32)
    given = options.parse_args()
    mitsuba.set_variant("scalar_rgb")
    print(f"Mitsuba {mitsuba.__version__}\n\n| phase function | scattered by | Lightshaft | Mitsuba | ratio | standard errors |\n|---|---|---|---|---|---|")
    worst = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, phase in PHASES.items():
            for angle in VIEWS:
                a, sa = ours(scene(phase, angle, given.size, 2 * given.spp), pathlib.Path(folder))
                b, sb = theirs(scene(phase, angle, given.size, given.spp))
                z = (a - b) / math.hypot(sa, sb)
                worst = max(worst, abs(z))
                print(f"| {name} | {angle} degrees | {a:.5f} | {b:.5f} | {a / b:.4f} | {z:+.1f} |", flush=True)
    sys.exit(worst > 5)


main()
