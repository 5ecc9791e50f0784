#!/usr/bin/env python3
"""Makes the six bench scenes, each a Mitsuba 3 XML file, with the two density grids that they need.

usage: make_bench.py FOLDER

Each grid is written twice: NAME.vol, which the scenes name, and NAME.vdb with the same floats for programs that read OpenVDB.
The same bytes every time. Needs python3-numpy only. The scenes are described in README.md beside this file.
"""
import argparse
import pathlib
import sys

import grids
import scenes

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "bath"))
import vdb  # noqa: E402: the bath's writers lie in a folder that has to be named first
import vol  # noqa: E402


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("folder", type=pathlib.Path, help="made if it is not there")
    folder = args.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in grids.ALL.items():
        grid = make()
        vol.write_vol(folder / f"{name}.vol", grid.values.transpose(2, 1, 0), *grid.box())
        centre = [edge + grid.voxel / 2 for edge in grid.corner]
        vdb.write_vdb(folder / f"{name}.vdb", grid.values.transpose(2, 1, 0), "density", centre, grid.voxel, half=False)
    for name, make in scenes.ALL.items():
        (folder / f"{name}.xml").write_text(make())


if __name__ == "__main__":
    main()
