#!/usr/bin/env python3
"""Every scene under a folder: does it load, and does it agree with the reference image that lies beside it?

usage: agreement.py --scenes DIR [--only TEXT] [--spp N] [--seconds S] [--load-only] [--markdown]
References are found by name: refs/NAME_ref_rgb.exr for a scene NAME_INTEGRATOR.xml, else ref/NAME_*spp.exr, else a
TungstenRender.exr in the scene's own folder. A scene without one is rendered all the same, and its picture must be finite.
Files that others include are not scenes.
Two seeds are rendered with N samples each. Printed: the ratio of means per channel with its standard error, from both renders'
difference alone, for references don't tell their samples; the share of blocks of 16 x 16 pixels (8 x 8 in images below 160 pixels)
with |z| > 4, z with a floor of 0.3 % of the block's mean; and a verdict: 'agrees' if every channel's mean lies within
0.5 % + 2 standard errors. References are renders by others: what they leave out, a verdict can't know.
Needs numpy and the OpenEXR package of PyPI. A bench, not a test.
"""
import argparse
import os
import pathlib
import re
import subprocess
import tempfile

import numpy as np
import OpenEXR

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("LIGHTSHAFT_BIN", ROOT / "build" / "release" / "bin"))
BAND, FLOOR = 5e-3, 3e-3


def load(path):
    channels = OpenEXR.File(str(path)).channels()
    for key in ("RGB", "RGBA"):
        if key in channels:
            return np.asarray(channels[key].pixels, dtype=np.float64)[..., :3]
    return np.stack([np.asarray(channels[c].pixels, dtype=np.float64) for c in "RGB"], -1)


def reference_of(scene):
    stem = re.sub(r"_[a-z]+$", "", scene.stem)
    named = [scene.parent / "refs" / f"{stem}_ref_rgb.exr", *sorted((scene.parent / "ref").glob(f"{scene.stem}_*spp.exr")),
             scene.parent / "TungstenRender.exr"]
    return next((image for image in named if image.exists()), None)


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


def render(scene, spp, seconds, folder):
    images = []
    for seed in (0, 1):
        out = folder / f"{seed}.exr"
        limit = ["--time", str(seconds)] if seconds else []
        subprocess.run([BIN / "lightshaft", "render", scene, "-o", out, "--float", "--spp", str(spp), "--seed", str(seed), "--threads", "2",
                        "--quiet", *limit], check=True, stderr=subprocess.DEVNULL)
        images.append(load(out))
    return images


def blocks(a, n):
    h, w = a.shape[0] // n * n, a.shape[1] // n * n
    return a[:h, :w].reshape(h // n, n, w // n, n, 3).mean((1, 3))


def compare(images, reference):
    """Ratio of means and its standard error, per channel, and the share of blocks with |z| > 4."""
    a, difference = (images[0] + images[1]) / 2, (images[0] - images[1]) ** 2 / 4
    pixels = a.shape[0] * a.shape[1]
    ratio = a.mean((0, 1)) / reference.mean((0, 1))
    error = np.sqrt(difference.sum((0, 1))) / pixels / reference.mean((0, 1))
    n = 8 if min(a.shape[:2]) < 160 else 16
    variance = blocks(difference, n) / n ** 2
    z = (blocks(a, n) - blocks(reference, n)) / np.sqrt(variance + (FLOOR * blocks(reference, n) + 1e-6) ** 2)
    return ratio, error, float((np.abs(z) > 4).mean())


def row(scene, root, options, folder):
    name = str(scene.relative_to(root))
    refusal = inspect(scene)
    if refusal:
        return name, "refused", refusal
    if options.load_only:
        return name, "loads", ""
    image = reference_of(scene)
    try:
        images = render(scene, options.spp, options.seconds, folder)
    except subprocess.CalledProcessError as e:
        return name, "FAILED", f"exit {e.returncode}"
    if not all(np.isfinite(i).all() for i in images):
        return name, "NOT FINITE", ""
    if image is None:
        return name, "renders", f"mean {' '.join(f'{x:.4g}' for x in images[0].mean((0, 1)))}"
    reference = load(image)
    if reference.shape != images[0].shape:
        return name, "OTHER SIZE", f"{images[0].shape[1]}x{images[0].shape[0]}, reference {reference.shape[1]}x{reference.shape[0]}"
    ratio, error, outliers = compare(images, reference)
    agrees = (np.abs(ratio - 1) < BAND + 2 * error).all()
    figures = ", ".join(f"{100 * (r - 1):+.2f} ± {100 * e:.2f} %" for r, e in zip(ratio, error))
    return name, "agrees" if agrees else "DIFFERS", f"{figures}; |z| > 4: {100 * outliers:.1f} %"


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("--scenes", type=pathlib.Path, required=True)
    args.add_argument("--only", default="")
    args.add_argument("--spp", type=int, default=256)
    args.add_argument("--seconds", type=float, default=0)
    args.add_argument("--load-only", action="store_true")
    args.add_argument("--markdown", action="store_true")
    options = args.parse_args()
    if options.markdown:
        print("| scene | verdict | ratio of means - 1 (red, green, blue), standard error |\n|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for scene in scenes_below(options.scenes):
            if options.only not in str(scene):
                continue
            cells = row(scene, options.scenes, options, pathlib.Path(folder))
            print("| " + " | ".join(cells) + " |" if options.markdown else "  ".join(cells), flush=True)


if __name__ == "__main__":
    main()
