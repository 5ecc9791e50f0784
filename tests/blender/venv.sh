#!/usr/bin/env bash
# Makes build/blender/venv: Debian's Python with Blender as a module (a wheel of 350 MB) and what tests/blender needs
# besides. Prints the path of its interpreter. Blender needs Debian's libegl1, libgl1, libsm6, libxfixes3, libxi6,
# libxkbcommon0, libxrender1 and libxxf86vm1.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
venv=build/blender/venv
export PIP_DISABLE_PIP_VERSION_CHECK=1
{
  [ -x "$venv/bin/pip" ] || /usr/bin/python3 -m venv --system-site-packages "$venv"
  "$venv/bin/pip" install -r tests/blender/requirements.txt
  "$venv/bin/python" -c 'import bpy'
} >&2
echo "$venv/bin/python"
