#!/usr/bin/env python3
"""What a scene does not need, measured: writes a page of tables.

usage: leave_out.py [--out FILE.md] [--jobs N] [--only NAME,...] [--bytes-alone] [--bits SCENE...]
N = 0: with what was built before, which must be of these sources.

For a vacuum, a homogeneous, a grid and a textured scene, and one of whose lights none has an extent:
- instructions per path (callgrind, within render_tile, one thread), and of every instantiation of the integrator that covers the
  scene: what the parts that its own leaves out would cost;
- counters of work (a build with -DLIGHTSHAFT_COUNT=ON, through `lightshaft inspect --work`);
- what a worker on a farm keeps resident and which libraries it has mapped, with larger files;
- bytes uploaded, sent and loaded with 100 MiB of assets that nothing needed names, and without.
--bits asks further scenes whether every instantiation that covers them gives the same bits (same_bits.py).
--bytes-alone measures the last two of the list, which need no other build. The build that counts lands in build/leave-out-counting;
build/release must be configured. Needs valgrind. Instruction counts do not depend on what else runs. Ends with 1 if a scene's
instantiation takes more than LIMIT beyond the cheapest that covers it, or a counter of unused work is not 0.
"""
import argparse
import array
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "support"), str(ROOT / "tests" / "system")]
from cli_kit import FOG, fog_values, write_fog  # noqa: E402
from local_farm import LocalFarm  # noqa: E402
from processes import family  # noqa: E402
from same_bits import same_bits  # noqa: E402

SIZE, SPP = (48, 36), 2
LIMIT = 0.005
UNUSED = 100 << 20
VOL = struct.Struct("<4s5i6f")  # the header of Mitsuba's grids
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
SCENES = {
    "vacuum": GRID.sub(BOX.format(""), LIT, count=1),
    "homogeneous": GRID.sub(HOMOGENEOUS + INSIDE, LIT, count=1),
    "grid": LIT.replace("</scene>", INSIDE + "</scene>"),
    "textured": GRID.sub(BOX.format(TEXTURE), LIT, count=1),
    "delta": GRID.sub(HOMOGENEOUS + INSIDE, UNLIT, count=1),
}
# Counters of work that a scene must leave at 0: all but these.
WORKS = {"vacuum": {"shadow_rays"}, "textured": {"shadow_rays", "texels"},
         "homogeneous": {"shadow_rays", "phase", "transmittance", "equiangular", "boundary_rays"},
         "grid": {"shadow_rays", "phase", "density", "macro_cells", "boundary_rays"}}
WORKS["delta"] = WORKS["homogeneous"]

TAKEN_OUT = "What is left out, and how: `docs/design/leave-out.md`.\n"


def scene_text(name):
    text = SCENES[name].replace('<integrator type="volpath"/>', '<integrator type="volpath"><integer name="path_reuse" value="-1"/></integrator>')
    return text if "$density" in text else text.replace('<default name="density" value="2"/>', "")


def png(width, height):
    rows = b"".join(b"\0" + bytes(x for i in range(width) for x in ((i * 7 + j * 3) % 256, (i ^ j) % 256, j % 256)) for j in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))  # noqa: E731
    head = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def write(folder, nodes, texels):
    """The scenes, with a grid of so many nodes a side and an image of so many texels."""
    folder.mkdir()
    values = array.array("f", fog_values(16))  # repeated: its content does not matter where it is large
    write_fog(folder, n=nodes) if nodes <= 32 else (folder / "fog.vol").write_bytes(
        VOL.pack(b"VOL\x03", 1, nodes, nodes, nodes, 1, 0, 0, 0, 1, 1, 1) + (values * (nodes ** 3 // len(values))).tobytes())
    (folder / "checks.png").write_bytes(png(texels, texels))
    for name in SCENES:
        (folder / f"{name}.xml").write_text(scene_text(name))


def build(folder, *targets, jobs):
    """With jobs = 0 nothing is built: what lies there is taken."""
    if jobs > 0:
        subprocess.run(["cmake", "--build", folder, "-j", str(jobs), "--target", *targets], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    return folder / "bin" / "lightshaft"


def build_counting(jobs):
    folder = ROOT / "build" / "leave-out-counting"
    if jobs > 0:
        subprocess.run(["cmake", "--preset", "release", "-B", folder, "-DLIGHTSHAFT_TESTS=OFF", "-DLIGHTSHAFT_COUNT=ON"], cwd=ROOT, check=True,
                       stdout=subprocess.DEVNULL)
    return build(folder, "lightshaft", jobs=jobs)


def instructions(binary, scene, folder):
    """Per path."""
    size = f"{SIZE[0]}x{SIZE[1]}"
    command = ["valgrind", "--tool=callgrind", "--toggle-collect=ls::render::render_tile(*", f"--callgrind-out-file={folder}/callgrind.out",
               binary, "render", scene, "--threads", "1", "--size", size, "--spp", str(SPP), "-o", folder / "out.exr"]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr[-2000:]
    collected = int(re.search(r"Collected : (\d+)", run.stderr)[1])
    return collected / (SIZE[0] * SIZE[1] * SPP)


# By name: the flags of worker/render/base/features.h in their order, without those that are not set at the end.
ALL, ANY_PHASE, HEIGHT = (1, 1, 1, 1, 1, 1), (0, 0, 0, 1), (0, 0, 0, 1, 1)
INSTANTIATIONS = {"surfaces": (), "surfaces that light passes": (0, 0, 0, 0, 0, 1), "homogeneous grey media": (1, 0, 0, 0, 0, 1),
                  "homogeneous chromatic media": (1, 0, 1, 0, 0, 1), "grey grids": (1, 1, 0, 0, 0, 1), "chromatic grids": (1, 1, 1, 0, 0, 1),
                  "everything": ALL, "everything, any phase function": ALL + (0, 0, 0) + ANY_PHASE,
                  "grey fog that falls with height": (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1),
                  "everything, fog that falls with height": ALL + (0, 0, 0) + HEIGHT, "everything, and light in parts": ALL + (1, 1, 0) + HEIGHT,
                  "homogeneous grey media, aimed": (1, 0, 0, 0, 0, 1, 0, 0, 1), "grey grids, aimed": (1, 1, 0, 0, 0, 1, 0, 0, 1),
                  "everything, aimed": ALL + (0, 0, 1), "everything, aimed, any phase function": ALL + (0, 0, 1) + ANY_PHASE,
                  "grey fog that falls with height, aimed": (1, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1),
                  "everything, aimed, fog that falls with height": ALL + (0, 0, 1) + HEIGHT,
                  "everything, aimed, and light in parts": ALL + (1, 1, 1) + HEIGHT}


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
    paths = 4 * (told["size"][0] * 32 // longer) * (told["size"][1] * 32 // longer)  # as cli/commands/inspect_command.cpp has it
    costs = {}
    for function, cost in inclusive(out).items():
        if (m := re.search(r"sample_with<ls::render::Features\{([^}]*)\}", function)):
            flags = [int(flag == "true") for flag in m[1].split(", ")] if m[1] else []
            while flags and not flags[-1]:
                flags.pop()
            flags = tuple(flags)
            costs[flags] = costs.get(flags, 0) + cost / paths
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
        blobs -= scene.stat().st_size  # the file as it was written, which names what is not used, too
        return {"rss": rss, "libraries": sorted(set(re.findall(r"/(lib[\w+.-]+?)\.so", maps))), "stored": blobs,
                "cached": used(folder / "cache"), "peak": report["peak_rss_bytes"], "pixels": report["pixels_sha256"]}


def with_unused(scene, folder):
    big = folder / "unused.vol"
    n = 298  # cubed, times four bytes: 100 MiB and a little
    big.write_bytes(VOL.pack(b"VOL\x03", 1, n, n, n, 1, 0, 0, 0, 1, 1, 1) + os.urandom(4096) + bytes(4 * n ** 3 - 4096))
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


def compute(binary, counting, scene, folder):
    return {"full": instructions(binary, scene, folder), "work": work(counting, scene), "variants": by_instantiation(binary, scene, folder)}


def measure(names, jobs, folder, bytes_alone):
    release = ROOT / "build" / "release"
    binary = build(release, "lightshaft", "lightshaft-coordinator", "lightshaft-worker", jobs=jobs)
    small, large = folder / "small", folder / "large"
    write(small, 32, 256)
    write(large, 128, 1024)
    counting = None if bytes_alone else build_counting(jobs)
    rows = {}
    for name in names:
        scene = large / f"{name}.xml"
        told = json.loads(subprocess.run([release / "bin" / "lightshaft", "inspect", scene, "--json"], check=True, capture_output=True, text=True).stdout)
        rows[name] = {"variant": told["variant"], "needed": sum(s["bytes"] for s in told["structures"]),
                      "farm": on_a_farm(scene, folder / f"farm-{name}"), "fat": on_a_farm(with_unused(scene, large), folder / f"farm-{name}-fat")}
        if not bytes_alone:
            rows[name] |= compute(binary, counting, small / f"{name}.xml", folder)
    return rows


def faults(rows):
    """What is not as it should be."""
    for name, r in rows.items():
        if "work" in r:
            (own, price), *others = r["variants"]
            yield from (f"{name}: {own} takes {percent(price, n)} of the instructions of {v}" for v, n in others if price > n * (1 + LIMIT))
            yield from (f"{name}: {n} of {key}, which it does not need" for key, n in r["work"].items() if n and key not in WORKS[name])
        if any(r["farm"][key] != r["fat"][key] for key in ("stored", "cached", "pixels")):
            yield f"{name}: unused files change what is stored, fetched or rendered"


def percent(n, of):
    return f"{100 * (n / of - 1):+.2f} %"


def computed(rows):
    out = ["## Instructions per path", "", f"Images of {SIZE[0]} x {SIZE[1]} pixels with {SPP} samples, one thread.", "",
           "Callgrind, within `render_tile`, by the instantiation that the scene is rendered with.", "",
           "| scene | instantiation | instructions |", "|---|---|---|",
           *(f"| {name} | {r['variant']} | {r['full']:.0f} |" for name, r in rows.items()), ""]
    out += ["### By instantiation", "",
            "The same bits at another price, in a small image (`lightshaft inspect SCENE --variants`, which names the prices itself where the machine has a "
            "counter of instructions; here again callgrind): the first is the one that the scene is rendered with. What it saves over the general one is "
            "what the parts that it leaves out would cost. *everything, and light in parts* is the price of AOVs of light, for those who ask for them.", ""]
    for name, r in rows.items():
        cheapest = r["variants"][0][1]
        out.append(f"- {name}: " + "; ".join(f"{v} {n:.0f}" + ("" if n == cheapest else f" ({percent(n, cheapest)})") for v, n in r["variants"]) + ".")
    return out + [""] + worked({name: r["work"] for name, r in rows.items()})


def worked(works):
    return ["## Work that is not done", "",
            "Counted in a build with `-DLIGHTSHAFT_COUNT=ON` (`lightshaft inspect SCENE --work`), in a small image; the script fails where a counter of "
            "what a scene does not need is not 0.", "", "| work | " + " | ".join(works) + " |", "|---|" + "---|" * len(works),
            *(f"| {key.replace('_', ' ')} | " + " | ".join(str(work[key]) for work in works.values()) + " |" for key in next(iter(works.values()))), ""]


def page(rows, bytes_alone, bits):
    command = "bench/leave_out.py" + (" --bytes-alone" if bytes_alone else "")
    commit = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()
    out = ["# What a scene does not need is left out", "", f"Made by `{command}` of commit {commit} (release build, GCC 12, `-march=x86-64-v3`).", "", TAKEN_OUT]
    if bytes_alone:
        out += ["Without `--bytes-alone` it also compares instructions per path of all instantiations, and tabulates the counters of work.", ""]
    else:
        out += computed(rows)
    out += same_bits(bits) if bits else []
    out += ["## Bytes", "",
            "A job on a farm with one worker, with a grid of 128^3 nodes (8 MiB) and an image of 1024^2 texels (3 MiB): what the coordinator stores of it "
            "beside the scene's own text, what the worker fetched, what its render process keeps resident; and "
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
    options.add_argument("--out", type=pathlib.Path, default=ROOT / "build" / "leave-out.md", help="build/leave-out.md unless told otherwise")
    options.add_argument("--jobs", type=int, default=2)
    options.add_argument("--only", default=",".join(SCENES))
    options.add_argument("--bytes-alone", action="store_true")
    options.add_argument("--bits", nargs="+", type=pathlib.Path, default=[])
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="lightshaft-leave-out-") as folder:
        rows = measure(chosen.only.split(","), chosen.jobs, pathlib.Path(folder), chosen.bytes_alone)
    chosen.out.write_text(page(rows, chosen.bytes_alone, chosen.bits))
    found = list(faults(rows))
    print("\n".join(found), file=sys.stderr)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
