#!/usr/bin/env bash
# Installs Intel Open Image Denoise 2, the library behind `--denoise`, from the wheel `pyoidn` of the Python Package Index into
# FOLDER. The default, build/oidn, is where this build looks for it. Needs Python 3.10 or later with pip; no privileges.
#
# usage: deploy/install-denoiser.sh [FOLDER]
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
version="2.5.1.0"

[ "$#" -le 1 ] || { echo "usage: deploy/install-denoiser.sh [FOLDER]" >&2; exit 2; }
folder="${1:-$root/build/oidn}"
if [ -e "$folder/lib/libOpenImageDenoise.so.2" ]; then
  echo "Open Image Denoise is in $folder already"
  exit 0
fi
python="$(command -v python3 || true)"
[ -n "$python" ] || { echo "error: there is no python3 to download Open Image Denoise with" >&2; exit 1; }

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
if ! "$python" -m pip --version >/dev/null 2>&1; then
  "$python" -m venv "$work/venv" >/dev/null 2>&1 || {
    echo "error: python3 has neither pip nor venv; on Debian: apt-get install python3-pip" >&2
    exit 1
  }
  python="$work/venv/bin/python"
fi
"$python" -m pip download --quiet --disable-pip-version-check --no-deps --only-binary=:all: --dest "$work" "pyoidn==$version"

# Installs the parts of the wheel that denoise on processors, not the modules for graphics cards.
mkdir -p "$folder/lib"  # the libraries search for one another in ../lib
"$python" - "$work"/pyoidn-*.whl "$folder" <<'PY'
import pathlib
import re
import sys
import zipfile

wheel, folder = sys.argv[1], pathlib.Path(sys.argv[2])
wanted = re.compile(r"lib/(libOpenImageDenoise(_core|_device_cpu)?\.so(\.\d+)+|libtbb\.so(\.\d+)+)$")
licence = re.compile(r"\.dist-info/licenses/")
with zipfile.ZipFile(wheel) as archive:
    for name in archive.namelist():
        if wanted.search(name) or licence.search(name) and not name.endswith("/"):
            (folder / "lib" / pathlib.PurePosixPath(name).name).write_bytes(archive.read(name))
if not (folder / "lib" / "libOpenImageDenoise.so.2").exists():
    sys.exit(f"error: {wheel} does not hold libOpenImageDenoise.so.2")
PY
echo "Open Image Denoise $version is in $folder"
