#!/usr/bin/env bash
# Fuzzes every target for some seconds, one after another, and says what came of it.
#   tests/fuzz/run.sh [SECONDS [TARGET...]]     default: 60 seconds each, all targets
# Needs clang-14 and libclang-rt-14-dev. New inputs are kept in build/fuzz/corpus/TARGET, findings in
# build/fuzz/findings/TARGET; a finding that is mended goes to tests/fuzz/corpus/TARGET, where every test run replays it.
# The exit code is 1 if there is any finding.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
here=tests/fuzz out=build/fuzz
seconds="${1:-60}"
shift || true
targets=("$@")
[ "${#targets[@]}" -gt 0 ] || targets=(scene_xml scene_json small_json image mesh volume partial bundle http protocol)

command -v clang++-14 >/dev/null || { echo "error: install clang-14 and libclang-rt-14-dev to fuzz" >&2; exit 2; }
cmake --preset fuzz -DLIGHTSHAFT_TESTS=ON >/dev/null || exit 2
cmake --build --preset fuzz --target "${targets[@]/#/fuzz_}" >"$out/build.log" 2>&1 || { grep -E 'error' -A 6 "$out/build.log" | head -n 40; exit 2; }

# The library's own allocations are bounded by its limits; a single one above this is a finding.
export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1 LIGHTSHAFT_LOG=error
found=0
printf '%-11s %9s %9s %12s %9s %9s %8s  %s\n' target 'wall s' 'cpu s' executions features edges inputs findings
for target in "${targets[@]}"; do
  corpus="$out/corpus/$target" findings="$out/findings/$target" log="$out/$target.log"
  mkdir -p "$corpus" "$findings"
  "$out/bin/fuzz_$target" --seeds "$corpus"
  dictionary=()
  [ ! -f "$here/dict/$target.txt" ] || dictionary=(-dict="$here/dict/$target.txt")
  known=()
  [ ! -d "$here/corpus/$target" ] || known=("$here/corpus/$target")
  began=$SECONDS
  times_before=$(times | tail -n 1)
  "$out/bin/fuzz_$target" "$corpus" "${known[@]}" "${dictionary[@]}" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=3000 \
    -malloc_limit_mb=2000 -max_len=65536 -print_final_stats=1 -artifact_prefix="$findings/" >"$log" 2>&1
  rc=$?
  # User and system time of children, "0m1.234s 0m0.100s", before and after.
  cpu=$(printf '%s %s\n' "$times_before" "$(times | tail -n 1)" | tr 'ms' '  ' | awk '{ printf "%.0f", ($5 * 60 + $6 + $7 * 60 + $8) - ($1 * 60 + $2 + $3 * 60 + $4) }')
  last=$(grep -E '^#[0-9]+.*cov: ' "$log" | tail -n 1)
  edges=$(grep -oE 'cov: [0-9]+' <<<"$last" | grep -oE '[0-9]+') features=$(grep -oE 'ft: [0-9]+' <<<"$last" | grep -oE '[0-9]+')
  runs=$(grep -oE 'number_of_executed_units: [0-9]+' "$log" | grep -oE '[0-9]+$')
  [ -n "$runs" ] || runs=$(grep -oE '^#[0-9]+' <<<"$last" | tr -d '#')
  said=none
  if [ "$rc" -ne 0 ]; then
    found=1
    said=$(grep -E 'ERROR: |runtime error|broken promise|SUMMARY' "$log" | head -n 1 | cut -c1-160)
    said="${said:-exit code $rc}; see $log"
  fi
  printf '%-11s %9d %9s %12s %9s %9s %8s  %s\n' "$target" $((SECONDS - began)) "$cpu" "${runs:-?}" "${features:-?}" "${edges:-?}" "$(find "$corpus" -type f | wc -l)" "$said"
done
exit "$found"
