"""The table of targets of docs/measurements/error.md: how often the stated intervals hold for jobs that stop by their own estimate, and
for denoised layers (error_page.py calls it).

The right answer is the mean of the whole images that error_page.py keeps, which have other seeds; its noise is known from the scatter
of their halves, and its square is subtracted.
"""
import json
import subprocess

import numpy as np

import bench_scenes
import denoised

SIDE, TILE = 64, 32
# Scene, target of the image, target of its denoised layers, first seed.
CELLS = [("fogbox", 4e-3, 1.5e-3, 386001), ("sky_room", 1.5e-3, 1e-3, 391001), ("fire", 2.5e-3, 1e-3, 392001)]
JOBS = 30


def right_answer(folder):
    """The mean of the last stage of all kept images (rendered.h), and the variance of that mean: arrays of height x width x 3."""
    across = SIDE // TILE
    halves = []
    for path in sorted(folder.glob("*.f64")):
        tiles = np.fromfile(path).reshape(-1, 2, across, across, 3, TILE, TILE)[-1]
        halves += list(tiles.transpose(0, 1, 4, 2, 5, 3).reshape(2, SIDE, SIDE, 3))
    return np.mean(halves, axis=0), np.var(halves, axis=0, ddof=1) / len(halves)


def relmse(image, right, variance):
    return float((((image - right) ** 2 - variance) / (right ** 2 + .01)).mean())


def job(scene, folder, seed, options):
    """The image of one job, its denoised layers and its report; those of an earlier run serve again."""
    out, report = folder / f"{seed}.exr", folder / f"{seed}.json"
    if not report.exists():
        new = folder / "new.json"
        subprocess.run([bench_scenes.ROOT / "build" / "release" / "bin" / "lightshaft", "render", scene, "-o", out, "--float", "--report", new, "--quiet",
                        "--size", f"{SIDE}x{SIDE}", "--seed", str(seed), *options], check=True)
        new.rename(report)
    return *denoised.layers(out), json.loads(report.read_text())


def shares(looks):
    """Cells: how many jobs state an interval, the share of them whose interval holds, and of those whose true figure is above it.

    looks: of each job its samples, its stated figure, the ends of its interval or None, and its true figure."""
    stated = [look for look in looks if look[2] is not None]
    if not stated:
        return f"0 of {len(looks)} | - | -"
    held = np.mean([low <= true <= high for _, _, (low, high), true in stated])
    above = np.mean([true > high for _, _, (_, high), true in stated])
    return (f"{len(stated)} of {len(looks)} | {100 * held:.1f} +- {100 * np.sqrt(held * (1 - held) / len(stated)):.1f} % | "
            f"{100 * above:.1f} %")


def line(name, what, looks):
    samples, figures, true = (np.array([look[i] for look in looks]) for i in (0, 1, 3))
    ratio = figures.mean() / true.mean()
    # by linearisation of the quotient, over jobs
    sigma = np.std(figures - ratio * true, ddof=1) / np.sqrt(len(looks)) / true.mean()
    return f"| {name} | {what} | {samples.mean():.0f} | {true.mean():.2g} | {shares(looks)} | {ratio:.3f} +- {sigma:.3f} |"


def measured(name, scene, targets, seed, jobs, work, threads):
    """What a row is of, and its looks."""
    right, variance = right_answer(work / "kept" / f"{name}-{SIDE}-64")
    for layer, target, first in zip(("raw", "denoised"), targets, (seed, seed + 500)):
        folder = work / "targets" / f"{name}-{layer}-{target:g}"
        folder.mkdir(parents=True, exist_ok=True)
        options = ["--target-error", f"{target:g}", "--target-layer", layer, "--denoise", "--threads", str(threads)]
        images, layers = [], []
        for image, smooth, report in (job(scene, folder, first + i, options) for i in range(jobs)):
            ends = report["relmse_ci95"] if report["trusted"] else None
            images.append((report["spp"], report["relmse"], ends, relmse(image, right, variance)))
            figures = report["denoised"]
            layers.append((report["spp"], figures["relmse"], figures["relmse_ci95"], relmse(smooth, right, variance)))
        to = f"to {target:g}" + (" of its denoised layers" if layer == "denoised" else "")
        yield f"image, {to}", images
        yield f"denoised layers, {to}", layers


def table(paths, work, only, share, threads):
    lines = ["| scene | figure | spp | true relMSE | with an interval | covered | above | estimated / true |", "|---|---|---|---|---|---|---|---|"]
    every = {"images": [], "denoised layers": []}
    for name, image, layers, seed in CELLS:
        if only and name not in only:
            continue
        for what, looks in measured(name, paths[name], (image, layers), seed, max(4, round(share * JOBS)), work, threads):
            lines.append(line(name, what, looks))
            print(lines[-1], flush=True)
            every["images" if what.startswith("image") else "denoised layers"] += looks
    # Samples and figures of different scenes have no common mean
    lines += [f"| all | {what} | | | {shares(looks)} | |" for what, looks in every.items()]
    print(*lines[-2:], sep="\n", flush=True)
    return lines
