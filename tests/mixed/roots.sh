#!/usr/bin/env bash
# Makes the root folders of other systems, with what a build needs, each unless it is there already:
#   trixie-amd64   Debian 13, to build and to run in, with a compiler for ARM
#   noble-amd64    Ubuntu 24.04, to build and to run in
#   trixie-arm64   Debian 13 for 64-bit ARM: libraries to link with and to run with, under qemu
#   tests/mixed/roots.sh FOLDER [NAME...]
# As root, with the Debian packages mmdebstrap and qemu-user-static. LIGHTSHAFT_UBUNTU: where Ubuntu's packages are.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
[ $# -ge 1 ] || { echo "usage: tests/mixed/roots.sh FOLDER [NAME...]" >&2; exit 2; }
mkdir -p "$1"
cd "$1"
shift
[ $# -gt 0 ] || set -- trixie-amd64 trixie-arm64 noble-amd64

# Of alternatives, the last one is what the newer systems have.
packages="$(awk '/^\[test/ { exit } /^[#[]/ || NF == 0 { next } { print $NF }' "$here/../../deploy/packages.txt")"
libraries="$(grep -E '^(lib|nlohmann|prometheus|protobuf|zlib)' <<<"$packages")"
ubuntu="${LIGHTSHAFT_UBUNTU:-http://archive.ubuntu.com/ubuntu}"

list() { paste -sd, <<<"$*"; }
for name in "$@"; do
  [ ! -e "$name/complete" ] || continue
  rm -rf "$name"
  echo "making $PWD/$name"
  case "$name" in
    trixie-amd64) mmdebstrap --mode=root --variant=minbase --include="$(list "$packages"),crossbuild-essential-arm64" trixie "$name" ;;
    trixie-arm64)
      mmdebstrap --mode=root --variant=extract --arch=arm64 --include="$(list "$libraries"),ca-certificates" trixie "$name"
      ln -s usr/lib "$name/lib"  # which a package of the base system would make
      ;;
    # Debian 12 has no key of Ubuntu's; nothing here leaves this test.
    noble-amd64) mmdebstrap --mode=root --variant=minbase --include="$(list "$packages")" noble "$name" "deb [trusted=yes] $ubuntu noble main universe" ;;
    *) echo "tests/mixed/roots.sh: no such root: $name" >&2; exit 2 ;;
  esac
  touch "$name/complete"
done
