#!/usr/bin/env python3
"""Where noise comes from: the error of the light that was scattered up to 1, 2, 3, ... times, with all techniques and without.

usage: depths.py SCENE[@WxH]... [--seeds N] [--first SEED] [--spp N] [--reference-spp N] [--out PAGE.md]
Renders each scene with several limits of `max_depth` (segments of a path: 2 is direct light), as it is, and with all techniques switched off
that `lightshaft inspect` names. An entry is the variance of such an image over the seeds, times 1 / (value² + 0.01) with the value of the
whole image, in the mean over pixels and channels: the part of the whole image's relMSE that light up to this depth has, with its standard
error over the seeds. Needs numpy, and the OpenEXR package of PyPI.
"""
import argparse
import json
import pathlib
import tempfile

import numpy

from denoised import publish, render
from techniques import decided, lightshaft, without

DEPTHS = (2, 3, 4, 6, 8, None)  # None: the scene's own limit


def noise(images, weight):
    """The mean of weight times the variance of one image, with its standard error over the images."""
    of_each = []
    for i, image in enumerate(images):
        others = sum(images[:i] + images[i + 1:]) / (len(images) - 1)
        of_each.append(((image - others) ** 2 * weight).mean() * (len(images) - 1) / len(images))
    return numpy.mean(of_each), numpy.std(of_each, ddof=1) / len(of_each) ** 0.5


def rows(given, asked, folder):
    name, _, size = given.partition("@")
    scene = folder / "scene.xml"
    lightshaft("convert", name, scene)
    used = decided(scene)
    own = json.loads(lightshaft("inspect", scene, "--json"))["max_depth"]
    whole = render(scene, folder, size, asked.reference_spp, 10**6)[0][0]
    weight = 1 / (whole * whole + 0.01)
    plain = scene
    for technique in used:
        plain = without(plain, technique["off"])
    for title, file in (("all", scene), *([("none of " + ", ".join(t["name"] for t in used), plain)] if used else [])):
        cells = []
        for depth in DEPTHS:
            if depth and 0 <= own <= depth:
                cells.append("-")
                continue
            limited = without(file, {"parameter": "max_depth", "value": str(depth)}) if depth else file
            images = [render(limited, folder, size, asked.spp, seed)[0][0] for seed in range(asked.first, asked.first + asked.seeds)]
            cells.append("{:.2g} ± {:.1g}".format(*noise(images, weight)))
        yield f"| {pathlib.Path(name).stem} | {title} | " + " | ".join(cells) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--reference-spp", type=int, default=512)
    parser.add_argument("--out", type=pathlib.Path)
    asked = parser.parse_args()
    if asked.seeds < 2:
        parser.error("--seeds: an error needs two images")
    lines = ["| scene | techniques | " + " | ".join(f"`max_depth` {d}" if d else "whole image" for d in DEPTHS) + " |", "|---" * (2 + len(DEPTHS)) + "|"]
    for scene in asked.scenes:
        with tempfile.TemporaryDirectory() as folder:
            for line in rows(scene, asked, pathlib.Path(folder)):
                lines.append(line)
                print(line, flush=True)
    publish("Where noise comes from", "{made}. What an entry is: see the script.", lines, asked.out)


if __name__ == "__main__":
    main()
