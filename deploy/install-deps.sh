#!/usr/bin/env bash
# Installs the Debian packages that are needed to build Lightshaft, and with --tests those that its tests
# need. If all of them are installed, it does nothing and needs no privileges.
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

missing=()
for section in $sections; do
  while read -r package; do
    if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then missing+=("$package"); fi
  done < <(packages_of "$section")
done
[ "${#missing[@]}" -gt 0 ] || exit 0

if ! command -v apt-get >/dev/null; then
  echo "error: these Debian 12 packages are missing and there is no apt-get to install them: ${missing[*]}" >&2
  exit 1
fi
as_root=""
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "error: run as root, or install sudo, to install: ${missing[*]}" >&2; exit 1; }
  as_root="sudo"
fi
echo "installing ${#missing[@]} packages: ${missing[*]}"
$as_root env DEBIAN_FRONTEND=noninteractive apt-get update -q
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}"
