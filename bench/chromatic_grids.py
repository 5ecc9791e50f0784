#!/usr/bin/env python3
"""Makes scenes with densities of three channels for agreement.py: `chromatic_grids.py DIR`, then `agreement.py --scenes DIR --mitsuba 512`.

Steam with a density of its own in red, green and blue: lit by a lamp and a sky; by a sky alone, absorbing only; dense, with an albedo grid (where Mitsuba's weights have no bound, and its noise is large).
The grids are smooth and their values lie where Mitsuba has them.
"""
import math
import pathlib
import struct
import sys

N = 12


def vol(path, value, channels=3):
    cells = [(i + .5) / N for i in range(N)]
    values = [v for z in cells for y in cells for x in cells for v in value(x, y, z)]
    head = b"VOL\x03" + struct.pack("<5i6f", 1, N, N, N, channels, 0, 0, 0, 1, 1, 1)
    path.write_bytes(head + struct.pack(f"<{len(values)}f", *values))


def blob(x, y, z, cx, cy, cz, width):
    return math.exp(-((x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2) / width ** 2)


def steam(x, y, z):
    return (blob(x, y, z, .3, .4, .5, .25), .5 * blob(x, y, z, .6, .6, .4, .3) + .05, 3 * blob(x, y, z, .5, .3, .6, .2) + .02 * x)


SCENE = """<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="{depth}"/><integer name="rr_depth" value="1000"/></integrator>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, -4, 1.5" target="0, 0, 0" up="0, 0, 1"/></transform>
    <sampler type="independent"/>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/><rfilter type="box"/></film>
  </sensor>
  <medium type="heterogeneous" id="steam">
    <volume type="gridvolume" name="sigma_t"><string name="filename" value="density.vol"/>
      <transform name="to_world"><translate value="-0.5, -0.5, -0.5"/><scale value="2"/></transform></volume>
    {albedo}
    <float name="scale" value="{scale}"/>
    <phase type="hg"><float name="g" value="0.3"/></phase>
  </medium>
  <shape type="cube"><bsdf type="null"/><ref name="interior" id="steam"/></shape>
  <shape type="rectangle"><transform name="to_world"><scale value="3"/><translate value="0, 0, -1.2"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.4, 0.3"/></bsdf></shape>
  {lights}
</scene>
"""
LAMP = """<shape type="sphere"><point name="center" x="1.5" y="-1" z="1.8"/><float name="radius" value="0.3"/>
    <emitter type="area"><rgb name="radiance" value="12, 10, 8"/></emitter></shape>
  <emitter type="constant"><rgb name="radiance" value="0.2, 0.3, 0.4"/></emitter>"""
SKY = '<emitter type="constant"><rgb name="radiance" value="1, 0.8, 0.6"/></emitter>'
GRID = """<volume type="gridvolume" name="albedo"><string name="filename" value="albedo.vol"/>
      <transform name="to_world"><translate value="-0.5, -0.5, -0.5"/><scale value="2"/></transform></volume>"""


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    vol(folder / "density.vol", steam)
    vol(folder / "albedo.vol", lambda x, y, z: (.95 - .2 * x, .6 + .3 * y, .4 + .5 * z))
    colour = '<rgb name="albedo" value="0.9, 0.8, 0.6"/>'
    (folder / "lamp.xml").write_text(SCENE.format(depth=12, albedo=colour, scale=4, lights=LAMP))
    (folder / "absorbing.xml").write_text(SCENE.format(depth=4, albedo='<float name="albedo" value="0"/>', scale=4, lights=SKY))
    (folder / "dense.xml").write_text(SCENE.format(depth=64, albedo=GRID, scale=20, lights=SKY))


if __name__ == "__main__":
    main()
