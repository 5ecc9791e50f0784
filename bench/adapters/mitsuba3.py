#!/usr/bin/env python3
"""Adapter of race.py for Mitsuba 3: one process per seed, whose picture is noted as its samples double.

usage: mitsuba3.py SCENE FOLDER --time S [--clock wall|cpu] --seed N --threads N --size W H --integrator volpath|volpathmis
       [--variant llvm_ad_rgb]
The scene must be one that Mitsuba 3 loads. Its integrator is replaced by the one asked for, with the scene's max_depth and
rr_depth; without media it is `path`. Passes of equally many samples, each with a seed of its own, are averaged: for the
`independent` sampler, which every scene here has, that is the same as one render of all the samples. Loading, compilation and
warm-up are not counted. Needs the packages mitsuba and numpy, and an LLVM library (llvm_library.py), which DRJIT_LIBLLVM_PATH
may name; with --variant scalar_rgb, which is slower, none.
"""
import re

import numpy as np

import llvm_library
import stopwatch

MOST_WAVE = 1 << 23  # samples of one pass: what memory holds
PASSES = 8           # at least so many in the time, so that it is used up to its end


def open_mitsuba(variant, threads):
    compiled = variant.startswith("llvm")
    if compiled:
        llvm_library.name_it()
    import drjit
    import mitsuba
    mitsuba.set_variant(variant)
    if compiled:
        drjit.set_thread_count(threads)
    return mitsuba


def load(mitsuba, options):
    scene = mitsuba.load_file(str(options.scene))
    parameters = mitsuba.traverse(scene)
    film = next(key for key in parameters.keys() if key.endswith("film.size"))
    for key in (film, film.replace("film.size", "film.crop_size")):
        parameters[key] = options.size
    parameters.update()
    text = options.scene.read_text()
    depths = {key: int(value) for key, value in re.findall(r'name="(max_depth|rr_depth)" value="(-?\d+)"', text)}
    name = options.integrator if "<medium" in text else "path"
    return scene, mitsuba.load_dict({"type": name, **depths})


def main():
    args = stopwatch.arguments(__doc__)
    args.add_argument("--integrator", default="volpath")
    args.add_argument("--variant", default="llvm_ad_rgb")
    options = args.parse_args()
    mitsuba = open_mitsuba(options.variant, options.threads)
    scene, integrator = load(mitsuba, options)

    def render(spp, seed):
        start = stopwatch.Cost.now()
        picture = np.asarray(mitsuba.render(scene, spp=spp, seed=seed, integrator=integrator).numpy(), dtype=np.float64)[..., :3]
        return picture, stopwatch.Cost.now() - start

    first = options.seed * 100_000
    render(1, first + 99_999)
    once = render(1, first + 99_998)[1].seconds(options)
    spp = 1
    while 2 * spp * once <= options.time / PASSES and 2 * spp * options.size[0] * options.size[1] <= MOST_WAVE:
        spp *= 2
    if spp > 1:
        render(spp, first + 99_997)
    total, cost, passes = 0., stopwatch.Cost(), 0
    while True:
        picture, spent = render(spp, first + passes)
        total, cost, passes = total + picture, cost + spent, passes + 1
        last = cost.seconds(options) * (passes + .5) / passes > options.time
        if last or passes & (passes - 1) == 0:
            name = f"{passes}.exr"
            mitsuba.Bitmap((total / passes).astype(np.float32)).write(str(options.folder / name))
            stopwatch.note(options.folder, name, passes * spp, cost)
        if last:
            return


if __name__ == "__main__":
    main()
