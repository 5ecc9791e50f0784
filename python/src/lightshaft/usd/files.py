"""The files of a stage's scene: those made from its meshes, and its images and grids.

Since a stage may come from anywhere, only files in the folder of the stage (after following links) and in the folders
that the caller allows are sent: this applies to images, to grids, and to layers from elsewhere.
"""

from __future__ import annotations

import hashlib
import os
import pathlib
import zipfile
from collections.abc import Iterable
from typing import Any

from pxr import Ar, Usd

from ..errors import FileRefused
from ..scene_files import PathLike, Source, written_otherwise
from .problems import Problems


def not_found(path: str) -> str:
    return f"the asset @{path}@ is not found. Put the file there, or mend the path"


class OutsideFolder(FileRefused):
    """A file lies outside of the folders that may be read."""

    def __init__(self, owner: str, named: str, real: pathlib.Path, root: pathlib.Path) -> None:
        super().__init__(
            f"{owner} names {named}, which is {real} and lies outside {root}; "
            f"to send it, allow its folder: allow=[{str(real.parent)!r}]"
        )
        self.owner, self.named = owner, named


class Asset:
    """A file of the stage, on disk or in a .usdz."""

    def __init__(self, path: pathlib.Path, member: str, prim: str) -> None:
        self.path, self.member, self.prim = path, member, prim

    @property
    def suffix(self) -> str:
        return pathlib.PurePosixPath(self.member or self.path.name).suffix.lower()

    @property
    def key(self) -> tuple[str, str]:
        return str(self.path), self.member

    def source(self) -> Source:
        return Source.of_bytes(self.read()) if self.member else Source.of_file(self.path)

    def read(self) -> bytes:
        try:
            if not self.member:
                source = Source.of_file(self.path)
                return source.read(0, source.size)
            with zipfile.ZipFile(self.path) as package:
                entry = package.getinfo(self.member)
                if entry.compress_type != zipfile.ZIP_STORED:
                    raise FileRefused(f"{self.prim}: {self.path} is no .usdz: {self.member} is compressed")
                return package.read(entry)
        except (OSError, KeyError, zipfile.BadZipFile) as error:
            raise FileRefused(f"{self.prim}: {self.path}[{self.member}] cannot be read: {error}") from None


class Files:
    def __init__(self, folder: PathLike, allowed: Iterable[PathLike], problems: Problems) -> None:
        self._roots = [pathlib.Path(os.path.realpath(root)) for root in (folder, *allowed)]
        self._problems = problems
        self._named: dict[tuple[str, str], str] = {}
        self.sources: dict[str, Source] = {}

    def check_layers(self, stage: Usd.Stage) -> None:
        for layer in stage.GetUsedLayers():
            if layer.anonymous or not layer.realPath:
                continue
            outer, _ = Ar.SplitPackageRelativePathOuter(layer.realPath)
            self._admit("the stage", layer.identifier, outer)

    def exists(self, value: Any) -> bool:
        resolved = str(value.resolvedPath) or self._meant(value.path)
        return bool(resolved) and os.path.isfile(Ar.SplitPackageRelativePathOuter(resolved)[0])

    def find(self, prim: Any, value: Any) -> Asset | None:
        """Returns the file of an asset path. Returns None and reports an error if it does not exist."""
        resolved = str(value.resolvedPath) or self._meant(value.path)
        outer, inner = Ar.SplitPackageRelativePathOuter(resolved)
        if not resolved or not os.path.isfile(outer):
            self._problems.error(
                prim, not_found(value.path)
            )
            return None
        real = self._admit(str(prim.GetPath()), value.path, outer)
        return Asset(real, inner, str(prim.GetPath()))

    def _meant(self, path: str) -> str:
        """Finds the file for a path that USD does not resolve because it was written on Windows or macOS."""
        found = written_otherwise(self._roots[0], path) if path else None
        return "" if found is None else str(found)

    def _admit(self, owner: str, named: str, place: str) -> pathlib.Path:
        real = pathlib.Path(os.path.realpath(place))
        if not any(real.is_relative_to(root) for root in self._roots):
            raise OutsideFolder(owner, named, real, self._roots[0])
        return real

    def take(self, asset: Asset) -> str:
        """Adds a file that is sent unchanged. Returns its name in the scene."""
        if asset.key not in self._named:
            self._named[asset.key] = self._keep(asset.source(), asset.suffix)
        return self._named[asset.key]

    def write(self, content: bytes, suffix: str) -> str:
        """Adds a file that is named by its content, so that equal files are sent once."""
        name = hashlib.sha256(content).hexdigest()[:32] + suffix
        if name not in self.sources:
            self.sources[name] = Source.of_bytes(content)
        return name

    def _keep(self, source: Source, suffix: str) -> str:
        name = source.digest[:32] + suffix
        self.sources.setdefault(name, source)
        return name
