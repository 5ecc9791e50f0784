#!/usr/bin/env bash
# Builds the Debian packages, installs them in a container of debian:bookworm-slim that has no compiler, runs coordinator and
# worker as their units say, and compares the pixels of a job of theirs with those of `lightshaft render`. Removes its container.
#   tests/packages/run.sh [--prebuilt] [--no-packages] [--network NET] [--base IMAGE]
# --prebuilt: of deploy/package.sh. --no-packages: take those of build/packages. The container installs what the packages
# depend on with apt-get, over Docker's network NET (default: bridge, or host where that does not reach Debian's archive).
# Exit codes: 0 all is so, 1 something is not, 77 it cannot be run here.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

build=1 package=() check=()
while [ $# -gt 0 ]; do
  case "$1" in
    --prebuilt) package+=("$1") ;;
    --no-packages) build=0 ;;
    --network | --base) check+=("$1" "$2"); shift ;;
    *) echo "usage: tests/packages/run.sh [--prebuilt] [--no-packages] [--network NET] [--base IMAGE]" >&2; exit 2 ;;
  esac
  shift
done

command -v docker >/dev/null || { echo "the packages are not tested here: there is no docker (apt-get install docker.io)" >&2; exit 77; }
docker info >/dev/null 2>&1 || { echo "the packages are not tested here: Docker's engine does not answer (docker info says why)" >&2; exit 77; }

[ "$build" = 0 ] || deploy/package.sh "${package[@]}"
exec /usr/bin/python3 -B tests/packages/check.py "${check[@]}"
