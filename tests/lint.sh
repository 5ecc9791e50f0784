#!/usr/bin/env bash
# Checks the form of the code: the links of its pages, the words of its identifiers, the generated parts of the Python package, clang-format on every source file, clang-tidy on those that changed since BASE.
#   tests/lint.sh            all but clang-tidy
#   tests/lint.sh BASE       clang-tidy too, on files that differ from the commit BASE (takes half a minute for each)
#   tests/lint.sh --fix      formats in place
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
mapfile -t files < <(git ls-files '*.cpp' '*.h')
case "${1:-}" in
  --fix) exec clang-format-14 -i "${files[@]}" ;;
  "") ;;
  *)
    cmake --preset dev >/dev/null
    mapfile -t changed < <(git diff --name-only --diff-filter=AM "$1" -- '*.cpp')
    # Half a minute for each file. Generated headers are there once the dev preset has built something.
    [ "${#changed[@]}" -eq 0 ] || printf '%s\n' "${changed[@]}" | xargs -P "$(nproc)" -n 1 clang-tidy-14 -p build/dev --quiet
    ;;
esac
# Only a warning; the architecture test refuses files of more than 800 lines.
wc -l "${files[@]}" | awk '$1 > 400 && $2 !~ /^(total|tests\/)/ { print "long, is it one subject? " $2 ": " $1 " lines" }'
/usr/bin/python3 tests/lint/links.py
/usr/bin/python3 tests/lint/words.py
/usr/bin/python3 python/generate.py --check
clang-format-14 --dry-run --Werror "${files[@]}" && echo "${#files[@]} files are formatted"
