#!/usr/bin/env python3
"""Writes flat.xml: a flat of N x N rooms with doors between them and a spherical lamp under each ceiling, seen from inside one room.

usage: make_flat.py DIR [--rooms N] [--fog SIGMA_T]
Each room is 4 x 4 x 3 m. With --fog the air has this extinction, per metre, and an albedo of 0.9. Of the lamps hardly more than one
reaches any place: a test of how lights are chosen (docs/decisions/0042-local-lights.md).
"""
import argparse
import pathlib

ROOM, HEIGHT, WALL = 4, 3, 0.1
DOOR = (1.5, 2.5, 2.1)  # from, to and height, within a wall


def box(low, high, bsdf, more=""):
    scale = [(b - a) / 2 for a, b in zip(low, high)]
    middle = [(a + b) / 2 for a, b in zip(low, high)]
    at = " ".join(f'{axis}="{value:g}"' for axis, value in zip("xyz", middle))
    size = " ".join(f'{axis}="{value:g}"' for axis, value in zip("xyz", scale))
    return f'<shape type="cube"><transform name="to_world"><scale {size}/><translate {at}/></transform>{bsdf}{more}</shape>'


def walls(rooms):
    """Two walls for each line of the plan, one along x and one along z, room by room; inner ones have doors."""
    half = rooms * ROOM / 2
    for line in range(rooms + 1):
        x = ROOM * line - half
        for room in range(rooms):
            z = ROOM * room - half
            whole = [(z, z + ROOM, 0)]
            with_door = [(z, z + DOOR[0], 0), (z + DOOR[1], z + ROOM, 0), (z + DOOR[0], z + DOOR[1], DOOR[2])]
            for begin, end, low in whole if line in (0, rooms) else with_door:
                yield (x - WALL, low, begin), (x + WALL, HEIGHT, end)
                yield (begin, low, x - WALL), (end, HEIGHT, x + WALL)


def flat(rooms, fog):
    half = rooms * ROOM / 2
    out = half + 2 * WALL
    plaster, floor = '<ref id="plaster"/>', '<ref id="floor"/>'
    lines = ['<scene version="3.0.0">', '<integrator type="volpath"><integer name="max_depth" value="8"/></integrator>',
             '<bsdf type="diffuse" id="plaster"><rgb name="reflectance" value="0.6, 0.58, 0.5"/></bsdf>',
             '<bsdf type="diffuse" id="floor"><rgb name="reflectance" value="0.35, 0.25, 0.2"/></bsdf>',
             box((-out, -0.2, -out), (out, 0, out), floor), box((-out, HEIGHT, -out), (out, HEIGHT + 0.2, out), plaster)]
    lines += [box(low, high, plaster) for low, high in walls(rooms)]
    lines.append(box((-0.5, 0, -1), (0.5, 0.7, -0.4), floor))  # a chest
    for i in range(rooms):
        for j in range(rooms):
            x, z = ROOM * i - half + ROOM / 2, ROOM * j - half + ROOM / 2
            radiance = f"{10 + 5 * ((i + j) % 2)}, {9 + 2 * (i % 3)}, {6 + 2 * (j % 3)}"
            lines.append(f'<shape type="sphere"><point name="center" x="{x:g}" y="2.6" z="{z:g}"/><float name="radius" value="0.15"/>'
                         f'<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>')
    air = ""
    if fog:
        lines.append(f'<medium type="homogeneous" id="fog"><float name="sigma_t" value="{fog:g}"/><float name="albedo" value="0.9"/></medium>')
        edge = half + WALL / 2  # within the outer walls
        lines.append(box((-edge, -0.05, -edge), (edge, HEIGHT + 0.05, edge), '<bsdf type="null"/>', '<ref name="interior" id="fog"/>'))
        air = '<ref name="medium" id="fog"/>'
    lines += [f'<sensor type="perspective"><float name="fov" value="75"/>{air}',
              '<transform name="to_world"><lookat origin="1.2, 1.6, 1.7" target="-1.2, 1.1, -2" up="0, 1, 0"/></transform>',
              '<film type="hdrfilm"><integer name="width" value="240"/><integer name="height" value="160"/></film></sensor>', "</scene>"]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dir", type=pathlib.Path)
    parser.add_argument("--rooms", type=int, default=3, help="rooms along each side (3)")
    parser.add_argument("--fog", type=float, default=0, help="extinction of the air, per metre (0)")
    options = parser.parse_args()
    if options.rooms < 1 or not options.fog >= 0:
        parser.error("a flat has at least one room, and its air no negative extinction")
    options.dir.mkdir(parents=True, exist_ok=True)
    (options.dir / "flat.xml").write_text(flat(options.rooms, options.fog))


if __name__ == "__main__":
    main()
