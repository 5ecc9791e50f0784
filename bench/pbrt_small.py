#!/usr/bin/env python3
"""Small scenes of pbrt, each of one or two things that the language can say, by ours and by pbrt-v4 itself.

usage: pbrt_small.py PBRT [--only TEXT ...] [--spp N] [--seeds K] [--size N] [--keep DIR] [--markdown]
PBRT is the program of pbrt-v4. The scenes are in pbrt_small_scenes.py; each is rendered K times by both, with --spp samples a pixel, at --size x --size pixels.
Printed for each: the ratio of our mean to pbrt's per channel with its standard error, from the spread of the renders of both; the share
of blocks of 8 x 8 pixels with |z| > 4 (agreement.py), which finds what a mean does not, such as a mirrored picture; and the verdict
(verdicts.py). A scene whose difference is known has a note that says what it is, and what we refuse says so. Ends with 1 if a scene
without a note differs, is refused, or has more than one block in ten out. Needs numpy, Pillow and the OpenEXR package of PyPI. A bench, not a test.
"""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

from agreement import BIN, compare, load
from pbrt_small_scenes import SCENES, text_of, write_images
from verdicts import verdict

MOST_BLOCKS = 0.1


def images(command, out, seeds):
    """What a program renders, or the first error that it tells."""
    found = []
    for seed in range(1, seeds + 1):
        done = subprocess.run([str(c) for c in command(out, seed)], capture_output=True, text=True, errors="replace")
        if done.returncode:
            plain = re.sub("\x1b\\[[0-9;]*m", "", done.stderr + done.stdout)
            told = [line for line in plain.splitlines() if "rror:" in line]
            return (told or [f"exit {done.returncode}"])[0].split("rror:")[-1].strip()
        found.append(load(out))
    return found


def row(scene, folder, options):
    """Cells of the table, and whether the scene is as it should be."""
    file = folder / "scene.pbrt"
    file.write_text(text_of(scene, options.size))
    if options.keep:
        (options.keep / f"{scene.name.replace(' ', '-').replace(',', '')}.pbrt").write_text(file.read_text())
    ours = images(lambda out, seed: [BIN / "lightshaft", "render", file, "-o", out, "--float", "--spp", options.spp, "--seed", seed,
                                     "--threads", 1, "--quiet"], folder / "ours.exr", options.seeds)
    theirs = images(lambda out, seed: [options.pbrt, "--quiet", "--nthreads", 1, "--spp", options.spp, "--seed", seed, "--outfile", out,
                                       file], folder / "theirs.exr", options.seeds)
    if isinstance(theirs, str):
        return [scene.name, "pbrt refuses it", theirs, scene.note], False
    if isinstance(ours, str):
        return [scene.name, "refused", ours, scene.note], bool(scene.note)
    if ours[0].shape != theirs[0].shape:
        return [scene.name, "other size", f"{ours[0].shape} and {theirs[0].shape}", scene.note], False
    ratio, error, out = compare(ours, theirs)
    said = verdict([(r - 1, e) for r, e in zip(ratio, error)])
    figures = ", ".join(f"{r:.4f} ± {e:.4f}" for r, e in zip(ratio, error))
    return [scene.name, said, f"{figures}; {100 * out:.0f} %", scene.note], bool(scene.note) or said != "differs" and out <= MOST_BLOCKS


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pbrt", type=pathlib.Path)
    parser.add_argument("--only", nargs="+", default=[""])
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--size", type=int, default=32)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--markdown", action="store_true")
    options = parser.parse_args()
    options.pbrt = options.pbrt.resolve()
    bad = 0
    if options.markdown:
        print("| scene | verdict | mean over pbrt's (red, green, blue), standard error; blocks out | known difference |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        write_images(folder)
        if options.keep:
            options.keep.mkdir(parents=True, exist_ok=True)
            write_images(options.keep)
        for scene in SCENES:
            if any(text in scene.name for text in options.only):
                cells, fine = row(scene, folder, options)
                bad += not fine
                print("| " + " | ".join(cells) + " |" if options.markdown else ("" if fine else "!! ") + "  ".join(cells), flush=True)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
