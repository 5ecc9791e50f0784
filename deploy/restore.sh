#!/usr/bin/env bash
# Makes a coordinator's --data folder of an archive of deploy/backup.sh. The folder must be new or empty. Run it as the user that
# the coordinator runs as.
#   deploy/restore.sh BACKUP.tar.gz DATA
set -euo pipefail
[ $# = 2 ] || { echo "usage: deploy/restore.sh BACKUP.tar.gz DATA" >&2; exit 2; }
if [ -e "$2" ] && [ -n "$(ls -A "$2")" ]; then echo "error: $2 is not empty; a restore makes a new folder" >&2; exit 1; fi
umask 077
mkdir -p "$2"
tar -xzf "$1" -C "$2" --no-same-owner
echo "$2: start lightshaft-coordinator --data $2"
