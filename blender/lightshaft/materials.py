"""Materials: node trees of surfaces as bsdfs and emission."""

import math

from .document import element
from .nodes import Place, constant, output_node


class Owner:
    """The object and the material, for messages. `item`: the object, if its volume may have been baked."""

    def __init__(self, name, material, item=None):
        self.name, self.material, self.item = name, material, item

    def __str__(self):
        return (
            f"object '{self.name}', material '{self.material.name}'"
            if self.material
            else f"object '{self.name}'"
        )


class Surface:
    """A surface and its emission. `bsdf` is None if there is only emission."""

    def __init__(self, bsdf, emission=None):
        self.bsdf, self.emission = bsdf, emission


class Materials:
    def __init__(self, document, problems, textures):
        self.document, self.problems, self.textures = document, problems, textures
        self.known = {}
        self.passing = set()  # ids of the bsdfs that all light passes unchanged

    def surface(self, name, material):
        """Returns (id of the bsdf or None, emission or None) of a material. Each material is exported once."""
        key = material.name_full if material else None
        if key not in self.known:
            found = self.build(Owner(name, material))
            bsdf = found.bsdf
            if bsdf is None:  # light alone, or what was refused
                bsdf = element("bsdf", "diffuse", None, reflectance=0.0)
            identifier = self.document.define(material.name if material else "no material", bsdf)
            if bsdf.get("type") == "null":
                self.passing.add(identifier)
            self.known[key] = (identifier, found.emission)
        return self.known[key]

    def build(self, owner):
        material = owner.material
        if material is None:
            # Blender 5 shows such a mesh with the default Principled BSDF.
            return Surface(two_sided(opaque([0.8] * 3, 0.0, 0.5, 0.0, 1.5)))
        node = output_node(material.node_tree, "OUTPUT_MATERIAL") if material.node_tree else None
        if node is None:
            return Surface(two_sided(element("bsdf", "diffuse", None, reflectance=[0.0, 0.0, 0.0])))
        output = Place(node)
        if output.source(output.input("Displacement"))[0]:
            self.problems.unsupported(f"{owner}: Displacement. Apply a Displace modifier, or unlink it")
        source, _ = output.source(output.input("Surface"))
        if source is None:
            has_volume = output.source(output.input("Volume"))[0] is not None
            return Surface(
                element("bsdf", "null")
                if has_volume
                else two_sided(element("bsdf", "diffuse", None, reflectance=0.0))
            )
        return self.shader(source, owner)

    def shader(self, place, owner):
        build = SHADERS.get(place.node.type)
        if build is None:
            self.problems.error(
                f"{owner}, node '{place.title}': Lightshaft has no {place.node.bl_label} shader. Use a Principled BSDF instead"
            )
            return Surface(None)
        return build(self, place, owner)

    def principled(self, place, owner):
        get = lambda name: self.textures.value(place, name, owner)  # noqa: E731
        for name in (
            "Subsurface Weight",
            "Coat Weight",
            "Sheen Weight",
            "Thin Film Thickness",
            "Anisotropic",
            "Diffuse Roughness",
        ):
            if constant(place, place.input(name)) != 0.0:
                self.problems.unsupported(f"{owner}, node '{place.title}': {name}. Set it to 0")
        colour, metallic, roughness = get("Base Color"), get("Metallic"), get("Roughness")
        transmission, ior, level = get("Transmission Weight"), get("IOR"), get("Specular IOR Level")
        if not isinstance(ior, float) or not isinstance(level, float):
            self.problems.error(f"{owner}, node '{place.title}': IOR and Specular IOR Level must be numbers")
            return Surface(None)
        if any(value is None for value in (colour, metallic, roughness, transmission)):
            return Surface(None)
        if constant(place, place.input("Specular Tint")) != [1.0, 1.0, 1.0] and metallic != 0.0:
            self.problems.unsupported(
                f"{owner}, node '{place.title}': Specular Tint of a metal. Set it to white"
            )
        multiple = keeps_energy(place.node)
        if transmission == 1.0 and metallic == 0.0:
            bsdf = self.glass(colour, roughness, ior, owner, place)
        else:
            bsdf = opaque(colour, metallic, roughness, transmission, adjusted_ior(ior, level), multiple)
        bsdf = self.with_normal(place, bsdf, owner)
        if not (transmission == 1.0 and metallic == 0.0) and transmission == 0.0:
            bsdf = two_sided(bsdf)
        alpha = get("Alpha")
        if alpha is not None and alpha != 1.0:
            bsdf = element("bsdf", "mask", None, bsdf, opacity=alpha)
        strength, glow = get("Emission Strength"), get("Emission Color")
        emission = self.scaled_emission(glow, strength)
        # What is cut out or lets light pass by its alpha gives as much less light.
        return Surface(bsdf, emission if alpha is None else times(alpha, emission))

    def glass(self, colour, roughness, ior, owner, place):
        if not isinstance(colour, list) or not isinstance(roughness, float):
            self.problems.unsupported(
                f"{owner}, node '{place.title}': textures of glass. Set Base Color and Roughness to fixed values"
            )
            colour = colour if isinstance(colour, list) else [1.0] * 3
            roughness = roughness if isinstance(roughness, float) else 0.0
        # Light passes two surfaces of a body, so that each gives it the root of the colour.
        passed = [math.sqrt(max(c, 0)) for c in colour]
        if roughness**2 < 1e-3:
            return element(
                "bsdf", "dielectric", None, int_ior=ior, ext_ior=1.0, specular_transmittance=passed
            )
        return element(
            "bsdf", "roughdielectric", None, distribution="ggx", alpha=roughness**2, int_ior=ior, ext_ior=1.0,
            specular_transmittance=passed, multiple_scattering=True,
        )  # fmt: skip

    def with_normal(self, place, bsdf, owner):
        socket = place.input("Normal")
        source, _ = place.source(socket)
        if source is None:
            return bsdf
        node, where = source.node, f"{owner}, node '{source.title}'"
        inner, output = source.source(source.input("Color" if node.type == "NORMAL_MAP" else "Height"))
        strength = constant(source, source.input("Strength")) if source.input("Strength") else None
        if (
            node.type not in ("NORMAL_MAP", "BUMP")
            or inner is None
            or inner.node.type != "TEX_IMAGE"
            or strength != 1.0
        ):
            self.problems.unsupported(
                f"{where}: Lightshaft reads normals of an image only through a Normal Map or Bump node of strength 1"
            )
            return bsdf
        texture = self.textures.image_node(inner, output, owner)
        if texture is None:
            return bsdf
        if node.type == "NORMAL_MAP":
            if node.space != "TANGENT":
                self.problems.unsupported(f"{where}: space {node.space.title()}. Choose Tangent Space")
            if source.node.uv_map:
                self.problems.warning(
                    f"{where}: the node names another UV map than the mesh's map for rendering, which is used: {source.node.uv_map}"
                )
            return element("bsdf", "normalmap", None, bsdf, normalmap=texture, follow_mirroring=True)
        distance = constant(source, source.input("Distance"))
        if not isinstance(distance, float) or source.source(source.input("Normal"))[0]:
            self.problems.unsupported(f"{where}: Distance must be a number, and Normal unlinked")
            return bsdf
        return element(
            "bsdf", "bumpmap", None, bsdf, texture=texture, scale=-distance if node.invert else distance
        )

    def diffuse(self, place, owner):
        if constant(place, place.input("Roughness")) != 0.0:
            self.problems.unsupported(
                f"{owner}, node '{place.title}': Roughness of a diffuse surface. Set it to 0"
            )
        colour = self.textures.value(place, "Color", owner)
        return Surface(
            two_sided(self.with_normal(place, element("bsdf", "diffuse", None, reflectance=colour), owner))
        )

    def glossy(self, place, owner):
        colour, roughness = self.textures.value(place, "Color", owner), self.textures.value(
            place, "Roughness", owner
        )
        if constant(place, place.input("Anisotropy")) != 0.0:
            self.problems.unsupported(f"{owner}, node '{place.title}': Anisotropy. Set it to 0")
        if not isinstance(roughness, float):
            self.problems.error(
                f"{owner}, node '{place.title}': Roughness must be a number; a Principled BSDF takes a texture"
            )
            return Surface(None)
        # Blender's Glossy reflects its colour at all angles: a perfect mirror by that factor.
        if roughness**2 < 1e-3:
            bsdf = element("bsdf", "conductor", None, specular_reflectance=colour, eta=0.0, k=1.0)
        else:
            bsdf = element(
                "bsdf", "roughconductor", None, distribution="ggx", alpha=roughness**2, specular_reflectance=colour,
                eta=0.0, k=1.0, multiple_scattering=keeps_energy(place.node),
            )  # fmt: skip
        return Surface(two_sided(self.with_normal(place, bsdf, owner)))

    def glass_shader(self, place, owner):
        colour, roughness = self.textures.value(place, "Color", owner), self.textures.value(
            place, "Roughness", owner
        )
        ior = constant(place, place.input("IOR"))
        if not isinstance(ior, float):
            self.problems.error(f"{owner}, node '{place.title}': IOR must be a number")
            return Surface(None)
        if isinstance(colour, list):
            colour = [c * c for c in colour]  # a Glass BSDF's colour is that of one surface
        return Surface(self.with_normal(place, self.glass(colour, roughness, ior, owner, place), owner))

    def transparent(self, place, owner):
        colour = constant(place, place.input("Color"))
        if not isinstance(colour, list) or max(colour) - min(colour) > 1e-4:
            self.problems.unsupported(
                f"{owner}, node '{place.title}': a coloured Transparent BSDF. Make its Color grey"
            )
            return Surface(element("bsdf", "null"))
        if colour[0] >= 1:
            return Surface(element("bsdf", "null"))
        black = two_sided(element("bsdf", "diffuse", None, reflectance=0.0))
        return Surface(element("bsdf", "mask", None, black, opacity=1 - colour[0]))

    def emission(self, place, owner):
        glow, strength = self.textures.value(place, "Color", owner), self.textures.value(
            place, "Strength", owner
        )
        return Surface(None, self.scaled_emission(glow, strength))

    def scaled_emission(self, glow, strength):
        return None if strength is None or glow is None else times(strength, glow)

    def mix(self, place, owner):
        first, second = place.node.inputs[1], place.node.inputs[2]
        share = self.textures.value(place, place.node.inputs[0].identifier, owner)
        parts = [
            self.shader(source, owner) if (source := place.source(s)[0]) else Surface(None)
            for s in (first, second)
        ]
        if share is None:
            return Surface(None)
        a, b = (part.emission for part in parts)
        if a is None:
            emission = times(share, b)
        elif isinstance(share, float) and b is None:
            emission = times(1 - share, a)
        elif isinstance(share, float) and isinstance(a, list) and isinstance(b, list):
            emission = [x * (1 - share) + y * share for x, y in zip(a, b)]
        else:
            self.problems.error(
                f"{owner}, node '{place.title}': emission is mixed by a texture in a way that Lightshaft does not support. Mix by a number, make the emission the second, or use Add Shader"
            )
            return Surface(None)
        sides = [
            two_sided(element("bsdf", "diffuse", None, reflectance=0.0)) if p.bsdf is None else p.bsdf
            for p in parts
        ]
        if sides[0].get("type") == "null":  # what lets light pass straight on is the gap of a mask
            return Surface(element("bsdf", "mask", None, sides[1], opacity=share), emission)
        if sides[1].get("type") == "null" and isinstance(share, float):
            return Surface(element("bsdf", "mask", None, sides[0], opacity=1 - share), emission)
        return Surface(element("bsdf", "blendbsdf", None, *sides, weight=share), emission)

    def add(self, place, owner):
        parts = [
            self.shader(source, owner) if (source := place.source(s)[0]) else Surface(None)
            for s in place.node.inputs[:2]
        ]
        bsdfs = [part.bsdf for part in parts if part.bsdf is not None]
        emissions = [part.emission for part in parts if part.emission is not None]
        if len(bsdfs) > 1 or len(emissions) > 1:
            self.problems.error(
                f"{owner}, node '{place.title}': Lightshaft adds emission to one other shader. Use a Mix Shader"
            )
            return Surface(None)
        return Surface(bsdfs[0] if bsdfs else None, emissions[0] if emissions else None)


SHADERS = {
    "BSDF_PRINCIPLED": Materials.principled,
    "BSDF_DIFFUSE": Materials.diffuse,
    "BSDF_GLOSSY": Materials.glossy,
    "BSDF_GLASS": Materials.glass_shader,
    "BSDF_TRANSPARENT": Materials.transparent,
    "EMISSION": Materials.emission,
    "MIX_SHADER": Materials.mix,
    "ADD_SHADER": Materials.add,
}


def two_sided(bsdf):
    return element("bsdf", "twosided", None, bsdf)


def times(share, emission):
    """Multiplies a radiance by a number or a texture. None means no light."""
    if emission is None or (isinstance(share, float) and share == 0.0):
        return None
    if isinstance(emission, list) and not any(emission):
        return None
    if isinstance(share, float) and isinstance(emission, list):
        return [share * c for c in emission]
    return emission if share == 1.0 else element("texture", "product", None, first=share, second=emission)


def keeps_energy(node):
    """Returns True if the node adds back light that is lost between facets, as its distribution Multiscatter GGX
    does."""
    return node.distribution == "MULTI_GGX"


def opaque(colour, metallic, roughness, transmission, eta, multiple=True):
    """Makes an opaque surface: a dielectric coat over a diffuse base where possible, because that is closest to
    Blender; otherwise Burley's model."""
    if transmission != 0.0 or not isinstance(roughness, float):
        return burley(colour, metallic, roughness, transmission, eta, multiple)
    coated = element(
        "bsdf", "roughplastic", None, distribution="ggx", alpha=max(roughness**2, 1e-3), int_ior=eta, ext_ior=1.0,
        diffuse_reflectance=colour, multiple_scattering=True,
    )  # fmt: skip
    if metallic == 0.0:
        return coated
    metal = burley(colour, 1.0, roughness, 0.0, eta, multiple)
    return metal if metallic == 1.0 else element("bsdf", "blendbsdf", None, coated, metal, weight=metallic)


def burley(colour, metallic, roughness, transmission, eta, multiple):
    return element(
        "bsdf", "principled", None, base_color=colour, metallic=metallic, roughness=roughness,
        spec_trans=None if transmission == 0.0 else transmission, eta=eta, multiple_scattering=multiple,
    )  # fmt: skip


def adjusted_ior(ior, level):
    """Returns the index of refraction whose reflection at normal incidence is that of `ior` times twice the level,
    which is what Blender's Specular IOR Level means."""
    f0 = min(((ior - 1) / (ior + 1)) ** 2 * 2 * level, 0.99)
    return max((1 + math.sqrt(f0)) / (1 - math.sqrt(f0)), 1.001)
