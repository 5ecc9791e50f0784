"""Lights of UsdLux, with the luminances and sizes that its specification defines."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

from .document import Document, colour
from .gprims import cylinder_part, rectangle_part, sphere_part
from .ignored import tell_light
from .images import LEAST_OF_A_MAP, Images, exr, is_tiny, scaled
from .links import NONE, Links
from .meshes import Part
from .motion import Motions, Placement
from .problems import Problems
from .shading import plain
from .transforms import EXACT, Matrix, is_similarity, mean_scale, mirrors, scale, unscaled
from .visibility import Visibility

FLIP = scale(1, -1, -1)  # USD's lights shine along -z, those of the scene format along +z
PROFILE = 512  # pixels of the image that a spot light throws
WIDEST_IMAGE = 85  # degrees: a wider cone has no image on a plane
Dict = dict[str, Any]


class Lights:
    def __init__(
        self,
        document: Document,
        images: Images,
        problems: Problems,
        time: Usd.TimeCode,
        up_axis: str,
        links: Links,
        motions: Motions,
    ) -> None:
        self._motions = motions
        self._document, self._images, self._problems, self._time = document, images, problems, time
        self._up_axis, self._links = up_axis, links
        self._sky: list[tuple[Usd.Prim, list[float], Dict]] = []
        self._maps = 0
        self.count = 0

    def add(self, prim: Usd.Prim, placement: Placement) -> None:
        build = BUILD.get(str(prim.GetTypeName()))
        if build is None:
            self._problems.warn(prim, f"a light of type {prim.GetTypeName()} is not read")
            return
        self.count += 1
        self._check(prim)
        tell_light(prim, self._problems)
        self._visible = Visibility(prim, self._time, self._problems)
        self._placement = placement
        build(self, prim, placement.still)

    def finish(self) -> None:
        """Combines domes of one colour into one sky, because the scene format has only one."""
        if self._maps > 1 or (self._maps and self._sky):
            self._problems.error(
                self._sky[0][0].GetPath() if self._sky else "the stage",
                "there is more than one dome light, one of them with an image. Leave one",
            )
        elif self._sky:
            total = np.sum([radiance for _, radiance, _ in self._sky], axis=0)
            first, _, flags = self._sky[0]
            if any(others != flags for _, _, others in self._sky):
                self._problems.warn(first, "dome lights differ in which rays see them, or in what they are linked to: all light everything")
                flags = {}
            sky = {"type": "constant", "radiance": colour(list(total)), **flags}
            self._document.define(str(first.GetPath()), sky)

    def value(self, prim: Usd.Prim, name: str, default: Any) -> Any:
        """Returns an input. In files from before 2021 it has its old name."""
        now, then = prim.GetAttribute(f"inputs:{name}"), prim.GetAttribute(name)
        old = then and then.HasAuthoredValue() and not (now and now.HasAuthoredValue())
        attribute = then if old else now
        if attribute and attribute.HasAuthoredConnections():
            self._problems.warn(prim, f"inputs:{name} is computed by a shader: the input's own value is used")
        found = attribute.Get(self._time) if attribute else None
        return default if found is None else found

    def number(self, prim: Usd.Prim, name: str, default: float) -> float:
        found = float(self.value(prim, name, default))
        if not math.isfinite(found):
            self._problems.error(prim, f"inputs:{name} is not finite")
            return default
        return found

    def luminance(self, prim: Usd.Prim, intensity: float = 1.0) -> list[float]:
        """Returns intensity * 2^exposure * color, times the colour of the temperature."""
        power = self.number(prim, "intensity", intensity)
        power *= 2.0 ** min(self.number(prim, "exposure", 0.0), 100.0)
        shown = plain(self.value(prim, "color", (1.0, 1.0, 1.0)))
        if self.value(prim, "enableColorTemperature", False):
            kelvin = self.number(prim, "colorTemperature", 6500.0)
            warm = plain(UsdLux.BlackbodyTemperatureAsRgb(kelvin))
            shown = [a * b for a, b in zip(shown, warm)]
        if power < 0 or min(shown) < 0:
            self._problems.warn(prim, "a light of negative intensity is left out")
        return [max(power * x, 0.0) for x in shown]

    def _check(self, prim: Usd.Prim) -> None:
        for name in ("diffuse", "specular"):
            if self.number(prim, name, 1.0) != 1:
                self._problems.warn(prim, f"inputs:{name} has no effect: light is reflected as the surface's material says")
        filters = prim.GetRelationship("light:filters")
        if filters and filters.GetTargets():
            self._problems.warn(prim, "light filters are left out")
        ies = self.value(prim, "shaping:ies:file", None)
        if ies is not None and ies.path:
            self._problems.warn(prim, "an IES profile is left out")

    def _linked(self, prim: Usd.Prim) -> Dict:
        """Returns the parameters of what the light lights, and of what shades it."""
        shades = self.value(prim, "shadow:enable", True) is not False
        return {**self._links.of_light(prim), **({} if shades else {"blockers": NONE})}

    def distant(self, prim: Usd.Prim, matrix: Matrix) -> None:
        self._stands(prim)
        luminance = self.luminance(prim, 50000.0)
        half = min(max(self.number(prim, "angle", 0.53) / 2, 0.0), 180.0)
        if half > 90:
            self._problems.error(prim, "an angle above 180 degrees is not supported. Use a DomeLight")
            return
        size = math.pi * math.sin(math.radians(half)) ** 2
        # Parallel light has no luminance: its intensity is what a plane that faces it receives.
        whole = half == 0 or self.value(prim, "normalize", False)
        direction = -matrix[:3, 2]
        self._document.define(
            str(prim.GetPath()),
            {
                "type": "directional",
                "direction": direction / np.linalg.norm(direction),
                "irradiance": colour([x * (1 if whole else size) for x in luminance]),
                "angular_radius": half,
                **self._visible.of_sky(),
                **self._linked(prim),
            },
        )

    def dome(self, prim: Usd.Prim, matrix: Matrix) -> None:
        luminance = self.luminance(prim)
        file = self.value(prim, "texture:file", None)
        if not any(luminance):
            return
        if file is None or not file.path:
            flags = {**self._visible.of_sky(), **self._linked(prim)}
            self._sky.append((prim, luminance, flags))
            return
        self._stands(prim)
        kind = str(self.value(prim, "texture:format", "automatic"))
        if kind not in ("automatic", "latlong"):
            self._problems.error(prim, f"a map of format {kind} is not supported. Make it latlong")
            return
        asset = self._document.files.find(prim, file)
        if asset is None:
            return
        if asset.suffix not in (".exr", ".hdr", ".png", ".jpg", ".jpeg"):
            self._problems.error(prim, f"@{file.path}@: a dome takes EXR, HDR, PNG and JPEG")
            return
        kept = max(luminance) - min(luminance) <= 1e-6 * max(luminance) and not is_tiny(asset)
        name = (
            self._document.files.take(asset)
            if kept
            else self._document.files.write(scaled(asset, luminance, LEAST_OF_A_MAP), ".exr")
        )
        self._maps += 1
        pole = prim.GetAttribute("poleAxis")
        axis = str(pole.Get(self._time)) if pole else "Y"
        stands = axis == "Z" or (axis == "scene" and self._up_axis == "Z")
        turn = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], float)  # +y to +z
        self._document.define(
            str(prim.GetPath()),
            {
                "type": "envmap",
                "filename": name,
                "scale": luminance[0] if kept else 1.0,
                # USD's map lies as the scene format's: its middle is +z, a quarter from its left edge is +x.
                "to_world": _turned(matrix) @ (turn if stands else np.eye(4)),
                **self._visible.of_sky(),
                **self._linked(prim),
            },
        )

    def rect(self, prim: Usd.Prim, matrix: Matrix) -> None:
        width, height = self.number(prim, "width", 1.0), self.number(prim, "height", 1.0)
        placed = matrix @ FLIP @ scale(width / 2, height / 2, 1)
        area = 4 * float(np.linalg.norm(np.cross(placed[:3, 0], placed[:3, 1])))
        self._lamp(prim, {"type": "rectangle"}, placed, area, flat=True)

    def disk(self, prim: Usd.Prim, matrix: Matrix) -> None:
        radius = self.number(prim, "radius", 0.5)
        placed = matrix @ FLIP @ scale(radius, radius, 1)
        area = math.pi * float(np.linalg.norm(np.cross(placed[:3, 0], placed[:3, 1])))
        self._lamp(prim, {"type": "disk"}, placed, area, flat=True)

    def sphere(self, prim: Usd.Prim, matrix: Matrix) -> None:
        radius = self.number(prim, "radius", 0.5)
        shaped = prim.HasAPI(UsdLux.ShapingAPI)
        cone = self.number(prim, "shaping:cone:angle", 90.0) if shaped else 180.0
        if self.value(prim, "treatAsPoint", False) or radius == 0 or cone < 180:
            self._point(prim, matrix, radius * mean_scale(matrix), cone)
        elif is_similarity(matrix):
            size = radius * mean_scale(matrix)
            lamp = {"type": "sphere", "radius": radius, "flip_normals": mirrors(matrix)}
            self._lamp(prim, lamp, matrix, 4 * math.pi * size**2)
        else:
            self._mesh_lamp(prim, sphere_part(radius).moved(matrix))

    def cylinder(self, prim: Usd.Prim, matrix: Matrix) -> None:
        length, radius = self.number(prim, "length", 1.0), self.number(prim, "radius", 0.5)
        if prim.HasAPI(UsdLux.ShapingAPI) and self.number(prim, "shaping:cone:angle", 90.0) < 180:
            self._problems.warn(prim, "the cone of a cylinder light is left out: it emits in all directions")
        x, y, z = (matrix[:3, k] for k in range(3))
        across = float(np.linalg.norm(y))
        straight = max(abs(x @ y), abs(x @ z), abs(y @ z)) <= 1e-6 * across**2
        if not straight or abs(float(np.linalg.norm(z)) - across) > 1e-6 * across:
            self._mesh_lamp(prim, cylinder_part(radius, radius, length, "X", caps=False).moved(matrix))
            return
        area = 2 * math.pi * radius * across * length * float(np.linalg.norm(x))
        shape = {
            "type": "cylinder",
            "p0": [-length / 2, 0.0, 0.0],
            "p1": [length / 2, 0.0, 0.0],
            "radius": radius,
        }
        self._lamp(prim, shape, matrix, area)

    def _mesh_lamp(self, prim: Usd.Prim, part: Part) -> None:
        name = self._document.files.write(part.ply(), ".ply")
        self._lamp(prim, {"type": "ply", "filename": name}, np.eye(4), part.area())

    def _lamp(self, prim: Usd.Prim, shape: Dict, to_world: Matrix, area: float, flat: bool = False) -> None:
        """Adds a shape that emits light and lets the light of others pass. `flat`: its normal is the axis of the
        light."""
        if not area > 0:
            self._problems.warn(prim, "a light without a size is left out")
            return
        size = area if self.value(prim, "normalize", False) else 1.0
        luminance = [x / size for x in self.luminance(prim)]
        radiance: Any = colour(luminance)
        file = self.value(prim, "texture:file", None) if flat else None
        if file is not None and file.path:
            asset = self._document.files.find(prim, file)
            if asset is None:
                return
            # Whoever looks at the lit side sees the image upright: its upper left corner is at (+x, +y).
            mirror = np.array([[-1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], float)
            name = self._document.files.write(scaled(asset, luminance), ".exr")
            radiance = {"type": "bitmap", "filename": name, "raw": True, "to_uv": mirror}
            radiance["wrap_mode"] = "clamp"
        emitter = {"type": "area", "radiance": radiance, **self._beam(prim, flat), **self._linked(prim)}
        shape, placement = self._moving(shape, to_world, flat, image=radiance["type"] == "bitmap")
        where = self._motions.to_world(prim, placement, rigid=True)
        placed = {**shape, "to_world": where, "bsdf": {"type": "null"}, "emitter": emitter}
        self._document.define(str(prim.GetPath()), {**placed, **self._visible.of_sky()})

    def _moving(self, shape: Dict, to_world: Matrix, flat: bool, image: bool) -> tuple[Dict, Placement]:
        """Returns the shape of a lamp and its placement. One that moves gets a form that its transforms do not
        stretch, as the renderer demands."""
        if not self._placement.moves:
            return shape, Placement(to_world)
        motion = self._placement @ np.linalg.inv(self._placement.still)
        if flat:
            x, y, z = np.linalg.norm(to_world[:3, :3], axis=0)
            if abs(x - y) <= EXACT * x:  # a flat shape has no size along z
                to_world = to_world @ scale(1, 1, x / z)
            elif shape["type"] == "rectangle" and not image and not mirrors(to_world):
                part = rectangle_part().moved(to_world)
                shape = {"type": "ply", "filename": self._document.files.write(part.ply(), ".ply")}
                to_world = np.eye(4)
        return shape, Placement(to_world, (motion @ to_world).poses)

    def _stands(self, prim: Usd.Prim) -> None:
        self._motions.stands(prim, self._placement, "a light without a shape")

    def _beam(self, prim: Usd.Prim, flat: bool) -> Dict:
        """Returns cone and focus as the angles of an area light, measured from its normal."""
        if not prim.HasAPI(UsdLux.ShapingAPI):
            return {}
        cone = min(self.number(prim, "shaping:cone:angle", 90.0), 90.0) if flat else 90.0
        soft = min(max(self.number(prim, "shaping:cone:softness", 0.0), 0.0), 1.0) if flat else 0.0
        focus = max(self.number(prim, "shaping:focus", 0.0), 0.0)
        if focus > 0 and max(plain(self.value(prim, "shaping:focusTint", (0, 0, 0)))) > 0:
            self._problems.warn(prim, "inputs:shaping:focusTint is black here")
        if cone >= 90 and soft == 0:  # cos(a)^focus
            return {"cutoff_angle": 90.0, "beam_width": 0.0, "falloff": focus} if focus > 0 else {}
        if focus > 0:
            self._problems.warn(prim, "inputs:shaping:focus beside a cone is left out")
        if cone <= 0:
            self._problems.warn(prim, "a cone of 0 degrees is rendered with 0.01 degrees")
            cone = 0.01
        begin = cone * (1 - soft)
        if soft == 0:
            return {"cutoff_angle": cone, "beam_width": cone}
        outer, inner, middle = (math.cos(math.radians(a)) for a in (cone, begin, (cone + begin) / 2))
        half = (middle - outer) / (inner - outer)  # the falloff's base where USD's smooth step is 1/2
        return {
            "cutoff_angle": cone,
            "beam_width": begin,
            "falloff": math.log(0.5) / math.log(half),
        }

    def _point(self, prim: Usd.Prim, matrix: Matrix, radius: float, cone: float) -> None:
        """Replaces a tiny sphere by a point that emits the light of its cross-section in each direction."""
        self._stands(prim)
        luminance = self.luminance(prim)
        flags = {**self._visible.of_light(), **self._linked(prim)}
        if self.value(prim, "normalize", False):
            intensity = [x / 4 for x in luminance]  # pi r^2 of 4 pi r^2
        else:
            intensity = [x * math.pi * radius**2 for x in luminance]
        if not any(intensity):
            self._problems.warn(prim, "a sphere of radius 0 emits no light unless inputs:normalize is on")
            return
        if cone >= 180:
            place = {"type": "point", "position": matrix[:3, 3], "intensity": colour(intensity)}
            self._document.define(str(prim.GetPath()), {**place, **flags})
            return
        if radius > 0:
            self._problems.warn(prim, "a sphere light with a cone shines from its centre: shadows are hard")
        soft = min(max(self.number(prim, "shaping:cone:softness", 0.0), 0.0), 1.0)
        cone = max(cone, 0.01)
        spot = {
            "type": "spot",
            "to_world": unscaled(matrix) @ FLIP,
            "intensity": colour(intensity),
            "cutoff_angle": cone,
            "beam_width": cone * 0.9999,
        }
        if soft > 0 and cone <= WIDEST_IMAGE:
            image = np.repeat(soft_profile(math.radians(cone), soft)[:, :, None], 3, axis=2)
            name = self._document.files.write(exr(image), ".exr")
            spot["texture"] = {"type": "bitmap", "filename": name, "raw": True, "wrap_mode": "clamp"}
        elif soft > 0:
            spot["beam_width"] = cone * (1 - soft)
        if self.number(prim, "shaping:focus", 0.0) > 0:
            self._problems.warn(prim, "inputs:shaping:focus beside a cone is left out")
        self._document.define(str(prim.GetPath()), {**spot, **flags})


def soft_profile(cone: float, soft: float) -> Any:
    """Makes an image of USD's falloff over the square around the cone. The axis is in its centre."""
    across = (np.arange(PROFILE) + 0.5) / PROFILE * 2 - 1
    angle = np.arctan(np.hypot(across[None, :], across[:, None]) * math.tan(cone))
    begin = cone * (1 - soft)
    t = np.clip((angle - begin) / (cone - begin), 0, 1)
    return 1 - t * t * (3 - 2 * t)


def _turned(matrix: Matrix) -> Matrix:
    """Removes position and size from a matrix. A mirroring stays."""
    left, _, right = np.linalg.svd(matrix[:3, :3])
    result = np.eye(4)
    result[:3, :3] = left @ right
    return result


BUILD = {
    "DistantLight": Lights.distant,
    "DomeLight": Lights.dome,
    "DomeLight_1": Lights.dome,
    "RectLight": Lights.rect,
    "DiskLight": Lights.disk,
    "SphereLight": Lights.sphere,
    "CylinderLight": Lights.cylinder,
}


def is_light(prim: Usd.Prim) -> bool:
    return bool(prim.HasAPI(UsdLux.LightAPI)) and not prim.IsA(UsdGeom.Gprim)
