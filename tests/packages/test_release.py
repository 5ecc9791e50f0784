"""deploy/release.sh: the same artefacts from the same build, a bill of materials that lacks nothing of what programs are made of,
and signatures that only what was signed passes."""

import json
import pathlib
import re
import shutil
import subprocess

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

ROOT = pathlib.Path(__file__).resolve().parents[2]


def release(*words, code=0):
    done = subprocess.run([ROOT / "deploy/release.sh", *map(str, words)], capture_output=True, text=True)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def make_key(folder, name):
    """(secret key, public key)."""
    secret, public = folder / f"{name}.key", folder / f"{name}.pub"
    subprocess.run(["minisign", "-G", "-W", "-s", secret, "-p", public], check=True, capture_output=True)
    return secret, public


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    return make_key(tmp_path_factory.mktemp("keys"), "release")


@pytest.fixture(scope="module")
def artefacts(tmp_path_factory, keys):
    folder = tmp_path_factory.mktemp("artefacts")
    release("--key", keys[0], "--out", folder, "--draft", "--prebuilt")
    return folder


@pytest.fixture
def copy(artefacts, tmp_path):
    return pathlib.Path(shutil.copytree(artefacts, tmp_path / "copy"))


@pytest.fixture(scope="module")
def bill(artefacts):
    return json.loads(next(artefacts.glob("*.cdx.json")).read_text())


@pytest.fixture(scope="module")
def programs(artefacts, tmp_path_factory):
    """The programs of all Debian packages."""
    folder = tmp_path_factory.mktemp("unpacked")
    for deb in artefacts.glob("*.deb"):
        subprocess.run(["dpkg-deb", "-x", deb, folder], check=True)
    found = [file for file in folder.rglob("*") if not file.is_symlink() and file.is_file() and file.read_bytes()[:4] == b"\x7fELF"]
    assert {"lightshaft", "lightshaft-coordinator", "lightshaft-worker", "lightshaft-vdb", "lightshaft-denoise", "lightshaft-exr", "lightshaft-scene", "lightshaft-validate"} == {f.name for f in found}
    return found


def test_two_runs_make_the_same_bytes(artefacts, keys, tmp_path):
    release("--key", keys[0], "--out", tmp_path, "--draft", "--prebuilt")

    names = sorted(file.name for file in artefacts.iterdir())
    assert names == sorted(file.name for file in tmp_path.iterdir())
    assert {re.sub(r"[_-]?\d+\.\d+\.\d+(-1_amd64)?|manylinux_\d+_\d+_", "", name) for name in names} == {
        "SHA256SUMS", "SHA256SUMS.minisig", "lightshaft.deb", "lightshaft-coordinator.deb", "lightshaft-worker.deb", "lightshaft-vdb.deb",
        "lightshaft-blender.zip", "lightshaft-py3-none-any.whl", "lightshaft-py3-none-x86_64.whl", "lightshaft.tar.gz", "lightshaft.cdx.json"}  # fmt: skip
    assert [name for name in names if (artefacts / name).read_bytes() != (tmp_path / name).read_bytes()] == []


def test_what_was_signed_passes(artefacts, keys):
    assert "signed and unchanged: 9 files, lightshaft " in release("--verify", artefacts, "--public-key", keys[1])


def test_a_changed_file_is_named(copy, keys):
    deb = next(copy.glob("lightshaft-worker_*.deb"))
    deb.write_bytes(deb.read_bytes()[:-1] + b"x")
    assert f"{deb.name}: FAILED" in release("--verify", copy, "--public-key", keys[1], code=1)


def test_a_file_that_nobody_signed_is_named(copy, keys):
    (copy / "lightshaft-extra.deb").write_bytes(b"")
    assert "nobody signed lightshaft-extra.deb" in release("--verify", copy, "--public-key", keys[1], code=1)


def test_sums_that_were_changed_too_are_not_signed(copy, keys):
    deb = next(copy.glob("lightshaft-worker_*.deb"))
    deb.write_bytes(b"")
    sums = subprocess.run(["sha256sum", *(f.name for f in copy.iterdir() if not f.name.startswith("SHA"))], cwd=copy, check=True,
                          capture_output=True, text=True).stdout  # fmt: skip
    (copy / "SHA256SUMS").write_text(sums)
    assert "SHA256SUMS is not signed by the key" in release("--verify", copy, "--public-key", keys[1], code=1)


def test_another_key_verifies_nothing(artefacts, tmp_path):
    assert "SHA256SUMS is not signed by the key" in release("--verify", artefacts, "--public-key", make_key(tmp_path, "other")[1], code=1)


def test_a_key_in_the_repository_and_a_commit_without_its_tag_are_refused(keys, tmp_path):
    inside = ROOT / "build/inside.key"
    try:
        shutil.copy(keys[0], inside)
        assert "lies in the repository" in release("--key", inside, "--draft", "--prebuilt", code=1)
    finally:
        inside.unlink()
    # A commit with its tag has a release of its own, in an empty clone that is built from nothing: not asked here.
    clone = tmp_path / "clone"
    subprocess.run(["git", "clone", "-q", "--no-tags", "--depth", "1", f"file://{ROOT}", clone], check=True)
    shutil.copy(ROOT / "deploy/release.sh", clone / "deploy/release.sh")
    done = subprocess.run([clone / "deploy/release.sh", "--key", keys[0], "--out", tmp_path / "out"], capture_output=True, text=True)
    assert done.returncode == 1
    assert "no commit (git status)" in done.stderr or "not the one with the tag" in done.stderr


def test_the_bill_of_materials_is_valid(bill):
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(json.dumps(bill)) is None
    names = {each["bom-ref"] for each in [bill["metadata"]["component"], *bill["components"]]}
    assert len(names) == len(bill["components"]) + 1
    for edge in bill["dependencies"]:
        assert {edge["ref"], *edge["dependsOn"]} <= names


def test_the_bill_names_every_library_that_the_loader_maps(bill, programs):
    used = {each["name"]: each for each in bill["components"]}
    for program in programs:
        for path in re.findall(r"(/\S+) \(0x", subprocess.run(["ldd", program], check=True, capture_output=True, text=True).stdout):
            path = pathlib.Path(path).resolve()
            said = subprocess.run(["dpkg-query", "-S", path, str(path).removeprefix("/usr")], capture_output=True, text=True).stdout
            package = said.split(":")[0]
            assert package in used, f"{program.name} maps {path}"
            version = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", package], check=True, capture_output=True, text=True).stdout
            assert used[package]["version"] == version


def test_the_bill_names_what_the_packages_depend_on_and_what_is_compiled_in(bill, artefacts):
    used = {each["name"] for each in bill["components"]}
    debian = [each["name"] for each in bill["components"] if each.get("purl", "").startswith("pkg:deb/debian/")]
    provided = subprocess.run(["dpkg-query", "-W", "-f", "${Provides}, ", *debian], check=True, capture_output=True, text=True).stdout
    provided = {part.split()[0] for part in provided.split(",") if part.strip()}  # libspdlog1.10-fmt9 is a name of libspdlog1.10
    for deb in artefacts.glob("*.deb"):
        depends = subprocess.run(["dpkg-deb", "-f", deb, "Depends"], check=True, capture_output=True, text=True).stdout
        libraries = {part.split()[0] for part in depends.split(",")} - {"adduser", "ca-certificates"}
        assert libraries - provided <= used, deb.name
    assert {"nlohmann-json3-dev", "libboost1.81-dev", "libcli11-dev", "libexpected-dev"} <= used, "headers are all of them"
    assert "libgtest-dev" not in used
    # Each library says its licences where Debian's file about them can be read by a program; GCC's cannot.
    bare = {each["name"] for each in bill["components"] if "licenses" not in each}
    for package in bare:
        assert not pathlib.Path(f"/usr/share/doc/{package}/copyright").read_text(errors="replace").lower().startswith("format:")


def test_the_bill_names_what_the_wheel_requires_and_hashes_every_artefact(bill, artefacts):
    by_name = {each["name"]: each for each in bill["components"]}
    assert {"httpx", "numpy", "OpenEXR"} <= {name for name, each in by_name.items() if each.get("scope") == "required"}
    assert {"ipython", "usd-core", "pillow", "mapbox-earcut"} <= {name for name, each in by_name.items() if each.get("scope") == "optional"}
    hashes = {each["hashes"][0]["content"] for each in bill["components"] if "hashes" in each}
    sums = dict(reversed(line.split()) for line in (artefacts / "SHA256SUMS").read_text().splitlines())
    assert hashes == {value for name, value in sums.items() if not name.endswith(".cdx.json")}
