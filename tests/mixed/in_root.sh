#!/usr/bin/env bash
# Runs a command in the root folder of another system. There, /src is this checkout, /build the folder BUILD, and /tmp is the
# machine's; /proc and /dev are its own. What is mounted goes with the command.
#   tests/mixed/in_root.sh ROOT BUILD COMMAND [ARGUMENTS...]
# LIGHTSHAFT_BESIDE: a folder that is shown at /arm64.
# A root for ARM is run by qemu, which the kernel starts for programs of its kind, in this command alone (Linux 6.7).
set -euo pipefail
root="$1" build="$2"
shift 2
source="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
# shellcheck disable=SC2016  # expanded by the inner shell
inside='
set -e
root="$1" build="$2" source="$3"
shift 3
mkdir -p "$root"/{src,build,proc,tmp,dev}
mount --rbind "$source" "$root/src"
mount --rbind "$build" "$root/build"
mount --rbind /tmp "$root/tmp"
if [ -n "${LIGHTSHAFT_BESIDE:-}" ]; then mount --rbind "$LIGHTSHAFT_BESIDE" "$root/arm64"; fi
mount -t proc proc "$root/proc"
for node in null zero urandom random; do
  [ -e "$root/dev/$node" ] || touch "$root/dev/$node"
  mount --bind "/dev/$node" "$root/dev/$node"
done
if [ -e "$root/lib/ld-linux-aarch64.so.1" ]; then
  mount -t binfmt_misc binfmt_misc /proc/sys/fs/binfmt_misc
  printf "%s" ":arm:M::\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00:\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff:/usr/bin/qemu-aarch64-static:FP" >/proc/sys/fs/binfmt_misc/register
fi
exec chroot "$root" "$@"
'
exec unshare --user --map-root-user --mount --pid --fork --kill-child -- bash -c "$inside" in_root "$root" "$build" "$source" "$@"
