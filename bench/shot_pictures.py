#!/usr/bin/env python3
"""Pictures for docs/guide/shots.md: a plate with composited steam, a relit bath with its error, a deep merge.

usage: shot_pictures.py [--spp 64] [--size 480x360] [--out docs/images] [steam relight deep]
Makes the bath (scenes/bath), renders its elements, composites them with oiiotool (Debian: openimageio-tools) as any program for
compositing does, and prints how far the composite is from the render of everything together. A bench, not a test.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "support")]
from exr_layers import read  # noqa: E402
from local_farm import LocalFarm, bin_dir  # noqa: E402

EXPOSURE = 0.8  # stops, as the demo shows the bath
MIXES = {"noon": {}, "evening": {"sun": [1.1, 0.55, 0.2], "garden": [0.5, 0.4, 0.45], "pane": 0.15},
         "night": {"sun": [0.02, 0.035, 0.07], "garden": [0.02, 0.03, 0.06], "pane": [2.4, 1.5, 0.7]}, "shaft": {"sun": {"volume": 3, "surface": 0.6}, "garden": 0.5}}


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def render(scene, out, options, *more):
    run(bin_dir() / "lightshaft", "render", scene, "-o", out, "--quiet", "--size", options.size, "--spp", options.spp, "--float", *more)
    return out


def picture(image, out):
    run("oiiotool", image, "--ch", "R,G,B", "--mulc", 2 ** EXPOSURE, "--colorconvert", "linear", "sRGB", "-d", "uint8", "--compression", "jpeg:88", "-o", out)


def difference(a, b):
    """The mean of image a over that of b, and how far their pixels are apart in the mean, in means of b."""
    values = [[value for channel in "RGB" for row in read(path)[0][channel] for value in row] for path in (a, b)]
    whole = sum(values[1])
    return sum(values[0]) / whole, sum(abs(p - q) for p, q in zip(*values)) / whole


def bath(folder):
    run(sys.executable, ROOT / "scenes/bath/make_bath.py", folder, "--setting", "small")
    return (folder / "bath.xml").read_text()


def held_out(text):
    """The steam alone, over a plate: every other shape is held out."""
    text = re.sub(r'(<shape type="(?!cube)[a-z]+">)', r'\1<boolean name="holdout" value="true"/>', text)
    return text.replace('<film type="hdrfilm">', '<film type="hdrfilm"><boolean name="transparent" value="true"/>')


def without_steam(text):
    text = re.sub(r'  <shape type="cube">.*?</shape>\n', "", text)
    return text.replace('<ref name="medium" id="steam"/>', "")


def steam(folder, options):
    text = bath(folder)
    images = {}
    for name, scene, more in (("plate", without_steam(text), ()), ("element", held_out(text), ("--aov", "alpha")), ("together", text, ())):
        (folder / f"{name}.xml").write_text(scene)
        image = render(folder / f"{name}.xml", folder / f"{name}.exr", options, *more, *(["--denoise"] if options.denoise else []))
        colours = "denoised.R,denoised.G,denoised.B" if options.denoise else "R,G,B"
        images[name] = folder / f"{name}-shown.exr"
        alpha = ",A" if name == "element" else ""
        run("oiiotool", image, "--ch", colours + alpha, "--chnames", "R,G,B" + alpha, "--compression", "zip", "-d", "float", "-o", images[name])
    over = folder / "over.exr"
    run("oiiotool", images["element"], "--ch", "R,G,B,A", images["plate"], "--ch", "R,G,B,A=1", "--over", "--compression", "zip", "-d", "float", "-o", over)
    run("oiiotool", "--pattern", "checker:width=16:height=16:color1=0.05,0.05,0.05:color2=0.12,0.12,0.12", options.size, 3, "--ch", "R,G,B,A=1", "-o", folder / "checks.exr")
    run("oiiotool", images["element"], "--ch", "R,G,B,A", folder / "checks.exr", "--over", "-o", folder / "checked.exr")
    for name, image in (("plate", images["plate"]), ("element", folder / "checked.exr"), ("over", over), ("together", images["together"])):
        picture(image, options.out / f"shot-steam-{name}.jpg")
    mean, apart = difference(over, images["together"])
    print(f"steam over the plate: mean {mean:.4f} of the render with steam; pixels differ by {100 * apart:.1f} % in the mean")


def grouped(text):
    def group(name):
        return f'<string name="light_group" value="{name}"/>'
    text = text.replace('<emitter type="directional">', f'<emitter type="directional">{group("sun")}')
    first, second = [match.end() for match in re.finditer(r'<emitter type="area">', text)]
    return text[:first] + group("garden") + text[first:second] + group("pane") + text[second:]


def relight(folder, options):
    (folder / "groups.xml").write_text(grouped(bath(folder)))
    with LocalFarm(folder / "farm", allow_fake=False) as farm:
        farm.add_worker(threads=2, fake=False)
        to = ("--to", f"http://127.0.0.1:{farm.http}", "--token-file", farm.data / "token")
        job = run(bin_dir() / "lightshaft", "submit", folder / "groups.xml", *to, "--size", options.size, "--spp", options.spp, "--float", "--aov",
                  "volume_light_groups", "--wait", *(["--denoise"] if options.denoise else [])).split()[0]
        for name, mix in MIXES.items():
            query = json.dumps(mix)
            out = folder / f"{name}.exr"
            run(bin_dir() / "lightshaft", "fetch", job, *to, "-o", out, *(["--mix", write(folder / f"{name}.json", query)] if mix else []))
            layer = "denoised.R,denoised.G,denoised.B" if options.denoise else "R,G,B"
            run("oiiotool", out, "--ch", layer, "--chnames", "R,G,B", "-o", folder / f"{name}-shown.exr")
            picture(folder / f"{name}-shown.exr", options.out / f"shot-relit-{name}.jpg")
            error = farm.get(f"/api/v1/jobs/{job}/mix?mix={query.replace(' ', '').replace('{', '%7B').replace('}', '%7D').replace(chr(34), '%22')}") if mix else farm.get(f"/api/v1/jobs/{job}")
            print(f"{name}: {query}: relMSE {error['relmse']:.3g}, 95 %: {error['relmse_ci95'][0]:.3g} to {error['relmse_ci95'][1]:.3g}, {error.get('verdict')}")


def write(path, text):
    path.write_text(text)
    return path


def fog_and_rings(fog, rings):
    """A cube of fog, a ring of balls, or both."""
    out = '<scene version="3.0.0"><integrator type="volpath"><integer name="max_depth" value="8"/></integrator>'
    if fog:
        out += ('<medium type="homogeneous" id="fog"><float name="sigma_t" value="0.9"/><rgb name="albedo" value="0.95, 0.9, 0.8"/><phase type="hg"><float name="g" value="0.4"/></phase></medium>'
                '<shape type="cube"><transform name="to_world"><scale value="1.3"/><rotate y="1" angle="35"/></transform><bsdf type="null"/><ref name="interior" id="fog"/></shape>')
    if rings:
        for i in range(14):
            out += (f'<shape type="sphere"><float name="radius" value="0.22"/><transform name="to_world"><translate x="1.6"/><rotate y="1" angle="{i * 360 / 14}"/>'
                    f'<rotate x="1" angle="14"/></transform><bsdf type="diffuse"><rgb name="reflectance" value="0.15, 0.35, 0.7"/></bsdf></shape>')
    return out + ('<emitter type="directional"><vector name="direction" x="-0.6" y="-1" z="0.7"/><rgb name="irradiance" value="5, 4.6, 4"/></emitter>'
                  '<emitter type="constant"><rgb name="radiance" value="0.12, 0.14, 0.2"/></emitter>'
                  '<sensor type="perspective"><float name="fov" value="34"/><transform name="to_world"><lookat origin="0, 2.2, -7" target="0, 0, 0" up="0, 1, 0"/></transform>'
                  '<film type="hdrfilm"><boolean name="transparent" value="true"/><rfilter type="box"/></film></sensor></scene>')


def deep(folder, options):
    for name, fog, rings in (("fog", True, False), ("rings", False, True), ("both", True, True)):
        scene = write(folder / f"{name}.xml", fog_and_rings(fog, rings))
        render(scene, folder / f"{name}.exr", options, "--aov", "alpha", *(["--deep", 32] if name != "both" else []))
    merged = folder / "merged.exr"
    run("oiiotool", folder / "fog.deep.exr", folder / "rings.deep.exr", "--deepmerge", "--flatten", "--compression", "zip", "-d", "float", "-o", merged)
    run("oiiotool", "--pattern", "constant:color=0.015,0.018,0.024,1", options.size, 4, "-o", folder / "dark.exr")
    for name, image in (("fog", folder / "fog.exr"), ("rings", folder / "rings.exr"), ("merged", merged), ("together", folder / "both.exr")):
        run("oiiotool", image, "--ch", "R,G,B,A", folder / "dark.exr", "--ch", "R,G,B,A=1", "--over", "-o", folder / "shown.exr")
        picture(folder / "shown.exr", options.out / f"shot-deep-{name}.jpg")
    mean, apart = difference(merged, folder / "both.exr")
    print(f"deep merge: mean {mean:.4f} of the render together, where fog and balls light and shade each other; pixels differ by {100 * apart:.1f} % in the mean")


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument("parts", nargs="*", choices=["steam", "relight", "deep", []], default=[])
    args.add_argument("--spp", type=int, default=64)
    args.add_argument("--size", default="480x360")
    args.add_argument("--denoise", action="store_true")
    args.add_argument("--out", type=pathlib.Path, default=ROOT / "docs" / "images")
    options = args.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    for name, part in (("steam", steam), ("relight", relight), ("deep", deep)):
        if not options.parts or name in options.parts:
            with tempfile.TemporaryDirectory() as folder:
                part(pathlib.Path(folder), options)


if __name__ == "__main__":
    main()
