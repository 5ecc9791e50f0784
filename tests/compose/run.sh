#!/usr/bin/env bash
# The farm of deploy/docker-compose.yml, really run: builds the images, starts coordinator, Redis and three workers, checks how
# they are confined, and renders one job again and again while workers, coordinator and Redis are killed: each time the pixels
# must be those of `lightshaft render`. Removes everything it started. Needs Docker and docker-compose; no root.
#   tests/compose/run.sh [--prebuilt] [--no-images] [--network NET]      (of deploy/images.sh; --no-images: take those there are)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

images=1 arguments=()
for argument in "$@"; do
  if [ "$argument" = --no-images ]; then images=0; else arguments+=("$argument"); fi
done
[ "$images" = 0 ] || deploy/images.sh "${arguments[@]}"
exec /usr/bin/python3 -B tests/compose/check.py
