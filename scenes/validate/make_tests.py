#!/usr/bin/env python3
"""Writes five t-tests of light in media, as Nori files with the meshes and grids that they need.

    scenes/validate/make_tests.py FOLDER
    lightshaft validate FOLDER/test-medium-absorption.xml        (and the others)

Each scene is a cube [-1, 1]^3 of a medium, seen along z through its middle: the ray's way through it is 2. The
references are closed forms, one for each channel.
"""
import pathlib
import struct
import sys
from math import exp, expm1, pi

LENGTH = 2.0  # of the ray's way through the cube
DEPTH = 1.0  # of the ray below the cube's upper face
PATHS = 100_000
INTEGRATORS = (
    ("volpath", ""),
    ("volpath_distant_mis", '<string name="distance" value="exponential"/>'),
    ("volpath_distant_mis", '<string name="distance" value="mis"/>'),
)


def cube():
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = ["v %d %d %d" % c for c in corners]
    for a, b, c, d in faces:
        lines += ["f %d %d %d" % (a, b, c), "f %d %d %d" % (a, c, d)]
    return "\n".join(lines) + "\n"


def grid(value):
    """2 x 2 x 2 nodes at the corners of the cube."""
    return struct.pack("<3i6f8f", 2, 2, 2, -1, -1, -1, 1, 1, 1, *([value] * 8))


def rgb(name, values):
    return f'<color name="{name}" value="{", ".join(format(v, ".17g") for v in values)}"/>'


def scene(integrator, medium, light, max_depth=-1):
    name, settings = integrator
    return f"""
  <scene>
    <integrator type="{name}"><integer name="maxDepth" value="{max_depth}"/>{settings}</integrator>
    <camera type="perspective">
      <transform name="toWorld"><lookat origin="0, 0, -5" target="0, 0, 0" up="0, 1, 0"/></transform>
      <float name="fov" value="0.001"/>
      <integer name="width" value="1"/>
      <integer name="height" value="1"/>
    </camera>
    <mesh type="obj">
      <string name="filename" value="cube.obj"/>
      {medium}
    </mesh>
    {light}
  </scene>"""


def homogeneous(**parameters):
    return f'<medium type="homogeneous">{"".join(rgb(*p) for p in parameters.items())}</medium>'


def surroundings(radiance):
    return f'<emitter type="constant">{rgb("radiance", radiance)}</emitter>' if any(radiance) else ""


def absorption():
    """Light of 1 from behind: exp(-sigma_a d)."""
    sigma = (0.2, 0.5, 3.0)
    for i in INTEGRATORS:
        yield (scene(i, homogeneous(sigma_a=sigma, sigma_s=(0, 0, 0)), surroundings((1, 1, 1))),
               [exp(-s * LENGTH) for s in sigma])


def emission():
    """Radiance per length: e (1 - exp(-sigma_a d)) / sigma_a, which is e d where nothing absorbs."""
    sigma, emitted = (0.2, 1.0, 0.0), (1.0, 2.0, 0.5)
    for i in INTEGRATORS:
        yield (scene(i, homogeneous(sigma_a=sigma, sigma_s=(0, 0, 0), emission=emitted), ""),
               [e * (-expm1(-s * LENGTH) / s if s else LENGTH) for s, e in zip(sigma, emitted)])


def hetero_constant():
    """A grid of the constant density 3: exp(-3 scale sigma_a d), the density counted once."""
    for i in INTEGRATORS:
        for s in (0.1, 0.5):
            medium = (f'<medium type="heterogeneous"><string name="filename" value="three.bin"/>'
                      f'{rgb("sigma_a", [s] * 3)}{rgb("sigma_s", [0] * 3)}'
                      f'<float name="density_scale" value="0.5"/></medium>')
            yield scene(i, medium, surroundings((1, 2, 4))), [k * exp(-3 * 0.5 * s * LENGTH) for k in (1, 2, 4)]


def furnace():
    """Light of 1 from everywhere: 1, where there is nothing of the medium, and where all is scattered."""
    for i in INTEGRATORS:
        for sigma_s in ((0, 0, 0), (0.5, 1, 2)):
            yield (scene(i, homogeneous(sigma_a=(0, 0, 0), sigma_s=sigma_s), surroundings((1, 1, 1))), [1, 1, 1])


def scattering_distant():
    """Irradiance E from straight above, scattered once (paths of two segments):

    E / (4 pi) sigma_s / sigma_t (1 - exp(-sigma_t d)) exp(-sigma_t h): the light fades on its way down, too.
    """
    absorbed, scattered, e = (0.1, 0.5, 2.0), (0.4, 0.5, 1.0), (1.0, 2.0, 3.0)
    light = f'<emitter type="distant"><vector name="direction" value="0, -1, 0"/>{rgb("irradiance", e)}</emitter>'
    for i in INTEGRATORS:
        references = []
        for a, s, k in zip(absorbed, scattered, e):
            t = a + s
            references.append(k / (4 * pi) * s / t * -expm1(-t * LENGTH) * exp(-t * DEPTH))
        yield scene(i, homogeneous(sigma_a=absorbed, sigma_s=scattered), light, max_depth=2), references


TESTS = {
    "test-medium-absorption": absorption,
    "test-medium-emission": emission,
    "test-medium-hetero-constant": hetero_constant,
    "test-medium-furnace-noscatter": furnace,
    "test-medium-scattering-distant": scattering_distant,
}


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "cube.obj").write_text(cube())
    (folder / "three.bin").write_bytes(grid(3.0))
    for name, make in TESTS.items():
        scenes, references = zip(*make())
        numbers = ", ".join(format(r, ".17g") for per_scene in references for r in per_scene)
        (folder / f"{name}.xml").write_text(f"""<?xml version="1.0" encoding="utf-8"?>
<!-- {make.__doc__.strip()} -->
<test type="ttest">
  <integer name="sampleCount" value="{PATHS}"/>
  <string name="references" value="{numbers}"/>
{"".join(scenes)}
</test>
""")


if __name__ == "__main__":
    main()
