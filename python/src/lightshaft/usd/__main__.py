"""python -m lightshaft.usd: writes a stage as a scene for `lightshaft render` and `lightshaft submit`."""

import argparse
import errno
import io
import json
import os
import sys
import tarfile

from ..errors import LightshaftError
from ..scene_files import Source
from . import StageScene, read
from .files import OutsideFolder, not_found

NO_ROOM = 3  # exit code: there is no room for the file of --to-descriptor
_PIECE = 1 << 24  # bytes read from a file at once


class _Pieces(io.RawIOBase):
    """The bytes of a source as a file."""

    def __init__(self, source: Source) -> None:
        self._source, self._place = source, 0

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1, /) -> bytes:
        left = self._source.size - self._place
        piece = self._source.read(self._place, min(left, _PIECE if size < 0 else size)) if left else b""
        self._place += len(piece)
        return piece


def write_bundle(scene: StageScene, descriptor: int) -> None:
    """Writes the scene with its files and warnings as a tar, as the coordinator takes it."""
    texts = {
        "job.json": json.dumps({"scene": "scene.xml"}),
        "scene.xml": scene.main.xml,
        "warnings.txt": "\n".join(scene.warnings),
    }
    files = {**scene.files, **{name: Source.of_bytes(text.encode()) for name, text in texts.items()}}
    with os.fdopen(descriptor, "wb") as file, tarfile.open(fileobj=file, mode="w|") as bundle:
        for name, source in files.items():
            entry = tarfile.TarInfo(name)
            entry.size = source.size
            bundle.addfile(entry, _Pieces(source))


def reason_of(error: LightshaftError) -> str:
    """Says why an uploaded stage is refused. Its user chooses neither the folders that are read nor a camera, and
    need not know what this machine has."""
    if isinstance(error, OutsideFolder):
        return f"{error.owner}: error: {not_found(error.named)}"
    return str(error).replace("give camera=", "leave one camera in the stage, or submit it by the Python package with camera=")


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m lightshaft.usd",
        description="Writes a USD stage as scene.xml, with the meshes and images that it names.",
    )
    parser.add_argument("stage", help="a .usd, .usda, .usdc or .usdz")
    place = parser.add_mutually_exclusive_group(required=True)
    place.add_argument("-o", "--output", metavar="FOLDER")
    # For the coordinator, whose sandbox allows no other file to be written: a tar, or why there is no scene
    place.add_argument("--to-descriptor", type=int, metavar="FD", help=argparse.SUPPRESS)
    parser.add_argument("--camera", metavar="PATH", help="the path of the camera's prim")
    parser.add_argument("--frames", metavar="A-B", help="time codes, as in 1-10 or 1-10x2")
    parser.add_argument(
        "--size", nargs=2, type=int, metavar=("WIDTH", "HEIGHT"), help="size of the image in pixels"
    )
    parser.add_argument("--folder", help="read no files outside of this folder (default: the stage's)")
    parser.add_argument(
        "--allow", action="append", default=[], metavar="FOLDER", help="also read files from this folder"
    )
    options = parser.parse_args()
    try:
        scene = read(
            options.stage,
            camera=options.camera,
            frames=options.frames,
            size=tuple(options.size) if options.size else None,
            folder=options.folder,
            allow=options.allow,
        )
        if options.to_descriptor is not None:
            write_bundle(scene, options.to_descriptor)
            return 0
        scene.write(options.output)
    except LightshaftError as error:
        if options.to_descriptor is not None:
            os.write(options.to_descriptor, reason_of(error).encode())
        else:
            print(error, file=sys.stderr)
        return 2
    except OSError as error:
        if options.to_descriptor is not None and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
            return NO_ROOM
        raise
    for warning in scene.warnings:
        print(warning, file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
