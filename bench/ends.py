#!/usr/bin/env python3
"""What the settings that end paths do to an image: writes their table into docs/reference/constants.md.

usage: ends.py [--spp N] [--seeds K] [--size WxH] [--print]
Three scenes in which light is scattered often: a white room lit by a small lamp, a cloud of albedo .999 and optical depth 20 under
a sun and a sky, and the grey fog of the tests. Each is rendered with `max_depth` from 4 to 256 and without a limit, by the same
seed: the same paths, of which longer ones are cut, so that what is missing of the image's mean is what they had brought. And with
`rr_depth` 1, 5 (the default) and 20 and without roulette, K seeds each: the ratio of means with its standard error from the seeds,
which is to be 1, and what roulette does to the error (the renderer's relMSE, mean over the seeds) and to the CPU time. --print
writes no file. A bench, not a test.
"""
import argparse
import json
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "tests" / "system")]
import exr_layers  # noqa: E402
from cli_kit import FOG, write_fog  # noqa: E402

DEPTHS = [4, 8, 16, 32, 64, 256]
NEVER = 1 << 20
ROULETTES = [1, 5, 20, NEVER]
BEGIN, END = "<!-- what ends paths, by bench/ends.py -->\n", "<!-- end of what ends paths -->"
HEAD = ('<scene version="3.0.0"><integrator type="volpath"><integer name="max_depth" value="$depth"/><integer name="rr_depth" value="$rr"/></integrator>'
        '<sensor type="perspective"><float name="fov" value="45"/><transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>'
        '<film type="hdrfilm"><rfilter type="box"/></film></sensor>')
ROOM = (HEAD + '<shape type="cube"><transform name="to_world"><scale value="5"/></transform><bsdf type="twosided"><bsdf type="diffuse">'
        '<rgb name="reflectance" value="0.9"/></bsdf></bsdf></shape><emitter type="point"><point name="position" x="1" y="3" z="1"/>'
        '<rgb name="intensity" value="30"/></emitter></scene>')
CLOUD = (HEAD + '<shape type="sphere"><bsdf type="null"/><medium name="interior" type="homogeneous"><float name="sigma_t" value="10"/>'
         '<float name="albedo" value="0.999"/></medium></shape><emitter type="directional"><vector name="direction" x="1" y="-2" z="-1"/>'
         '<rgb name="irradiance" value="3"/></emitter><emitter type="constant"><rgb name="radiance" value="0.2"/></emitter></scene>')
SCENES = {"white room, albedo .9": ROOM, "cloud, albedo .999": CLOUD,
          "grey fog": FOG.replace('<integrator type="volpath"/>', HEAD[HEAD.index("<integrator"):HEAD.index("<sensor")])}


def render(scene, depth, rr, seed, args, folder):
    out, report = folder / "out.exr", folder / "report.json"
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--float", "--spp", str(args.spp), "--size", args.size, "--seed", str(seed),
                    "--threads", "1", "-D", f"depth={depth}", "-D", f"rr={rr}", "--report", report, "--quiet"], check=True)
    rows = exr_layers.read(out)[0]
    told = json.loads(report.read_text())
    mean = statistics.fmean(x for name in "RGB" for row in rows[name] for x in row)
    return mean, told["relmse"], resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def depth_row(name, scene, args, folder):
    whole = render(scene, -1, NEVER, 0, args, folder)[0]
    missing = [render(scene, depth, NEVER, 0, args, folder)[0] / whole - 1 for depth in DEPTHS]
    return f"| {name} | " + " | ".join(f"{100 * m:+.3g} %" if m else "0" for m in missing) + " |"


def roulette_row(name, scene, args, folder):
    runs = {rr: [render(scene, -1, rr, seed, args, folder) for seed in range(1, args.seeds + 1)] for rr in ROULETTES}
    mean = {rr: [statistics.fmean(r[k] for r in of) for k in range(3)] for rr, of in runs.items()}
    error = {rr: statistics.stdev([r[0] for r in of]) / args.seeds ** .5 / mean[rr][0] for rr, of in runs.items()}
    cells = []
    for rr in ROULETTES[:-1]:
        ratio, chance = mean[rr][0] / mean[NEVER][0] - 1, (error[rr] ** 2 + error[NEVER] ** 2) ** .5
        cells.append(f"{100 * ratio:+.2f} +- {100 * chance:.2f} %, {mean[rr][1] / mean[NEVER][1]:.2f}, {mean[rr][2] / mean[NEVER][2]:.2f}")
    return f"| {name} | " + " | ".join(cells) + " |"


def table(args, folder):
    write_fog(folder)
    depths, roulettes = [], []
    for i, (name, text) in enumerate(SCENES.items()):
        scene = folder / f"scene{i}.xml"
        scene.write_text(text.replace('<default name="density" value="2"/>', '<default name="density" value="4"/>'))
        depths.append(depth_row(name, scene, args, folder))
        roulettes.append(roulette_row(name, scene, args, folder))
        print(depths[-1], roulettes[-1], sep="\n", flush=True)
    return "\n".join([
        f"`bench/ends.py` ({args.size} pixels, {args.spp} samples). `max_depth` is a scene's own limit; without one, which is the default, nothing is cut "
        "off. What is missing of the image's mean (the same paths, roulette off):", "",
        "| scene | " + " | ".join(f"`max_depth` {d}" for d in DEPTHS) + " |", "|---|" + "---|" * len(DEPTHS), *depths, "",
        f"`rr_depth` is where roulette begins; {args.seeds} seeds. The image's mean against that without roulette, with one standard error; then relMSE and "
        "CPU time, both over those without (where the room's paths end by `forced_survival` alone, beyond 1024 scatterings):", "",
        "| scene | " + " | ".join(f"`rr_depth` {rr}" + (" (default)" if rr == 5 else "") for rr in ROULETTES[:-1]) + " |", "|---|" + "---|" * (len(ROULETTES) - 1),
        *roulettes, ""])


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--spp", type=int, default=96)
    options.add_argument("--seeds", type=int, default=4)
    options.add_argument("--size", default="16x12")
    options.add_argument("--print", action="store_true")
    args = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="lightshaft-ends-") as folder:
        text = table(args, pathlib.Path(folder))
    file = ROOT / "docs" / "reference" / "constants.md"
    if args.print:
        print(text)
    else:
        page = file.read_text()
        file.write_text(page[:page.index(BEGIN) + len(BEGIN)] + text + page[page.index(END):])


if __name__ == "__main__":
    main()
