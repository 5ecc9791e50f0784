#!/usr/bin/env python3
"""Pictures of the bench scenes after equal times, side by side: Lightshaft, Blender Cycles and Mitsuba 3.

usage: equal_time.py [--scenes DIR] [--names a,b,c] [--times 5,15,60] [--clock wall|cpu] [--threads N] [--seed N] [--size WxH] [--out DIR]
       [--page PAGE.md] [--program ADAPTER.json]...
DIR holds NAME.xml and refs/NAME.0.exr, refs/NAME.1.exr (two independent references); without, the bench scenes are made and rendered.
Each program renders each scene for each of the times, by the adapter with which it races in race.py (bench/adapters;
docs/reference/compare.md): seconds count from the first ray, --clock cpu counts CPU seconds over threads, for a machine that others
use. In DIR (build/equal_time) it writes sheet.png (a row for each scene and time, a column for each program, and the reference), the
single pictures, and index.html, with the samples and the relMSE of each picture: (x - ref0)(x - ref1) / (ref^2 + 0.01), the mean over
pixels. --page also writes a page of Markdown with the sheet of each scene as images/equal-time-NAME.jpg in the folder above the page's.
All pictures of a scene have the same exposure. With another --size than the references' there is no relMSE, nor a column for
the reference. Runs in the order of scenes and times, each entrant alone; a program that fails has an empty cell, and the exit code is 1.
Needs numpy, Pillow and the OpenEXR package of PyPI, and what the adapters need (docs/guide/compare.md): run it by the Python that has
the packages mitsuba and bpy.
"""
import argparse
import html
import os
import pathlib
import sys
import tempfile

import numpy as np
from PIL import Image, ImageDraw

import bench_scenes
from denoised import publish
from efficiency import BIN, NAMES, ROOT, load, relmse
from racing import adapter
from racing.adapter import RaceError
from racing.racers import Conditions, Program

ADAPTERS = [ROOT / "bench" / "adapters" / f"{name}.json" for name in ("lightshaft", "cycles", "mitsuba3_volpath")]
GAP, LABEL = 6, 16  # pixels of the sheet: between pictures, and for the line above each
BRIGHT = 0.99  # the share of the reference's values that are not clipped


class Last(Program):
    """A program whose longest picture is kept."""

    def _take(self, image, spp, cost):
        self.points = [(load(image), spp, cost)]
        image.unlink()

    def picture(self):
        """Pixels, samples, and seconds of the race's clock."""
        while self.expected is not None:
            super().run()
        image, spp, cost = self.points[-1]
        return image, spp, cost.seconds(self.conditions.clock, self.conditions.threads)


def shown(image, scale):
    """8-bit sRGB of linear values."""
    x = np.clip(image * scale, 0, 1)
    return Image.fromarray((np.where(x <= .0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - .055) * 255 + .5).astype(np.uint8))


def sheet(rows, columns):
    """rows: (title, [(picture or None, text)]). A grid of pictures with a line of text above each."""
    width = max(p.width for _, cells in rows for p, _ in cells if p)
    heights = [max(p.height for p, _ in cells if p) for _, cells in rows]
    out = Image.new("RGB", (GAP + len(columns) * (width + GAP), 2 * LABEL + sum(h + 2 * LABEL + GAP for h in heights)), "white")
    draw, y = ImageDraw.Draw(out), LABEL
    for i, name in enumerate(columns):
        draw.text((GAP + i * (width + GAP), 2), name, fill="black")
    for (title, cells), height in zip(rows, heights):
        draw.text((GAP, y + 2), title, fill="black")
        for i, (picture, text) in enumerate(cells):
            x = GAP + i * (width + GAP)
            draw.text((x, y + LABEL + 2), text, fill="black")
            if picture:
                out.paste(picture, (x, y + 2 * LABEL))
        y += height + 2 * LABEL + GAP
    return out


def page(rows, columns, about):
    head = "".join(f"<th>{html.escape(c)}</th>" for c in columns)
    body = ""
    for title, cells, files in rows:
        body += f"<tr><th>{html.escape(title)}</th>" + "".join(
            f'<td>{f"<img src={chr(34)}{html.escape(file)}{chr(34)} alt={chr(34)}{chr(34)}>" if file else ""}<br>{html.escape(text)}</td>'
            for (_, text), file in zip(cells, files)) + "</tr>\n"
    return ('<!doctype html><html lang="en"><meta charset="utf-8"><title>Pictures after equal times</title><style>body{font-family:sans-serif}'
            f"td{{padding:4px;vertical-align:top}}</style><h1>Pictures after equal times</h1><p>{html.escape(about)}</p><table><tr><th></th>{head}"
            f"</tr>\n{body}</table></html>\n")


def write_page(page, scenes, columns, about):
    """scenes: {name: [(title, cells, files)]}. Cells beyond the columns hold the reference."""
    images = page.parent.parent / "images"
    images.mkdir(parents=True, exist_ok=True)
    lines = ["| scene | " + " | ".join(columns) + " |", "|---" * (1 + len(columns)) + "|"]
    for title, cells, _ in sum(scenes.values(), []):
        lines.append(f"| {title} | " + " | ".join(text for _, text in cells[:len(columns)]) + " |")
    for name, rows in scenes.items():
        file = images / f"equal-time-{name}.jpg"
        sheet([(title, cells) for title, cells, _ in rows], [*columns, "reference"]).save(file, quality=80)
        lines += ["", f"![{name} after equal times](../images/{file.name})"]
    publish("Pictures after equal times", f"{{made}}. {about}", lines, page)


def entrants(options, scene, seconds, size, folder):
    """For each program: (image, text); image is None if it failed or cannot render this scene."""
    for number, one in enumerate(options.adapters):
        if one.scenes and scene.stem not in one.scenes:
            yield None, "cannot render this scene"
            continue
        own = folder / f"{scene.stem}-{seconds:g}-{number}"
        own.mkdir()
        conditions = Conditions(scene.absolute(), seconds, options.clock, options.threads, size, None, [])
        try:
            image, spp, took = Last(one, options.seed, conditions, own, None).picture()
        except RaceError as error:
            print(f"equal_time.py: {scene.stem}: {one.name}: {error}", file=sys.stderr)
            options.failed = True
            yield None, "failed"
            continue
        yield image, f"{spp:.4g} spp in {took:.3g} s"


def rows_of(options, scene, folder):
    """(title, cells, files) for each time."""
    references = [load(r) for r in bench_scenes.references(scene.parent, scene.stem) if r.exists()]
    size = options.size or (references[0].shape[1::-1] if references else (320, 240))
    known = len(references) == 2 and references[0].shape[1::-1] == tuple(size)
    right = sum(references) / 2 if known else None
    scale = None if right is None else 1 / max(1e-9, float(np.quantile(right, BRIGHT)))
    for seconds in options.times:
        cells, files = [], []
        for one, (image, text) in zip(options.adapters, entrants(options, scene, seconds, size, folder)):
            picture, file = None, ""
            if image is not None:
                scale = scale or 1 / max(1e-9, float(np.quantile(image, BRIGHT)))
                picture, file = shown(image, scale), f"{scene.stem}-{seconds:g}s-{one.name.replace(' ', '_')}.png"
                picture.save(options.out / file)
                text += f", relMSE {relmse(image, *references):.3g}" if known else ""
            cells.append((picture, text))
            files.append(file)
            print(f"{scene.stem}, {seconds:g} s, {one.name}: {text}", flush=True)
        if right is not None:
            file = f"{scene.stem}-reference.png"
            shown(right, scale).save(options.out / file)
            cells.append((shown(right, scale), ""))
            files.append(file)
        yield f"{scene.stem}, {seconds:g} s", cells, files


def read_options():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--scenes", type=pathlib.Path)
    args.add_argument("--names", default=NAMES)
    args.add_argument("--times", type=lambda text: [float(t) for t in text.split(",")], default=[5., 15., 60.])
    args.add_argument("--clock", choices=("wall", "cpu"), default="wall")
    args.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)))
    args.add_argument("--seed", type=int, default=0)
    args.add_argument("--size", type=lambda text: tuple(map(int, text.split("x"))))
    args.add_argument("--page", type=pathlib.Path)
    args.add_argument("--program", type=pathlib.Path, action="append", help="instead of Lightshaft, Cycles and Mitsuba 3")
    args.add_argument("--out", type=pathlib.Path, default=ROOT / "build" / "equal_time")
    options = args.parse_args()
    options.adapters, options.failed = [adapter.read(path) for path in options.program or ADAPTERS], False
    if not options.program:
        options.adapters[0] = options.adapters[0]._replace(name="Lightshaft")
    return options


def main():
    options = read_options()
    # The adapters name `lightshaft` and `python3`: those of this build, and this one.
    os.environ["PATH"] = os.pathsep.join([str(BIN), str(pathlib.Path(sys.executable).parent), os.environ["PATH"]])
    folder = bench_scenes.scenes(options.scenes)
    options.out.mkdir(parents=True, exist_ok=True)
    scenes, programs = {}, [one.name for one in options.adapters]
    with tempfile.TemporaryDirectory(prefix="lightshaft-equal-time-") as made:
        for name in options.names.split(","):
            scenes[name] = list(rows_of(options, folder / f"{name}.xml", pathlib.Path(made)))
    rows, columns = sum(scenes.values(), []), list(programs)
    if any(len(cells) > len(columns) for _, cells, _ in rows):
        columns.append("reference")
    if any(picture for _, cells, _ in rows for picture, _ in cells):
        sheet([(title, cells) for title, cells, _ in rows if any(p for p, _ in cells)], columns).save(options.out / "sheet.png")
    about = (f"Each program rendered each picture for the time at its left, on {options.threads} threads, counted by "
             f"{'the clock' if options.clock == 'wall' else 'CPU seconds over threads'} from its first ray.")
    (options.out / "index.html").write_text(page(rows, columns, about))
    if options.page:
        write_page(options.page, scenes, programs, about)
    print(f"written: {options.out / 'index.html'}")
    return 1 if options.failed else 0


if __name__ == "__main__":
    sys.exit(main())
