#!/usr/bin/env bash
# Builds dist/lightshaft-VERSION-py3-none-manylinux_2_36_x86_64.whl: the programs with the shared libraries that they need, the
# Python package and the demo scene. It installs with pip, without compiler and privileges, where glibc is 2.36 or later: Debian
# 12 and 13, Ubuntu 24.04. The C library, libstdc++ and libgcc are those of the system, but for the mathematical functions, which
# travel in the programs. Nothing is downloaded.
#   deploy/wheel.sh [--prebuilt] [--out FOLDER]
# --prebuilt takes the programs of build/release/bin as they are.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

prebuilt=0 out=dist
while [ $# -gt 0 ]; do
  case "$1" in
    --prebuilt) prebuilt=1 ;;
    --out) [ $# -ge 2 ] || { echo "error: --out needs a folder" >&2; exit 2; }; out="$2"; shift ;;
    *) echo "usage: deploy/wheel.sh [--prebuilt] [--out FOLDER]" >&2; exit 2 ;;
  esac
  shift
done

programs=(lightshaft lightshaft-coordinator lightshaft-worker lightshaft-vdb lightshaft-denoise lightshaft-exr lightshaft-scene lightshaft-validate)
if [ "$prebuilt" = 0 ]; then
  deploy/install-deps.sh
  # A build folder that was configured with tests stays so.
  [ -f build/release/CMakeCache.txt ] || cmake --preset release -DLIGHTSHAFT_TESTS=OFF
  cmake --build --preset release --target "${programs[@]}"
fi
for program in patchelf strip; do
  command -v "$program" >/dev/null || { echo "error: $program is missing; deploy/install-deps.sh installs it" >&2; exit 1; }
done
for program in "${programs[@]}"; do
  [ -x "build/release/bin/$program" ] || { echo "error: there is no build/release/bin/$program: build the project first" >&2; exit 1; }
done
exec /usr/bin/python3 -B deploy/wheel.py "$out" "${programs[@]}"
