"""Volume shaders as media: fog in closed meshes, and OpenVDB grids of volume objects."""

import math
import xml.etree.ElementTree as ElementTree

import numpy as np

from .document import element
from .nodes import BAKED_ONCE, Place, constant, is_animated, output_node
from .voxels import baked_values, vol


ISOTROPIC = ("isotropic", {})


def within(value, least, most):
    return min(max(value, least), most)


def anisotropy(g):
    """Blender's slider goes to 1 and -1, where a phase function is none; Cycles stops a thousandth before."""
    return within(g, -0.999, 0.999)


def henyey_greenstein(g):
    return ("hg", {"g": anisotropy(g)}) if g else ISOTROPIC


def nesting(phase):
    """How deep a phase function is nested: 1 if it is no blend."""
    return 1 + max((nesting(part) for part in phase[1].get("parts", ())), default=0)


# By the name of Blender's phase function: the inputs that it has, and its plugin with the parameters. What is
# outside the ranges of the plugins scatters as the nearest value within.
MOST_NESTED = 8  # phase functions within each other that the scene language takes
PHASES = {
    "HENYEY_GREENSTEIN": (("Anisotropy",), lambda v: henyey_greenstein(v["Anisotropy"])),
    "FOURNIER_FORAND": (
        ("Backscatter", "IOR"),
        lambda v: (
            "fournier_forand",
            {"backscatter": within(v["Backscatter"], 1e-5, 0.5), "ior": within(v["IOR"], 1.0001, 5.0)},
        ),
    ),
    "DRAINE": (
        ("Anisotropy", "Alpha"),
        lambda v: ("draine", {"g": anisotropy(v["Anisotropy"]), "alpha": within(v["Alpha"], 0.0, 1000.0)}),
    ),
    "RAYLEIGH": ((), lambda v: ("rayleigh", {})),
    "MIE": (("Diameter",), lambda v: ("droplets", {"diameter": within(v["Diameter"], 1e-3, 50.0)})),
}


class Coefficients:
    """Scattering, absorption (1/m) and emission (radiance/m) in three channels, each a number or an array of voxels
    (z x y x x), and the phase function: the name of its plugin and its parameters. `grid`: the name of the grid that
    multiplies scattering and absorption, or None. `voxels`: the Grid of the arrays, or None."""

    voxels = None

    def __init__(self, scattering=(0, 0, 0), absorption=(0, 0, 0), emission=(0, 0, 0), phase=ISOTROPIC, grid=None):
        self.scattering, self.absorption, self.emission, self.phase, self.grid = (
            scattering,
            absorption,
            emission,
            phase,
            grid,
        )


class Volumes:
    def __init__(self, document, problems):
        self.document, self.problems = document, problems

    def coefficients(self, owner, of_grid):
        """Returns the coefficients of the material's Volume input. Returns None if there are none or if an error
        was reported."""
        material = owner.material
        node = output_node(material.node_tree, "OUTPUT_MATERIAL") if material and material.node_tree else None
        output = Place(node) if node else None
        source = output.source(output.input("Volume"))[0] if output else None
        if source is None:
            if of_grid:
                self.problems.error(
                    f"{owner}: a volume object needs a material with a Principled Volume. Add one in Material properties"
                )
            return None
        return self.shader(source, owner, of_grid)

    def shader(self, place, owner, of_grid):
        where = f"{owner}, node '{place.title}'"
        kind = place.node.type
        if kind == "ADD_SHADER":
            return self.sum_of(place, owner, of_grid)
        names = INPUTS.get(kind)
        if names is None:
            self.problems.error(
                f"{where}: Lightshaft has no {place.node.bl_label} shader for volumes. Use a Principled Volume"
            )
            return None
        phase_of = None
        if kind in ("VOLUME_SCATTER", "VOLUME_COEFFICIENTS"):
            if place.node.phase not in PHASES:
                self.problems.error(
                    f"{where}: phase function {place.node.phase.replace('_', ' ').title()}. Choose Henyey-Greenstein"
                )
                return None
            more, phase_of = PHASES[place.node.phase]
            names = (*names, *more)
        values, voxels = {}, None
        for name in names:
            values[name] = constant(place, place.input(name))
            if (
                values[name] is None
                and name in ("Density", "Emission Strength")
                and self.is_grid(place, name, of_grid)
            ):
                continue
            if values[name] is None and name in VARYING.get(kind, ()) and owner.item is not None and not of_grid:
                if (baked := baked_values(owner.item, owner.material, place, place.input(name))) is None:
                    way = (
                        "Ungroup the node, since what is in a group cannot be baked"
                        if place.groups
                        else "Press Bake Procedural Textures in Render Properties > Lightshaft"
                    )
                    self.problems.error(f"{where}: {name} is procedural. {way}")
                    return None
                values[name], voxels = channels_of(baked[0], place.input(name)), baked[1]
                if is_animated(owner.material.node_tree):
                    self.problems.warning(f"{where}: {name} {BAKED_ONCE}")
                continue
            if values[name] is None:
                self.problems.error(
                    f"{where}: {name} varies by nodes. Lightshaft supports numbers and grids of OpenVDB files: "
                    "unlink it, or bake the volume to an OpenVDB file (Geometry Nodes: Mesh to Volume; Physics: Fluid)"
                )
                return None
        found = BUILD[kind](values)
        found.voxels = voxels
        if phase_of:
            found.phase = phase_of(values)
        if kind == "PRINCIPLED_VOLUME":
            if values["Blackbody Intensity"] != 0.0:
                self.problems.unsupported(
                    f"{where}: Blackbody Intensity. Set it to 0, and use Emission Strength"
                )
            if place.input("Color Attribute").default_value:
                self.problems.unsupported(f"{where}: Color Attribute. Clear it, and set Color")
        if of_grid:
            found.grid = self.grid_name(place, values)
            if any(found.emission):
                self.problems.unsupported(
                    f"{where}: emission of a grid's volume, which Blender emits everywhere in its box. Set it to 0"
                )
                found.emission = (0, 0, 0)
        return found

    def is_grid(self, place, name, of_grid):
        source, _ = place.source(place.input(name))
        return (
            of_grid
            and name == "Density"
            and source is not None
            and source.node.type in ("ATTRIBUTE", "VOLUME_INFO")
        )

    def grid_name(self, place, values):
        """Returns the grid that multiplies the density: the attribute of a Principled Volume, else what is linked
        to Density."""
        if values.get("Density") is None:
            node = place.source(place.input("Density"))[0].node
            return node.attribute_name if node.type == "ATTRIBUTE" else "density"
        if place.node.type == "PRINCIPLED_VOLUME":
            return place.input("Density Attribute").default_value or "density"
        return None

    def sum_of(self, place, owner, of_grid):
        parts = [
            self.shader(source, owner, of_grid) if (source := place.source(s)[0]) else None
            for s in place.node.inputs[:2]
        ]
        parts = [part for part in parts if part is not None]
        if len(parts) < 2:
            return parts[0] if parts else None
        one, two = parts
        add = lambda a, b: tuple(x + y for x, y in zip(a, b))  # noqa: E731
        scattering = add(one.scattering, two.scattering)
        if one.voxels or two.voxels:
            phase = one.phase if one.phase == two.phase else None
        else:
            phase = blended(one, two, scattering)
        if phase is None or one.grid != two.grid:
            self.problems.error(
                f"{owner}, node '{place.title}': the sum of two volumes of different grids, or of different phase functions and colours. Give both the same, or put them into two objects"
            )
            return None
        if nesting(phase) > MOST_NESTED:
            self.problems.error(
                f"{owner}, node '{place.title}': volumes of more than {MOST_NESTED} phase functions, one added to the other. "
                "Add them in pairs, or give some the same phase function"
            )
            return None
        both = Coefficients(
            scattering,
            add(one.absorption, two.absorption),
            add(one.emission, two.emission),
            phase,
            one.grid,
        )
        both.voxels = one.voxels or two.voxels
        return both

    def of_voxels(self, name, found, matrix, group, link_sets):
        """Defines a medium of baked voxels in a mesh at this place. Returns its id."""
        shape = tuple(int(n) for n in found.voxels.counts[::-1])
        place = matrix @ type(matrix).Translation(found.voxels.low) @ type(matrix).Diagonal((*found.voxels.size, 1))

        def grid(parameter, channels):
            values = np.stack([np.broadcast_to(c, shape) for c in channels], axis=-1)
            values = np.maximum(np.nan_to_num(values, nan=0, posinf=0, neginf=0), 0)  # as Cycles takes them
            if np.ptp(values, axis=-1).max() == 0:
                values = values[..., :1]
            filename = self.document.write(vol(values), ".vol")
            return element("volume", "gridvolume", parameter, filename=filename, to_world=place)

        sigma_t = total(found)
        albedo = [s / np.maximum(t, 1e-30) for s, t in zip(found.scattering, sigma_t)]
        glows = present(found.emission)
        fog = element(
            "medium",
            "heterogeneous",
            None,
            phase_element(found.phase),
            grid("sigma_t", sigma_t),
            grid("albedo", albedo),
            grid("emission", found.emission) if glows else None,
            light_group=group if glows else None,
            link_sets=link_sets,
        )
        return self.document.define(name, fog)

    def homogeneous(self, name, found, group, link_sets):
        return self.document.define(
            name, medium("homogeneous", found, total(found), any(found.emission), group, link_sets)
        )

    def grid(self, item, owner, found, path, matrix, box, link_sets):
        """Makes a medium of a grid's file in the box (in object space). Returns its id, and the position of its
        box [-1, 1]^3. Returns None if it is empty or if an error was reported."""
        data = item.data
        if found.grid is None:
            self.problems.error(
                f"{owner}: Density is the same everywhere in the box of its grids. Link an Attribute node 'density' to it"
            )
            return None
        if data.render.space == "OBJECT":  # thickness as the object's own space has it, however it is scaled
            size = (matrix.to_3x3() @ type(matrix.translation)((1, 1, 1))).length / math.sqrt(3)
            found.scattering, found.absorption = (
                [c / size for c in part] for part in (found.scattering, found.absorption)
            )
        sigma_t = total(found)
        peak = max(sigma_t)
        if peak <= 0:
            return None
        if max(sigma_t) - min(sigma_t) > 1e-6 * peak:
            self.problems.error(
                f"{owner}: the three channels of extinction differ. Set Absorption Color to black, or Color to grey"
            )
            return None
        filename = self.document.take(path, str(owner))
        grid = element(
            "volume", "gridvolume", "sigma_t", filename=filename, grid_name=found.grid, to_world=matrix
        )
        fog = medium("heterogeneous", found, None, False, None, link_sets)
        fog.append(ElementTree.Element("float", name="scale", value=repr(float(peak))))
        fog.append(grid)
        identifier = self.document.define(item.name, fog)
        low, high = ([f(corner[axis] for corner in box) for axis in range(3)] for f in (min, max))
        middle = [(a + b) / 2 for a, b in zip(low, high)]
        half = [(b - a) / 2 * 1.001 for a, b in zip(low, high)]
        cls = type(matrix)
        place = matrix @ cls.Translation(middle) @ cls.Diagonal((*half, 1))
        inside = ElementTree.Element("ref", {"name": "interior", "id": identifier})
        self.document.add(element("shape", "cube", None, element("bsdf", "null"), inside, to_world=place))
        return identifier, place


def channels_of(values, socket):
    """Returns voxels (z x y x x x 3) as a number's array or those of three channels."""
    return values[..., 0] if socket.type == "VALUE" else list(np.moveaxis(values, -1, 0))


def present(channels):
    return any(np.any(channel) for channel in channels)


def not_negative(x):
    return np.maximum(x, 0) if isinstance(x, np.ndarray) else max(x, 0)


def root(x):
    return np.sqrt(not_negative(x)) if isinstance(x, np.ndarray) else math.sqrt(max(x, 0))


def total(found):
    return [s + a for s, a in zip(found.scattering, found.absorption)]


def blended(one, two, scattering):
    """Returns the phase function of the sum of two volumes: a blend by the share of each of the scattering. Returns
    None if that share differs between the channels."""
    if one.phase == two.phase or not any(two.scattering):
        return one.phase
    if not any(one.scattering):
        return two.phase
    weight = sum(two.scattering) / sum(scattering)
    if any(abs(s - weight * both) > 1e-6 * both for s, both in zip(two.scattering, scattering)):
        return None
    return ("blendphase", {"weight": weight, "parts": (one.phase, two.phase)})


def phase_element(phase):
    plugin, parameters = phase
    inner = [phase_element(part) for part in parameters.get("parts", ())]
    numbers = {name: value for name, value in parameters.items() if name != "parts"}
    return element("phase", plugin, None, *inner, **numbers)


def medium(plugin, found, sigma_t, glows, group, link_sets):
    albedo = [s / (s + a) if s + a > 0 else 0.0 for s, a in zip(found.scattering, found.absorption)]
    return element(
        "medium",
        plugin,
        None,
        phase_element(found.phase),
        sigma_t=sigma_t,
        albedo=albedo,
        emission=list(found.emission) if glows else None,
        light_group=group if glows else None,
        link_sets=link_sets,
    )


# The inputs that may vary by nodes in meshes, by the type of the shader; Cycles evaluates them (voxels.py).
VARYING = {
    "PRINCIPLED_VOLUME": ("Color", "Density", "Absorption Color", "Emission Strength", "Emission Color"),
    "VOLUME_SCATTER": ("Color", "Density"),
    "VOLUME_ABSORPTION": ("Color", "Density"),
    "VOLUME_COEFFICIENTS": ("Absorption Coefficients", "Scatter Coefficients", "Emission Coefficients"),
    "EMISSION": ("Color", "Strength"),
}
INPUTS = {
    "PRINCIPLED_VOLUME": (
        "Color", "Density", "Anisotropy", "Absorption Color", "Emission Strength", "Emission Color", "Blackbody Intensity",
    ),
    "VOLUME_SCATTER": ("Color", "Density"),
    "VOLUME_ABSORPTION": ("Color", "Density"),
    "VOLUME_COEFFICIENTS": ("Absorption Coefficients", "Scatter Coefficients", "Emission Coefficients"),
    "EMISSION": ("Color", "Strength"),
}  # fmt: skip


def principled(v):
    density = density_of(v)
    scattering = [density * c for c in v["Color"]]
    # Blender's rule: absorption = density * (1 - Color) * (1 - sqrt(Absorption Color)).
    absorption = [
        density * not_negative(1 - c) * not_negative(1 - root(a))
        for c, a in zip(v["Color"], v["Absorption Color"])
    ]
    emission = [v["Emission Strength"] * c for c in v["Emission Color"]]
    return Coefficients(scattering, absorption, emission, henyey_greenstein(v["Anisotropy"]))


def density_of(v):
    return 1.0 if v["Density"] is None else not_negative(v["Density"])


BUILD = {
    "PRINCIPLED_VOLUME": principled,
    "VOLUME_SCATTER": lambda v: Coefficients([density_of(v) * c for c in v["Color"]]),
    "VOLUME_ABSORPTION": lambda v: Coefficients(
        absorption=[density_of(v) * not_negative(1 - c) for c in v["Color"]]
    ),
    "VOLUME_COEFFICIENTS": lambda v: Coefficients(
        v["Scatter Coefficients"], v["Absorption Coefficients"], v["Emission Coefficients"]
    ),
    "EMISSION": lambda v: Coefficients(emission=[v["Strength"] * c for c in v["Color"]]),
}
