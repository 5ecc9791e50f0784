"""Converts a stage to a scene: the XML of its frame, or of each of its frames, and the files that they name."""

from __future__ import annotations

import dataclasses
import os
import pathlib
import re
from collections.abc import Iterable, Mapping

from pxr import Gf, Tf, Usd, UsdGeom, UsdSkel

from ..errors import FileRefused, StageRejected
from ..scene_dict import SceneText, scene_of_dict
from ..scene_files import PathLike, Source, frame_numbers
from . import camera as cameras
from .document import Document, colour
from .files import Files
from .geometry import Geometry
from .images import Images
from .lights import Lights
from .links import Links
from .materials import Materials
from .motion import Exposure, Motions
from .problems import Problems
from .volumes import Volumes
from .walk import Walk

FRAME_NAME = "frame.####.xml"


@dataclasses.dataclass(frozen=True)
class StageScene:
    main: SceneText
    included: Mapping[str, SceneText]
    """For a sequence: the scene of each frame, by name."""
    files: Mapping[str, Source]
    """The files that the scene and the scenes of all frames name."""
    warnings: tuple[str, ...]

    def text_of(self, file: str) -> SceneText:
        """Returns the scene in which the farm found a problem."""
        return self.included.get(file, self.main)

    def write(self, folder: PathLike) -> pathlib.Path:
        """Writes scene.xml and its files into a folder, and returns the path of scene.xml."""
        place = pathlib.Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        for name, source in self.files.items():
            with open(place / name, "wb") as file:
                for begin in range(0, source.size, 1 << 24):
                    file.write(source.read(begin, min(1 << 24, source.size - begin)))
        (place / "scene.xml").write_text(self.main.xml, encoding="utf-8")
        return place / "scene.xml"


def read(
    path: PathLike,
    *,
    camera: str | None = None,
    frames: str | None = None,
    size: tuple[int, int] | None = None,
    folder: PathLike | None = None,
    allow: Iterable[PathLike] = (),
) -> StageScene:
    """The scene of a .usd, .usda, .usdc or .usdz.

    `camera`: the path of the camera's prim, which is needed if the stage has several. `frames` ("1-10"): a
    sequence, one image for each of these time codes; without it, the stage is read at its start. `size`:
    size of the image in pixels. Nothing is read that lies outside of `folder` (default: that of the stage) and
    the folders `allow`. StageRejected has everything that is wrong, by the paths of prims.
    """
    place = pathlib.Path(path)
    problems = Problems()
    files = Files(place.parent if folder is None else folder, allow, problems)
    stage = _open(place)
    if _ends_within_a_line(place):
        problems.warn(
            stage.GetPseudoRoot(),
            f"{place.name} ends within a line: it may have been cut short; if it is whole, put a line end at its end",
        )
    files.check_layers(stage)
    _check_composition(stage, problems)
    times = _times(stage, frames)
    _bake_skinning(stage, times)
    reader = _Reader(stage, files, Images(files), problems, camera, size)
    texts = []
    for time in times:
        texts.append(reader.at(time))
        problems.raise_errors()
    if frames is None:
        return StageScene(texts[0], {}, files.sources, tuple(problems.warnings))
    included: dict[str, SceneText] = {}
    for time, text in zip(times, texts):
        name = FRAME_NAME.replace("####", str(int(time.GetValue())).zfill(4))
        included[name] = text
        files.sources[name] = Source.of_bytes(text.xml.encode())
    xml = f'<scene version="3.0.0"><include filename="{FRAME_NAME}"/></scene>\n'
    return StageScene(SceneText(xml, ("",)), included, files.sources, tuple(problems.warnings))


def _times(stage: Usd.Stage, frames: str | None) -> list[Usd.TimeCode]:
    if frames is None:
        known = stage.HasAuthoredTimeCodeRange()
        return [Usd.TimeCode(stage.GetStartTimeCode()) if known else Usd.TimeCode.EarliestTime()]
    numbers = [number for number in frame_numbers(frames) if number is not None]
    if not numbers:
        raise StageRejected(f"frames {frames!r} must be a time code or a range such as 1-10")
    return [Usd.TimeCode(number) for number in numbers]


def _bake_skinning(stage: Usd.Stage, times: list[Usd.TimeCode]) -> None:
    """Writes the points of skinned meshes into the session layer, which is never saved."""
    roots = [prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Root)]
    if times[0].IsEarliestTime():
        interval = Gf.Interval.GetFullInterval()
    else:
        interval = Gf.Interval(times[0].GetValue(), times[-1].GetValue())
    stage.SetEditTarget(stage.GetSessionLayer())
    for root in roots:
        UsdSkel.BakeSkinning(UsdSkel.Root(root), interval)


def _open(path: pathlib.Path) -> Usd.Stage:
    if not path.is_file():
        raise FileRefused(f"there is no file {path}")
    try:
        with Tf.DiagnosticTrap() as told:  # USD prints a line for each; _check_composition tells them
            stage = Usd.Stage.Open(os.path.abspath(path), Usd.Stage.LoadAll)
            told.ClearWarnings()
    except Tf.ErrorException as error:
        reasons = dict.fromkeys(" ".join(_words_of(part).split()) for part in error.args)
        raise StageRejected(f"{path} is no stage: {'; '.join(reasons)}") from None
    if not stage:
        raise StageRejected(f"{path} is no stage")
    return stage


def _ends_within_a_line(path: pathlib.Path) -> bool:
    """Returns whether a stage in text has no line end at its end. The text has no other mark of its end."""
    with path.open("rb") as file:
        is_text = file.read(5) == b"#usda"
        file.seek(-1, os.SEEK_END)
        return is_text and file.read(1) not in b"\r\n"


def _words_of(error: Tf.Error) -> str:
    """Returns what USD says of an error. It quotes the file, whose bytes may be no text."""
    try:
        return str(error.commentary)
    except UnicodeDecodeError as broken:
        return bytes(broken.object).decode("utf-8", "replace")


def _check_composition(stage: Usd.Stage, problems: Problems) -> None:
    """Reports referenced layers that are missing or unreadable."""
    for error in stage.GetCompositionErrors():
        prim, told = error.rootSite.path, " ".join(str(error).split())
        material = re.search(r"@([^@]+\.mtlx)@", told)
        if material and os.path.isfile(material[1]):
            problems.warn(prim, f"MaterialX is not supported: {os.path.basename(material[1])} is ignored")
        else:
            problems.error(prim, told)
    problems.raise_errors()


class _Reader:
    def __init__(
        self,
        stage: Usd.Stage,
        files: Files,
        images: Images,
        problems: Problems,
        camera: str | None,
        size: tuple[int, int] | None,
    ) -> None:
        self._stage, self._files, self._images, self._problems = stage, files, images, problems
        self._camera, self._size = cameras.chosen(stage, camera), size

    def at(self, time: Usd.TimeCode) -> SceneText:
        document = Document(self._files)
        document.scene["integrator"] = {"type": "volpath"}
        problems = self._problems
        up_axis = str(UsdGeom.GetStageUpAxis(self._stage))
        materials = Materials(document, self._images, problems, time)
        exposure = None
        if self._camera is not None:
            with problems.reading(self._camera):
                exposure = Exposure.of(self._camera, time)
        motions = Motions(problems, exposure)
        geometry = Geometry(document, materials, problems, time, motions)
        links = Links(self._stage, problems)
        lights = Lights(document, self._images, problems, time, up_axis, links, motions)
        volumes = Volumes(document, problems, time, links, motions)
        Walk(document, problems, time, geometry, lights, volumes, links, motions).run(self._stage)
        lights.finish()
        links.finish(document.scene)
        shines = any("emitter" in value or "temperature" in value for value in document.scene.values())
        if not lights.count and not shines:
            problems.warn("the stage", "it has no light: a white sky is added")
            document.define("sky", {"type": "constant", "radiance": colour([1, 1, 1])})
        if self._camera is None:
            cameras.add_framing_camera(document, problems, self._stage, time, self._size)
        else:
            with problems.reading(self._camera):
                inside = volumes.around(cameras.eye(self._camera, time))
                cameras.add_camera(document, problems, self._camera, time, self._size, inside, motions)
        return scene_of_dict(document.scene)
