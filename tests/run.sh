#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test.
#   tests/run.sh                everything: release build, unit, statistical, system and browser tests; sanitizer builds
#   tests/run.sh --quick        the inner loop: release build, unit tests, the fast system tests
#   tests/run.sh --require-all  a test that cannot run here is a failure, not a skip
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

quick=0 require_all=0
for arg in "$@"; do
  case "$arg" in
    --quick) quick=1 ;;
    --require-all) require_all=1 ;;
    *) echo "usage: tests/run.sh [--quick] [--require-all]" >&2; exit 2 ;;
  esac
done

passed=0 failed=0 skipped=0
started=$SECONDS
logs=build/test-logs
mkdir -p "$logs"
say() { printf '\n== %s (%d s)\n' "$1" $((SECONDS - started)); }
give_up() { printf '\n%s\n%d passed, %d failed, %d skipped\n' "$1" "$passed" "$((failed + 1))" "$skipped"; exit 1; }

build() {  # preset, targets...
  local preset="$1"; shift
  cmake --preset "$preset" -DLIGHTSHAFT_TESTS=ON >"$logs/configure-$preset.log" 2>&1 || { tail -n 40 "$logs/configure-$preset.log"; give_up "the '$preset' build could not be configured"; }
  cmake --build --preset "$preset" ${1:+--target "$@"} >"$logs/build-$preset.log" 2>&1 || { grep -E '^FAILED|^ninja: |[ :]error: |Killed|No space' -A 12 "$logs/build-$preset.log" | head -n 80; give_up "the '$preset' build failed"; }
}

# Each GoogleTest case counts: the binaries' own summaries are added up. (--output-on-failure would print failing ones twice.)
run_ctest() {  # preset, label, log name
  local log="$logs/$3.log"
  ctest --preset "$1" -L "$2" --verbose -j "$(nproc)" >"$log" 2>&1
  local rc=$?
  # ctest -V prefixes lines with the test's number.
  local p f s
  p=$(grep -oE '\[  PASSED  \] [0-9]+' "$log" | awk '{ n += $4 } END { print n + 0 }')
  f=$(grep -oE '\[  FAILED  \] [0-9]+ test' "$log" | awk '{ n += $4 } END { print n + 0 }')
  s=$(grep -oE '\[  SKIPPED \] [0-9]+ test' "$log" | awk '{ n += $4 } END { print n + 0 }')
  passed=$((passed + p)) skipped=$((skipped + s)) failed=$((failed + f))
  if [ "$rc" -ne 0 ]; then
    [ "$f" -gt 0 ] || failed=$((failed + 1))
    grep -E '\[  FAILED  \]|Failure|ERROR|Expected|Which is|\*\*\*|SUMMARY|WARNING: ThreadSanitizer' "$log" | head -n 60
  fi
  echo "$3: $p passed, $f failed, $s skipped$([ "$rc" -eq 0 ] || echo ', ctest says failed')"
}

run_pytest() {  # name, arguments...
  local name="$1" log="$logs/$1.log"; shift
  /usr/bin/python3 -m pytest -q -ra -p no:cacheprovider "$@" >"$log" 2>&1
  local rc=$? last
  last=$(grep -E '[0-9]+ (passed|failed|skipped|error)' "$log" | tail -n 1)
  local p f s e
  p=$(grep -oE '[0-9]+ passed' <<<"$last" | grep -oE '[0-9]+'); f=$(grep -oE '[0-9]+ failed' <<<"$last" | grep -oE '[0-9]+')
  s=$(grep -oE '[0-9]+ skipped' <<<"$last" | grep -oE '[0-9]+'); e=$(grep -oE '[0-9]+ error' <<<"$last" | grep -oE '[0-9]+')
  passed=$((passed + ${p:-0})) skipped=$((skipped + ${s:-0})) failed=$((failed + ${f:-0} + ${e:-0}))
  if [ "$rc" -ne 0 ]; then
    [ $((${f:-0} + ${e:-0})) -gt 0 ] || failed=$((failed + 1))
    grep -E '^(FAILED|ERROR|E  )' "$log" | head -n 60
  fi
  grep -E '^SKIPPED' "$log" || true
  echo "$name: ${last:-pytest exited with $rc}"
}

deploy/install-deps.sh --tests || give_up "what the tests need could not be installed"

say "release build"
build release
export LIGHTSHAFT_BIN="$PWD/build/release/bin"

say "unit and architecture tests"
run_ctest release unit unit
if [ "$quick" -eq 1 ]; then
  say "system tests, the fast ones"
  run_pytest system tests/system -m "not slow"
else
  say "statistical tests"
  run_ctest release statistical statistical
  say "system tests"
  run_pytest system tests/system
  say "browser tests"
  run_pytest web tests/web
  say "AddressSanitizer and UndefinedBehaviorSanitizer"
  build asan tests-unit lightshaft lightshaft-coordinator lightshaft-worker
  run_ctest asan unit unit-asan
  LIGHTSHAFT_BIN="$PWD/build/asan/bin" run_pytest farm-asan tests/system -m sanitized
  say "ThreadSanitizer"
  build tsan tests-tsan
  run_ctest tsan tsan threads-tsan
fi

say "done"
if [ "$require_all" -eq 1 ] && [ "$skipped" -gt 0 ]; then echo "--require-all: $skipped tests were skipped"; failed=$((failed + skipped)); skipped=0; fi
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
