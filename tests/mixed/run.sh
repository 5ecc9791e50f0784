#!/usr/bin/env bash
# A farm of machines that are not alike: builds the programs on Debian 13 and Ubuntu 24.04 and for 64-bit ARM, compares the
# pixels of all of them with those of this machine's build, and runs a farm of all of them and a coordinator of each. Writes
# its page of measurements with --write; arm64 alone has a page of its own.
#   tests/mixed/run.sh [--write] [SYSTEM...]
# SYSTEM: trixie, noble or arm64; all three where none is named.
# As root, on Debian 12 with Linux 6.7, with the packages mmdebstrap and qemu-user-static and 6 GB of disk in $LIGHTSHAFT_MIXED
# (build/mixed). This machine's programs must be there: $LIGHTSHAFT_BIN, or build/release/bin. JOBS: how many compilers at once.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
here=tests/mixed
mixed="${LIGHTSHAFT_MIXED:-$PWD/build/mixed}"

write=() systems=()
for argument; do
  case "$argument" in
    --write) write=(--write) ;;
    trixie | noble | arm64) systems+=("$argument") ;;
    *) echo "tests/mixed/run.sh: no such system: $argument; there are trixie, noble and arm64" >&2; exit 2 ;;
  esac
done
[ ${#systems[@]} -gt 0 ] || systems=(trixie noble arm64)

build() {  # NAME ROOT [OPTIONS OF CMAKE...]
  local name="$1" root="$2"
  shift 2
  "$here/roots.sh" "$mixed" "$root"
  mkdir -p "$mixed/build/$name"
  local inside=("$here/in_root.sh" "$mixed/$root" "$mixed/build/$name" env CCACHE_DIR=/build/ccache)
  "${inside[@]}" cmake --preset release -S /src -B /build -DLIGHTSHAFT_TESTS=OFF "$@" >"$mixed/$name.log"
  "${inside[@]}" cmake --build /build ${JOBS:+-j "$JOBS"} --target lightshaft lightshaft-worker lightshaft-coordinator lightshaft-vdb >>"$mixed/$name.log" ||
    { tail -n 40 "$mixed/$name.log" >&2; exit 1; }
}
for system in "${systems[@]}"; do
  case "$system" in
    trixie) build trixie-amd64 trixie-amd64 ;;
    noble) build noble-amd64 noble-amd64 ;;
    arm64)
      # The root for ARM stands beside: it is shown inside at /arm64, for what is linked.
      "$here/roots.sh" "$mixed" trixie-arm64
      mkdir -p "$mixed/trixie-amd64/arm64"
      LIGHTSHAFT_BESIDE="$mixed/trixie-arm64" build trixie-arm64 trixie-amd64 --toolchain /src/cmake/arm64.cmake -DCMAKE_SYSROOT=/arm64
      ;;
  esac
done
exec /usr/bin/python3 -B "$here/check.py" "$mixed" "${write[@]}" "${systems[@]}"
