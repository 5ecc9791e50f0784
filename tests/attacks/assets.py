"""Meshes, textures and grids with wrong sizes and contents, on a worker that renders: each job fails with an error message or is rendered, and
the worker goes on."""

import gzip
import json
import struct
import zlib

from archives import zip_of
from attack_kit import LocalFarm, TINY, UNLIMITED, ask, group, shown, submit
from local_farm import wait_until
from test_odd_assets import exr

MEMORY = 2 << 30  # of the worker's renderer, bytes
SOON = 120  # seconds in which such a job is over; none takes longer than its file could be rendered in


def ply(count="3", faces="1", form="ascii", vertices=b"0 0 0\n1 0 0\n0 1 0\n", listed=b"3 0 1 2\n", kind="uchar int"):
    return (f"ply\nformat {form} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\nelement face {faces}\nproperty list {kind} vertex_indices\nend_header\n").encode() + vertices + listed


def png(width=4, height=4, depth=8, kind=2, rows=None, packed=None, more=b""):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    data = zlib.compress(rows if rows is not None else b"".join(b"\0" + bytes(12) for _ in range(4))) if packed is None else packed
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width % 2 ** 32, height % 2 ** 32, depth, kind, 0, 0, 0)) + more + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def vol(nx=2, ny=2, nz=2, channels=1, kind=1, version=3, data=None, box=(-1, -1, -1, 1, 1, 1)):
    return b"VOL" + struct.pack("<Biiiii6f", version, kind, nx, ny, nz, channels, *box) + (struct.pack("<8f", *[1] * 8) if data is None else data)


def hdr(width=4, height=4, rows=b"\x80\x80\x80\x80" * 16):
    return f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode() + rows


def serialized(version=4, flags=0x1000, vertices=3, faces=1, offsets=(0,), count=1, name=b"\0", data=None):
    body = struct.pack("<I", flags) + name + struct.pack("<QQ", vertices, faces) + (struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0) + struct.pack("<3I", 0, 1, 2) if data is None else data)
    return struct.pack("<HH", 0x041C, version) + zlib.compress(body) + struct.pack(f"<{len(offsets)}Q", *offsets) + struct.pack("<I", count)


def with_mesh(kind, name):
    return TINY.replace("</scene>", f'<shape type="{kind}"><string name="filename" value="{name}"/></shape></scene>')


def with_texture(name):
    return TINY.replace('<bsdf type="diffuse"/>', f'<bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="{name}"/></texture></bsdf>')


def with_grid(name):
    return TINY.replace("</scene>", f'<shape type="cube"><bsdf type="null"/><medium type="heterogeneous" name="interior"><volume type="gridvolume" name="sigma_t"><string name="filename" value="{name}"/></volume><float name="albedo" value="0.5"/></medium></shape></scene>')


def files():
    """(label, scene, name of the file, its bytes, whether it must be rendered)"""
    def mesh(label, data, kind="ply", good=False):
        return f"{kind}: {label}", with_mesh(kind, f"a.{kind}"), f"a.{kind}", data, good

    def texture(label, data, end="png", good=False):
        return f"{end}: {label}", with_texture(f"a.{end}"), f"a.{end}", data, good

    def grid(label, data, end="vol", good=False):
        return f"{end}: {label}", with_grid(f"a.{end}"), f"a.{end}", data, good

    little, big = "binary_little_endian", "binary_big_endian"
    triangle = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    yield mesh("as it should be", ply(), good=True)
    for count in (2 ** 31, 2 ** 32, 2 ** 60, 2 ** 63, 2 ** 64, -1, "1e9", "nan", ""):
        yield mesh(f"{count} vertices", ply(count=count))
        yield mesh(f"{count} faces", ply(faces=count))
        yield mesh(f"{count} vertices in binary", ply(count=count, form=little, vertices=triangle, listed=b"\3" + struct.pack("<3i", 0, 1, 2)))
    for length in (-1, 2 ** 31 - 1, 4_000_000_000):
        yield mesh(f"a list of {length}", ply(form=little, vertices=triangle, listed=struct.pack("<I", length % 2 ** 32) + struct.pack("<3i", 0, 1, 2), kind="uint int"))
    for index in (-1, 3, 2 ** 31 - 1):
        yield mesh(f"corner {index}", ply(listed=f"3 0 1 {index}\n".encode()))
    yield mesh("NaN", ply(vertices=b"nan 0 0\n1 inf 0\n0 1 -inf\n"))
    yield mesh("1e38", ply(vertices=b"1e38 0 0\n-1e38 1e38 0\n0 1e38 1e38\n"))
    yield mesh("a head that does not end", b"ply\nformat ascii 1.0\n" + b"comment a\n" * 500_000)
    yield mesh("100,000 properties", b"ply\nformat ascii 1.0\nelement vertex 1\n" + b"".join(b"property float p%d\n" % i for i in range(100_000)) + b"end_header\n")
    yield mesh("big-endian, cut", ply(form=big, vertices=triangle[:10], listed=b""))
    yield mesh("empty", b"")
    yield mesh("as it should be", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "obj", True)
    for face in ("f 1 2 4", "f 0 1 2", "f -9 1 2", "f 99999999999999999999 1 2", "f 1/9/9 2/9/9 3/9/9", "f " + "1 " * 1_000_000, "f"):
        yield mesh(face[:20], b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + face.encode() + b"\n", "obj")
    yield mesh("a line of 20 MB", b"v " + b"1" * 20_000_000 + b"\n", "obj")
    yield mesh("as it should be", serialized(), "serialized", True)
    for label, data in (("2^60 vertices", serialized(vertices=2 ** 60)), ("2^63 faces", serialized(faces=2 ** 63)), ("a bomb of 1 GB", serialized(vertices=2 ** 26, data=bytes(1 << 30))), ("offset beyond", serialized(offsets=(2 ** 63,))),
                        ("2^32 - 1 meshes", serialized(count=2 ** 32 - 1)), ("a name without end", serialized(name=b"n" * 1_000_000)), ("doubles", serialized(flags=0x2000)), ("version 9", serialized(version=9)), ("only its end", struct.pack("<I", 1))):
        yield mesh(label, data, "serialized")
    yield texture("as it should be", png(), good=True)
    for width, height in ((0, 4), (2 ** 31 - 1, 2 ** 31 - 1), (2 ** 32 - 1, 1), (65536, 65536), (1, 2 ** 31 - 1)):
        yield texture(f"{width} x {height}", png(width, height))
    yield texture("a bomb of 1 GB", png(20_000, 17_000, rows=bytes(17_000 * 60_001)))
    yield texture("depth 3", png(depth=3))
    yield texture("colours of kind 7", png(kind=7))
    yield texture("a palette that is missing", png(kind=3))
    yield texture("text of 200 MB", png(more=struct.pack(">I", 2 ** 31 - 1) + b"zTXt"))
    yield texture("cut", png()[:50])
    yield texture("broken packing", png(packed=b"\xff" * 100))
    yield texture("as it should be", exr(4, 4, {"R": .5, "G": .5, "B": .5}), "exr", True)
    good = exr(4, 4, {"R": .5, "G": .5, "B": .5})
    for label, window in (("2^31 wide", (0, 0, 2 ** 31 - 2, 3)), ("a window upside down", (3, 3, 0, 0)), ("a window far away", (2 ** 31 - 5, 0, 2 ** 31 - 2, 3)), ("100,000 square", (0, 0, 99_999, 99_999))):
        yield texture(label, good.replace(struct.pack("<4i", 0, 0, 3, 3), struct.pack("<4i", *window), 1), "exr")
    yield texture("a table of offsets that leads away", good.replace(struct.pack("<Q", len(good) - 4 * 56), struct.pack("<Q", 2 ** 63)), "exr")
    yield texture("cut", good[:-30], "exr")
    yield texture("NaN", exr(4, 4, {"R": float("nan"), "G": float("inf"), "B": -1}), "exr")
    yield texture("packed by gzip, 300 MB of zeros", gzip.compress(bytes(300 << 20), 9), "exr")
    yield texture("as it should be", hdr(), "hdr", True)
    for width, height in ((0, 0), (2 ** 31 - 1, 2 ** 31 - 1), (-4, 4), ("9" * 50, 4)):
        yield texture(f"{width} x {height}", hdr(width, height), "hdr")
    yield texture("runs beyond the line", hdr(100, 1, b"\2\2\0\x64" + b"\xff\1" * 10), "hdr")
    yield grid("as it should be", vol(), good=True)
    for size in ((2 ** 31 - 1,) * 3, (-1, 2, 2), (0, 0, 0), (2 ** 20, 2 ** 20, 2), (1290, 1290, 1290)):
        yield grid(f"{size}", vol(*size))
    for label, data in (("a billion channels", vol(channels=10 ** 9)), ("kind 99", vol(kind=99)), ("version 9", vol(version=9)), ("a box of NaN", vol(box=(float("nan"),) * 6)), ("a box turned inside out", vol(box=(1, 1, 1, -1, -1, -1))), ("densities below zero", vol(data=struct.pack("<8f", *[-1] * 8))),
                        ("densities without bound", vol(data=struct.pack("<8f", *[3e38] * 8))), ("NaN", vol(data=struct.pack("<8f", *[float("nan")] * 8))), ("cut", vol()[:50])):
        yield grid(label, data)
    for label, data in (("zeros", bytes(10_000)), ("its head alone", b" BDV\0\0\0\0" + struct.pack("<III", 224, 10, 0) + b"\1" + b"0" * 36), ("its head and 2^32 - 1 grids", b" BDV\0\0\0\0" + struct.pack("<III", 224, 10, 0) + b"\0" + b"0" * 36 + struct.pack("<I", 0) + struct.pack("<I", 2 ** 32 - 1)),
                        ("its head and 2^31 of metadata", b" BDV\0\0\0\0" + struct.pack("<III", 224, 10, 0) + b"\0" + b"0" * 36 + struct.pack("<II", 2 ** 31, 2 ** 31))):
        yield grid(label, data, "vdb")
    for label, data in (("zeros", bytes(10_000)), ("its head alone", struct.pack("<QIHH", 0x304244566F6E614E, 0, 1, 0)), ("its head and 2^64 bytes", struct.pack("<QIHHQQQ", 0x304244566F6E614E, 0, 1, 0, 2 ** 64 - 1, 2 ** 64 - 1, 0) + bytes(1000))):
        yield grid(label, data, "nvdb")
    texture_tree = '<texture type="checkerboard" id="t0"/>' + "".join(f'<texture type="checkerboard" id="t{i}"><ref id="t{i - 1}" name="color0"/><ref id="t{i - 1}" name="color1"/></texture>' for i in range(1, 60))
    yield "textures that double 60 times", TINY.replace("<shape", texture_tree + "<shape", 1).replace('<bsdf type="diffuse"/>', '<bsdf type="diffuse"><ref id="t59" name="reflectance"/></bsdf>'), "unused.txt", b"", True
    ids = "".join(f'<shape type="sphere" id="{i:05d}{"n" * 195}"><transform name="to_world"><translate x="{i}"/></transform></shape>' for i in range(20_000))
    yield "20,000 names of 200 bytes for a matte", TINY.replace("</scene>", ids + "</scene>"), "unused.txt", b"", True
    yield "a name of 60 KB", TINY.replace('<shape type="sphere"', '<shape type="sphere" id="' + "n" * 60_000 + '"', 1), "unused.txt", b"", False


def over(farm, token, job):
    return (view := json.loads(ask(farm, "GET", f"/api/v1/jobs/{job}", token).body))["state"] in ("done", "failed", "cancelled") and view


@group("Hostile files on a worker that renders")
def assets(record, folder):

    with LocalFarm(folder, flags=UNLIMITED) as farm:
        worker = farm.add_worker("--memory-limit", MEMORY, "--build-limit", 60, fake=False)
        farm.wait_for_workers(1)
        record.row = "PLY, OBJ, serialized, PNG, EXR, HDR, VOL, VDB, NanoVDB: sizes up to 2^64, indices, bombs, NaN, cut files; doubling textures, endless names"
        expected = farm.pixels(submit(farm, farm.token, TINY, spp=2))
        for n, (label, scene, name, data, good) in enumerate(files()):
            with record.expecting(label):
                user = farm.token_of(f"user-{n}")  # failures of one user's jobs must not slow down the next try
                matte = "&aov=crypto_object" if "matte" in label else ""
                answer = ask(farm, "POST", f"/api/v1/jobs?spp=2{matte}", user, zip_of([("scene.xml", scene.encode()), (name, data)]), "application/zip", patience=180)
                if answer.status != 201:
                    record.attempt(label, 400 <= answer.status < 500 and not good, shown(answer))
                    continue
                job = json.loads(answer.body)["id"]
                try:
                    view = wait_until(lambda: over(farm, user, job), f"{label} is over", SOON)
                except AssertionError as error:
                    ask(farm, "DELETE", f"/api/v1/jobs/{job}", farm.token)
                    record.attempt(label, False, f"{error}: {json.loads(ask(farm, 'GET', f'/api/v1/jobs/{job}', user).body)}")
                    continue
                right = view["state"] == "done" if good else view["state"] == "done" or view["state"] == "failed" and len(view["error"]) > 20
                record.attempt(label, right and worker.alive(), f"{view['state']}: {view['error']}")
        record.row = "afterwards"
        record.attempt("the worker is the one that it was", worker.alive() and [w["state"] for w in farm.get("/api/v1/workers")["workers"]] == ["connected"], farm.get("/api/v1/workers"))
        record.attempt("it renders the pixels that it rendered before", farm.pixels(submit(farm, farm.token, TINY, spp=2)) == expected, "")
