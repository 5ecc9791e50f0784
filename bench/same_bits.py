#!/usr/bin/env python3
"""Whether each instantiation of the integrator that covers a scene gives the same bits: a section of the page of leave_out.py.

usage: same_bits.py SCENE.xml...        with build/release; ends with 1 if one does not
"""
import json
import pathlib
import subprocess
import sys

LIGHTSHAFT = pathlib.Path(__file__).resolve().parents[1] / "build" / "release" / "bin" / "lightshaft"


def same_bits(scenes):
    """A section: whether each instantiation that covers a scene gives the same bits, in a small image of it."""
    out = ["## The same bits", "", "Every instantiation that covers a scene, on the scene as a job's, in a small image (`lightshaft inspect SCENE --variants`):", "",
           "| scene | instantiation | others that cover it | same bits |", "|---|---|---|---|"]
    for scene in scenes:
        said = subprocess.run([LIGHTSHAFT, "inspect", scene, "--json", "--variants"], check=True, capture_output=True, text=True)
        told = json.loads(said.stdout)
        own, *others = [v["variant"] for v in told["variant_bits"]]
        name = scene.parent.name if scene.stem == "scene" else scene.stem
        out.append(f"| {name} | {own} | {', '.join(others) or 'none'} | {'yes' if told['variants_agree'] else 'NO'} |")
    return out + [""]


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    section = "\n".join(same_bits([pathlib.Path(scene) for scene in sys.argv[1:]]))
    print(section)
    sys.exit(1 if "| NO |" in section else 0)
