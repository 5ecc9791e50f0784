"""Archives with names outside their folder, with wrong sizes and checksums, and archives that unpack to very many bytes."""

import bz2
import gzip
import io
import json
import lzma
import os
import struct
import tarfile
import warnings
import zipfile
import zlib

from attack_kit import Bystander, LocalFarm, TINY, UNLIMITED, ask, group, shown, still_serves

warnings.filterwarnings("ignore", message="Duplicate name")  # twins are meant
SOON = 20  # seconds; the largest bomb unpacks to 200 times its size before it is refused
ZIP, TAR, GZIP = "application/zip", "application/x-tar", "application/gzip"
SCENE = TINY.encode()
OUTSIDE = ["../evil", "a/../../evil", "/evil", "//evil", "\\evil", "..\\evil", "C:\\evil", "c:/evil", "C:evil", "a/./../..//evil", "./../evil", "a\nb", "", ".", "..", "/", "a" * 5000, "/".join(["d"] * 2000)]
ODD = ["evil\0.xml", "~/evil", "CON", "a:stream", "%2e%2e/evil", "\u202eevil", "．．/evil", "..\u2215evil", "a.xml/b", "scene.xml/", "-rf", "$(id)", "`id`", "a;b", "file:///evil"]
# The archives that SECURITY.md promises to refuse. Others may be accepted: their files are stored under their SHA-256, not under their names.
REFUSED = ("outside", "symbolic link", "hard link", "device", "block device", "FIFO", "the scene is a link", "a link in a zip", "512 MB", "a bomb", "GNU sparse of", "it says 4 GB", "a wrong checksum", "encrypted")


def zip_of(entries, method=zipfile.ZIP_DEFLATED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, data in entries:
            info = zipfile.ZipInfo("x")
            info.filename = name
            info.compress_type = method
            archive.writestr(info, data)
    return out.getvalue()


def tar_of(members, form=tarfile.GNU_FORMAT):
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w", format=form) as archive:
        for info, data in members:
            archive.addfile(info, io.BytesIO(data))
    return out.getvalue()


def member(name, data=b"", **more):
    info = tarfile.TarInfo(name)
    info.size = len(data)
    for key, value in more.items():
        setattr(info, key, value)
    return info, data


def sparse(size):
    """The old header of GNU for a file of so many bytes, of which the last 512 are there."""
    head = bytearray(tarfile.TarInfo("bomb").tobuf(tarfile.GNU_FORMAT))
    head[124:136] = b"%011o\0" % 512
    head[156:157] = tarfile.GNUTYPE_SPARSE
    head[386:410] = b"\x80" + (size - 512).to_bytes(11, "big") + b"%011o\0" % 512
    head[483:495] = b"\x80" + size.to_bytes(11, "big")
    head[148:156] = b" " * 8
    head[148:156] = b"%06o\0 " % sum(head)
    return bytes(head) + b"x" * 512


def patched_zip(data, signature, offset, form, value):
    at = data.index(signature) + offset
    return data[:at] + struct.pack(form, value) + data[at + struct.calcsize(form):]


def archives():
    good = [("scene.xml", SCENE)]
    yield "zip as it should be", zip_of(good), ZIP
    yield "tar as it should be", tar_of([member("scene.xml", SCENE)]), TAR
    for kind, names in (("outside", OUTSIDE), ("odd", ODD)):
        for name in names:
            yield f"{kind}: zip with {name[:30]!r}", zip_of([*good, (name, b"x")]), ZIP
            if "\0" not in name and name:
                yield f"{kind}: tar with {name[:30]!r}", tar_of([member("scene.xml", SCENE), member(name, b"x")]), TAR
    yield "twins", zip_of([*good, ("a", b"1"), ("a", b"2")]), ZIP
    yield "twins by case", zip_of([*good, ("a", b"1"), ("A", b"2")]), ZIP
    yield "twins by Unicode", zip_of([*good, ("é", b"1"), ("é", b"2")]), ZIP
    yield "twins by a dot", zip_of([*good, ("a", b"1"), ("./a", b"2")]), ZIP
    yield "a file that is a folder", zip_of([*good, ("a", b"1"), ("a/b", b"2")]), ZIP
    for label, kind in (("symbolic link", tarfile.SYMTYPE), ("hard link", tarfile.LNKTYPE), ("device", tarfile.CHRTYPE), ("block device", tarfile.BLKTYPE), ("FIFO", tarfile.FIFOTYPE), ("contiguous", tarfile.CONTTYPE), ("of no kind", b"Z")):
        for target in ("/etc/passwd", "scene.xml", "../../token"):
            yield f"{label} to {target}", tar_of([member("scene.xml", SCENE), member("a", type=kind, linkname=target, devmajor=1, devminor=5)]), TAR
    yield "the scene is a link", tar_of([member("scene.xml", type=tarfile.SYMTYPE, linkname="/etc/passwd")]), TAR
    link = zipfile.ZipInfo("a")
    link.external_attr = 0o120777 << 16
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("scene.xml", SCENE)
        archive.writestr(link, "/etc/passwd")
    yield "a link in a zip", out.getvalue(), ZIP
    yield "pax: another size", tar_of([member("scene.xml", SCENE, pax_headers={"size": "99999999999999"})], tarfile.PAX_FORMAT), TAR
    yield "pax: another path", tar_of([member("scene.xml", SCENE, pax_headers={"path": "../../evil"})], tarfile.PAX_FORMAT), TAR
    yield "pax: a link", tar_of([member("scene.xml", SCENE, pax_headers={"linkpath": "/etc/passwd"})], tarfile.PAX_FORMAT), TAR
    yield "pax: a length that lies", tar_of([member("scene.xml", SCENE, pax_headers={"a": "b"})], tarfile.PAX_FORMAT).replace(b"7 a=b", b"9 a=b"), TAR
    yield "pax: sparse", tar_of([member("scene.xml", SCENE, pax_headers={"GNU.sparse.major": "1", "GNU.sparse.minor": "0", "GNU.sparse.realsize": "9" * 18})], tarfile.PAX_FORMAT), TAR
    yield "GNU sparse", tar_of([member("scene.xml", SCENE), member("a", b"x" * 512, type=tarfile.GNUTYPE_SPARSE)]), TAR
    yield "GNU sparse of a terabyte", tar_of([member("scene.xml", SCENE)])[:512 + len(SCENE) + -len(SCENE) % 512] + sparse(10 ** 12) + bytes(1024), TAR
    yield "a size below zero", tar_of([member("scene.xml", SCENE)]).replace(b"0" * 7 + oct(len(SCENE))[2:].encode(), b"-1\0\0\0\0\0\0\0\0\0"[:7 + len(oct(len(SCENE))[2:])]), TAR
    packed = zip_of([*good, ("bomb", bytes(512 << 20))])
    yield "512 MB of zeros", packed, ZIP
    yield "512 MB of zeros in a tar", gzip.compress(tar_of([member("scene.xml", SCENE), member("bomb", bytes(512 << 20))]), 1), GZIP
    yield "a bomb within a gzip of a gzip", gzip.compress(gzip.compress(bytes(64 << 20))), GZIP
    yield "endless gzip members", gzip.compress(tar_of([member("scene.xml", SCENE)])) + gzip.compress(b"") * 100_000, GZIP
    inner = zip_of([("a", bytes(1 << 20))])
    yield "zips within zips", zip_of([*good, *[(f"{i}.zip", inner) for i in range(1000)]]), ZIP
    small = zip_of([*good, ("a", b"x" * 100)])
    yield "it says 4 GB", patched_zip(small, b"PK\1\2", 24, "<I", 2 ** 32 - 2), ZIP
    yield "it says 0 bytes", patched_zip(small, b"PK\1\2", 24, "<I", 0), ZIP
    yield "packed bytes beyond its end", patched_zip(small, b"PK\1\2", 20, "<I", 2 ** 31), ZIP
    yield "an entry beyond its end", patched_zip(small, b"PK\1\2", 42, "<I", 2 ** 31), ZIP
    yield "two entries at one place", patched_zip(small, b"PK\1\2", 42, "<I", 0), ZIP
    yield "another name in its head", small.replace(b"scene.xml", b"../ev.xml", 1), ZIP
    yield "a wrong checksum", patched_zip(small, b"PK\1\2", 16, "<I", 1), ZIP
    yield "encrypted", patched_zip(patched_zip(small, b"PK\1\2", 8, "<H", 1), b"PK\3\4", 6, "<H", 1), ZIP
    yield "an unknown method", patched_zip(patched_zip(small, b"PK\1\2", 10, "<H", 99), b"PK\3\4", 8, "<H", 99), ZIP
    yield "65,535 entries announced", patched_zip(small, b"PK\5\6", 10, "<H", 65535), ZIP
    yield "a directory beyond its end", patched_zip(small, b"PK\5\6", 16, "<I", 2 ** 32 - 1), ZIP
    yield "several parts", patched_zip(small, b"PK\5\6", 4, "<H", 5), ZIP
    yield "bzip2 within", zip_of(good, zipfile.ZIP_BZIP2), ZIP
    yield "LZMA within", zip_of(good, zipfile.ZIP_LZMA), ZIP
    yield "bzip2 as gzip", bz2.compress(SCENE), GZIP
    yield "xz as gzip", lzma.compress(SCENE), GZIP
    yield "zlib as gzip", zlib.compress(SCENE), GZIP
    yield "50,000 files", zip_of([*good, *[(f"f{i}", b"") for i in range(50_000)]]), ZIP
    overlapping = zip_of([*good, ("a", os.urandom(1 << 20))], zipfile.ZIP_STORED)
    for cut in (0, 4, 30, 100, len(overlapping) // 2, len(overlapping) - 10):
        yield f"cut at {cut}", overlapping[:cut], ZIP
    for kind in (ZIP, TAR, GZIP):
        yield f"random bytes as {kind}", os.urandom(100_000), kind
        yield f"zeros as {kind}", bytes(100_000), kind
    for job in ("{", "[]", "null", '{"scene": "../../etc/passwd"}', '{"scene": 1}', '{"scene": "none.xml"}', '{"priority": 1}', '{"scene":"scene.xml","scene":"/etc/passwd"}', "[" * 100_000, '{"spp": 1e400}', '{"mix": "' + "a" * 5_000_000 + '"}', "\xff"):
        yield f"job.json {job[:30]!r}", zip_of([*good, ("job.json", job.encode("latin-1"))]), ZIP


@group("Archives", quick=True)
def hostile_archives(record, folder):
    with LocalFarm(folder, flags=UNLIMITED) as farm:
        token, bob = farm.token_of("mallory"), Bystander(farm)
        before = {p for p in folder.rglob("*")}
        record.row = "names outside, links, devices, lies, bombs, twins, garbage, odd job.json"
        with bob.watching():
            for label, data, kind in archives():
                with record.expecting(label):
                    answer = ask(farm, "POST", "/api/v1/jobs?spp=2", token, data, kind, patience=120)
                    right = (201,) if "as it should be" in label else (400, 413) if label.startswith(REFUSED) else (201, 400, 403, 413, 415, 422)
                    record.attempt(label, answer.status in right and answer.seconds < SOON and b"root:x:" not in answer.body, shown(answer))
                    if answer.status == 201:
                        ask(farm, "DELETE", f"/api/v1/jobs/{json.loads(answer.body)['id']}", token)
        record.row = "nothing is written under a name of an archive, and nothing outside"
        after = {p for p in folder.rglob("*")} - before
        record.attempt("names of new files", not [p for p in after if "evil" in p.name or p.name in ("bomb", "a", "A", "CON")], sorted(after)[:5])
        record.attempt("links of new files", not [p for p in after if p.is_symlink()], "")
        record.row = "another user meanwhile: no request refused, none longer than a second"
        record.attempt("beside all of them", bob.served(), f"{bob.told()} {bob.refused[:2]}")
        record.row = "afterwards"
        still_serves(record, farm, bob.token)
