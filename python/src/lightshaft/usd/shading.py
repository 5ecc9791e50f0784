"""Reads inputs of shaders: a number, a colour, a texture, or a primvar of the mesh."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from pxr import Usd, UsdShade

from .files import Asset, Files
from .ignored import tell_shader
from .images import Images, Look
from .problems import Problems
from .transforms import Matrix

UPSIDE_DOWN = np.array([[1, 0, 0, 0], [0, -1, 0, 1], [0, 0, 1, 0], [0, 0, 0, 1]], float)
WRAP = {"repeat": "repeat", "useMetadata": "repeat", "mirror": "mirror", "clamp": "clamp"}


@dataclasses.dataclass(frozen=True)
class Texture:
    asset: Asset
    look: Look
    wrap: str
    coordinates: str
    """The primvar with its texture coordinates."""
    to_st: Matrix


@dataclasses.dataclass(frozen=True)
class Primvar:
    name: str
    fallback: tuple[float, ...]


Input = float | list[float] | Texture | Primvar


def plain(value: Any) -> Any:
    """Converts USD's numbers and vectors to Python's numbers and lists."""
    if isinstance(value, (bool, str)) or value is None:
        return value
    try:
        return [float(x) for x in value]
    except TypeError:
        return float(value)


class Shaders:
    """Follows the connections of shaders at one time code."""

    def __init__(self, files: Files, images: Images, problems: Problems, time: Usd.TimeCode) -> None:
        self._files, self._images, self._problems, self._time = files, images, problems, time

    def follow(self, shader: UsdShade.Shader, name: str) -> tuple[Any, UsdShade.Shader | None, str]:
        """Returns (value, None, ""), or (None, the shader that computes it, the name of its output)."""
        given = shader.GetInput(name)
        if not given:
            return None, None, ""
        for attribute in given.GetValueProducingAttributes():
            base, kind = UsdShade.Utils.GetBaseNameAndType(attribute.GetName())
            if kind == UsdShade.AttributeType.Output:
                return None, UsdShade.Shader(attribute.GetPrim()), base
            return attribute.Get(self._time), None, ""
        return None, None, ""

    def constant(self, shader: UsdShade.Shader, name: str, default: Any) -> Any:
        """Returns the value of an input that cannot be connected."""
        value, source, _ = self.follow(shader, name)
        if source is not None:
            self._problems.warn(shader, f"inputs:{name} is computed by a shader: ignored")
        return default if value is None else value

    def input(self, shader: UsdShade.Shader, name: str, default: float | list[float]) -> Input:
        value, source, output = self.follow(shader, name)
        if source is None:
            found: Input = default if value is None else plain(value)
            return found
        kind = source.GetIdAttr().Get()
        if kind == "UsdUVTexture":
            return self._texture(source, output)
        if kind and kind.startswith("UsdPrimvarReader_"):
            fallback = plain(self.constant(source, "fallback", None))
            values = default if fallback is None else fallback
            if isinstance(values, list) and isinstance(default, list):
                return Primvar(str(self.constant(source, "varname", "")), tuple(values[:3]))
            self._problems.warn(source, "a primvar of a single number is not supported: its fallback is used")
            return values if isinstance(values, float) else default
        self._problems.warn(
            source, f"the shader {kind or 'without an id'} is not read: inputs:{name} has its default"
        )
        return default

    def _texture(self, node: UsdShade.Shader, output: str) -> Input:
        tell_shader(node, self._problems)
        scale, bias, fallback = (
            tuple(plain(self.constant(node, name, default)))
            for name, default in (
                ("scale", (1.0,) * 4),
                ("bias", (0.0,) * 4),
                ("fallback", (0, 0, 0, 1)),
            )
        )
        channels = output if output in ("r", "g", "b", "a") else "rgb"
        value = self.constant(node, "file", None)
        number = {"r": 0, "g": 1, "b": 2, "a": 3}.get(channels)
        computed = [f * s + b for f, s, b in zip(fallback, scale, bias)]
        without = computed[:3] if number is None else computed[number]
        if value is None or not value.path:
            return without
        if "<UDIM>" in value.path:
            self._problems.error(node, f"@{value.path}@: images in tiles (UDIM) are not supported")
            return 0.0
        given = node.GetInput("fallback")
        if given and given.GetAttr().HasAuthoredValue():
            why = self._images.fault(node, value)
            if why:
                self._problems.warn(node, f"@{value.path}@ {why}: the shader's fallback is used")
                return without
        asset = self._files.find(node, value)
        if asset is None:
            return 0.0
        coordinates, to_st = self._coordinates(node)
        look = Look(channels, scale, bias, str(self.constant(node, "sourceColorSpace", "auto")))
        return Texture(asset, look, self._wrap(node), coordinates, to_st)

    def _wrap(self, node: UsdShade.Shader) -> str:
        across, along = (str(self.constant(node, name, "useMetadata")) for name in ("wrapS", "wrapT"))
        if across != along:
            self._problems.warn(node, "wrapS and wrapT differ: wrapS is used for both")
        if across not in WRAP:
            self._problems.warn(node, f"wrapS '{across}' is not supported: the image's edge is extended")
        return WRAP.get(across, "clamp")

    def _coordinates(self, node: UsdShade.Shader) -> tuple[str, Matrix]:
        matrix = np.eye(4)
        _, source, _ = self.follow(node, "st")
        for _ in range(16):
            kind = source.GetIdAttr().Get() if source else None
            if kind != "UsdTransform2d":
                break
            matrix = matrix @ self._transform(source)
            _, source, _ = self.follow(source, "in")
        if source is None:
            return "st", matrix
        if not kind or not kind.startswith("UsdPrimvarReader_float2"):
            self._problems.warn(source, f"texture coordinates of the shader {kind}: st is used")
            return "st", matrix
        return str(self.constant(source, "varname", "st")) or "st", matrix

    def _transform(self, node: UsdShade.Shader) -> Matrix:
        angle = np.radians(float(self.constant(node, "rotation", 0.0)))
        across, along = plain(self.constant(node, "scale", (1.0, 1.0)))
        move = plain(self.constant(node, "translation", (0.0, 0.0)))
        matrix = np.eye(4)
        cos, sin = np.cos(angle), np.sin(angle)
        matrix[:2, :2] = [[cos * across, -sin * along], [sin * across, cos * along]]
        matrix[:2, 3] = move
        return matrix

    def bitmap(self, texture: Texture, **changes: Any) -> dict[str, Any]:
        """Makes a texture of the scene. `changes`: changes of its Look."""
        name, raw = self._images.name(texture.asset, dataclasses.replace(texture.look, **changes))
        found: dict[str, Any] = {"type": "bitmap", "filename": name, "raw": raw, "wrap_mode": texture.wrap}
        if not np.allclose(texture.to_st, np.eye(4)):
            found["to_uv"] = UPSIDE_DOWN @ texture.to_st @ UPSIDE_DOWN
        return found
