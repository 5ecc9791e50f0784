"""The scenes of a race: how tables name them, and the references that a folder has for them."""

import os
import pathlib
from collections.abc import Sequence


def names_of(scenes: Sequence[str | os.PathLike[str]]) -> list[str]:
    """A file's name, or its folder's if it is called scene.xml; a number behind one that is there twice."""
    names: list[str] = []
    for scene in (pathlib.Path(os.path.abspath(scene)) for scene in scenes):
        name = scene.parent.name if scene.stem == "scene" and scene.parent.name else scene.stem
        again = [name, *(f"{name}-{k}" for k in range(2, len(scenes) + 1))]
        names.append(next(n for n in again if n not in names))
    return names


def references_in(folder: pathlib.Path, name: str) -> list[pathlib.Path]:
    """NAME.0.exr and NAME.1.exr, or NAME.exr; nothing if there are none."""
    pair, single = [folder / f"{name}.{k}.exr" for k in (0, 1)], folder / f"{name}.exr"
    return pair if all(p.exists() for p in pair) else [single] if single.exists() else []
