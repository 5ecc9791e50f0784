#!/usr/bin/env bash
# Builds the images lightshaft-coordinator, lightshaft-worker and lightshaft-redis.
#   deploy/images.sh [--prebuilt] [--tag TAG] [--base IMAGE] [--network NET]
# --prebuilt takes the programs of build/release/bin instead of compiling them in the image: for a machine that runs Debian 12
# itself. Tag `local`, base debian:bookworm-slim and the engine's usual network unless told otherwise.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

tag=local base=debian:bookworm-slim network=default binaries=compiled
while [ $# -gt 0 ]; do
  case "$1" in
    --prebuilt) binaries=prebuilt ;;
    --tag) tag="$2"; shift ;;
    --base) base="$2"; shift ;;
    --network) network="$2"; shift ;;
    *) echo "usage: deploy/images.sh [--prebuilt] [--tag TAG] [--base IMAGE] [--network NET]" >&2; exit 2 ;;
  esac
  shift
done

mkdir -p build/image
if [ "$binaries" = prebuilt ]; then
  bin="${LIGHTSHAFT_BIN:-build/release/bin}"
  for program in lightshaft lightshaft-coordinator lightshaft-worker lightshaft-vdb lightshaft-denoise lightshaft-exr lightshaft-scene lightshaft-validate; do
    [ -x "$bin/$program" ] || { echo "error: --prebuilt, but there is no $bin/$program: build the project first" >&2; exit 1; }
    strip -o "build/image/$program" "$bin/$program"
  done
fi
for target in coordinator worker redis; do
  DOCKER_BUILDKIT=1 docker build --network "$network" --file deploy/Dockerfile --target "$target" --tag "lightshaft-$target:$tag" \
    --build-arg "BASE=$base" --build-arg "BINARIES=$binaries" .
done
docker images --format '{{.Repository}}:{{.Tag}}  {{.Size}}' | grep "^lightshaft-.*:$tag "
