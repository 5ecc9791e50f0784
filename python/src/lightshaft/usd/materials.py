"""Converts UsdPreviewSurface to a bsdf and emission, in the same way as the Blender add-on."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from pxr import Usd, UsdShade

from .document import Document, colour
from .ignored import tell_material, tell_shader
from .images import Images
from .problems import Problems
from .shading import Input, Primvar, Shaders, Texture

GREY = (0.18, 0.18, 0.18)  # the diffuse colour of a UsdPreviewSurface that says nothing
SMOOTH = 1e-3  # the smallest alpha of a rough coat
Dict = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Surface:
    bsdf: str
    emission: Any = None
    coordinates: str | None = None
    """The primvar of the texture coordinates for images."""
    colours: Primvar | None = None
    """The primvar that a mesh must have as its attribute `color`."""


class Materials:
    def __init__(self, document: Document, images: Images, problems: Problems, time: Usd.TimeCode) -> None:
        self._document, self._problems = document, problems
        self._shaders = Shaders(document.files, images, problems, time)
        self._known: dict[str, Surface | None] = {}
        self._colours: dict[Any, Surface] = {}

    def of_material(self, material: UsdShade.Material) -> Surface | None:
        """Converts a material. Returns None and reports a warning if it has no supported surface."""
        path = str(material.GetPath())
        if path not in self._known:
            self._known[path] = None
            with self._problems.reading(material):
                self._known[path] = self._build(material)
        return self._known[path]

    def of_colour(self, prim: Any, value: list[float] | Primvar, opacity: float) -> Surface:
        """Makes a diffuse material of displayColor for prims without a material."""
        key = (value.name if isinstance(value, Primvar) else tuple(value), opacity)
        if key not in self._colours:
            used = _Used(self._shaders, self._problems)
            bsdf = masked(two_sided({"type": "diffuse", "reflectance": used.value(value)}), opacity)
            name = "displayColor" if isinstance(value, Primvar) else "displayColor " + str(key[0])
            self._colours[key] = Surface(self._document.define(name, bsdf), colours=used.colours)
        return self._colours[key]

    def _build(self, material: UsdShade.Material) -> Surface | None:
        shader = material.ComputeSurfaceSource()[0]
        kind = shader.GetIdAttr().Get() if shader else None
        if kind != "UsdPreviewSurface":
            told = f"its surface is {kind}, not UsdPreviewSurface" if kind else "it has no UsdPreviewSurface"
            self._problems.warn(material, f"{told}: displayColor is used")
            return None
        used = _Used(self._shaders, self._problems)
        tell_material(material, self._problems)
        built = Preview(shader, self._shaders, self._problems, used)
        bsdf, opacity = built.bsdf(), built.opacity()
        bsdf, emission = masked(bsdf, opacity), built.emission(opacity)
        identifier = self._document.define(str(material.GetPath()), bsdf)
        return Surface(identifier, emission, used.coordinates, used.colours)


class _Used:
    """Turns inputs into values of the scene, and collects the attributes that a mesh must have for them."""

    def __init__(self, shaders: Shaders, problems: Problems) -> None:
        self._shaders, self._problems = shaders, problems
        self.coordinates: str | None = None
        self.colours: Primvar | None = None

    def value(self, given: Input, bounded: bool = True, **look: Any) -> Any:
        if isinstance(given, Texture):
            if self.coordinates not in (None, given.coordinates):
                self._problems.warn(
                    given.asset.prim,
                    f"a material with two sets of texture coordinates: {self.coordinates} is used for all",
                )
            self.coordinates = self.coordinates or given.coordinates
            return self._shaders.bitmap(given, bounded=bounded, **look)
        if isinstance(given, Primvar):
            if self.colours is not None and self.colours.name != given.name:
                self._problems.warn(given.name, "a material with two colours from primvars: the first is used")
            self.colours = self.colours or given
            return {"type": "mesh_attribute", "name": "vertex_color"}
        if isinstance(given, list):
            return colour([min(max(x, 0), 1) if bounded else max(x, 0) for x in given[:3]])
        return min(max(given, 0.0), 1.0) if bounded else given


class Preview:
    """One UsdPreviewSurface."""

    def __init__(self, shader: UsdShade.Shader, shaders: Shaders, problems: Problems, used: _Used) -> None:
        self._shader, self._shaders, self._problems, self._used = shader, shaders, problems, used

    def _input(self, name: str, default: Any) -> Input:
        return self._shaders.input(self._shader, name, default)

    def bsdf(self) -> Dict:
        """Returns the bsdf without its opacity."""
        tell_shader(self._shader, self._problems)
        if self._input("displacement", 0.0) != 0.0:
            self._problems.warn(self._shader, "displacement is ignored")
        base = self._used.value(self._input("diffuseColor", list(GREY)))
        roughness = self._used.value(self._input("roughness", 0.5))
        ior = max(float(self._shaders.constant(self._shader, "ior", 1.5)), 1e-3)
        if ior < 1:  # the reflection straight on is that of its reciprocal
            ior = 1 / ior
        coat = self._used.value(self._input("clearcoat", 0.0))
        if self._shaders.constant(self._shader, "useSpecularWorkflow", 0) == 1:
            bsdf = self._by_specular_colour(base, roughness)
        else:
            metallic = self._used.value(self._input("metallic", 0.0))
            bsdf = opaque(base, metallic, roughness, ior, coat, self._gloss(coat))
        return two_sided(self._with_normals(bsdf))

    def _by_specular_colour(self, base: Any, roughness: Any) -> Dict:
        """Makes a surface whose reflection at normal incidence is a colour."""
        given = self._input("specularColor", [0.0, 0.0, 0.0])
        if not isinstance(given, list):
            self._problems.warn(self._shader, "a texture as specularColor: 0.04 is used")
            given = [0.04] * 3
        top = min(max(given), 0.99)
        if top <= 0:
            return {"type": "diffuse", "reflectance": base}
        if top > 0.2:  # a metal
            return burley(self._used.value(given), 1.0, roughness, 1.5)
        root = top**0.5
        bsdf = opaque(base, 0.0, roughness, (1 + root) / (1 - root), 0.0, 0.0)
        if bsdf["type"] == "roughplastic":
            bsdf["specular_reflectance"] = colour([max(x, 0) / top for x in given])
        return bsdf

    def _gloss(self, coat: Any) -> Any:
        """Returns Burley's gloss, from 0 (alpha 0.1) to 1 (alpha 0.001), for a roughness whose square is alpha."""
        rough = self._input("clearcoatRoughness", 0.01)
        if coat == 0.0:
            return 0.0
        if not isinstance(rough, float):
            self._problems.warn(self._shader, "a texture as clearcoatRoughness: 0.01 is used")
            rough = 0.01
        return min(max((0.1 - rough**2) / 0.099, 0.0), 1.0)

    def _with_normals(self, bsdf: Dict) -> Dict:
        given = self._input("normal", [0.0, 0.0, 1.0])
        if isinstance(given, Primvar):
            self._problems.warn(self._shader, "normals from a primvar are ignored")
        if not isinstance(given, Texture):
            return bsdf
        look = given.look
        # The scene's normals are 2 texel - 1, so that a scale of 2 and a bias of -1 leave the file as it is.
        halved = tuple(s / 2 for s in look.scale[:3]) + (1.0,)
        moved = tuple((b + 1) / 2 for b in look.bias[:3]) + (0.0,)
        return {
            "type": "normalmap",
            "normalmap": self._used.value(given, scale=halved, bias=moved),
            "follow_mirroring": True,
            "bsdf": bsdf,
        }

    def opacity(self) -> Any:
        given = self._input("opacity", 1.0)
        threshold = float(self._shaders.constant(self._shader, "opacityThreshold", 0.0))
        if isinstance(given, Texture):
            return self._used.value(given, threshold=max(threshold, 0.0))
        if isinstance(given, float) and threshold > 0:
            return float(given >= threshold)
        return self._used.value(given)

    def emission(self, opacity: Any) -> Any:
        """Returns the emission. Parts that `opacity` cuts out or makes transparent emit less."""
        given = self._input("emissiveColor", [0.0, 0.0, 0.0])
        if opacity == 0.0 or (isinstance(given, list) and not any(x > 0 for x in given)):
            return None
        if isinstance(given, list) and isinstance(opacity, float):
            given = [x * opacity for x in given]
            opacity = 1.0
        glow = self._used.value(given, bounded=False)
        return glow if opacity == 1.0 else {"type": "product", "first": glow, "second": opacity}


def two_sided(bsdf: Dict) -> Dict:
    return {"type": "twosided", "bsdf": bsdf}


def masked(bsdf: Dict, opacity: Any) -> Dict:
    return bsdf if opacity == 1.0 else {"type": "mask", "opacity": opacity, "bsdf": bsdf}


def opaque(base: Any, metallic: Any, roughness: Any, ior: float, coat: Any, gloss: Any) -> Dict:
    """Makes an opaque surface: a dielectric coat over a diffuse base where possible, else Burley's model."""
    if not isinstance(roughness, float) or coat != 0.0:
        return burley(base, metallic, roughness, ior, coat, gloss)
    coated = {
        "type": "roughplastic",
        "distribution": "ggx",
        "alpha": max(roughness**2, SMOOTH),
        "int_ior": max(ior, 1.001),
        "ext_ior": 1.0,
        "diffuse_reflectance": base,
        "multiple_scattering": True,
    }
    if metallic == 0.0:
        return coated
    metal = burley(base, 1.0, roughness, ior)
    if metallic == 1.0:
        return metal
    return {"type": "blendbsdf", "weight": metallic, "coated": coated, "metal": metal}


def burley(base: Any, metallic: Any, roughness: Any, ior: float, coat: Any = 0.0, gloss: Any = 0.0) -> Dict:
    built = {
        "type": "principled",
        "base_color": base,
        "metallic": metallic,
        "roughness": roughness,
        "eta": max(ior, 1.001),
        "multiple_scattering": True,
    }
    return built if coat == 0.0 else {**built, "clearcoat": coat, "clearcoat_gloss": gloss}


def constant_colour(values: Any) -> list[float]:
    return [float(x) for x in np.clip(np.asarray(values, np.float64).ravel()[:3], 0, 1)]
