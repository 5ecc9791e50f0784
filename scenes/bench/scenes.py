"""The bench scenes as text (Mitsuba 3 XML): what other renderers load as it is."""


def element(tag, *inside, **attributes):
    words = "".join(f' {key}="{value:g}"' if isinstance(value, (int, float)) else f' {key}="{value}"' for key, value in attributes.items())
    return f"<{tag}{words}>{''.join(inside)}</{tag}>" if inside else f"<{tag}{words}/>"


def triple(values):
    return ", ".join(f"{v:g}" for v in values)


def rgb(name, *values):
    return element("rgb", name=name, value=triple(values))


def number(name, value):
    return element("float", name=name, value=value)


def whole(name, value):
    return element("integer", name=name, value=value)


def word(name, value):
    return element("string", name=name, value=value)


def transform(*steps, name="to_world"):
    return element("transform", *steps, name=name)


def look(origin, target, up=(0, 1, 0)):
    return element("lookat", origin=triple(origin), target=triple(target), up=triple(up))


def use(name):
    return element("ref", id=name)


NULL = element("bsdf", type="null")


def filled(medium):
    """A boundary that bends no light, with this medium behind it."""
    return NULL + element("ref", name="interior", id=medium)


# Materials

def both_sides(name, *inside):
    return element("bsdf", element("bsdf", *inside, type="diffuse"), type="twosided", id=name)


def diffuse(name, *reflectance):
    return both_sides(name, rgb("reflectance", *reflectance))


def rough_metal(name, distribution, alpha, eta, k):
    return element("bsdf", word("distribution", distribution), number("alpha", alpha), rgb("eta", *eta), rgb("k", *k), type="roughconductor", id=name)


# Media

def phase(g):
    return element("phase", number("g", g), type="hg")


def homogeneous(name, sigma_t, albedo, g, *more):
    return element("medium", *more, rgb("sigma_t", *sigma_t), rgb("albedo", *albedo), phase(g), type="homogeneous", id=name)


def grid(name, scale, albedo, g):
    """The density of NAME.vol, in the box that the file gives."""
    volume = element("volume", word("filename", f"{name}.vol"), element("boolean", name="use_grid_bbox", value="true"), type="gridvolume", name="sigma_t")
    return element("medium", volume, number("scale", scale), albedo, phase(g), type="heterogeneous", id=name)


# Shapes

def box(lo, hi, *inside):
    half, middle = [(b - a) / 2 for a, b in zip(lo, hi)], [(a + b) / 2 for a, b in zip(lo, hi)]
    place = transform(element("scale", **dict(zip("xyz", half))), element("translate", **dict(zip("xyz", middle))))
    return element("shape", place, *inside, type="cube")


def ball(centre, radius, *inside):
    return element("shape", element("point", name="center", **dict(zip("xyz", centre))), number("radius", radius), *inside, type="sphere")


def square(half, angle, at, *inside):
    """Turned about x: at 90 degrees it faces down, at -90 up."""
    place = transform(element("scale", x=half, y=half), element("rotate", x=1, angle=angle), element("translate", **dict(zip("xyz", at))))
    return element("shape", place, *inside, type="rectangle")


# Lights

def shines(*radiance):
    return element("emitter", rgb("radiance", *radiance), type="area")


def sun(direction, *irradiance):
    return element("emitter", element("vector", name="direction", **dict(zip("xyz", direction))), rgb("irradiance", *irradiance), type="directional")


def sky(*radiance):
    return element("emitter", rgb("radiance", *radiance), type="constant")


# Whole scenes

def camera(origin, target, fov, *more, size=(256, 256), kind="perspective"):
    sampler = element("sampler", whole("sample_count", 64), type="independent")
    film = element("film", whole("width", size[0]), whole("height", size[1]), element("rfilter", type="box"), type="hdrfilm")
    return element("sensor", number("fov", fov), word("fov_axis", "x"), transform(look(origin, target)), *more, sampler, film, type=kind)


def scene(*parts, max_depth=16):
    integrator = element("integrator", whole("max_depth", max_depth), whole("rr_depth", 5), type="volpathmis")
    return '<scene version="3.0.0">\n' + "".join(f"  {part}\n" for part in (integrator, *parts)) + "</scene>\n"


def shafts():
    """Sun through a slatted window into a room of 4 x 3 x 6 m that is full of drifting steam; the camera stands in the steam."""
    wall = .1  # thickness; the window is 1.7 m high and 3.2 m long, in the wall at x = 2
    inner, outer = 3, 3 + wall
    slats = [box((2, 1.08 + .21 * k, -1.6), (2.1, 1.14 + .21 * k, 1.6), use("wood")) for k in range(8)]
    posts = [box((2, 1, -.85 + .8 * k), (2.1, 2.7, -.75 + .8 * k), use("wood")) for k in range(3)]
    return scene(
        grid("steam", 2.2, number("albedo", .96), .35),
        diffuse("plaster", .7, .68, .64), diffuse("wood", .45, .3, .18), diffuse("tile", .3, .4, .42),
        rough_metal("brass", "beckmann", .15, (.44, .53, 1.09), (3.7, 2.77, 1.83)),
        box((-2 - wall, -wall, -outer), (2 + wall, 0, outer), use("wood")),
        box((-2 - wall, 3, -outer), (2 + wall, 3 + wall, outer), use("plaster")),
        box((-2 - wall, 0, -outer), (-2, 3, outer), use("plaster")),
        box((-2, 0, -outer), (2, 3, -inner), use("plaster")),
        box((-2, 0, inner), (2, 3, outer), use("plaster")),
        box((2, 0, -outer), (2 + wall, 1, outer), use("plaster")),
        box((2, 2.7, -outer), (2 + wall, 3, outer), use("plaster")),
        box((2, 1, -outer), (2 + wall, 2.7, -1.6), use("plaster")),
        box((2, 1, 1.6), (2 + wall, 2.7, outer), use("plaster")),
        *slats, *posts,
        box((-1.6, 0, -.5), (.3, .6, 1.3), use("tile")),
        ball((.9, .35, -1.2), .35, use("brass")),
        sun((-.8, -.62, .18), 60, 52, 40),
        box((-1.95, .05, -2.95), (1.95, 2.93, 2.93), filled("steam")),
        camera((-1.2, 1.5, 2.7), (.5, 1.15, -.6), 72, element("ref", name="medium", id="steam"), size=(320, 240)))


def fogbox():
    """A box with a red and a green wall, filled with homogeneous fog, under a small lamp."""
    return scene(
        diffuse("white", .73, .73, .73), diffuse("red", .6, .07, .05), diffuse("green", .12, .45, .1),
        box((-1.1, -1.1, -1.1), (1.1, -1, 1.1), use("white")),
        box((-1.1, 1, -1.1), (1.1, 1.1, 1.1), use("white")),
        box((-1, -1, -1.1), (1, 1, -1), use("white")),
        box((-1.1, -1, -1.1), (-1, 1, 1.1), use("red")),
        box((1, -1, -1.1), (1.1, 1, 1.1), use("green")),
        box((-.7, -1, -.6), (-.1, .2, 0), use("white")),
        ball((.45, -.65, .2), .35, use("white")),
        square(.25, 90, (0, .985, 0), shines(18, 15, 11)),
        homogeneous("fog", (.6,) * 3, (.9,) * 3, .2),
        box((-.995,) * 3, (.995,) * 3, filled("fog")),
        camera((0, 0, 3.9), (0, 0, 0), 39))


def cloud():
    """A dense cloud that scatters forward and absorbs a thousandth, under sun and sky."""
    return scene(
        grid("cloud", 60, rgb("albedo", .999, .999, .999), .75),
        diffuse("ground", .25, .28, .2),
        square(8, -90, (0, -.4, 0), use("ground")),
        box((-.985, .015, -.985), (.985, 1.48, .985), filled("cloud")),
        sun((.5, -.7, -.5), 8, 7.4, 6.4),
        sky(.35, .5, .8),
        camera((0, 1, 4.2), (0, .55, 0), 36), max_depth=64)


def spotfog():
    """A narrow spot in thin fog: most light is scattered once, near the lamp."""
    lamp = element("emitter", transform(look((-.8, 1.6, .4), (.1, -.6, 0), up=(0, 0, 1))), rgb("intensity", 30, 28, 24),
                   number("cutoff_angle", 22), number("beam_width", 14), type="spot")
    return scene(
        diffuse("floor", .5, .5, .5), diffuse("ball", .8, .3, .2),
        box((-3, -1.2, -3), (3, -1, 3), use("floor")),
        ball((.1, -.6, 0), .4, use("ball")),
        lamp,
        homogeneous("thin", (.25,) * 3, (.95,) * 3, .5),
        box((-2.9, -.99, -2.9), (2.9, 2.2, 2.9), filled("thin")),
        camera((0, .35, 4.6), (0, .2, 0), 50))


def tint():
    """A ball whose extinction is as 1 : 4 : 16 in red, green and blue, of the same index as the air."""
    return scene(
        diffuse("grey", .5, .5, .5),
        box((-3, -1.2, -3), (3, -1, 3), use("grey")),
        homogeneous("syrup", (.0625, .25, 1), (.995, .97, .8), .6, number("scale", 12.8)),
        ball((0, 0, 0), .98, filled("syrup")),
        square(.8, 60, (0, 2.4, -1.8), shines(14, 14, 14)),
        sky(.2, .2, .2),
        camera((0, .4, 4.4), (0, 0, 0), 34), max_depth=64)


def surface():
    """No medium: rough gold, plastic and a diffuse ball on a chequered floor, through a thin lens."""
    squares = element("texture", rgb("color0", .45, .3, .15), rgb("color1", .25, .15, .08),
                      transform(element("scale", x=12, y=12), name="to_uv"), type="checkerboard", name="reflectance")
    plastic = element("bsdf", word("distribution", "beckmann"), number("alpha", .1), number("int_ior", 1.5),
                      rgb("diffuse_reflectance", .6, .5, .08), type="roughplastic", id="plastic")
    balls = (("gold", -1.3, -1.2), ("plastic", 0, 0), ("blue", 1.1, 1.1), ("gold", 1.6, -2))
    return scene(
        diffuse("white", .73, .73, .73), diffuse("blue", .15, .25, .6),
        rough_metal("gold", "ggx", .1, (.17, .35, 1.5), (3.14, 2.98, 1.94)), plastic, both_sides("wood", squares),
        square(4, -90, (0, -1, 0), use("wood")),
        box((-4, -1, -4.1), (4, 3, -4), use("white")),
        *[ball((x, -.5, z), .5, use(material)) for material, x, z in balls],
        square(.5, 90, (-1, 2.5, .5), shines(20, 18, 15)),
        sky(.15, .18, .22),
        camera((0, .6, 5), (0, -.4, 0), 40, number("aperture_radius", .12), number("focus_distance", 5.1), kind="thinlens"))


ALL = {make.__name__: make for make in (shafts, fogbox, cloud, spotfog, tint, surface)}
