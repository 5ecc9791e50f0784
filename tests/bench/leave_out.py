#!/usr/bin/env python3
"""What a scene does not need, measured: writes docs/leave-out.md.

usage: leave_out.py [--out FILE.md] [--jobs N] [--only NAME,...] [--bytes-alone]

For a vacuum, a homogeneous, a grid and a textured scene:
- instructions per path (callgrind, within render_tile, one thread) of the release build, against a build of the same sources
  without the parts that the scene does not use (cmake -DLIGHTSHAFT_WITHOUT=...);
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
       "equiangular", "light_trees", "lenses"]
GRID = re.compile(r'  <shape type="cube">.*?</shape>\n', re.S)
BOX = '<shape type="cube"><transform name="to_world"><scale value="0.6"/></transform><bsdf type="diffuse">{}</bsdf></shape>\n'
HOMOGENEOUS = """  <shape type="cube"><bsdf type="null"/><medium name="interior" type="homogeneous"><float name="sigma_t" value="1.5"/>
    <rgb name="albedo" value="0.9, 0.8, 0.6"/></medium></shape>
"""
TEXTURE = '<texture type="bitmap" name="reflectance"><string name="filename" value="checks.png"/></texture>'
LIT = FOG.replace('<emitter type="constant"><rgb name="radiance" value="0.1"/></emitter>', "").replace('<default name="density" value="2"/>', "")
SCENES = {  # text, the parts that it needs
    "vacuum": (GRID.sub(BOX.format(""), LIT), []),
    "homogeneous": (GRID.sub(HOMOGENEOUS + BOX.format("").replace("0.6", "0.3"), LIT), ["media", "boundaries", "equiangular"]),
    "grid": (FOG.replace("</scene>", BOX.format("").replace("0.6", "0.3") + "</scene>"), ["media", "grids", "boundaries"]),
    "textured": (GRID.sub(BOX.format(TEXTURE), LIT), ["textures"]),
}


def png(width, height):
    rows = b"".join(b"\0" + bytes(x for i in range(width) for x in ((i * 7 + j * 3) % 256, (i ^ j) % 256, j % 256)) for j in range(height))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))  # noqa: E731
    head = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def write(folder):
    write_fog(folder, n=32)
    (folder / "checks.png").write_bytes(png(256, 256))
    for name, (text, _) in SCENES.items():
        (folder / f"{name}.xml").write_text(text)


def build(name, *options, jobs):
    folder = ROOT / "build" / f"leave-out-{name}"
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


def compute(name, release, counting, jobs, scene, folder):
    without = [part for part in ALL if part not in SCENES[name][1]]
    bare = build(name, "-DLIGHTSHAFT_WITHOUT=" + ",".join(without), jobs=jobs)
    full, pixels = instructions(release, scene, folder)
    least, same = instructions(bare, scene, folder)
    assert pixels == same, f"{name}: the build without {without} gives another image"
    print(name, f"{full:.0f} instructions a path, {least:.0f} without: {100 * (full / least - 1):+.2f} %", flush=True)
    return {"full": full, "bare": least, "without": without, "work": work(counting, scene)}


def measure(names, jobs, folder, bytes_alone):
    write(folder)
    release = ROOT / "build" / "release" / "bin" / "lightshaft"
    counting = None if bytes_alone else build("counting", "-DLIGHTSHAFT_COUNT=ON", jobs=jobs)
    rows = {}
    for name in names:
        scene = folder / f"{name}.xml"
        told = json.loads(subprocess.run([release, "inspect", scene, "--json"], check=True, capture_output=True, text=True).stdout)
        rows[name] = {"variant": told["variant"], "needed": sum(s["bytes"] for s in told["structures"]),
                      "farm": on_a_farm(scene, folder / f"farm-{name}"), "fat": on_a_farm(with_unused(scene, folder), folder / f"farm-{name}-fat")}
        if not bytes_alone:
            rows[name] |= compute(name, release, counting, jobs, scene, folder)
    return rows


def computed(rows):
    out = ["## Instructions per path", "", f"Images of {SIZE[0]} x {SIZE[1]} pixels with {SPP} samples, one thread.", "",
           "Callgrind, within `render_tile`: what the presence of parts that the scene does not use costs it. *without*: the same sources "
           "with these parts compiled out (`cmake -DLIGHTSHAFT_WITHOUT=...`); both give the same pixels, bit for bit.", "",
           "| scene | instantiation | instructions | without the unused parts | difference |", "|---|---|---|---|---|"]
    for name, r in rows.items():
        out.append(f"| {name} | {r['variant']} | {r['full']:.0f} | {r['bare']:.0f} | {100 * (r['full'] / r['bare'] - 1):+.2f} % |")
    out += ["", "Compiled out were: " + "; ".join(f"for *{n}* {', '.join(r['without'])}" for n, r in rows.items()) + ".", "",
            "## Work that is not done", "", "Counted in a build with `-DLIGHTSHAFT_COUNT=ON` (`lightshaft inspect SCENE --work`), in a small image.", "",
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
    out += ["", "OpenVDB is mapped by none of them: only once a scene names a `.vdb` or `.nvdb` file (`tests/system/test_leave_out.py`).", ""]
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
