#!/usr/bin/env python3
"""What each output costs beside a job without it: instructions, seconds of the cores, bytes. Writes a table in Markdown.

usage: outputs.py SCENE.xml [--size WxH] [--spp N] [--pairs 5] [--before BIN [--also SCENE.xml]...] [--out FILE.md] [OUTPUT...]
For each output, `lightshaft render` with it and without it take turns on the same cores, with the same seed, and the median of the
ratios of core seconds is told, the interval being that of all pairs. Instructions are counted by callgrind within render_tile, in
a small image with one thread, and do not depend on what else runs. Bytes are those of the results that a worker sends (as
--partial-dir keeps them) and of the image. `--before BIN`: the folder of another build's programs. A second table then compares
instructions and pixels without any output between that build and this one, for SCENE.xml and those of --also. An OUTPUT is the options
that ask for it, such as "--aov alpha"; without any, those of OUTPUTS are measured. Needs valgrind. A bench, not a test.
"""
import argparse
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "support")]
from local_farm import bin_dir  # noqa: E402

OUTPUTS = ["--aov depth,normal,position", "--aov albedo,direct,indirect", "--aov crypto_object", "--aov alpha", "--aov opacity,volume_opacity", "--aov light_groups",
           "--aov volume_light_groups", "--deep 8", "--deep 32"]
COUNTED_SIZE, COUNTED_SPP = "48x36", 4


def render(bin, scene, folder, options, *more):
    command = [bin / "lightshaft", "render", scene, "--quiet", "-o", folder / "out.exr", "--report", folder / "report.json", *more, *options.split()]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return json.loads((folder / "report.json").read_text())


def instructions(bin, scene, folder, options):
    """Per path."""
    command = ["valgrind", "--tool=callgrind", "--toggle-collect=ls::render::render_tile(*", f"--callgrind-out-file={folder}/callgrind.out",
               bin / "lightshaft", "render", scene, "--threads", "1", "--size", COUNTED_SIZE, "--spp", COUNTED_SPP, "-o", folder / "out.exr", *options.split()]
    run = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-2000:]
    width, height = map(int, COUNTED_SIZE.split("x"))
    return int(re.search(r"Collected : (\d+)", run.stderr)[1]) / (width * height * COUNTED_SPP)


def sizes(bin, scene, folder, options, *more):
    """Bytes of all results, and of the files of the image."""
    partials = folder / "partials"
    for file in [*partials.glob("*"), *folder.glob("out*.exr")]:
        file.unlink()
    render(bin, scene, folder, options, "--partial-dir", partials, *more)
    return sum(file.stat().st_size for file in partials.iterdir()), sum(file.stat().st_size for file in folder.glob("out*.exr"))


def percent(ratio):
    return f"{100 * (ratio - 1):+.1f} %"


def compared(before, now, scene, folder):
    """The row of a scene without outputs, in the build before and in this one."""
    old, new = [instructions(bin, scene, folder, "") for bin in (before, now)]
    pixels = {render(bin, scene, folder, "", "--size", COUNTED_SIZE, "--spp", COUNTED_SPP)["pixels_sha256"] for bin in (before, now)}
    return f"| {scene.stem} | {old:,.0f} | {new:,.0f} ({percent(new / old)}) | {'the same' if len(pixels) == 1 else 'others'} |"


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("scene", type=pathlib.Path)
    args.add_argument("outputs", nargs="*", metavar="OUTPUT")
    args.add_argument("--size", default="320x240")
    args.add_argument("--spp", type=int, default=16)
    args.add_argument("--pairs", type=int, default=5)
    args.add_argument("--before", type=pathlib.Path)
    args.add_argument("--also", type=pathlib.Path, action="append", default=[])
    args.add_argument("--out", type=pathlib.Path)
    options = args.parse_intermixed_args()
    bin, scene, more = bin_dir(), options.scene, ("--size", options.size, "--spp", options.spp, "--threads", 2)
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        bare = instructions(bin, scene, folder, "")
        sent, stored = sizes(bin, scene, folder, "", *more)
        rows = [f"| none | {bare:,.0f} | | {sent:,} | {stored:,} |"]
        for output in options.outputs or OUTPUTS:
            counted = instructions(bin, scene, folder, output)
            ratios = []
            for pair in range(options.pairs):
                runs = {}
                for given in ((output, "") if pair % 2 else ("", output)):
                    runs[given] = render(bin, scene, folder, given, "--seed", 1 + pair, *more)
                assert runs[output]["pixels_sha256"] == runs[""]["pixels_sha256"], f"{output} changes the pixels"
                ratios.append(runs[output]["core_seconds"] / runs[""]["core_seconds"])
            with_sent, with_stored = sizes(bin, scene, folder, output, *more)
            rows.append(f"| `{output}` | {counted:,.0f} ({percent(counted / bare)}) | {percent(statistics.median(ratios))} ({percent(min(ratios))} to {percent(max(ratios))}) | "
                        f"{with_sent:,} ({with_sent / sent:.1f} x) | {with_stored:,} ({with_stored / stored:.1f} x) |")
            print(rows[-1], file=sys.stderr)
        others = [compared(options.before, bin, each, folder) for each in [scene, *options.also]] if options.before else []
    text = "| output | instructions of a path | core seconds | bytes of all results | bytes of the image |\n|---|---|---|---|---|\n" + "\n".join(rows) + "\n"
    if others:
        text += "\n| scene, without outputs | instructions of a path before | now | pixels |\n|---|---|---|---|\n" + "\n".join(others) + "\n"
    options.out.write_text(text) if options.out else print(text, end="")


if __name__ == "__main__":
    main()
