#!/usr/bin/env bash
# Builds the docs as a static site, build/site/html/index.html, and checks every link and anchor on the way.
#   docs/site.sh            needs python3-venv, and PyPI the first time (mkdocs, mkdocs-material into build/site/venv)
#   docs/site.sh --serve    and shows it on http://127.0.0.1:8000
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

serve=0
for arg in "$@"; do
  case "$arg" in
    --serve) serve=1 ;;
    *) echo "usage: docs/site.sh [--serve]" >&2; exit 2 ;;
  esac
done

site=build/site
mkdir -p "$site"
/usr/bin/python3 tests/lint/links.py
if ! cmp -s docs/site/requirements.txt "$site/venv/installed.txt"; then
  /usr/bin/python3 -m venv "$site/venv"
  "$site/venv/bin/pip" install --quiet --disable-pip-version-check -r docs/site/requirements.txt
  cp docs/site/requirements.txt "$site/venv/installed.txt"
fi
"$site/venv/bin/python" docs/site/stage.py "$site"
# Not --quiet, which would hide warnings from --strict, too.
if ! NO_MKDOCS_2_WARNING=1 "$site/venv/bin/mkdocs" build --strict --config-file "$site/mkdocs.yml" >"$site/build.log" 2>&1; then
  grep -E '^(WARNING|ERROR)|^Aborted' "$site/build.log" >&2 || cat "$site/build.log" >&2
  exit 1
fi
echo "the site: $site/html/index.html"
[ "$serve" -eq 0 ] || exec /usr/bin/python3 -m http.server --bind 127.0.0.1 --directory "$site/html" 8000
