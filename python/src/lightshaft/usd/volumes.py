"""Converts volumes of UsdVol, grids of OpenVDB files, to media."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdVol

from .document import Document, colour, reference
from .links import Links
from .motion import Motions, Placement
from .problems import Problems
from .shading import plain
from .transforms import Matrix, is_usable, scale, translation

MARGIN = 1.001  # the box of a medium is larger than its grid, whose border has density
# Settings of a volume for which USD has no schema. They are primvars: name, and default value.
SETTINGS = {
    "densityScale": 1.0,
    "albedo": [0.75, 0.75, 0.75],
    "anisotropy": 0.0,
    "temperatureScale": 1.0,
    "temperatureOffset": 0.0,
    "emissionScale": 1.0,
}


class Volumes:
    def __init__(
        self,
        document: Document,
        problems: Problems,
        time: Usd.TimeCode,
        links: Links,
        motions: Motions,
    ) -> None:
        self._motions = motions
        self._document, self._problems, self._time, self._links = document, problems, time, links
        self._boxes: list[tuple[str, Matrix]] = []
        self._settings = {name: plain(value) for name, value in SETTINGS.items()}

    def around(self, point: Matrix) -> str | None:
        """Returns the medium that contains a point."""
        for medium, box in self._boxes:
            local = np.linalg.inv(box) @ np.append(point, 1.0)
            if np.abs(local[:3]).max() < 1:
                return medium
        return None

    def add(self, prim: Usd.Prim, placement: Placement) -> None:
        self._motions.stands(prim, placement, "a volume")
        matrix = placement.still
        density = temperature = None
        for name, target in UsdVol.Volume(prim).GetFieldPaths().items():
            if name == "density":
                density = self._grid(prim, str(target), matrix)
            elif name == "temperature":
                temperature = self._grid(prim, str(target), matrix)
            else:
                self._problems.warn(prim, f"the field {name} is ignored: only density and temperature are supported")
        if density is None:
            self._problems.warn(prim, "a volume without a field `density` is left out")
            return
        box = self._box(prim, matrix)
        if box is None:
            return
        values = {name: self._setting(prim, name) for name in SETTINGS}
        medium: dict[str, Any] = {
            "type": "heterogeneous",
            "sigma_t": density,
            "scale": max(values["densityScale"], 0.0),
            "albedo": colour(values["albedo"]),
            "phase": {"type": "isotropic"},
            **self._links.of_object(prim),
        }
        if values["anisotropy"]:
            medium["phase"] = {"type": "hg", "g": values["anisotropy"]}
        if temperature is not None:
            medium["temperature"] = temperature
            medium["temperature_scale"] = max(values["temperatureScale"], 0.0)
            medium["temperature_offset"] = values["temperatureOffset"]
            medium["emission_scale"] = max(values["emissionScale"], 0.0)
        identifier = self._document.define(f"{prim.GetPath()} medium", medium)
        self._boxes.append((identifier, box))
        cube = {"type": "cube", "to_world": box, "bsdf": {"type": "null"}}
        self._document.define(str(prim.GetPath()), {**cube, "interior": reference(identifier)})

    def _setting(self, prim: Usd.Prim, name: str) -> Any:
        primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(f"lightshaft:{name}")
        value = primvar.Get(self._time) if primvar else None
        default = SETTINGS[name]
        if value is None:
            return default
        try:
            found = np.asarray(value, np.float64).ravel()
        except (TypeError, ValueError):
            found = np.empty(0)
        count = len(default) if isinstance(default, list) else 1
        if found.size != count or not np.isfinite(found).all():
            self._problems.error(prim, f"primvars:lightshaft:{name} takes {count} numbers")
            return default
        return [float(x) for x in found] if count > 1 else float(found[0])

    def _grid(self, prim: Usd.Prim, path: str, matrix: Matrix) -> dict[str, Any] | None:
        field = prim.GetStage().GetPrimAtPath(path)
        if not field or not field.IsA(UsdVol.OpenVDBAsset):
            self._problems.warn(prim, f"the field {path} is not an OpenVDBAsset: ignored")
            return None
        file = field.GetAttribute("filePath").Get(self._time)
        if file is None or not file.path:
            self._problems.error(field, "it names no file. Set filePath")
            return None
        asset = self._document.files.find(field, file)
        if asset is None:
            return None
        if asset.suffix != ".vdb":
            self._problems.error(field, f"@{file.path}@ is not a .vdb file")
            return None
        own = UsdGeom.Xformable(field) if field.IsA(UsdGeom.Xformable) else None
        if own is not None and not np.allclose(np.array(own.GetLocalTransformation(self._time)), np.eye(4)):
            self._problems.warn(field, "the transform of a field is ignored: move its volume instead")
        name = field.GetAttribute("fieldName").Get(self._time)
        grid = {"type": "gridvolume", "filename": self._document.files.take(asset), "to_world": matrix}
        return {**grid, "grid_name": str(name)} if name else grid

    def _box(self, prim: Usd.Prim, matrix: Matrix) -> Matrix | None:
        """Returns the position of the medium's cube [-1, 1]^3. USD gives the size of a volume as its extent."""
        extent = prim.GetAttribute("extent").Get(self._time)
        if extent is None or len(extent) != 2:
            self._problems.error(prim, "it has no extent. Set it to the box of its grids")
            return None
        low, high = np.array(extent[0], float), np.array(extent[1], float)
        half = (high - low) / 2 * MARGIN
        box = matrix @ translation(*((low + high) / 2)) @ scale(*half)
        if (half <= 0).any() or not is_usable(box):
            self._problems.error(prim, "its extent is empty")
            return None
        return box
