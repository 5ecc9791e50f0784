#!/usr/bin/env bash
# Makes build/openjd/venv: Debian's Python with what tests/openjd needs. Prints the path of its interpreter.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=build/openjd
export PIP_DISABLE_PIP_VERSION_CHECK=1
mkdir -p "$out"
{
  [ -x "$out/venv/bin/pip" ] || /usr/bin/python3 -m venv --system-site-packages "$out/venv"
  "$out/venv/bin/pip" install -r tests/openjd/requirements.txt
} >&2
echo "$out/venv/bin/python"
