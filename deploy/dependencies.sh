#!/usr/bin/env bash
# Writes docs/reference/dependencies.md: what deploy/packages.txt installs, in the versions of this machine.
#   deploy/install-deps.sh --tests && deploy/dependencies.sh > docs/reference/dependencies.md
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"

cat <<'HEAD'
# Dependencies

All of them are packages of Debian 12; there is nothing else, no bundled copy in the repository and no download; Open Image Denoise is optional, and `deploy/install-denoiser.sh` fetches it. The [wheel](../guide/add-a-machine.md#the-wheel) brings those of the shared libraries that the programs load. A coordinator that is to make videos needs the package `ffmpeg` besides, which it runs as a program of its own. The [Python package](../guide/python.md) takes httpx (BSD-3-Clause), NumPy (BSD-3-Clause), OpenEXR (BSD-3-Clause), for notebooks IPython (BSD-3-Clause), and for [USD](../guide/usd.md) usd-core (TOST-1.0), Pillow (MIT-CMU) and mapbox-earcut (ISC), for denoising beside the wheel pyoidn (Apache-2.0), from the Python Package Index; its tests also openapi-python-client (MIT) and openapi-spec-validator (Apache-2.0), those of a release cyclonedx-python-lib (Apache-2.0). Made by `deploy/dependencies.sh` on a machine with
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

cat <<'TAIL'
## Known faults of gRPC 1.51

Debian 12's gRPC is 1.51.1, without fixes of its own for these; Debian 13 and Ubuntu 24.04 have 1.51.1 as well. What each means for the workers' port, and what stops it ([decision 43](../decisions/0043-connections-of-workers.md)); `tests/system/test_workers_port.py` tries the first two on a running coordinator.

| fault | what it is | here |
|---|---|---|
| CVE-2023-4785 | after "too many open files" gRPC's listener accepts nothing any more (1.23 to before the fixes of 2023) | its listener is not used: the coordinator accepts connections itself, with and without TLS |
| CVE-2023-33953 | headers of any length are read and kept, in a time that grows as the square of their length | before a hello a connection may send 64 KB, few at a time 320 KB, and 16 KB ahead of what is read; an address that sends more is refused for 30 s. With `--tls` a certificate is needed first. A worker with the join token can still do it |
| CVE-2023-44487 (rapid reset) | calls that are begun and cancelled at once | a connection without a hello is closed at its 17th open call and after 64 KB; what a worker with the join token may do is not limited |
| CVE-2023-1428 | some headers together with more than 8 KB of others end the process | tried with many sets of headers against 1.51.1, without effect |
| CVE-2023-32731 | a peer's header table gets out of step | came with a change of February 2023 ([#32309](https://github.com/grpc/grpc/pull/32309)), which 1.51.1 does not have |
| CVE-2023-32732, CVE-2024-7246 | a client makes a proxy's connection to the server fail, or its header table wrong, for other clients of the proxy | workers connect without a proxy that reads HTTP/2; do not put one before the port that strangers reach |

## Known faults of other libraries

Debian mends faults of these packages within Debian 12 ([security tracker](https://security-tracker.debian.org/tracker/)), so `apt upgrade` comes first. What would remain reaches this far. The faults are examples; advisories were not searched library by library.

| library | where faults are to be expected | where strangers' bytes reach it, and what stops them |
|---|---|---|
| OpenEXR, Imath | damaged files; overflow in deep scanlines (CVE-2023-5841, up to 3.1.11) | images of scenes: a worker's render child, in its sandbox. References of users: `lightshaft-exr`, likewise. Results of workers are read by code of the coordinator's own, for one uncompressed form. Deep images are written, never read |
| libpng, libjpeg | damaged files | images of scenes: a worker's render child, in its sandbox |
| OpenVDB, Blosc | damaged files | `lightshaft-vdb`, a process of its own below the render child, in the same sandbox |
| libarchive | readers of rare formats, such as RAR (CVE-2025-5914) | bundles of users, in the coordinator: only ZIP and tar with gzip are switched on, with limits on entries and bytes; fuzzed |
| hiredis | replies with too many elements (CVE-2021-32765) | replies of the farm's own Redis alone |
| OpenColorIO | look-up tables | configurations of the operator alone |
| Embree, oneTBB | meshes with wrong indices or numbers | meshes are checked before they are handed over |
| libxml2 | documents and schemas | not called: it comes along with libarchive, whose XAR reader is off |
TAIL
