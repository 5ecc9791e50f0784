#!/usr/bin/env bash
# Upgrades farms of the last release (release.txt), which it builds the first time, to this build, with jobs under way. Part of
# tests/run.sh --upgrade.
#   tests/upgrade/run.sh [pytest's arguments]
# This build's programs must be there: $LIGHTSHAFT_BIN, or build/release/bin. Exit code 77: it cannot be run here.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

LIGHTSHAFT_OLD_BIN=$(tests/upgrade/build.sh)
export LIGHTSHAFT_OLD_BIN
exec /usr/bin/python3 -m pytest -q -ra -p no:cacheprovider tests/upgrade "$@"
