#!/usr/bin/env bash
# Writes a coordinator's --data folder, and its --secrets folder if it has one, to one archive. The coordinator may be running.
# The archive contains secrets, so only its owner can read it. Results that the farm accepts during the backup may be missing in
# the archive: after a restore they are rendered again, to the same bits.
#   deploy/backup.sh DATA OUT.tar.gz [SECRETS]          needs python3 (for SQLite's online backup)
set -euo pipefail
[ $# = 2 ] || [ $# = 3 ] || { echo "usage: deploy/backup.sh DATA OUT.tar.gz [SECRETS]" >&2; exit 2; }
data="$1" out="$2" secrets="${3:-}"
[ -e "$data/jobs.sqlite" ] || { echo "error: $data is no coordinator's folder: it has no jobs.sqlite" >&2; exit 1; }

umask 077
stage=$(mktemp -d "$out.XXXXXX")
trap 'rm -rf "$stage"' EXIT
mkdir "$stage/jobs"

# The order makes the archive consistent. A film is copied before the results that it was folded from, so that
# no result that it needs is missing. The database is copied after both, so that it has every job that has
# results. Blobs, which never change, are copied last, so that no job lacks one.
for job in "$data"/jobs/*/; do
  [ -d "$job" ] || continue
  to="$stage/jobs/$(basename "$job")"
  mkdir "$to"
  if [ -e "$job/film.snap" ]; then cp -a "$job/film.snap" "$to/" 2>/dev/null || true; fi
  # Jobs that are removed meanwhile and files that are still being written are left out.
  find "$job" -mindepth 1 -maxdepth 1 ! -name film.snap ! -name '*.new' ! -name '*.tmp*' -exec cp -a -t "$to" {} + 2>/dev/null || true
done
python3 - "$data/jobs.sqlite" "$stage/jobs.sqlite" <<'END'
import sqlite3, sys
source, target = sqlite3.connect(f"file:{sys.argv[1]}?mode=ro", uri=True), sqlite3.connect(sys.argv[2])
source.backup(target)
target.close()
END
kept=()
for name in blobs webhooks node-id token tokens join-token worker-key webhook-secret tls; do
  if [ -e "$data/$name" ]; then kept+=("$name"); fi
done
if [ -n "$secrets" ]; then
  mkdir "$stage/secrets"
  for name in token tokens join-token worker-key tls; do
    if [ -e "$secrets/$name" ]; then cp -a "$secrets/$name" "$stage/secrets/"; fi
  done
  [ -e "$stage/secrets/token" ] || { echo "error: $secrets is no folder of secrets: it has no token" >&2; exit 1; }
fi
# Status 1 means that a file changed while it was read, such as an upload in progress, which is not needed.
tar -czf "$out.new" --exclude '*.tmp' -C "$stage" jobs jobs.sqlite ${secrets:+secrets} -C "$(realpath "$data")" "${kept[@]}" 2>/dev/null || [ $? = 1 ]
mv "$out.new" "$out"
echo "$out: $(du -h "$out" | cut -f 1), $(find "$stage/jobs" -mindepth 1 -maxdepth 1 | wc -l) jobs"
