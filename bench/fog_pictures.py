#!/usr/bin/env python3
"""Pictures for docs/guide/fog.md: pillars in fog that falls with height, and in banks of noise.

usage: fog_pictures.py [--spp 64] [--size 480x270] [--out docs/images] [--denoise] [height banks]
       fog_pictures.py --times [--spp 16]
With --times it prints how long a sample takes in homogeneous fog, in fog that falls with height, in the same fog as a grid of 256
layers, in banks of noise and in a cloud (docs/guide/fog.md). Needs oiiotool (Debian: openimageio-tools) for pictures. A bench, not
a test.
"""
import argparse
import json
import math
import pathlib
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "support")]
from local_farm import bin_dir  # noqa: E402

NULL = '<bsdf type="null"/>'
HEIGHT = '<volume name="{}" type="heightfog"> <float name="value" value="{}"/> <float name="height" value="1.2"/> </volume>'
BANKS = """<volume name="sigma_t" type="product">
    <volume name="first" type="noise"> <float name="scale" value="0.3"/> <integer name="octaves" value="5"/>
      <float name="low" value="-9"/> <float name="high" value="10"/>
      <point name="min" x="-12" y="0" z="-12"/> <point name="max" x="12" y="6" z="12"/> </volume>
    {} </volume>""".format(HEIGHT.format("second", 0.35))
CLOUD = """<volume name="sigma_t" type="cloud"> <float name="frequency" value="4"/>
    <transform name="to_world"><translate x="-0.5" z="-0.5"/><scale x="9" y="4.5" z="9"/></transform> </volume>"""
GRID = """<volume name="sigma_t" type="gridvolume"> <string name="filename" value="{}"/>
    <transform name="to_world">{}</transform> </volume>"""
ALBEDO = '<float name="albedo" value="0.98"/> <phase type="hg"><float name="g" value="0.6"/></phase>'


def medium(density, scale=1):
    return f'<medium type="heterogeneous" id="air">\n  {density}\n  <float name="scale" value="{scale}"/> {ALBEDO} </medium>'


HOMOGENEOUS = f'<medium type="homogeneous" id="air"> <float name="sigma_t" value="0.1"/> {ALBEDO} </medium>'


def pillars():
    text = ""
    for i in range(9):
        x, z, height = 2.3 * math.cos(2.4 * i) * (0.5 + i / 5), -3 + 1.5 * i, 1.5 + 0.45 * (i * 5 % 7)
        text += (f'<shape type="cylinder"> <float name="radius" value="0.25"/> <point name="p0" x="{x:.3f}" y="0" z="{z:.3f}"/>'
                 f' <point name="p1" x="{x:.3f}" y="{height:.3f}" z="{z:.3f}"/> <ref id="stone"/> </shape>\n')
    return text


def scene(air, inside, camera, fov, within=True):
    """Pillars on a plane in a low sun. The fog fills everything, or the shape `inside`; `within` tells whether the camera is in it."""
    sensor = '<ref name="medium" id="air"/>' if within else ""
    return f"""<scene version="3.0.0">
<integrator type="volpath"> <integer name="max_depth" value="32"/> </integrator>
{air}
<bsdf type="twosided" id="stone"> <bsdf type="diffuse"> <rgb name="reflectance" value="0.35, 0.32, 0.28"/> </bsdf> </bsdf>
<shape type="rectangle"> <transform name="to_world"><rotate x="1" angle="-90"/><scale value="200"/></transform> <ref id="stone"/> </shape>
{pillars()}{inside}
<emitter type="directional"> <vector name="direction" x="-0.75" y="-0.42" z="-0.5"/> <rgb name="irradiance" value="6, 4.6, 3.2"/>
  <float name="angular_radius" value="0.3"/> </emitter>
<emitter type="constant"> <rgb name="radiance" value="0.16, 0.22, 0.32"/> </emitter>
<sensor type="perspective"> <float name="fov" value="{fov}"/>
  <transform name="to_world"><lookat origin="{camera[0]}" target="{camera[1]}" up="0,1,0"/></transform>
  <film type="hdrfilm"> <integer name="width" value="480"/> <integer name="height" value="270"/> </film> {sensor} </sensor>
</scene>
"""


def box(low, high):
    middle = [(a + b) / 2 for a, b in zip(low, high)]
    half = [(b - a) / 2 for a, b in zip(low, high)]
    return (f'<shape type="cube"> <transform name="to_world"><scale x="{half[0]}" y="{half[1]}" z="{half[2]}"/>'
            f'<translate x="{middle[0]}" y="{middle[1]}" z="{middle[2]}"/></transform> {NULL} <ref name="interior" id="air"/> </shape>\n')


CAMERA = ("0,1.3,-9", "0,1.5,0")
SCENES = {
    "height": lambda: scene(medium(HEIGHT.format("sigma_t", 0.35)), "", CAMERA, 55),
    "banks": lambda: scene(medium(BANKS), box((-12, 0.01, -12), (12, 6, 12)), CAMERA, 55),
}


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def render(text, folder, size, spp, seed=0, more=()):
    (folder / "scene.xml").write_text(text)
    run(bin_dir() / "lightshaft", "render", folder / "scene.xml", "-o", folder / "out.exr", "--report", folder / "out.json",
        "--quiet", "--size", size, "--spp", spp, "--seed", seed, "--threads", 1, *more)
    return json.loads((folder / "out.json").read_text())


def layers(folder, count=256, top=24.0):
    """The fog of the first scene as a grid of layers, in the name of a file and its transform."""
    values = [math.exp(-max(0.0, (i + 0.5) / count * top / 1.2)) for i in range(count)]
    header = struct.pack("<4s5i6f", b"VOL\3", 1, 1, count, 1, 1, 0, 0, 0, 1, 1, 1)
    (folder / "layers.vol").write_bytes(header + struct.pack(f"<{count}f", *values))
    return GRID.format("layers.vol", f'<translate x="-0.5" z="-0.5"/><scale x="400" y="{top}" z="400"/>')


def times(options):
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        kinds = {"homogeneous": scene(HOMOGENEOUS, "", CAMERA, 55), "heightfog": SCENES["height"](),
                 "a grid of 256 layers": scene(medium(layers(folder), 0.35), "", CAMERA, 55),
                 "noise times heightfog": SCENES["banks"](),
                 "cloud": scene(medium(CLOUD, 6), box((-4.5, 0.01, -4.5), (4.5, 4.5, 4.5)), ("0,3.5,-13", "0,2,0"), 40, False)}
        best = {}
        for turn in range(5):
            for kind, text in kinds.items():
                report = render(text, folder, "160x90", options.spp, turn)
                best.setdefault(kind, []).append(report["core_seconds"] / report["samples"] * 1e6)
        base = sorted(best["homogeneous"])[2]
        for kind, seconds in best.items():
            print(f"{kind:24} {sorted(seconds)[2]:8.2f} us a sample, {sorted(seconds)[2] / base:5.2f} of homogeneous fog")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--size", default="480x270")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs/images")
    parser.add_argument("--denoise", action="store_true")
    parser.add_argument("--times", action="store_true")
    options = parser.parse_args()
    if options.times:
        return times(options)
    with tempfile.TemporaryDirectory() as scratch:
        for name in options.names or SCENES:
            folder = pathlib.Path(scratch)
            render(SCENES[name](), folder, options.size, options.spp, more=["--denoise"] if options.denoise else [])
            colours = "denoised.R,denoised.G,denoised.B" if options.denoise else "R,G,B"
            run("oiiotool", folder / "out.exr", "--ch", colours, "--chnames", "R,G,B", "--colorconvert", "linear", "sRGB", "-d", "uint8",
                "--compression", "jpeg:88", "-o", options.out / f"fog-{name}.jpg")


if __name__ == "__main__":
    main()
