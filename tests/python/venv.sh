#!/usr/bin/env bash
# Makes build/python/venv: Debian's Python with the wheel of python/, built as docs/guide/python.md says, and
# what tests/python needs besides. Prints the path of its interpreter.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=build/python
export PIP_DISABLE_PIP_VERSION_CHECK=1
mkdir -p "$out"
{
  [ -x "$out/venv/bin/pip" ] || /usr/bin/python3 -m venv --system-site-packages "$out/venv"
  rm -rf "$out/dist"
  # A compiler that is not there: the wheel needs none.
  CC=/nonexistent CXX=/nonexistent "$out/venv/bin/pip" wheel --no-deps -w "$out/dist" ./python
  wheel=$(echo "$out"/dist/lightshaft-*-py3-none-any.whl)
  "$out/venv/bin/pip" install "$wheel[notebook,usd]" -r tests/python/requirements.txt
  "$out/venv/bin/pip" install --force-reinstall --no-deps "$wheel"
} >&2
echo "$out/venv/bin/python"
