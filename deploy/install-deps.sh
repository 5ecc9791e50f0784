#!/usr/bin/env bash
# Installs the packages of Debian 12 or 13 or Ubuntu 24.04 that are needed to build Lightshaft, and
# with --tests those that its tests need. If all of them are installed, it does nothing and needs no privileges.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"

sections="build"
for arg in "$@"; do
  case "$arg" in
    --tests) sections="build test" ;;
    *) echo "usage: deploy/install-deps.sh [--tests]" >&2; exit 2 ;;
  esac
done

packages_of() { awk -v want="[$1]" '/^#/ || NF == 0 { next } /^\[/ { on = ($0 == want); next } on' "$here/packages.txt"; }

installed() {  # NAME [| OTHER...]
  local name
  for name in ${1//|/ }; do
    if [ "$(dpkg-query -W -f='${db:Status-Status}' "$name" 2>/dev/null)" = installed ]; then return 0; fi
  done
  return 1
}
available() {  # NAME [| OTHER...]: the first that there is
  local name
  for name in ${1//|/ }; do
    if [ -n "$(apt-cache show "$name" 2>/dev/null)" ]; then echo "$name"; return; fi
  done
  echo "${1%% *}"
}

missing=()
for section in $sections; do
  while read -r package; do
    installed "$package" || missing+=("$package")
  done < <(packages_of "$section")
done
[ "${#missing[@]}" -gt 0 ] || exit 0

if ! command -v apt-get >/dev/null; then
  echo "error: these packages are missing and there is no apt-get to install them: ${missing[*]}" >&2
  exit 1
fi
as_root=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "error: run as root, or install sudo, to install: ${missing[*]}" >&2; exit 1; }
  as_root="sudo"
fi
echo "installing ${#missing[@]} packages: ${missing[*]}"
$as_root env DEBIAN_FRONTEND=noninteractive apt-get update -q
mapfile -t missing < <(for package in "${missing[@]}"; do available "$package"; done)
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}"
