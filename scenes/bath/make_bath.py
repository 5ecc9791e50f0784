#!/usr/bin/env python3
"""Makes the bath: bath.xml with its meshes, textures and steam, in one folder.

usage: make_bath.py FOLDER [--setting sketch|small|full] [--grid vdb|vol]

The same setting gives the same bytes every time. Needs python3-numpy only.
"""
import argparse
import importlib.util
import pathlib
import sys
from collections import defaultdict

if importlib.util.find_spec("numpy") is None:
    sys.exit(f"error: making the bath needs NumPy, which {sys.executable} does not have: install python3-numpy (Debian, Ubuntu), or numpy with its pip")

import furniture
import hall
import plants
import scene
import steam
import textures
from mesh import Mesh

# detail: scale of the textures; voxel: edge in metres of the steam's grid; cells_high: of the grid that it is simulated on.
SETTINGS = {
    "sketch": {"detail": 0.125, "voxel": 0.2, "cells_high": 12, "width": 160, "height": 120, "spp": 16},
    "small": {"detail": 0.5, "voxel": 0.06, "cells_high": 32, "width": 480, "height": 360, "spp": 64},
    "full": {"detail": 1.0, "voxel": 0.03, "cells_high": 56, "width": 1280, "height": 960, "spp": 1024},
}


def main():
    args = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    args.add_argument("folder", type=pathlib.Path, help="made if it is not there")
    args.add_argument("--setting", choices=SETTINGS, default="small", help="sketch: for tests and quick looks; full: for the picture in the README")
    args.add_argument("--grid", choices=("vdb", "vol"), default="vdb", help="format of the steam: OpenVDB, or Mitsuba's own for races against it")
    options = args.parse_args()
    setting, folder = SETTINGS[options.setting], options.folder
    folder.mkdir(parents=True, exist_ok=True)

    groups = defaultdict(Mesh)
    for part in (hall, furniture, plants):
        part.build(groups)
    for name in scene.GROUPS:
        groups[name].write(folder / f"{name}.ply")
    textures.write_all(folder, setting["detail"])
    steam.write(folder / f"steam.{options.grid}", setting["voxel"], setting["cells_high"])
    (folder / "bath.xml").write_text(scene.scene(setting["width"], setting["height"], setting["spp"], options.grid))
    print(f"{folder / 'bath.xml'}: {sum(len(t) for g in groups.values() for t in g.triangles)} triangles")


if __name__ == "__main__":
    main()
