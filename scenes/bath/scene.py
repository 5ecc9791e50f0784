"""The scene file: materials, the meshes by material, the steam, sun and sky, the camera (Mitsuba 3 XML)."""
from hall import BACK, BAYS, FRONT, HEIGHT, LEFT, RIGHT, SILL, TOP, WALL

SUN_DIRECTION = (-0.80, -0.36, 0.38)  # the way the light travels: down, into the hall, towards the camera
SUN = (58.0, 42.0, 24.0)
FILL = (1.8, 2.25, 2.8)
CAMERA, TARGET, FOV = (0.45, 1.32, 3.45), (0.08, 1.30, -1.0), 63

# name: (reflectance as rgb or image, roughness) of what is diffuse under a glossy coat
COATED = {
    "enamel": ("0.80, 0.79, 0.75", .13),
    "clay": ("0.33, 0.115, 0.06", .22),
    "amber": ("0.20, 0.075, 0.012", .13),
    "leaf": ("0.045, 0.115, 0.028", .22),
}


def scene(width, height, spp, grid):
    out = '<scene version="3.0.0">\n'
    for name, value in (("spp", spp), ("width", width), ("height", height)):
        out += f'  <default name="{name}" value="{value}"/>\n'
    out += '  <integrator type="volpath"><integer name="max_depth" value="14"/><integer name="rr_depth" value="5"/></integrator>\n'
    return out + steam(grid) + materials() + shapes() + light() + camera() + '</scene>\n'


def steam(grid):
    box = '<boolean name="use_grid_bbox" value="true"/>' if grid == "vol" else ""
    return ('  <medium type="heterogeneous" id="steam">\n'
            '    <volume type="gridvolume" name="sigma_t"><string name="filename" value="steam.' + grid + f'"/>{box}</volume>\n'
            '    <float name="scale" value="1"/><rgb name="albedo" value="0.985, 0.985, 0.985"/>\n'
            '    <phase type="hg"><float name="g" value="0.55"/></phase>\n  </medium>\n')


def image(parameter, file, uv="", raw=False, mirror=False):
    extra = '<boolean name="raw" value="true"/>' if raw else ""
    extra += '<string name="wrap_mode" value="mirror"/>' if mirror else ""
    extra += f'<transform name="to_uv">{uv}</transform>' if uv else ""
    return f'<texture type="bitmap" name="{parameter}"><string name="filename" value="{file}"/>{extra}</texture>'


def coated(reflectance, alpha, name=None):
    attribute = f' id="{name}"' if name else ""
    colour = reflectance if "<" in reflectance else f'<rgb name="diffuse_reflectance" value="{reflectance}"/>'
    return (f'<bsdf type="roughplastic"{attribute}><string name="distribution" value="ggx"/><float name="alpha" value="{alpha}"/>'
            f'<float name="int_ior" value="1.5"/>{colour}</bsdf>')


def materials():
    out = "".join(f'  <bsdf type="twosided" id="{name}">{coated(*m)}</bsdf>\n' for name, m in COATED.items())
    boards = image("diffuse_reflectance", "floor.png")
    out += ('  <bsdf type="normalmap" id="floor">' + image("normalmap", "floor_normal.png", raw=True)
            + '<bsdf type="blendbsdf">' + image("weight", "puddles.png", raw=True)
            + coated(boards, .24) + coated(boards, .11) + '</bsdf></bsdf>\n')
    out += ('  <bsdf type="normalmap" id="tiles">' + image("normalmap", "tiles_normal.png", raw=True)
            + coated(image("diffuse_reflectance", "tiles.png"), .14) + '</bsdf>\n')
    lime = image("reflectance", "plaster.png", '<scale x="0.4" y="0.4"/>')
    out += f'  <bsdf type="twosided" id="plaster"><bsdf type="diffuse">{lime}</bsdf></bsdf>\n'
    oak = image("diffuse_reflectance", "wood.png", '<scale x="2" y="0.5"/>', mirror=True)
    out += f'  <bsdf type="twosided" id="wood">{coated(oak, .25)}</bsdf>\n'
    out += f'  <bsdf type="twosided" id="towel"><bsdf type="diffuse">{image("reflectance", "towel.png")}</bsdf></bsdf>\n'
    out += ('  <bsdf type="twosided" id="brass"><bsdf type="roughconductor"><string name="distribution" value="ggx"/>'
            '<float name="alpha" value="0.2"/><rgb name="eta" value="0.444, 0.527, 1.094"/>'
            '<rgb name="k" value="3.695, 2.765, 1.829"/></bsdf></bsdf>\n')
    out += '  <bsdf type="twosided" id="mirror"><bsdf type="conductor"><string name="material" value="Ag"/></bsdf></bsdf>\n'
    out += '  <bsdf type="thindielectric" id="water"><float name="int_ior" value="1.33"/></bsdf>\n'
    return out


GROUPS = ("plaster", "tiles", "floor", "wood", "brass", "enamel", "water", "mirror", "towel", "clay", "amber", "leaf")


def shapes():
    out = "".join(f'  <shape type="ply"><string name="filename" value="{g}.ply"/><ref id="{g}"/></shape>\n' for g in GROUPS)
    lo, hi = (LEFT + .002, .002, BACK + .002), (RIGHT - .002, HEIGHT - .002, FRONT - .002)
    scale, centre = [(b - a) / 2 for a, b in zip(lo, hi)], [(b + a) / 2 for a, b in zip(lo, hi)]
    out += ('  <shape type="cube"><transform name="to_world">' + '<scale x="{:.6g}" y="{:.6g}" z="{:.6g}"/>'.format(*scale)
            + '<translate x="{:.6g}" y="{:.6g}" z="{:.6g}"/>'.format(*centre)
            + '</transform><bsdf type="null"/><ref name="interior" id="steam"/></shape>\n')
    return out


def light():
    """The sun, and the sky as far as the bays show it: a panel that sunlight passes, so that few samples look for the sky
    where walls are."""
    out = ('  <emitter type="directional"><vector name="direction" x="{}" y="{}" z="{}"/>'.format(*SUN_DIRECTION)
           + '<rgb name="irradiance" value="{}, {}, {}"/></emitter>\n'.format(*SUN))
    z0, z1 = BAYS[0][0], BAYS[-1][1]
    out += (f'  <shape type="rectangle"><transform name="to_world"><scale x="{(z1 - z0) / 2:.6g}" y="{(TOP - SILL) / 2:.6g}"/>'
            f'<rotate y="1" angle="-90"/><translate x="{RIGHT + WALL + .01:.6g}" y="{(TOP + SILL) / 2:.6g}" z="{(z0 + z1) / 2:.6g}"/>'
            f'</transform><bsdf type="null"/><emitter type="area">{image("radiance", "outside.hdr")}</emitter></shape>\n')
    # Behind the camera the hall ends in frosted glass.
    out += ('  <shape type="rectangle"><transform name="to_world"><scale x="1.5" y="1.2"/><rotate y="1" angle="180"/>'
            f'<translate x="-0.4" y="1.9" z="{FRONT - .01:.6g}"/></transform><bsdf type="diffuse"/>'
            '<emitter type="area"><rgb name="radiance" value="{}, {}, {}"/></emitter></shape>\n'.format(*FILL))
    return out


def camera():
    look = 'origin="{}, {}, {}" target="{}, {}, {}" up="0, 1, 0"'.format(*CAMERA, *TARGET)
    return (f'  <sensor type="perspective"><float name="fov" value="{FOV}"/><string name="fov_axis" value="x"/>'
            f'<transform name="to_world"><lookat {look}/></transform><ref name="medium" id="steam"/>'
            '<sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>'
            '<film type="hdrfilm"><integer name="width" value="$width"/><integer name="height" value="$height"/>'
            '<rfilter type="gaussian"/></film></sensor>\n')
