#!/usr/bin/env bash
# Builds the programs of the release that release.txt names into build/upgrade/VERSION, from git's history; prints the folder
# that has them. The first time takes as long as a build from nothing.
#   tests/upgrade/build.sh
# Exit code 77: the history is not here (a shallow clone).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

read -r version commit < <(grep -v '^#' tests/upgrade/release.txt)
git rev-parse -q --verify "v$version^{commit}" >/dev/null && commit="v$version"
git rev-parse -q --verify "$commit^{commit}" >/dev/null || { echo "error: release $version is not in this clone: git fetch --unshallow --tags" >&2; exit 77; }

folder="$PWD/build/upgrade/$version"
programs=(lightshaft lightshaft-coordinator lightshaft-worker lightshaft-vdb)
{
  # Sources that are there already stay, so that what was built of them is not built again.
  if [ "$(cat "$folder/commit" 2>/dev/null)" != "$(git rev-parse "$commit^{commit}")" ]; then
    rm -rf "$folder"
    mkdir -p "$folder/source"
    git archive "$commit" | tar -x -C "$folder/source"
    git rev-parse "$commit^{commit}" >"$folder/commit"
  fi
  cd "$folder/source"
  cmake --preset release -DLIGHTSHAFT_TESTS=OFF
  cmake --build --preset release --target "${programs[@]}"
} >&2
echo "$folder/source/build/release/bin"
