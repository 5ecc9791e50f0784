#!/usr/bin/env python3
"""Prints the bill of materials (CycloneDX 1.6, JSON) of a release's artefacts.

    deploy/sbom.py FOLDER --build build/release --version 0.3.0 --commit SHA --time SECONDS > lightshaft-0.3.0.cdx.json

FOLDER has the Debian packages, the wheel, the add-on and the source archive. What a program is made of is read from the program
and from the build that made it, not from a list: the shared libraries that the loader finds for it, and the headers that its
objects were compiled with (Ninja's log). Of both dpkg says which Debian package they come from, in which version, and the
package's copyright file under which licences. Equal artefacts on one machine give equal bytes: `--time` (seconds since 1970) is
the commit's, and the serial number is made of what is listed.
"""

import argparse
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import tomllib
import urllib.parse
import uuid
import zipfile

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Debian's short names of licences that are called otherwise in SPDX's list. A name that is in neither is given as a name.
SPDX = {
    "apache-2.0": "Apache-2.0", "artistic": "Artistic-1.0", "boost-1.0": "BSL-1.0", "bsl-1.0": "BSL-1.0", "bsl-1": "BSL-1.0",
    "bsd-2-clause": "BSD-2-Clause", "bsd-3-clause": "BSD-3-Clause", "bsd-4-clause": "BSD-4-Clause", "cc0-1.0": "CC0-1.0",
    "curl": "curl", "expat": "MIT", "isc": "ISC", "mit": "MIT", "libpng": "Libpng", "mpl-2.0": "MPL-2.0", "openldap-2.8": "OLDAP-2.8",
    "openssl": "OpenSSL", "zlib": "Zlib", "gpl-1+": "GPL-1.0-or-later", "gpl-2": "GPL-2.0-only", "gpl-2+": "GPL-2.0-or-later",
    "gpl-3": "GPL-3.0-only", "gpl-3+": "GPL-3.0-or-later", "lgpl-2": "LGPL-2.0-only", "lgpl-2+": "LGPL-2.0-or-later",
    "lgpl-2.0+": "LGPL-2.0-or-later", "lgpl-2.1": "LGPL-2.1-only", "lgpl-2.1+": "LGPL-2.1-or-later", "lgpl-3": "LGPL-3.0-only",
    "lgpl-3+": "LGPL-3.0-or-later", "agpl-3": "AGPL-3.0-only", "gfdl-1.3+": "GFDL-1.3-or-later",
}
# Licences of what the wheel requires: the Python Package Index tells them to people, not in one form to programs.
PYTHON = {"httpx": "BSD-3-Clause", "numpy": "BSD-3-Clause", "openexr": "BSD-3-Clause", "ipython": "BSD-3-Clause",
          "usd-core": "TOST-1.0", "pillow": "MIT-CMU", "mapbox-earcut": "ISC", "pyoidn": "Apache-2.0"}  # fmt: skip
NAMED_ONLY = {"TOST-1.0"}  # not in the SPDX list that the format's version 1.6 knows


def output(*words, **options):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True, **options).stdout


def digest(path):
    return [{"alg": "SHA-256", "content": hashlib.sha256(path.read_bytes()).hexdigest()}]


def licence(name):
    known = name in SPDX.values() or (name in PYTHON.values() and name not in NAMED_ONLY)
    return {"license": {"id": name} if known else {"name": name}}


def debian_licences(package):
    """Of a package's copyright file in Debian's machine-readable form, but of its packaging; empty if it is in another form."""
    copyright = pathlib.Path(f"/usr/share/doc/{package}/copyright")
    text = copyright.read_text(errors="replace") if copyright.exists() else ""
    if not text.lstrip().lower().startswith("format:"):
        return []
    names = set()
    for paragraph in re.split(r"\n\s*\n", text):
        fields = dict(re.findall(r"^(Files|License):[ \t]*(.*)", paragraph, re.M))
        if "License" in fields and fields.get("Files", "debian/").split()[:1] != ["debian/*"] and "Files" in fields:
            names.update(re.split(r",? (?:and|or|and/or) |, ", fields["License"].strip()))
    return [licence(name) for name in sorted({SPDX.get(name.lower(), name) for name in names if name})]


class Packages:
    """Debian packages by the files that they own."""

    def __init__(self):
        self.used = {}  # name -> (component, how it is used)

    def of_files(self, paths, use):
        """The references of the packages that own these files, which are noted as used."""
        return {self.note(owner, use) for owner in self.owners(paths)}

    def owners(self, paths):
        """The names of the packages that own these files."""
        paths = sorted({str(path) for path in paths})
        # A file of /lib is /usr/lib's where the two are one folder, and dpkg knows it by the name that its package gives.
        names = paths + [path.removeprefix("/usr") for path in paths if path.startswith("/usr/lib")]
        said = subprocess.run(["dpkg-query", "-S", *names], capture_output=True, text=True).stdout
        owners, found = set(), set()
        for line in said.splitlines():
            packages, file = line.rsplit(": ", 1)
            if not packages.startswith("diversion "):
                owners.update(name.split(":")[0] for name in packages.split(", "))
                found.update((file, "/usr" + file))
        lost = [path for path in paths if path not in found]
        if lost:
            sys.exit(f"error: no Debian package owns {', '.join(lost[:5])}: the bill of materials would lack it")
        return owners

    def note(self, package, use):
        if package not in self.used:
            fields = "${Version}\n${Architecture}\n${source:Package}\n${binary:Summary}\n"
            version, architecture, source, summary = output("dpkg-query", "-W", "-f", fields, package).splitlines()[:4]
            reference = f"pkg:deb/debian/{urllib.parse.quote(package)}@{urllib.parse.quote(version)}?arch={architecture}&distro=debian-12"
            component = {"type": "library", "bom-ref": reference, "name": package, "version": version, "description": summary, "purl": reference}
            if found := debian_licences(package):
                component["licenses"] = found
            component["properties"] = [{"name": "lightshaft:source-package", "value": source}]
            self.used[package] = (component, set())
        component, uses = self.used[package]
        uses.add(use)
        return component["bom-ref"]

    def components(self):
        for _, (component, uses) in sorted(self.used.items()):
            component["properties"] += [{"name": "lightshaft:used-as", "value": use} for use in sorted(uses)]
            yield component


def shared_libraries(program):
    """The files that the loader maps for it."""
    found = re.findall(r"^\s*(?:\S+ => )?(/\S+) \(0x", output("ldd", program), re.M)
    if "not found" in output("ldd", program):
        sys.exit(f"error: the loader does not find all libraries of {program}")
    return [pathlib.Path(path).resolve() for path in found]


def headers(build, program):
    """The system's headers that the program's objects were compiled with."""
    inputs = output("ninja", "-C", build, "-t", "inputs", program).splitlines()
    objects = [line for line in inputs if line.endswith(".o")]
    if not objects:
        sys.exit(f"error: {build} has no log of what {program} was built from")
    listed = output("ninja", "-C", build, "-t", "deps", *objects)
    return {line.strip() for line in listed.splitlines() if line.startswith("    /usr/")}


def archives(build):
    """The system's archives of which the programs have parts (cmake/libm.cmake)."""
    return [pathlib.Path(output("g++", "-print-file-name=libm.a").strip()).resolve()] if (build / "libls_m.a").exists() else []


def debian_package(path, build, packages):
    """(component of a .deb, what it depends on)."""
    name, version, architecture = output("dpkg-deb", "-f", path, "Package", "Version", "Architecture").splitlines()
    name, version, architecture = (field.split(": ", 1)[1] for field in (name, version, architecture))
    reference = f"pkg:deb/{name}@{urllib.parse.quote(version)}?arch={architecture}"
    needs, programs = set(), []
    with tempfile.TemporaryDirectory() as folder:
        output("dpkg-deb", "-x", path, folder)
        for file in sorted(pathlib.Path(folder).rglob("*")):
            if file.is_symlink() or not file.is_file() or file.read_bytes()[:4] != b"\x7fELF":
                continue
            needs |= packages.of_files(shared_libraries(file), "shared library")
            needs |= packages.of_files(headers(build, file.name), "headers, compiled in")
            needs |= packages.of_files(archives(build), "mathematical functions, linked in")
            inside = f"/{file.relative_to(folder)}"
            programs.append({"type": "file", "bom-ref": f"{reference}#{inside.lstrip('/')}", "name": inside, "hashes": digest(file)})
    component = {"type": "application", "bom-ref": reference, "name": name, "version": version, "purl": reference, "hashes": digest(path),
                 "licenses": [licence("Apache-2.0")], "components": programs}  # fmt: skip
    return component, needs


def wheel(path, version):
    """(component of the wheel, components of what it requires)."""
    project = tomllib.loads((ROOT / "python/pyproject.toml").read_text())["project"]
    required = [(text, "required") for text in project["dependencies"]]
    required += [(text, "optional") for extra in project["optional-dependencies"].values() for text in extra]
    components = []
    for text, scope in required:
        name, versions = re.fullmatch(r"([A-Za-z0-9._-]+)(.*)", text).groups()
        reference = f"pkg:pypi/{name.lower()}"
        components.append({"type": "library", "bom-ref": reference, "name": name, "scope": scope, "purl": reference,
                           "licenses": [licence(PYTHON[name.lower()])],
                           "properties": [{"name": "lightshaft:versions", "value": versions}]})  # fmt: skip
    reference = f"pkg:pypi/lightshaft@{version}" + (f"?file_name={path.name}" if is_bundled(path) else "")
    own = {"type": "library", "bom-ref": reference, "name": "lightshaft (Python)", "version": version, "purl": reference,
           "hashes": digest(path), "licenses": [licence("Apache-2.0")]}  # fmt: skip
    return own, components


def is_bundled(path):
    """Of deploy/wheel.sh: with programs and libraries."""
    return not path.name.endswith("-any.whl")


def bundled_packages(path, packages):
    """The references of the Debian packages of which a wheel brings libraries or compiled headers, from its licences."""
    with zipfile.ZipFile(path) as archive:
        names = {name.split("/licenses/")[1].split("/")[0] for name in archive.namelist() if name.endswith("/copyright")}
    return {packages.note(name, "in the wheel") for name in sorted(names)}


def denoiser():
    version = re.search(r'^version="(.*)"$', (ROOT / "deploy/install-denoiser.sh").read_text(), re.M)[1]
    reference = f"pkg:pypi/pyoidn@{version}"
    return {"type": "library", "bom-ref": reference, "name": "Open Image Denoise", "version": version, "scope": "optional", "purl": reference,
            "description": "loaded where it is installed (deploy/install-denoiser.sh); in no artefact",
            "licenses": [licence("Apache-2.0")]}  # fmt: skip


def bill(folder, build, version, commit, seconds):
    packages = Packages()
    artefacts, others, needs = [], [denoiser()], {}
    for path in sorted(folder.iterdir()):
        if path.suffix == ".deb":
            component, depends = debian_package(path, build, packages)
            if component["name"] in ("lightshaft", "lightshaft-coordinator"):
                depends = depends | {others[0]["bom-ref"]}
        elif path.suffix == ".whl":
            component, required = wheel(path, version)
            others += [each for each in required if each not in others]
            depends = {each["bom-ref"] for each in required}
            if is_bundled(path):
                depends |= bundled_packages(path, packages)
        elif path.name.endswith((".zip", ".tar.gz")):
            component = {"type": "file", "bom-ref": f"file:{path.name}", "name": path.name, "version": version, "hashes": digest(path),
                         "licenses": [licence("Apache-2.0")]}  # fmt: skip
            depends = set()
        else:
            continue
        artefacts.append(component)
        needs[component["bom-ref"]] = sorted(depends)
    root = {"type": "application", "bom-ref": f"lightshaft@{version}", "name": "lightshaft", "version": version,
            "licenses": [licence("Apache-2.0")], "properties": [{"name": "lightshaft:commit", "value": commit}]}  # fmt: skip
    return document(root, artefacts, [*packages.components(), *others], needs, seconds)


def wheel_bill(names, packages, version, seconds):
    """The bill of materials that a wheel of deploy/wheel.sh brings: `names` are the Debian packages in it."""
    needs = sorted(packages.note(name, "in the wheel") for name in names)
    reference = f"pkg:pypi/lightshaft@{version}"
    own = {"type": "application", "bom-ref": f"{reference}#programs", "name": "lightshaft", "version": version, "licenses": [licence("Apache-2.0")]}
    root = {"type": "application", "bom-ref": reference, "name": "lightshaft", "version": version, "licenses": [licence("Apache-2.0")]}
    return document(root, [own], list(packages.components()), {own["bom-ref"]: needs}, seconds)


def document(root, parts, others, needs, seconds):
    """`parts` of the root, whose `needs` are among the `others`."""
    components = [*parts, *others]
    listed = json.dumps([root, components], sort_keys=True).encode()
    edges = {root["bom-ref"]: [each["bom-ref"] for each in parts], **needs}
    return {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json", "bomFormat": "CycloneDX", "specVersion": "1.6",
        "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, hashlib.sha256(listed).hexdigest())}", "version": 1,
        "metadata": {"timestamp": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds)), "component": root},
        "components": components,
        "dependencies": [{"ref": ref, "dependsOn": on} for ref, on in edges.items()],
    }  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description="Prints the bill of materials of a release's artefacts.")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--build", type=pathlib.Path, required=True)
    parser.add_argument("--version", required=True)
    parser.add_argument("--commit", required=True)
    parser.add_argument("--time", type=int, required=True)
    given = parser.parse_args()
    print(json.dumps(bill(given.folder, given.build, given.version, given.commit, given.time), indent=1))


if __name__ == "__main__":
    main()
