#!/usr/bin/env bash
# Fuzzes, in turns of some seconds, whichever target has had the least of the processor so far.
#   tests/fuzz/run.sh [--slice SECONDS] [--goal SECONDS] [--turns N] [--no-build] [TARGET...]
#       until every target has had --goal seconds of the processor (default 60), turns of --slice seconds (default 180),
#       counted over all calls: it goes on where it was stopped; or until --turns are over
#   tests/fuzz/run.sh --table [TARGET...]     sums what was done so far
#   tests/fuzz/run.sh --pack [TARGET...]      distils each corpus to what covers as much, into tests/fuzz/corpus/TARGET.pack
# Needs clang-14 and libclang-rt-14-dev. New inputs are kept in build/fuzz/corpus/TARGET, findings in
# build/fuzz/findings/TARGET, a line for each turn in build/fuzz/turns.tsv. A finding that is mended goes to
# tests/fuzz/corpus/TARGET, where every test run replays it. The exit code is 1 if there is a finding.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
here=tests/fuzz out=build/fuzz turns=build/fuzz/turns.tsv
all=(scene_xml scene_pbrt scene_gltf partial http wire protocol bundle image mesh volume scene_json small_json)
slice=180 goal=60 most=1000000 build=yes errand=fuzz
while [ $# -gt 0 ]; do
  case "$1" in
    --slice) slice=$2; shift ;;
    --goal) goal=$2; shift ;;
    --turns) most=$2; shift ;;
    --no-build) build=no ;;
    --table | --pack) errand=${1#--} ;;
    -*) echo "error: $1 is not known; see the head of $0" >&2; exit 2 ;;
    *) break ;;
  esac
  shift
done
targets=("$@")
[ "${#targets[@]}" -gt 0 ] || targets=("${all[@]}")
mkdir -p "$out"
touch "$turns"

# A turn's line: target, seconds of wall and of processor, executions, edges, features, inputs, its end in words.
table() {
  printf '| %-10s | %7s | %11s | %8s | %8s | %6s | %s\n' target 'CPU min' executions edges features inputs 'findings |'
  printf '|---|---:|---:|---:|---:|---:|---:|\n'
  for target in "${targets[@]}"; do
    open=$(find "$out/findings/$target" -type f 2>/dev/null | wc -l)
    awk -F '\t' -v target="$target" -v open="$open" '
      $1 == target { cpu += $3; runs += $4; if ($5 > edges) edges = $5; if ($6 > features) features = $6; inputs = $7 }
      END { printf "| %-10s | %7.1f | %11d | %8d | %8d | %6d | %s |\n", target, cpu / 60, runs, edges, features, inputs, open }' "$turns"
  done
}
if [ "$errand" = table ]; then
  table
  exit 0
fi

command -v clang++-14 >/dev/null || { echo "error: install clang-14 and libclang-rt-14-dev to fuzz" >&2; exit 2; }
if [ "$build" = yes ]; then
  cmake --preset fuzz -DLIGHTSHAFT_TESTS=ON >/dev/null || exit 2
  cmake --build --preset fuzz --target "${targets[@]/#/fuzz_}" >"$out/build.log" 2>&1 || { grep -E 'error' -A 6 "$out/build.log" | head -n 40; exit 2; }
fi
export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1 LIGHTSHAFT_LOG=error
# Every reader bounds what it takes before it takes it: one allocation above malloc_limit_mb is a finding. Hangs are told by
# the processor's time (main.cpp); -timeout is only for those that wait.
limits=(-timeout=600 -report_slow_units=600 -rss_limit_mb=2048 -malloc_limit_mb=512 -max_len=65536)

pack() {
  local target=$1 distilled=$out/distilled/$1
  rm -rf "$distilled"
  mkdir -p "$distilled" "$here/corpus"
  "$out/bin/fuzz_$target" -merge=1 -max_len=8192 -timeout=600 "$distilled" "$out/corpus/$target" >"$out/$target.merge.log" 2>&1 || return 1
  "$out/bin/fuzz_$target" --pack "$distilled" "$here/corpus/$target.pack"
  printf '%-10s %6d inputs, %7d bytes\n' "$target" "$(find "$distilled" -type f | wc -l)" "$(stat -c %s "$here/corpus/$target.pack")"
}
if [ "$errand" = pack ]; then
  for target in "${targets[@]}"; do pack "$target" || exit 1; done
  exit 0
fi

# What libFuzzer said last, as columns of the turn's line.
said() {
  local last edges features runs
  last=$(grep -aE '^#[0-9]+.*cov: ' "$1" | tail -n 1)
  edges=$(grep -oE 'cov: [0-9]+' <<<"$last" | grep -oE '[0-9]+') features=$(grep -oE 'ft: [0-9]+' <<<"$last" | grep -oE '[0-9]+')
  runs=$(grep -aoE 'number_of_executed_units: [0-9]+' "$1" | grep -oE '[0-9]+$')
  printf '%s\t%s\t%s' "${runs:-$(grep -oE '^#[0-9]+' <<<"$last" | tr -d '#')}" "${edges:-0}" "${features:-0}"
}

# One turn, from a copy: the build may go on meanwhile.
child='' stopped=no
turn() {
  local target=$1 corpus=$out/corpus/$1 findings=$out/findings/$1 log=$out/$1.log run=$out/running/$1 began=$SECONDS
  local known=() dictionary=() rc=0 end=none cpu
  mkdir -p "$corpus" "$findings"
  cp -f "$out/bin/fuzz_$target" "$run"
  "$run" --seeds "$corpus" "$here/corpus/$target.pack"
  [ ! -f "$here/dict/$target.txt" ] || dictionary=(-dict="$here/dict/$target.txt")
  [ ! -d "$here/corpus/$target" ] || known=("$here/corpus/$target")
  times >"$run.times"
  nice -n 19 "$run" "$corpus" "${known[@]}" "${dictionary[@]}" "${limits[@]}" -max_total_time="$slice" -print_final_stats=1 \
    -artifact_prefix="$findings/" >"$log" 2>&1 &
  child=$!
  while kill -0 "$child" 2>/dev/null; do wait "$child"; rc=$?; done
  child=''
  times >>"$run.times"
  # The children's user and system time, "0m1.234s 0m0.100s", in the 2nd and the 4th line.
  cpu=$(tr 'ms' '  ' <"$run.times" | awk 'NR % 2 == 0 { t[NR] = $1 * 60 + $2 + $3 * 60 + $4 } END { printf "%.1f", t[4] - t[2] }')
  if [ "$rc" -ne 0 ] && [ "$stopped" = no ]; then
    end=$(grep -aE 'broken promise|ERROR: |runtime error|SUMMARY' "$log" | head -n 1 | cut -c1-160)
    end="${end:-exit code $rc}"
    cp -f "$log" "$findings.$(date +%H%M%S).log"
    echo "$target: $end (see $findings.*.log)" >&2
  fi
  printf '%s\t%d\t%s\t%s\t%d\t%s\n' "$target" $((SECONDS - began)) "$cpu" "$(said "$log")" "$(find "$corpus" -type f | wc -l)" "$end" >>"$turns"
  [ "$end" = none ]
}
trap 'stopped=yes; [ -z "$child" ] || kill -TERM "$child"' TERM INT

# The targets that still lack some of the processor's time, the poorest first.
poor() {
  for target in "${targets[@]}"; do
    [[ " $found " == *" $target "* ]] ||
      awk -F '\t' -v target="$target" -v goal="$goal" '$1 == target { cpu += $3 } END { if (cpu < goal) print cpu + 0, target }' "$turns"
  done | sort -s -g | cut -d ' ' -f 2
}
# A target that another run.sh is at is left to it: several may run at once.
mkdir -p "$out/running"
found=''
while [ "$stopped" = no ] && [ "$most" -gt 0 ]; do
  took=no most=$((most - 1))
  for target in $(poor); do
    exec 9>"$out/running/$target.lock"
    flock -n 9 || continue
    took=yes
    turn "$target" 9>&- || found+=" $target"
    exec 9>&-
    break
  done
  [ "$took" = yes ] || break
done
table
[ -z "$found" ]
