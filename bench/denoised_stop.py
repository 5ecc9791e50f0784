#!/usr/bin/env python3
"""How often the denoised layers of a job that stopped at their target error are truly as good as asked.

usage: denoised_stop.py SCENE.xml[@WxH]... --target E[,E...] [--seeds N] [--first SEED] [--reference-spp N] [--out PAGE.md]
Renders each scene with N seeds and --target-error E --target-layer denoised. The true relMSE of the denoised layers is (x - ref0)(x -
ref1) / (ref^2 + 0.01) against two references with seeds of their own, free of their noise in the mean. Columns: samples per pixel at the
stop, checks that were made, the estimate at the stop and its upper end, the truth, and how many seeds' true error is at most the target,
with the 95 % interval of that share (Clopper and Pearson). A seed whose truth the references do not tell from the target (by two
standard errors of their noise) has no say. Needs Open Image Denoise (deploy/install-denoiser.sh), numpy, scipy, and the OpenEXR package
of PyPI.
"""
import argparse
import pathlib
import statistics
import tempfile

from scipy.stats import beta

from denoised import against, publish, render

MOST_SPP = 65536


def share(held, known):
    """"19 of 20 (75 to 100 %)"."""
    low = beta.ppf(.025, held, known - held + 1) if held else 0
    high = beta.ppf(.975, held + 1, known - held) if held < known else 1
    return f"{held} of {known} ({100 * low:.0f} to {100 * high:.0f} %)" if known else "not known"


def row(scene, size, target, references, asked, folder):
    spp, checks, told, upper, true, held, known = [], [], [], [], [], 0, 0
    for seed in range(asked.first, asked.first + asked.seeds):
        (_, denoised), report = render(scene, folder, size, MOST_SPP, seed, "--target-error", str(target), "--target-layer", "denoised")
        assert report["stopped"] == "error", report["stopped"]
        last = report["denoised_checks"][-1]
        (relmse, noise), _ = against(denoised, *references)
        spp.append(report["spp"])
        checks.append(len(report["denoised_checks"]))
        told.append(last["relmse"])
        upper.append(last["at_most"])
        true.append(relmse)
        if abs(relmse - target) > 2 * noise:
            known += 1
            held += relmse <= target
    mean = statistics.mean
    return (f"| {scene.stem} | {target:g} | {mean(spp):.0f} | {mean(checks):.1f} | {mean(told):.3g} | {mean(upper):.3g} "
            f"| {mean(true):.3g} ({min(true):.3g} to {max(true):.3g}) | {share(held, known)} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--target", required=True, type=lambda text: [float(t) for t in text.split(",")])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--reference-spp", type=int, default=2048)
    parser.add_argument("--out", type=pathlib.Path)
    asked = parser.parse_args()
    lines = ["| scene | target | samples a pixel | checks | told | upper end | true (least to most) | true at most the target |", "|---|---|---|---|---|---|---|---|"]
    with tempfile.TemporaryDirectory() as made:
        folder = pathlib.Path(made)
        for named in asked.scenes:
            name, _, size = named.partition("@")
            scene = pathlib.Path(name)
            references = [render(scene, folder, size, asked.reference_spp, 10**6 + i)[0][0] for i in (0, 1)]
            for target in asked.target:
                lines.append(row(scene, size, target, references, asked, folder))
                print(lines[-1], flush=True)
    publish("Targets of the denoised layers", "{made}. What the columns are: see the script.", lines, asked.out)


if __name__ == "__main__":
    main()
