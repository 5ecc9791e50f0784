"""deploy/wheel.sh: a wheel that installs without a network, needs nothing of this machine but its C and C++ runtime, renders the
pixels of the build that it is made of, and brings the licences of what it bundles."""

import json
import os
import re
import subprocess
import sys
import zipfile

import pytest
from local_farm import ROOT, bin_dir
from test_up import SCENE, check_a_farm_of_two_machines, leaves_nothing  # noqa: F401

pytestmark = [pytest.mark.slow, pytest.mark.skipif(bin_dir() != ROOT / "build" / "release" / "bin", reason="wheels are made of the release build")]
# Every manylinux system has these libraries, the C and C++ runtime; the wheel brings all others.
SYSTEM = re.compile(r"linux-vdso\.so|ld-linux-x86-64\.so|lib(c|m|dl|rt|pthread|resolv|stdc\+\+|gcc_s)\.so")

# Libraries that the programs need and Python does not, which runs with those of this machine.
NOT_OF_PYTHON = ("libopenvdb", "libembree", "libgrpc", "libabsl", "libprotobuf", "libfmt", "libtbb", "libImath", "libblosc", "libboost")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run([ROOT / "deploy/wheel.sh", "--prebuilt", "--out", folder], check=True, capture_output=True)
    return next(folder.iterdir())


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The folder bin of an environment that has the wheel and nothing else."""
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run(["/usr/bin/python3", "-m", "venv", folder], check=True, capture_output=True)
    subprocess.run([folder / "bin/pip", "install", "--no-index", "--no-deps", wheel], check=True, capture_output=True)
    return folder / "bin"


def programs(installed):
    return next(installed.parent.glob("lib/*/site-packages")) / "lightshaft_command/programs/bin"


def pixels(program, scene, folder):
    done = subprocess.run([program, "render", scene, "-o", folder / "image.exr"], check=True, capture_output=True, text=True)
    return re.search(r"pixels_sha256 (\w+)", done.stdout + done.stderr)[1]


def test_it_says_what_it_runs_on(wheel):
    assert re.fullmatch(r"lightshaft-[\d.]+-py3-none-manylinux_2_36_x86_64\.whl", wheel.name)
    assert wheel.stat().st_size < 100e6, "the Python Package Index takes no larger one"


def test_it_needs_no_newer_symbols_than_the_systems_of_its_name_have(installed):
    sys.path.insert(0, str(ROOT / "deploy"))
    import wheel as maker

    files = [file for file in programs(installed).rglob("*") if file.is_file()]
    needed = subprocess.run(["readelf", "-V", "-W", *files], check=True, capture_output=True, text=True).stdout
    # glibc 2.36 and GCC 12, as Debian 12 has them
    assert (2, 36) >= maker.newest(needed, "GLIBC") > (2, 17)
    assert (3, 4, 30) >= maker.newest(needed, "GLIBCXX") > (3, 4)
    assert (1, 3, 13) >= maker.newest(needed, "CXXABI") > (1, 3)
    assert maker.newest("Name: GLIBCXX_3.4.9  Name: GLIBCXX_3.4.32 Name: CXXABI_FLOAT128", "GLIBCXX") == (3, 4, 32)
    assert maker.newest("none", "GLIBCXX") == ()


def test_programs_find_all_libraries_in_the_wheel(installed):
    for program in [file for file in programs(installed).iterdir() if file.is_file()]:
        listed = subprocess.run(["ldd", program], check=True, capture_output=True, text=True, env={**os.environ, "LD_LIBRARY_PATH": "/lib/x86_64-linux-gnu"}).stdout
        outside = [line for line in listed.splitlines() if str(programs(installed)) not in line and not SYSTEM.search(line)]
        assert outside == [], program


def test_licences_and_bill_of_materials_cover_every_library(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        bill = json.loads(archive.read(next(name for name in names if name.endswith(".cdx.json"))))
        notice = archive.read(next(name for name in names if name.endswith("licenses/NOTICE"))).decode()
    licensed = {name.split("/licenses/")[1].split("/")[0] for name in names if name.endswith("/copyright")}
    listed = {component["name"] for component in bill["components"] if component["bom-ref"].startswith("pkg:deb/")}
    files = [os.path.realpath(f"/lib/x86_64-linux-gnu/{name.rsplit('/', 1)[1]}") for name in names if "lightshaft-libraries/" in name]
    # dpkg knows a file by the name that its package gives: with or without /usr.
    said = subprocess.run(["dpkg-query", "-S", *files, *[file.removeprefix("/usr") for file in files]], capture_output=True, text=True).stdout
    owners = {line.split(":")[0] for line in said.splitlines()}

    assert len(owners) > 20
    assert owners <= licensed == listed
    sources = {each["value"] for component in bill["components"] for each in component.get("properties", []) if each["name"] == "lightshaft:source-package"}
    assert sources and sources == set(re.findall(r"^(\S+) [0-9]\S*$", notice, re.M))


@pytest.fixture(scope="module")
def bath(tmp_path_factory):
    """A scene with a volume, which a program of its own reads, with libraries of its own."""
    folder = tmp_path_factory.mktemp("bath")
    subprocess.run(["/usr/bin/python3", ROOT / "scenes/bath/make_bath.py", folder, "--setting", "sketch"], check=True, capture_output=True)
    return folder / "bath.xml"


def test_it_renders_the_pixels_of_its_build(installed, bath, tmp_path):
    assert pixels(installed / "lightshaft", bath, tmp_path) == pixels(bin_dir() / "lightshaft", bath, tmp_path)


def test_its_commands_find_its_other_programs_and_its_python(installed, tmp_path):
    (tmp_path / "scene.xml").write_text(SCENE)
    nowhere = {"PATH": "/nonexistent", "HOME": str(tmp_path)}

    def lightshaft(*arguments, code=0):
        done = subprocess.run([installed / "lightshaft", *map(str, arguments)], env=nowhere, capture_output=True, text=True)
        assert done.returncode == code, done.stderr
        return done.stdout + done.stderr

    assert "--join-token FILE is needed" in lightshaft("farm", "up", "--on", "ssh", code=2)
    lightshaft("compare", tmp_path / "scene.xml", "--time", 60, "--spp", 4, "--seeds", 2, "--report", tmp_path / "out")
    assert (tmp_path / "out" / "index.html").exists()
    assert "cases passed" in lightshaft("validate", "--quick", "--case", "N01-no*/grid/volpath")


@pytest.mark.skipif(subprocess.run(["unshare", "-m", "true"], capture_output=True).returncode != 0,
                    reason="here nobody may hide this machine's libraries from a program")
def test_a_farm_of_two_machines_where_its_libraries_are_not_installed(installed, bath, tmp_path, leaves_nothing):  # noqa: F811
    names = [file.name for file in (programs(installed) / "lightshaft-libraries").iterdir() if file.name.startswith(NOT_OF_PYTHON)]
    hidden = [f"/usr/lib/x86_64-linux-gnu/{name}" for name in names]
    program = tmp_path / "lightshaft"
    program.write_text(f"""#!/bin/sh
exec unshare -m sh -c 'for file in {" ".join(hidden)}; do mount --bind /dev/null $file; done; exec env PATH=/nonexistent {installed}/lightshaft "$@"' sh "$@"
""")
    program.chmod(0o755)

    check_a_farm_of_two_machines(tmp_path, program=program, scene=bath)
