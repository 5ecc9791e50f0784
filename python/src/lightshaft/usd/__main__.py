"""python -m lightshaft.usd: writes a stage as a scene for `lightshaft render` and `lightshaft submit`."""

import argparse
import sys

from ..errors import LightshaftError
from . import read


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m lightshaft.usd",
        description="Writes a USD stage as scene.xml, with the meshes and images that it names.",
    )
    parser.add_argument("stage", help="a .usd, .usda, .usdc or .usdz")
    parser.add_argument("-o", "--output", required=True, metavar="FOLDER")
    parser.add_argument("--camera", metavar="PATH", help="the path of the camera's prim")
    parser.add_argument("--frames", metavar="A-B", help="time codes, as in 1-10 or 1-10x2")
    parser.add_argument(
        "--size", nargs=2, type=int, metavar=("WIDTH", "HEIGHT"), help="size of the image in pixels"
    )
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
            allow=options.allow,
        )
        scene.write(options.output)
    except LightshaftError as error:
        print(error, file=sys.stderr)
        return 2
    for warning in scene.warnings:
        print(warning, file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
