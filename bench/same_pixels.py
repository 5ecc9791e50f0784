#!/usr/bin/env python3
"""Whether two builds render the same pixels, and how many instructions a path takes in each.

usage: same_pixels.py BEFORE AFTER SCENE.xml... [--random N] [--band PERCENT]

BEFORE and AFTER are folders with the executables of two builds, of one compiler. Each scene is rendered small (96 x 64, 4 samples a
pixel) by both; then every instantiation of the integrator that covers it is counted under callgrind (`lightshaft inspect
--variants`). --random N: N scenes of tests/property too, as that build's property_test prints them; pixels alone. Ends with 1 if
pixels differ, or instructions by more than the band (0.3 %).
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from leave_out import by_instantiation

SIZE, SPP = "96x64", 4


def pixels(folder, scene, out):
    run = subprocess.run([folder / "lightshaft", "render", scene, "--size", SIZE, "--spp", str(SPP), "-o", out], capture_output=True, text=True)
    found = re.search(r"pixels_sha256 (\w+)", run.stdout)
    return found[1] if found else f"no image: {run.stderr.strip().splitlines()[-1] if run.stderr.strip() else run.returncode}"


def random_scenes(folder, count, into):
    """Scenes that name no files, so that each is one XML, and of which no two have the same picture: many are black."""
    into.mkdir()
    scenes, seen, seed = [], set(), 9000
    while len(scenes) < count:
        env = {**os.environ, "LIGHTSHAFT_TELL_SCENE": "1", "LIGHTSHAFT_FIRST_SCENE": str(seed), "LIGHTSHAFT_SCENES": "1"}
        said = subprocess.run([folder / "property_test", "--gtest_filter=RandomScenes.AreRefused*"], env=env, capture_output=True, text=True)
        text = re.search(r"<scene.*?</scene>", said.stdout + said.stderr, re.S)
        if text and 'name="filename"' not in text[0]:
            scene = into / f"{seed}.xml"
            scene.write_text(text[0])
            picture = pixels(folder, scene, into / "out.exr")
            if not picture.startswith("no image") and picture not in seen:
                seen.add(picture)
                scenes.append(scene)
        seed += 1
    return scenes


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=pathlib.Path)
    parser.add_argument("after", type=pathlib.Path)
    parser.add_argument("scenes", nargs="*", type=pathlib.Path)
    parser.add_argument("--random", type=int, default=0)
    parser.add_argument("--band", type=float, default=.3)
    args = parser.parse_args()
    bad = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        print("| scene | pixels_sha256 | the same |\n|---|---|---|")
        for scene in [*args.scenes, *(random_scenes(args.after, args.random, folder / "random") if args.random else [])]:
            before, after = (pixels(build, scene, folder / "out.exr") for build in (args.before, args.after))
            same = before == after and not before.startswith("no image")
            bad += not same
            name = scene.parent.name if scene.stem == "scene" else scene.stem
            print(f"| {name} | {before[:40] if before == after else before[:60] + ' / ' + after[:60]} | {'yes' if same else 'NO'} |", flush=True)
        print("\n| scene | instantiation | instructions per path, before | after | difference |\n|---|---|---|---|---|")
        for scene in args.scenes:
            before, after = (dict(by_instantiation(build / "lightshaft", scene, folder)) for build in (args.before, args.after))
            for name, cost in before.items():
                off = 100 * (after[name] / cost - 1)
                bad += abs(off) > args.band
                print(f"| {scene.parent.name if scene.stem == 'scene' else scene.stem} | {name} | {cost:.0f} | {after[name]:.0f} | {off:+.2f} % |", flush=True)
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
