"""The bench scenes of scenes/bench and their reference images, for the benches beside this file."""
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
KIT = ROOT / "scenes" / "bench"
REFERENCES = KIT / "references"
SCENES = ROOT / "build" / "bench"


def scenes(folder=None):
    """The folder given, or the bench scenes, made anew so that they are those of this checkout."""
    if folder is None:
        subprocess.run([sys.executable, KIT / "make_bench.py", SCENES], check=True)
    return folder or SCENES


def references(folder, name):
    """NAME.0.exr and NAME.1.exr for a scene of this folder: those in its refs/, of the bench scenes those in the repository."""
    where = REFERENCES if folder.resolve() == SCENES else folder / "refs"
    return [where / f"{name}.{k}.exr" for k in (0, 1)]
