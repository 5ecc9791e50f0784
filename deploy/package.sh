#!/usr/bin/env bash
# Builds the Debian packages lightshaft-coordinator, lightshaft-worker, lightshaft (the command line) and lightshaft-vdb (the
# reader of OpenVDB files, which the last two need) into build/packages.
#   deploy/package.sh [--prebuilt]
# --prebuilt takes the programs of build/release/bin as they are.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

prebuilt=0
for arg in "$@"; do
  case "$arg" in
    --prebuilt) prebuilt=1 ;;
    *) echo "usage: deploy/package.sh [--prebuilt]" >&2; exit 2 ;;
  esac
done

for program in dpkg-shlibdeps file; do
  command -v "$program" >/dev/null || { echo "error: $program is missing; deploy/install-deps.sh installs it" >&2; exit 1; }
done

programs=(lightshaft lightshaft-coordinator lightshaft-worker lightshaft-vdb lightshaft-denoise lightshaft-exr lightshaft-scene lightshaft-validate)
if [ "$prebuilt" = 0 ]; then
  # A build folder that was configured with tests stays so.
  [ -f build/release/CMakeCache.txt ] || cmake --preset release -DLIGHTSHAFT_TESTS=OFF
  cmake --build --preset release --target "${programs[@]}"
else
  for program in "${programs[@]}"; do
    [ -x "build/release/bin/$program" ] || { echo "error: --prebuilt, but there is no build/release/bin/$program: build the project first" >&2; exit 1; }
  done
fi
rm -rf build/packages
cpack --config build/release/CPackConfig.cmake -B build/packages
rm -rf build/packages/_CPack_Packages
ls -l build/packages
