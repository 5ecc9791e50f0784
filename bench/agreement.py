#!/usr/bin/env python3
"""Every scene under a folder: does it load, and does it agree with the reference image that lies beside it?

usage: agreement.py [--scenes DIR] [--only TEXT] [--spp N] [--seeds K] [--size WxH | --across N] [--seconds S] [--load-only] [--markdown] [--mitsuba N [--variant NAME]]
       agreement.py --scenes DIR --page PAGE
With --page the tables of docs/measurements/agreement.md are made: the rows of TABLES, of collections of scenes below DIR. About an hour of CPU time.
Without DIR the bench scenes are made and compared with their references. References are found by name: refs/NAME.0.exr and
NAME.1.exr (independent of each other, so that their noise counts in the standard errors), else refs/NAME_ref_rgb.exr for a scene
NAME_INTEGRATOR.xml, else ref/NAME_*spp.exr, else a TungstenRender.exr in the scene's own folder. A scene without one is rendered all the same, and its picture must be finite.
Files that others include are not scenes.
K seeds (4) are rendered with N samples each. Printed: the ratio of means per channel with its standard error, from the spread of our
renders, for a single reference does not tell its samples; the share of blocks of 16 x 16 pixels (8 x 8 in images below 160 pixels) with
|z| > 4, z with a floor of 0.3 % of the block's mean; and a verdict (verdicts.py): 'agrees' if every channel's mean less and plus
2 standard errors lies within 0.5 % of the reference's, 'differs' if a channel's interval lies outside of that band, else 'too few
samples to say'. References are renders by others: what they leave out, a verdict can't know. With --size a reference of a whole
multiple of that size is averaged down to it. With --mitsuba N the reference is a fresh render by Mitsuba 3 instead: K seeds of N samples with
the scene's own integrator, at the same size, and its noise counts in the standard errors. The `moment` wrapper is left out; what
Mitsuba does not load as it is, it is given as `lightshaft convert` writes it. Needs the mitsuba package and an LLVM library, or the
variant scalar_rgb, which needs none.
Needs numpy and the OpenEXR package of PyPI. A bench, not a test.
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR

import bench_scenes
from verdicts import verdict

ROOT = pathlib.Path(__file__).resolve().parents[1]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
FLOOR = 3e-3
# The rows of the page: the beginning of a scene's path below DIR, its size (None: the reference's), our samples per pixel and seed,
# Mitsuba's (0: the reference beside the scene), and seeds.
TABLES = {
    "references": [
        ("01-mitsuba-media/", None, 128, 0, 4), ("02-mitsuba-bsdf-lights/", None, 128, 0, 4),
        ("04-cornell-box/", "256x256", 128, 0, 4), ("11-kombu-nori-agpl/pa3/veach_mi/veach_mis.xml", None, 32, 0, 4)],
    "mitsuba": [
        ("05-volumetric-caustic/scene_v3.xml", "64x36", 256, 512, 4), ("06-lajolla-volpath/scenes/volpath_test/vol", "64x64", 64, 256, 4),
        ("10-mitsuba-tutorials/", "64x64", 64, 256, 4), ("11-kombu-nori-agpl/project/volumetric/cbox/cbox_inmedium.xml", "64x48", 64, 256, 4),
        ("11-kombu-nori-agpl/project/volumetric/cbox/cbox_vol_path_mats.xml", "64x48", 64, 256, 4), ("03-living-room/", "160x90", 32, 128, 4),
        ("chromatic_grids/", "64x48", 512, 512, 4)]}


def load(path):
    channels = OpenEXR.File(str(path)).channels()
    for key in ("RGB", "RGBA"):
        if key in channels:
            return np.asarray(channels[key].pixels, dtype=np.float64)[..., :3]
    return np.stack([np.asarray(channels[c].pixels, dtype=np.float64) for c in "RGB"], -1)


def references_of(scene):
    """The images beside it: none, one, or two independent ones."""
    pair = bench_scenes.references(scene.parent, scene.stem)
    if all(image.exists() for image in pair):
        return pair
    stem = re.sub(r"_[a-z]+$", "", scene.stem)
    named = [scene.parent / "refs" / f"{stem}_ref_rgb.exr", *sorted((scene.parent / "ref").glob(f"{scene.stem}_*spp.exr")),
             scene.parent / "TungstenRender.exr"]
    return [image for image in named if image.exists()][:1]


def scenes_below(root):
    files = sorted(root.rglob("*.xml"))
    included = {pathlib.PurePath(name).name for file in files
                for name in re.findall(r'<include[^>]*filename="([^"]+)"', file.read_text(errors="replace"))}
    return [file for file in files if file.name not in included and file.parent.name != "include"]


def inspect(scene):
    """None if it loads, else the first error."""
    run = subprocess.run([BIN / "lightshaft", "inspect", scene], capture_output=True, text=True)
    if run.returncode == 0:
        return None
    errors = [line for line in run.stderr.splitlines() if "error:" in line]
    return (errors or run.stderr.splitlines() or [f"exit {run.returncode}"])[0].split("error:")[-1].strip()


def size_of(scene, options):
    """The flags for the size that is asked for."""
    if options.across:
        told = subprocess.run([BIN / "lightshaft", "inspect", scene, "--json"], capture_output=True, text=True, check=True).stdout
        own = json.loads(told)["size"]
        return ["--size", "x".join(str(max(1, round(n * options.across / max(own)))) for n in own)]
    return ["--size", options.size] if options.size else []


def render(scene, options, folder):
    images = []
    size = size_of(scene, options)
    for seed in range(options.seeds):
        out = folder / f"{seed}.exr"
        limit = ["--time", str(options.seconds)] if options.seconds else []
        subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--float", "--spp", str(options.spp), "--seed", str(seed),
                        "--threads", "2", "--quiet", *limit, *size], check=True, stderr=subprocess.DEVNULL)
        images.append(load(out))
    return images


def render_by_mitsuba(scene, options, size, folder):
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", "/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1")
    import mitsuba
    mitsuba.set_variant(options.variant)
    text = re.sub(r'<integrator type="moment">\s*(<integrator.*?</integrator>)\s*</integrator>', r"\1", scene.read_text(), flags=re.S)
    try:
        loaded = mitsuba.load_file(str(scene)) if text == scene.read_text() else mitsuba.load_string(text)
    except RuntimeError:  # a dialect that it doesn't know, or settings that it refuses
        subprocess.run([BIN / "lightshaft", "convert", scene, folder / "converted.xml"], check=True, capture_output=True)
        loaded = mitsuba.load_file(str(folder / "converted.xml"))
    parameters = mitsuba.traverse(loaded)
    film = next(key for key in parameters.keys() if key.endswith("film.size"))
    parameters[film] = size
    parameters[film.replace("film.size", "film.crop_size")] = size
    parameters.update()
    step = min(options.mitsuba, 256)
    images = []
    for seed in range(options.seeds):
        parts = [np.asarray(mitsuba.render(loaded, spp=step, seed=1000 * seed + k).numpy(), dtype=np.float64)[..., :3]
                 for k in range(options.mitsuba // step)]
        images.append(np.mean(parts, 0))
    return images


def blocks(a, n):
    h, w = a.shape[0] // n * n, a.shape[1] // n * n
    return a[:h, :w].reshape(h // n, n, w // n, n, 3).mean((1, 3))


def mean_and_variance(images):
    return np.mean(images, 0), np.var(images, 0, ddof=1) / len(images)


def compare(images, references):
    """Ratio of means and its standard error, per channel, and the share of blocks with |z| > 4."""
    a, variance = mean_and_variance(images)
    reference, more = mean_and_variance(references) if len(references) > 1 else (references[0], 0)
    variance = variance + more
    pixels = a.shape[0] * a.shape[1]
    of, by = a.mean((0, 1)), reference.mean((0, 1))
    of, by = np.where(of == by, 1, of), np.where(of == by, 1, by)  # a channel that is black in both
    ratio, error = of / by, np.sqrt(variance.sum((0, 1))) / pixels / by
    n = 8 if min(a.shape[:2]) < 160 else 16
    z = (blocks(a, n) - blocks(reference, n)) / np.sqrt(blocks(variance, n) / n ** 2 + (FLOOR * blocks(reference, n) + 1e-6) ** 2)
    return ratio, error, float((np.abs(z) > 4).mean())


def fit(reference, shape):
    """Averaged down to this shape, if it is a whole multiple of it."""
    ky, kx = reference.shape[0] // shape[0], reference.shape[1] // shape[1]
    if (ky * shape[0], kx * shape[1]) != reference.shape[:2]:
        return reference
    return reference.reshape(shape[0], ky, shape[1], kx, 3).mean((1, 3))


def row(scene, root, options, folder):
    name = str(scene.relative_to(root))
    refusal = inspect(scene)
    if refusal:
        return name, "refused", refusal
    if options.load_only:
        return name, "loads", ""
    found = references_of(scene)
    try:
        images = render(scene, options, folder)
    except subprocess.CalledProcessError as e:
        return name, "FAILED", f"exit {e.returncode}"
    if not all(np.isfinite(i).all() for i in images):
        return name, "NOT FINITE", ""
    if not found and not options.mitsuba:
        return name, "renders", f"mean {' '.join(f'{x:.4g}' for x in images[0].mean((0, 1)))}"
    if options.mitsuba:
        try:
            references = render_by_mitsuba(scene, options, images[0].shape[1::-1], folder)
        except (RuntimeError, StopIteration, subprocess.CalledProcessError) as e:
            return name, "not rendered by Mitsuba", " ".join(str(e).split())[:200]
    else:
        references = [fit(load(image), images[0].shape) for image in found]
    reference = references[0]
    if reference.shape != images[0].shape:
        return name, "OTHER SIZE", f"{images[0].shape[1]}x{images[0].shape[0]}, reference {reference.shape[1]}x{reference.shape[0]}"
    ratio, error, outliers = compare(images, references)
    channels = [(round(r - 1, 4), round(e, 4)) for r, e in zip(ratio, error)]  # as printed: who reads them comes to the same verdict
    figures = ", ".join(f"{100 * (r - 1):+.2f} ± {100 * e:.2f} %" for r, e in zip(ratio, error))
    return name, verdict(channels), f"{figures}; |z| > 4: {100 * outliers:.1f} %"


def page(options):
    """Makes the tables of the page, from the scenes below the folder and those of chromatic_grids.py, and writes them between its marks."""
    commit = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True, check=True).stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        subprocess.run([sys.executable, ROOT / "bench" / "chromatic_grids.py", folder / "chromatic_grids"], check=True, stdout=subprocess.DEVNULL)
        for table, rows in TABLES.items():
            lines = ["| scene | size; samples per pixel and seed, ours / Mitsuba's | verdict | ratio of means - 1 (red, green, blue), standard error |", "|---|---|---|---|"]
            for begin, options.size, options.spp, options.mitsuba, options.seeds in rows:
                root = folder if begin.startswith("chromatic_grids") else options.scenes
                for scene in scenes_below(root):
                    if not str(scene.relative_to(root)).startswith(begin):
                        continue
                    name, said, figures = row(scene, root, options, folder)
                    samples = f"{options.size or 'of the reference'}; {options.spp}" + (f" / {options.mitsuba}" if options.mitsuba else "")
                    lines.append(f"| {name} | {samples} | {said} | {figures.replace('|z|', chr(92) + '|z' + chr(92) + '|')} |")
                    print(lines[-1], flush=True)
            text = options.page.read_text()
            head, rest = text.split(f"<!-- {table} -->\n", 1)
            options.page.write_text(f"{head}<!-- {table} -->\nCommit {commit}.\n\n" + "\n".join(lines) + f"\n<!-- end of {table} -->" + rest.split(f"<!-- end of {table} -->", 1)[1])


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--scenes", type=pathlib.Path)
    args.add_argument("--only", default="")
    args.add_argument("--spp", type=int, default=128)
    args.add_argument("--seeds", type=int, default=4)
    args.add_argument("--size")
    args.add_argument("--across", type=int)
    args.add_argument("--mitsuba", type=int, default=0)
    args.add_argument("--variant", default="llvm_ad_rgb")
    args.add_argument("--seconds", type=float, default=0)
    args.add_argument("--load-only", action="store_true")
    args.add_argument("--markdown", action="store_true")
    args.add_argument("--page", type=pathlib.Path)
    options = args.parse_args()
    if options.page:
        if not options.scenes:
            args.error("--page needs --scenes DIR")
        return page(options)
    scenes = bench_scenes.scenes(options.scenes)
    if options.markdown:
        print("| scene | verdict | ratio of means - 1 (red, green, blue), standard error |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for scene in scenes_below(scenes):
            if options.only not in str(scene):
                continue
            cells = row(scene, scenes, options, pathlib.Path(folder))
            print("| " + " | ".join(cells) + " |" if options.markdown else "  ".join(cells), flush=True)


if __name__ == "__main__":
    main()
