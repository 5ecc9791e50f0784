#!/usr/bin/env bash
# The manifests and `lightshaft farm up --on kubernetes` against a real API server of Kubernetes, which it builds the first time
# (tools.sh). Not part of tests/run.sh.
#   tests/kubernetes/run.sh [pytest's arguments]
# Exit code 77: it cannot be run here.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

LIGHTSHAFT_KUBERNETES=$(tests/kubernetes/tools.sh)
export LIGHTSHAFT_KUBERNETES
exec /usr/bin/python3 -m pytest -q -ra -p no:cacheprovider tests/kubernetes "$@"
