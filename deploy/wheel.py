"""Makes Lightshaft's wheel of programs that are built: deploy/wheel.sh calls it.

    wheel.py FOLDER PROGRAM...

Each program of build/release/bin is stripped and told (RPATH, which holds for the libraries of its libraries, too) to look for
them in the folder beside it, whatever the environment says: other libraries could render other pixels. Libraries are those that
the loader maps here, as Debian has them, all but those of the system's C and C++ runtime, of which the mathematical functions
are in the programs (cmake/libm.sh). The licences of their packages and a bill of materials (CycloneDX) travel with them.
"""

import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import sbom

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = ROOT / "build" / "release"
# Every system has these, newer ones than the build's serve it as well, and two copies of them in one process do not work.
SYSTEM = {"libc6", "libgcc-s1", "libstdc++6"}
LIBRARIES = "lightshaft-libraries"  # util/sandbox/sandbox.cpp knows this name
ENTRY_POINTS = """[console_scripts]
lightshaft = lightshaft_command.programs:lightshaft
lightshaft-coordinator = lightshaft_command.programs:coordinator
lightshaft-worker = lightshaft_command.programs:worker
"""


def run(*words, **options):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True, **options).stdout


def commit_seconds():
    """The time that the files of the wheel have: of the commit, so that equal inputs give equal bytes."""
    if "SOURCE_DATE_EPOCH" in os.environ:
        return os.environ["SOURCE_DATE_EPOCH"]
    asked = subprocess.run(["git", "-C", ROOT, "show", "-s", "--format=%ct", "HEAD"], capture_output=True, text=True)
    return asked.stdout.strip() or "315532800"  # 1980, the first year of zip files


def pure_wheel(work):
    """The wheel of python/, unpacked."""
    sources = work / "python"
    shutil.copytree(ROOT / "python", sources, ignore=shutil.ignore_patterns("__pycache__", "dist"))
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", work, cwd=sources)
    run(sys.executable, "-m", "wheel", "unpack", "-d", work / "unpacked", next(work.glob("*.whl")))
    return next((work / "unpacked").iterdir())


def needed_libraries(program):
    """(name by which it is asked for, file) of each shared library that the loader maps for it."""
    listed = run("ldd", program)
    if "not found" in listed:
        sys.exit(f"error: the loader does not find all libraries of {program}")
    return re.findall(r"^\s*(\S+) => (/\S+) \(0x", listed, re.M)


def add_programs(folder, programs, packages):
    """The Debian packages that travel."""
    libraries = folder / LIBRARIES
    libraries.mkdir(parents=True)
    travels = set()
    for program in programs:
        built = BUILD / "bin" / program
        run("strip", "-o", folder / program, built)
        for name, file in needed_libraries(built):
            real = pathlib.Path(file).resolve()
            owners = packages.owners([real])
            if owners & SYSTEM:
                continue
            travels |= owners
            if not (libraries / name).exists():
                shutil.copyfile(real, libraries / name)
                (libraries / name).chmod(0o755)
        travels |= packages.owners(sbom.headers(BUILD, program)) - SYSTEM
    travels |= packages.owners(sbom.archives(BUILD))
    run("patchelf", "--force-rpath", "--set-rpath", f"$ORIGIN/{LIBRARIES}", *[folder / program for program in programs])
    if "RUNPATH" in run("readelf", "-d", *libraries.iterdir()):
        sys.exit("error: a library has a path of its own (RUNPATH), so that its libraries would not be found where they are in the wheel")
    return travels


# The newest symbols that a system with glibc 2.36 is sure to have: its libstdc++ and libgcc are of GCC 12 or later.
MOST = {"GLIBCXX": (3, 4, 30), "CXXABI": (1, 3, 13), "GCC": (12, 0, 0)}


def newest(needed, prefix):
    """The highest version of symbols that begin so, of a listing by readelf; () if there is none."""
    return max((tuple(map(int, version.split("."))) for version in re.findall(rf"\b{prefix}_(\d+(?:\.\d+)+)\b", needed)), default=())


def glibc_of(folder):
    """The version of glibc that these files need, such as "2_36"."""
    needed = run("readelf", "-V", "-W", *[file for file in folder.rglob("*") if file.is_file()])
    for prefix, most in MOST.items():
        if newest(needed, prefix) > most:
            sys.exit(f"error: symbols of {prefix}_{'.'.join(map(str, newest(needed, prefix)))} are needed, which systems of the wheel's tag lack: build it on Debian 12")
    return "{}_{}".format(*newest(needed, "GLIBC")[:2])


def add_bath(folder):
    """The scene of the first picture. It takes a while to make, so it is kept until its sources change."""
    sources = sorted((ROOT / "scenes" / "bath").glob("*.py"))
    digest = hashlib.sha256(b"".join(file.read_bytes() for file in sources)).hexdigest()[:16]
    kept = ROOT / "build" / "wheel" / f"bath-{digest}"
    if not kept.exists():
        unfinished = kept.with_suffix(f".{os.getpid()}")
        run(sys.executable, "-B", ROOT / "scenes/bath/make_bath.py", unfinished)
        unfinished.replace(kept)
    shutil.copytree(kept, folder)


def add_licences(folder, travels):
    """The copyright file of each package, and the licences that these name instead of repeating them."""
    named = set()
    for package in sorted(travels):
        file = pathlib.Path("/usr/share/doc") / package / "copyright"
        (folder / package).mkdir(parents=True)
        shutil.copyfile(file, folder / package / "copyright")
        named.update(re.findall(r"/usr/share/common-licenses/([A-Za-z0-9.-]*[A-Za-z0-9])", file.read_text(errors="replace")))
    for name in sorted(named):
        whole = pathlib.Path("/usr/share/common-licenses") / name
        if whole.exists():
            shutil.copyfile(whole, folder / name)
    shutil.copyfile(ROOT / "LICENSE", folder / "LICENSE")
    # The LGPL and the MPL ask that whoever gets a library learns where its source is.
    listed = run("dpkg-query", "-W", "-f", "${source:Package} ${source:Version}\\n", *travels).splitlines()
    notice = [(ROOT / "NOTICE").read_text(), "The libraries in this wheel are those of Debian, unchanged. Debian's archive of all versions has their sources, by these names and versions of source packages:\n", *sorted(set(listed)), ""]
    (folder / "NOTICE").write_text("\n".join(notice))


def main():
    out, programs = pathlib.Path(sys.argv[1]).absolute(), sys.argv[2:]
    os.environ |= {"SOURCE_DATE_EPOCH": commit_seconds(), "LC_ALL": "C", "TZ": "UTC"}
    out.mkdir(parents=True, exist_ok=True)
    packages = sbom.Packages()
    with tempfile.TemporaryDirectory() as name:
        work = pathlib.Path(name)
        tree = pure_wheel(work)
        information = next(tree.glob("*.dist-info"))
        version = information.name.split("-")[1].removesuffix(".dist")
        package = tree / "lightshaft_command"
        travels = add_programs(package / "programs" / "bin", programs, packages)
        tag = f"py3-none-manylinux_{glibc_of(package / 'programs')}_x86_64"
        add_bath(package / "bath")
        add_licences(information / "licenses", travels)
        (information / "sboms").mkdir()
        bill = sbom.wheel_bill(travels, packages, version, int(os.environ["SOURCE_DATE_EPOCH"]))
        (information / "sboms" / "lightshaft.cdx.json").write_text(json.dumps(bill, indent=1))
        (information / "entry_points.txt").write_text(ENTRY_POINTS)
        (information / "WHEEL").write_text(f"Wheel-Version: 1.0\nGenerator: lightshaft deploy/wheel.py\nRoot-Is-Purelib: false\nTag: {tag}\n")
        installed = sum(file.stat().st_size for file in tree.rglob("*") if file.is_file())
        for folder, kind in ((package / "programs" / "bin" / LIBRARIES, "libraries"), (package / "programs" / "bin", "programs with them"), (package / "bath", "scene")):
            print(f"{kind}: {sum(file.stat().st_size for file in folder.rglob('*') if file.is_file()) / 1e6:.1f} MB")
        run(sys.executable, "-m", "wheel", "pack", "-d", out, tree)
    wheel = out / f"lightshaft-{version}-{tag}.whl"
    print(f"{wheel}: {wheel.stat().st_size / 1e6:.1f} MB, {installed / 1e6:.1f} MB when installed")


if __name__ == "__main__":
    main()
