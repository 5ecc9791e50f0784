"""Scenes for docs/measurements/error.md beside the bench scenes and the bath: kinds of light that those do not have."""
import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "scenes" / "bench"), str(ROOT / "scenes" / "bath")]
import grids  # noqa: E402: they lie in folders that have to be named first
import scenes as kit  # noqa: E402
import vol  # noqa: E402


def walls():
    """A closed room of 4 x 3 x 6 m with a window of 1.2 x 1.6 m in the wall at x = 2."""
    plaster, wood = kit.use("plaster"), kit.use("wood")
    return [
        kit.diffuse("plaster", .7, .68, .64), kit.diffuse("wood", .45, .3, .18), kit.diffuse("tile", .3, .4, .42),
        kit.box((-2.1, -.1, -3.1), (2.1, 0, 3.1), wood), kit.box((-2.1, 3, -3.1), (2.1, 3.1, 3.1), plaster),
        kit.box((-2.1, 0, -3.1), (-2, 3, 3.1), plaster), kit.box((-2, 0, -3.1), (2, 3, -3), plaster), kit.box((-2, 0, 3), (2, 3, 3.1), plaster),
        kit.box((2, 0, -3.1), (2.1, 1, 3.1), plaster), kit.box((2, 2.6, -3.1), (2.1, 3, 3.1), plaster),
        kit.box((2, 1, -3.1), (2.1, 2.6, -.6), plaster), kit.box((2, 1, .6), (2.1, 2.6, 3.1), plaster),
        kit.box((-1.6, 0, -.5), (.3, .6, 1.3), kit.use("tile")), kit.ball((.9, .35, -1.2), .35, plaster)]


def sky_room():
    """Lit by nothing but the sky in its window."""
    return kit.scene(*walls(), kit.sky(3, 4, 6), kit.camera((-1.2, 1.5, 2.7), (.5, 1.15, -.6), 72))


def lamps():
    """36 small lamps in two colours under the ceiling of a room."""
    colours = (9, 7, 4), (3, 5, 9)
    lights = [kit.ball((-1.5 + .6 * i, 2.8, -2.5 + .9 * k), .04, kit.shines(*(20 * c for c in colours[(i + k) % 2])))
              for i in range(6) for k in range(6)]
    return kit.scene(*walls(), *lights, kit.camera((-1.2, 1.5, 2.7), (.5, 1.15, -.6), 72))


def flames():
    """A flame of 1 x 2 x 1 m: extinction, least at its edge, and the light that it gives off, most in its core."""
    corner, voxel, counts = (-.5, 0., -.5), .04, (25, 50, 25)
    x, y, z = grids.centres(counts, [n * voxel for n in counts])
    noise = grids.turbulence(x, y, z, seed=5, octaves=4, lowest=4)
    x, y, z = (at + c for at, c in zip((x, y, z), corner))
    core = np.clip(1 - np.sqrt(x * x + z * z) / (.12 + .5 * np.exp(-1.2 * y) * np.sqrt(y)) + .35 * noise, 0, 1) * np.clip(2 - y, 0, 1)
    return {name: grids.Grid(values.astype("<f4"), corner, voxel) for name, values in (("smoke", core), ("glow", core ** 3))}


def flame(brightness):
    """The medium "smoke", which gives off light."""
    glow = kit.element("volume", kit.word("filename", "glow.vol"), kit.element("boolean", name="use_grid_bbox", value="true"),
                       type="gridvolume", name="emission")
    medium = kit.grid("smoke", 3, kit.number("albedo", .5), .3)
    return medium.replace("</medium>", glow + kit.number("emission_scale", brightness) + "</medium>")


def fire_room():
    """A flame in a room that has no other light (docs/decisions/0049-emissive-grids.md)."""
    return kit.scene(*walls(), flame(300), kit.box((-.495, .005, -.495), (.495, 1.995, .495), kit.filled("smoke")),
                     kit.camera((-1.2, 1.5, 2.7), (.5, 1.15, -.6), 72))


def fire():
    """A flame over a dark floor lights its own smoke, a ball and two blocks."""
    return kit.scene(
        kit.diffuse("ground", .3, .28, .25), kit.diffuse("stone", .5, .5, .5), flame(30),
        kit.square(6, -90, (0, -.01, 0), kit.use("ground")),
        kit.ball((.9, .4, .4), .4, kit.use("stone")), kit.box((-1.4, 0, -.4), (-.8, .9, .2), kit.use("stone")), kit.box((-.4, 0, -1.6), (1.2, 1.2, -1.2), kit.use("stone")),
        kit.box((-.495, .005, -.495), (.495, 1.995, .495), kit.filled("smoke")),
        kit.camera((-.6, 1.4, 4.4), (0, .8, 0), 45))


ALL = {"sky_room": sky_room, "fire": fire, "lamps": lamps}


def make(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, grid in flames().items():
        vol.write_vol(folder / f"{name}.vol", grid.values.transpose(2, 1, 0), *grid.box())
    for name, scene in {**ALL, "fire_room": fire_room}.items():
        (folder / f"{name}.xml").write_text(scene())
