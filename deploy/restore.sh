#!/usr/bin/env bash
# Restores a coordinator's --data folder, and its --secrets folder if it had one, from an archive made by deploy/backup.sh. The
# folders must be new or empty. Run it as the user who runs the coordinator. Never run two coordinators from one archive: both
# would have the same node-id.
#   deploy/restore.sh BACKUP.tar.gz DATA [SECRETS]          without SECRETS, secrets are restored to DATA/secrets
set -euo pipefail
[ $# = 2 ] || [ $# = 3 ] || { echo "usage: deploy/restore.sh BACKUP.tar.gz DATA [SECRETS]" >&2; exit 2; }
data="$2" secrets="${3:-}"
for folder in "${@:2}"; do
  if [ -e "$folder" ] && [ -n "$(ls -A "$folder")" ]; then echo "error: $folder is not empty; a restore makes a new folder" >&2; exit 1; fi
done
umask 077
mkdir -p "$data"
tar -xzf "$1" -C "$data" --no-same-owner
if [ ! -d "$data/secrets" ]; then
  [ -z "$secrets" ] || echo "$1 has no secrets of a folder of their own: nothing is written to $secrets" >&2
  echo "$data: start lightshaft-coordinator --data $data"
  exit 0
fi
if [ -n "$secrets" ]; then
  mkdir -p "$secrets"
  cp -a "$data/secrets/." "$secrets/"
  rm -r "$data/secrets"
fi
echo "$data: start lightshaft-coordinator --data $data --secrets ${secrets:-$data/secrets}"
