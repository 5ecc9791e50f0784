#!/usr/bin/env bash
# Writes docs/reference/dependencies.md: what deploy/packages.txt installs, in the versions of this machine.
#   deploy/install-deps.sh --tests && deploy/dependencies.sh > docs/reference/dependencies.md
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"

cat <<'HEAD'
# Dependencies

All of them are packages of Debian 12; there is nothing else, no bundled copy and no download; Open Image Denoise is optional, and `deploy/install-denoiser.sh` fetches it. A coordinator that is to make videos needs the package `ffmpeg` besides, which it runs as a program of its own. The [Python package](../guide/python.md) takes httpx (BSD-3-Clause), NumPy (BSD-3-Clause), OpenEXR (BSD-3-Clause), for notebooks IPython (BSD-3-Clause), and for [USD](../guide/usd.md) usd-core (TOST-1.0), Pillow (MIT-CMU) and mapbox-earcut (ISC) from the Python Package Index; its tests also openapi-python-client (MIT) and openapi-spec-validator (Apache-2.0), those of a release cyclonedx-python-lib (Apache-2.0). Made by `deploy/dependencies.sh` on a machine with
the versions below; security fixes to them come with `apt-get upgrade` and, where a library is linked statically or headers are all
of it (nlohmann-json, CLI11, Boost, expected, stb, spdlog), with a new build.
HEAD
section=""
while read -r line; do
  case "$line" in
    "" | "#"*) continue ;;
    "["*)
      section="${line//[\[\]]/}"
      printf '\n## %s\n\n| package | version | what it is |\n|---|---|---|\n' \
        "$([ "$section" = build ] && echo "To build and to run" || echo "For the tests besides")"
      continue ;;
  esac
  line="${line%% *}"
  dpkg-query -W -f='| `${Package}` | ${Version} | ${binary:Summary} |\n' "$line" 2>/dev/null ||
    { echo "error: $line is not installed: deploy/install-deps.sh --tests first" >&2; exit 1; }
done <"$here/packages.txt"
