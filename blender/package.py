#!/usr/bin/env python3
"""Packs the add-on into build/blender/lightshaft-VERSION.zip, which Blender installs, and prints the path. The
same sources give the same bytes: names are sorted and times are constant."""

import pathlib
import tomllib
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = HERE / "lightshaft"


def main():
    version = tomllib.loads((SOURCE / "blender_manifest.toml").read_text())["version"]
    target = HERE.parent / f"build/blender/lightshaft-{version}.zip"
    target.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(target, "w") as archive:
        for path in sorted([*SOURCE.glob("*.py"), SOURCE / "blender_manifest.toml", HERE.parent / "LICENSE"]):
            entry = zipfile.ZipInfo(path.name)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, path.read_bytes())
    print(target)


main()
