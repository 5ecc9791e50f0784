#!/usr/bin/env python3
"""What a scene does not need, measured: writes docs/leave-out.md.

usage: leave_out.py [--out FILE.md] [--jobs N] [--only NAME,...] [--bytes-alone]    N = 0: with what was built before

For a vacuum, a homogeneous, a grid and a textured scene, and one of whose lights none has an extent:
- instructions per path (callgrind, within render_tile, one thread) of the release build, against a build of the same sources
  without the parts that the scene does not use (cmake -DLIGHTSHAFT_WITHOUT=...), and against one without the guards of health;
- the same of every instantiation of the integrator that covers the scene;
- counters of work (a build with -DLIGHTSHAFT_COUNT=ON, through `lightshaft inspect --work`);
- what a worker on a farm keeps resident and which libraries it has mapped;
- bytes uploaded, sent and loaded with 100 MiB of assets that nothing needed names, and without.
--bytes-alone measures the last two, which need no other build. Builds land in build/leave-out-*. Needs valgrind and a release build. Instruction counts do not depend on what else runs.
"""
import argparse
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "tests" / "system")]
from cli_kit import FOG, write_fog  # noqa: E402
from local_farm import LocalFarm  # noqa: E402
from processes import family  # noqa: E402

SIZE, SPP = (48, 32), 8
UNUSED = 100 << 20
ALL = ["media", "grids", "chromatic", "emission", "overlaps", "boundaries", "coincident", "veils", "textures", "user_geometries", "instances", "environment_maps",
       "equiangular", "light_trees", "lenses", "found_lights"]
GRID = re.compile(r'  <shape type="cube">.*?</shape>\n', re.S)
BOX = '<shape type="cube"><transform name="to_world"><scale value="0.6"/></transform><bsdf type="diffuse">{}</bsdf></shape>\n'
HOMOGENEOUS = """  <shape type="cube"><bsdf type="null"/><medium name="interior" type="homogeneous"><float name="sigma_t" value="1.5"/>
    <rgb name="albedo" value="0.9, 0.8, 0.6"/></medium></shape>
"""
# A closed room: every path meets something.
ROOM = '<shape type="cube"><transform name="to_world"><scale value="5"/></transform><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape>\n'
POINT = '<emitter type="spot"><transform name="to_world"><lookat origin="2,3,2" target="0,0,0" up="0,1,0"/></transform><rgb name="intensity" value="30"/></emitter>\n'
TEXTURE = '<texture type="bitmap" name="reflectance"><string name="filename" value="checks.png"/></texture>'
LIT = FOG.replace('<emitter type="constant"><rgb name="radiance" value="0.1"/></emitter>', ROOM)
UNLIT = re.sub(r'  <shape type="rectangle">.*?</shape>\n', POINT, LIT, flags=re.S)
INSIDE = BOX.format("").replace("0.6", "0.3")
SCENES = {  # text, the parts that it needs
    "vacuum": (GRID.sub(BOX.format(""), LIT, count=1), ["found_lights"]),
    "homogeneous": (GRID.sub(HOMOGENEOUS + INSIDE, LIT, count=1), ["media", "boundaries", "equiangular", "found_lights"]),
    "grid": (LIT.replace("</scene>", INSIDE + "</scene>"), ["media", "grids", "boundaries", "found_lights"]),
    "textured": (GRID.sub(BOX.format(TEXTURE), LIT, count=1), ["textures", "found_lights"]),
    "delta": (GRID.sub(HOMOGENEOUS + INSIDE, UNLIT, count=1), ["media", "boundaries", "equiangular"]),
}


def scene_text(name):
    text = SCENES[name][0]
    return text if "$density" in text else text.replace('<default name="density" value="2"/>', "")


def png(width, height):
    rows = b"".join(b"\0" + bytes(x for i in range(width) for x in ((i * 7 + j * 3) % 256, (i ^ j) % 256, j % 256)) for j in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))  # noqa: E731
    head = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def write(folder):
    write_fog(folder, n=32)
    (folder / "checks.png").write_bytes(png(256, 256))
    for name in SCENES:
        (folder / f"{name}.xml").write_text(scene_text(name))


def build(name, *options, jobs):
    """Nothing is built with jobs = 0: the binaries that lie there are taken."""
    folder = ROOT / "build" / f"leave-out-{name}"
    if jobs == 0:
        return folder / "bin" / "lightshaft"
    subprocess.run(["cmake", "--preset", "release", "-B", folder, "-DLIGHTSHAFT_TESTS=OFF", *options], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", folder, "-j", str(jobs), "--target", "lightshaft"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return folder / "bin" / "lightshaft"


def instructions(binary, scene, folder):
    """Per path, and the image's digest."""
    size = f"{SIZE[0]}x{SIZE[1]}"
    command = ["valgrind", "--tool=callgrind", "--toggle-collect=ls::render::render_tile(*", f"--callgrind-out-file={folder}/callgrind.out",
               binary, "render", scene, "--threads", "1", "--size", size, "--spp", str(SPP), "-o", folder / "out.exr"]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-2000:]
    collected = int(re.search(r"Collected : (\d+)", run.stderr)[1])
    return collected / (SIZE[0] * SIZE[1] * SPP), re.search(r"pixels_sha256 (\w+)", run.stdout)[1]


# By name: the flags of worker/render/features.h, in their order, without those that are not set at the end.
INSTANTIATIONS = {"surfaces": (), "homogeneous grey media": (1,), "homogeneous chromatic media": (1, 0, 1), "grey grids": (1, 1),
                  "chromatic grids": (1, 1, 1), "everything": (1, 1, 1, 1, 1), "everything, and light in parts": (1, 1, 1, 1, 1, 1)}


def inclusive(callgrind):
    """Instructions in calls of each function, what it called included."""
    names, costs, callee = {}, {}, None
    for line in callgrind.read_text().splitlines():
        if (m := re.match(r"c?fn=\((\d+)\)(?: (.*))?", line)):
            if m[2]:
                names[m[1]] = m[2]
            if line[0] == "c":
                callee = names[m[1]]
        elif callee and not line.startswith(("calls=", "cob=", "cfi=", "cfl=")):
            costs[callee] = costs.get(callee, 0) + int(line.split()[1])
            callee = None
    return costs


def by_instantiation(binary, scene, folder):
    """(name, instructions per path) of every instantiation that covers the scene, in a small image."""
    out = folder / "variants.out"
    said = subprocess.run(["valgrind", "--tool=callgrind", "--toggle-collect=ls::render::render_tile_as(*", f"--callgrind-out-file={out}",
                           binary, "inspect", scene, "--json", "--variants"], check=True, capture_output=True, text=True)
    told = json.loads(said.stdout)
    assert told["variants_agree"], told["variant_bits"]
    longer = max(told["size"])
    paths = 4 * (told["size"][0] * 32 // longer) * (told["size"][1] * 32 // longer)  # as cli/inspect_command.cpp has it
    costs = {}
    for function, cost in inclusive(out).items():
        if (m := re.search(r"sample_with<ls::render::Features\{([^}]*)\}", function)):
            flags = tuple(int(flag == "true") for flag in m[1].split(", ")) if m[1] else ()
            costs[flags] = cost / paths
    return [(v["variant"], costs[INSTANTIATIONS[v["variant"]]]) for v in told["variant_bits"]]


def on_a_farm(scene, folder):
    """A worker's resident bytes and libraries, the coordinator's store and the worker's cache, after a job."""
    folder.mkdir()
    with LocalFarm(folder, bin=ROOT / "build" / "release" / "bin") as farm:
        worker = farm.add_worker(fake=False)
        env = {**os.environ, "LIGHTSHAFT_URL": f"http://127.0.0.1:{farm.http}/", "LIGHTSHAFT_TOKEN": farm.token}
        said = subprocess.run([farm.bin / "lightshaft", "submit", scene, "--spp", "4", "--size", "48x32"], env=env, check=True, capture_output=True, text=True)
        report = farm.report(said.stdout.split()[0]) if farm.pixels(said.stdout.split()[0]) else None
        pids = family(worker.popen.pid)
        maps = "".join(pathlib.Path(f"/proc/{pid}/maps").read_text() for pid in pids)
        rss = max(int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{pid}/status").read_text())[1]) * 1024 for pid in pids)
        used = lambda path: sum(p.stat().st_size for p in path.rglob("*") if p.is_file())  # noqa: E731
        blobs = used(farm.data / "blobs") if (farm.data / "blobs").is_dir() else used(farm.data)
        return {"rss": rss, "libraries": sorted(set(re.findall(r"/(lib[\w+.-]+?)\.so", maps))), "stored": blobs,
                "cached": used(folder / "cache"), "peak": report["peak_rss_bytes"], "pixels": report["pixels_sha256"]}


def with_unused(scene, folder):
    big = folder / "unused.vol"
    n = 298  # cubed, times four bytes: 100 MiB and a little
    head = b"VOL\x03" + struct.pack("<5i6f", 1, n, n, n, 1, 0, 0, 0, 1, 1, 1)
    big.write_bytes(head + os.urandom(4096) + bytes(4 * n ** 3 - 4096))
    assert big.stat().st_size >= UNUSED
    text = scene.read_text().replace("</scene>", '<medium type="heterogeneous" id="u"><volume name="sigma_t" type="gridvolume">'
                                     '<string name="filename" value="unused.vol"/></volume></medium></scene>')
    fat = folder / f"{scene.stem}-fat.xml"
    fat.write_text(text)
    return fat


def mib(n):
    return f"{n / 2 ** 20:.2f}"


def work(binary, scene):
    done = subprocess.run([binary, "inspect", scene, "--json", "--work"], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)["work"]


def compute(name, release, unguarded, counting, jobs, scene, folder):
    without = [part for part in ALL if part not in SCENES[name][1]]
    bare = build(name, "-DLIGHTSHAFT_WITHOUT=" + ",".join(without), jobs=jobs)
    full, pixels = instructions(release, scene, folder)
    least, same = instructions(bare, scene, folder)
    assert pixels == same, f"{name}: the build without {without} gives another image"
    print(name, f"{full:.0f} instructions a path, {least:.0f} without: {100 * (full / least - 1):+.2f} %", flush=True)
    trusting, same = instructions(unguarded, scene, folder)
    assert pixels == same, f"{name}: the build without guards gives another image"
    print(name, f"{trusting:.0f} without the guards of health: {100 * (full / trusting - 1):+.2f} %", flush=True)
    return {"full": full, "bare": least, "without": without, "unguarded": trusting, "work": work(counting, scene),
            "variants": by_instantiation(release, scene, folder)}


def measure(names, jobs, folder, bytes_alone):
    write(folder)
    release = ROOT / "build" / "release" / "bin" / "lightshaft"
    if not bytes_alone:
        counting = build("counting", "-DLIGHTSHAFT_COUNT=ON", jobs=jobs)
        unguarded = build("unguarded", "-DLIGHTSHAFT_WITHOUT=health", jobs=jobs)
    rows = {}
    for name in names:
        scene = folder / f"{name}.xml"
        told = json.loads(subprocess.run([release, "inspect", scene, "--json"], check=True, capture_output=True, text=True).stdout)
        rows[name] = {"variant": told["variant"], "needed": sum(s["bytes"] for s in told["structures"]),
                      "farm": on_a_farm(scene, folder / f"farm-{name}"), "fat": on_a_farm(with_unused(scene, folder), folder / f"farm-{name}-fat")}
        if not bytes_alone:
            rows[name] |= compute(name, release, unguarded, counting, jobs, scene, folder)
    return rows


def percent(n, of):
    return f"{100 * (n / of - 1):+.2f} %"


def computed(rows):
    out = ["## Instructions per path", "", f"Images of {SIZE[0]} x {SIZE[1]} pixels with {SPP} samples, one thread.", "",
           "Callgrind, within `render_tile`: what the presence of parts that the scene does not use costs it. *without*: the same sources "
           "with these parts compiled out (`cmake -DLIGHTSHAFT_WITHOUT=...`); both give the same pixels, bit for bit.", "",
           "| scene | instantiation | instructions | without the unused parts | difference |", "|---|---|---|---|---|"]
    for name, r in rows.items():
        out.append(f"| {name} | {r['variant']} | {r['full']:.0f} | {r['bare']:.0f} | {percent(r['full'], r['bare'])} |")
    out += ["", "Compiled out were: " + "; ".join(f"for *{n}* {', '.join(r['without'])}" for n, r in rows.items()) + ".", ""]
    out += ["### By instantiation", "",
            "The same bits at another price, in a small image (`lightshaft inspect SCENE --variants`, which names the prices itself where the machine has a "
            "counter of instructions; here again callgrind): the first is the one that the scene is rendered with. What it saves over the general one is "
            "what the parts that it leaves out would cost. *everything, and light in parts* is the price of AOVs of light, for those who ask for them.", ""]
    for name, r in rows.items():
        cheapest = r["variants"][0][1]
        out.append(f"- {name}: " + "; ".join(f"{v} {n:.0f}" + ("" if n == cheapest else f" ({percent(n, cheapest)})") for v, n in r["variants"]) + ".")
    out += ["", "### The guards of numeric health", "",
            "Against a build without them (`-DLIGHTSHAFT_WITHOUT=health`): each sample's test, the bounds of densities, directions that are none.", "",
            "| scene | instructions | without the guards | difference |", "|---|---|---|---|"]
    for name, r in rows.items():
        out.append(f"| {name} | {r['full']:.0f} | {r['unguarded']:.0f} | {percent(r['full'], r['unguarded'])} |")
    out += ["", "## Work that is not done", "", "Counted in a build with `-DLIGHTSHAFT_COUNT=ON` (`lightshaft inspect SCENE --work`), in a small image.", "",
            "| work | " + " | ".join(rows) + " |", "|---|" + "---|" * len(rows)]
    for key in next(iter(rows.values()))["work"]:
        out.append(f"| {key.replace('_', ' ')} | " + " | ".join(str(r["work"][key]) for r in rows.values()) + " |")
    return out + [""]


def page(rows, bytes_alone):
    command = "tests/bench/leave_out.py" + (" --bytes-alone" if bytes_alone else "")
    out = ["# What a scene does not need is left out", "", f"Made by `{command}` (release build, GCC 12, `-march=x86-64-v3`).", ""]
    if bytes_alone:
        out += ["Without `--bytes-alone` it also builds the renderer without the parts that each scene does not use and compares instructions per path, "
                "and tabulates the counters of work.", ""]
    else:
        out += computed(rows)
    out += ["## Bytes", "",
            "A job on a farm with one worker: what the coordinator stores of it, what the worker fetched, what its render process keeps resident; and "
            "the same with a grid of 100 MiB beside it that nothing needed names. *needed*: the sum of the scene's structures (`lightshaft inspect`); "
            "resident memory beyond the vacuum scene's against what is needed beyond its.", "",
            "| scene | needed MiB | resident MiB | beyond vacuum: resident, needed | stored MiB, with 100 MiB unused | fetched MiB, with | resident MiB, with | same pixels |",
            "|---|---|---|---|---|---|---|---|"]
    base = rows.get("vacuum")
    for name, r in rows.items():
        farm, fat = r["farm"], r["fat"]
        beyond = f"{mib(farm['rss'] - base['farm']['rss'])}, {mib(r['needed'] - base['needed'])}" if base else "-"
        out.append(f"| {name} | {mib(r['needed'])} | {mib(farm['rss'])} | {beyond} | {mib(farm['stored'])}, {mib(fat['stored'])} | "
                   f"{mib(farm['cached'])}, {mib(fat['cached'])} | {mib(fat['rss'])} | {'yes' if farm['pixels'] == fat['pixels'] else 'NO'} |")
    common = set.intersection(*(set(r["farm"]["libraries"]) for r in rows.values()))
    out += ["", "## Libraries", "", f"All workers have these {len(common)} mapped: {', '.join(sorted(common))}.", ""]
    for name, r in rows.items():
        more = sorted(set(r["farm"]["libraries"]) - common)
        out.append(f"- {name}: {'nothing else' if not more else ', '.join(more)}.")
    out += ["", "OpenVDB is mapped by none of them, and by no worker: a program of its own, `lightshaft-vdb`, reads a `.vdb` or `.nvdb` file that a scene names, and ends (`tests/system/test_leave_out.py`).", ""]
    return "\n".join(out)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--out", type=pathlib.Path, default=ROOT / "docs" / "leave-out.md")
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--only", default=",".join(SCENES))
    options.add_argument("--bytes-alone", action="store_true")
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="lightshaft-leave-out-") as folder:
        rows = measure(chosen.only.split(","), chosen.jobs, pathlib.Path(folder), chosen.bytes_alone)
    chosen.out.write_text(page(rows, chosen.bytes_alone))


if __name__ == "__main__":
    main()
