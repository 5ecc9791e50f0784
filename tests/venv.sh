#!/usr/bin/env bash
# Makes build/NAME/venv: Debian's Python with what tests/NAME/requirements.txt lists. Prints the path of its interpreter.
#   tests/venv.sh python     besides the wheel of python/, built as docs/guide/python.md says
#   tests/venv.sh blender    with Blender as a module (a wheel of 350 MB); it needs Debian's libegl1, libgl1, libsm6, libxfixes3,
#                            libxi6, libxkbcommon0, libxrender1 and libxxf86vm1
#   tests/venv.sh openjd
#   tests/venv.sh web        without what its package requires (a driver of browsers), since only a file of it is used
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
name=$1 out=build/$1
export PIP_DISABLE_PIP_VERSION_CHECK=1
mkdir -p "$out"
{
  [ -x "$out/venv/bin/pip" ] || /usr/bin/python3 -m venv --system-site-packages "$out/venv"
  wheel=()
  if [ "$name" = python ]; then
    rm -rf "$out/dist"
    # A compiler that is not there: the wheel needs none.
    CC=/nonexistent CXX=/nonexistent "$out/venv/bin/pip" wheel --no-deps -w "$out/dist" ./python
    wheel=("$(echo "$out"/dist/lightshaft-*-py3-none-any.whl)")
  fi
  alone=()
  if [ "$name" = web ]; then alone=(--no-deps); fi
  "$out/venv/bin/pip" install "${alone[@]}" "${wheel[@]/%/[notebook,usd]}" -r "tests/$name/requirements.txt"
  if [ "$name" = python ]; then "$out/venv/bin/pip" install --force-reinstall --no-deps "${wheel[@]}"; fi
  if [ "$name" = blender ]; then "$out/venv/bin/python" -c 'import bpy'; fi
} >&2
echo "$out/venv/bin/python"
