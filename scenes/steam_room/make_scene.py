#!/usr/bin/env python3
"""Writes steam_room.xml, the demo scene: low sun through a slatted window into a room full of steam (Mitsuba 3 XML).

usage: make_scene.py OUT.xml
"""
import sys

T = 0.1  # thickness of walls


def ref(name):
    return f'<ref id="{name}"/>'


def box(lo, hi, inner):
    c = [(a + b) / 2 for a, b in zip(lo, hi)]
    s = [(b - a) / 2 for a, b in zip(lo, hi)]
    return (f'  <shape type="cube"><transform name="to_world"><scale x="{s[0]:.6g}" y="{s[1]:.6g}" z="{s[2]:.6g}"/>'
            f'<translate x="{c[0]:.6g}" y="{c[1]:.6g}" z="{c[2]:.6g}"/></transform>{inner}</shape>\n')


def sphere(c, r, inner):
    return f'  <shape type="sphere"><point name="center" x="{c[0]}" y="{c[1]}" z="{c[2]}"/><float name="radius" value="{r}"/>{inner}</shape>\n'


def diffuse(name, r, g, b):
    return f'  <bsdf type="twosided" id="{name}"><bsdf type="diffuse"><rgb name="reflectance" value="{r}, {g}, {b}"/></bsdf></bsdf>\n'


def materials():
    out = diffuse("plaster", .55, .56, .54) + diffuse("wood", .36, .22, .12) + diffuse("leaf", .12, .24, .07) + diffuse("clay", .45, .22, .14)
    out += ('  <bsdf type="twosided" id="floor"><bsdf type="diffuse"><texture type="checkerboard" name="reflectance">'
            '<rgb name="color0" value="0.46, 0.43, 0.38"/><rgb name="color1" value="0.17, 0.19, 0.2"/>'
            '<transform name="to_uv"><scale x="6" y="9"/></transform></texture></bsdf></bsdf>\n')
    out += ('  <bsdf type="roughconductor" id="brass"><string name="distribution" value="ggx"/><float name="alpha" value="0.16"/>'
            '<rgb name="eta" value="0.444, 0.527, 1.094"/><rgb name="k" value="3.695, 2.765, 1.829"/></bsdf>\n')
    out += ('  <bsdf type="roughplastic" id="enamel"><string name="distribution" value="ggx"/><float name="alpha" value="0.08"/>'
            '<float name="int_ior" value="1.5"/><rgb name="diffuse_reflectance" value="0.8, 0.8, 0.78"/></bsdf>\n')
    out += ('  <bsdf type="conductor" id="mirror"><rgb name="eta" value="0.2, 0.92, 1.1"/><rgb name="k" value="3.91, 2.45, 2.14"/>'
            '<rgb name="specular_reflectance" value="0.9, 0.9, 0.9"/></bsdf>\n')
    return out


def room():
    p = ref("plaster")
    out = box((-2 - T, 3, -3 - T), (2 + T, 3 + T, 3 + T), p) + box((-2 - T, 0, -3 - T), (-2, 3, 3 + T), p)
    out += box((-2, 0, -3 - T), (2, 3, -3), p) + box((-2, 0, 3), (2, 3, 3 + T), p)
    # the floor is one rectangle, for its tiles' uv
    out += ('  <shape type="rectangle"><transform name="to_world"><scale x="2.1" y="3.1"/><rotate x="1" angle="-90"/></transform>'
            + ref("floor") + '</shape>\n')
    # the window wall at x = 2: below, above, beside the opening 0.7..2.75 x -2.3..1
    out += box((2, 0, -3 - T), (2 + T, .7, 3 + T), p) + box((2, 2.75, -3 - T), (2 + T, 3, 3 + T), p)
    out += box((2, .7, -3 - T), (2 + T, 2.75, -2.3), p) + box((2, .7, 1), (2 + T, 2.75, 3 + T), p)
    for k in range(5):
        y = .7 + .49 * k
        out += box((2.0, y, -2.3), (2.1, y + .1, 1), ref("wood"))
    for z in (-1.25, -.1):
        out += box((2.0, .7, z), (2.1, 2.75, z + .1), ref("wood"))
    # The sky, as far as the window shows it: a panel that light passes, so that the sun comes through and the sky is sampled.
    out += ('  <shape type="rectangle"><transform name="to_world"><scale x="1.65" y="1.025"/><rotate y="1" angle="-90"/>'
            '<translate x="2.15" y="1.725" z="-0.65"/></transform><bsdf type="null"/>'
            '<emitter type="area"><rgb name="radiance" value="1.2, 1.6, 2.3"/></emitter></shape>\n')
    return out


def furniture():
    e = ref("enamel")
    out = box((-1.7, .12, -1.7), (.1, .2, .5), e) + box((-1.7, .12, -1.7), (-1.62, .68, .5), e) + box((.02, .12, -1.7), (.1, .68, .5), e)
    out += box((-1.7, .12, -1.7), (.1, .68, -1.62), e) + box((-1.7, .12, .42), (.1, .68, .5), e)
    out += box((-1.62, .2, -1.62), (.02, .5, .42), ref("mirror"))  # still water, from above
    for x in (-1.55, -.05):
        for z in (-1.5, .3):
            out += sphere((x, .07, z), .07, ref("brass"))
    out += sphere((1.15, .3, -1.75), .3, ref("brass")) + sphere((.72, .16, -1.2), .16, ref("clay"))
    out += box((-1.99, 1.1, -1.5), (-1.96, 2.2, .1), ref("brass")) + box((-1.965, 1.16, -1.44), (-1.95, 2.14, .04), ref("mirror"))
    out += box((-1.2, 1.55, -3), (-.2, 1.6, -2.75), ref("wood"))
    for k, (r, h) in enumerate(((.09, 1.69), (.07, 1.67), (.1, 1.7))):
        out += sphere((-1.0 + .28 * k, h, -2.86), r, ref(("clay", "brass", "leaf")[k]))
    return out


def scene():
    out = '<scene version="3.0.0">\n  <default name="spp" value="64"/>\n  <default name="width" value="480"/>\n  <default name="height" value="320"/>\n'
    out += '  <integrator type="volpath"><integer name="max_depth" value="16"/><integer name="rr_depth" value="5"/></integrator>\n'
    out += ('  <medium type="heterogeneous" id="steam"><volume type="gridvolume" name="sigma_t"><string name="filename" value="steam.vol"/>'
            '<boolean name="use_grid_bbox" value="true"/></volume><float name="scale" value="2.4"/><float name="albedo" value="0.98"/>'
            '<phase type="hg"><float name="g" value="0.45"/></phase></medium>\n')
    out += materials() + room() + furniture()
    out += box((-1.94, .01, -2.99), (1.99, 2.99, 2.99), '<bsdf type="null"/><ref name="interior" id="steam"/>')
    out += '  <emitter type="directional"><vector name="direction" x="-0.8" y="-0.52" z="-0.2"/><rgb name="irradiance" value="58, 46, 30"/></emitter>\n'
    out += ('  <sensor type="perspective"><float name="fov" value="64"/><string name="fov_axis" value="x"/><transform name="to_world">'
            '<lookat origin="-1.2, 1.45, 2.8" target="0.45, 1.2, -0.9" up="0, 1, 0"/></transform><ref name="medium" id="steam"/>'
            '<sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>'
            '<film type="hdrfilm"><integer name="width" value="$width"/><integer name="height" value="$height"/><rfilter type="gaussian"/></film></sensor>\n')
    return out + '</scene>\n'


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], "w") as f:
        f.write(scene())
