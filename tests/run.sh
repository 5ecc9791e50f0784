#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test.
#   tests/run.sh                everything: release build, unit, statistical, system and browser tests; sanitizer builds
#   tests/run.sh --quick        the inner loop: release build, unit tests, the fast system tests
#   tests/run.sh --only PART    one part and the builds that it needs; may be repeated. The parts: lint, unit, statistical,
#                               asan, tsan (the sanitizers), system, web, python, containers, blender, kubernetes, upgrade
#   tests/run.sh --blender      also the tests of the add-on that need Blender, a download of 350 MB and some minutes
#   tests/run.sh --kubernetes   also the tests that need Kubernetes' API server, which the first time takes minutes to build
#   tests/run.sh --upgrade      also the upgrade from the last release, whose programs are built the first time
#   tests/run.sh --docker       installs and starts Docker for the tests of compose, containers and packages, where that is possible
#   tests/run.sh --require-all  a test that cannot run here is a failure, not a skip; the parts above that were not asked for, or
#                               cannot run on this machine, are named at the end
# System and browser tests mostly wait, for farms and pages; builds and unit tests mostly compute. So these are two lanes
# that run side by side once the programs are built. Logs, and the seconds of each step, are in build/test-logs.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

quick=0 blender=0 kubernetes=0 upgrade=0 docker=0 require_all=0 only=" "
usage() { sed -n '3,/^# System/s/^# \{0,1\}//p' tests/run.sh | sed '$d' >&2; exit 2; }
while [ $# -gt 0 ]; do
  case "$1" in
    --only)
      case "${2:-}" in
        lint | unit | statistical | asan | tsan | system | web | python | containers) ;;
        blender) blender=1 ;;
        kubernetes) kubernetes=1 ;;
        upgrade) upgrade=1 ;;
        *) usage ;;
      esac
      only+="$2 "
      shift ;;
    --quick) quick=1 ;;
    --blender) blender=1 ;;
    --kubernetes) kubernetes=1 ;;
    --upgrade) upgrade=1 ;;
    --docker) docker=1 ;;
    --require-all) require_all=1 ;;
    *) usage ;;
  esac
  shift
done

if [ "$quick" -eq 1 ] && [ "$only" != " " ]; then echo "tests/run.sh: --quick and --only exclude each other" >&2; exit 2; fi

started=$SECONDS
logs=build/test-logs
rm -rf "$logs"
mkdir -p "$logs"
counts=$logs/counts times=$logs/times.csv not_run=$logs/not-run
: >"$counts"
: >"$not_run"
echo "step,begins,seconds,processor_seconds" >"$times"

left_out() { echo "$1: $2" >>"$not_run"; }  # part, why it is not part of this run
count() { echo "$1 $2 $3" >>"$counts"; }  # passed failed skipped
total() { awk -v column="$1" '{ n += $column } END { print n + 0 }' "$counts"; }
summary() { echo "$(total 1) passed, $(total 2) failed, $(total 3) skipped"; }
# Ends a lane, or the whole run: what comes after needs what failed.
give_up() { printf '\n%s\n' "$1"; count 0 1 0; summary; exit 1; }

# A lane that gives up ends with 1 and has counted its failure; one that is killed has not.
lane_ended() {  # lane, exit code
  [ "$2" -le 1 ] || { printf '\nthe lane of %s ended with exit code %s\n' "$1" "$2"; count 0 1 0; }
}

# Sets `used`: seconds of the processors that what this lane has waited for took.
count_processor_seconds() {
  local file="$logs/times.$BASHPID"
  times >"$file"  # not by a pipe: in a subshell all of them are zero
  used=$(awk -F'[ms ]' 'NR == 2 { printf "%d", 60 * $1 + $2 + 60 * $4 + $5 }' "$file")
}

step() {  # name, command...: with its seconds by the clock and of the processors
  local name="$1" begins=$((SECONDS - started)) used_before used; shift
  count_processor_seconds; used_before=$used
  "$@"
  count_processor_seconds
  local took=$((SECONDS - started - begins))
  echo "$name,$begins,$took,$((used - used_before))" >>"$times"
  printf '== %s: %d s, %d s of the processors, ended after %d s\n' "$name" "$took" $((used - used_before)) $((SECONDS - started))
}

build() {  # preset, targets...
  local preset="$1"; shift
  cmake --preset "$preset" -DLIGHTSHAFT_TESTS=ON >"$logs/configure-$preset.log" 2>&1 || { tail -n 40 "$logs/configure-$preset.log"; give_up "the '$preset' build could not be configured"; }
  cmake --build --preset "$preset" ${1:+--target "$@"} >"$logs/build-$preset.log" 2>&1 || { grep -E '^FAILED|^ninja: |[ :]error: |Killed|No space' -A 12 "$logs/build-$preset.log" | head -n 80; give_up "the '$preset' build failed"; }
}

# Adds the JUnit files of a step to the sums, and prints its failures. A command that failed without a failed test counts as one.
count_results() {  # name, exit code of the command, arguments of results.py...
  local name="$1" rc="$2" p f s; shift 2
  /usr/bin/python3 -B tests/support/results.py "$@" >"$logs/$name.results"
  read -r p f s < <(tail -n 1 "$logs/$name.results")
  if [ "$rc" -ne 0 ] && [ "${f:-0}" -eq 0 ]; then f=1; tail -n 20 "$logs/$name.log"; fi
  count "${p:-0}" "${f:-1}" "${s:-0}"
  head -n -1 "$logs/$name.results" | head -n 120
  echo "$name: ${p:-0} passed, ${f:-1} failed, ${s:-0} skipped"
}

# Each case of a GoogleTest program counts, and a program that writes no result file is a failure.
run_ctest() {  # preset, label, name
  local log="$logs/$3.log" cases="$PWD/$logs/$3-cases" rc
  mkdir -p "$cases"
  GTEST_OUTPUT="xml:$cases/" ctest --preset "$1" -L "^$2\$" --no-tests=error --output-junit "$PWD/$logs/$3.xml" --verbose -j "$(nproc)" >"$log" 2>&1
  rc=$?
  # Tests of hostile messages make libprotobuf complain.
  [ "$rc" -eq 0 ] || grep -v 'libprotobuf ERROR' "$log" | grep -E -A 4 ': ERROR: |WARNING: ThreadSanitizer|SUMMARY' | head -n 80
  count_results "$3" "$rc" ctest "$logs/$3.xml" "$cases"
}

run_pytest() {  # name, arguments...; by $PYTHON if it is set
  local name="$1"; shift
  "${PYTHON:-/usr/bin/python3}" -m pytest -q -ra --durations=0 --junitxml="$logs/$name.xml" -p no:cacheprovider "$@" >"$logs/$name.log" 2>&1
  count_results "$name" $? pytest "$logs/$name.xml"
}

run_lint() {
  if tests/lint.sh >"$logs/lint.log" 2>&1; then count 1 0 0; else count 0 1 0; tail -n 20 "$logs/lint.log"; fi
  echo "lint: $(tail -n 1 "$logs/lint.log")"
}

run_in_venv() {  # name, arguments...: by a Python that has what tests/NAME needs
  local name="$1" python
  if python=$(tests/venv.sh "$name" 2>"$logs/$name-venv.log"); then PYTHON="$python" run_pytest "$@"
  else count 0 1 0; tail -n 20 "$logs/$name-venv.log"; echo "$name: what its tests need could not be installed"; fi
}

run_blender() {
  if [ "$blender" -eq 1 ]; then run_in_venv blender tests/blender; return; fi
  left_out "rendering in Blender" "only with --blender"
  run_pytest blender tests/blender/test_files.py
}

run_kubernetes() {
  [ "$kubernetes" -eq 1 ] || { left_out "Kubernetes" "only with --kubernetes"; return 0; }
  local programs
  if programs=$(tests/kubernetes/tools.sh 2>"$logs/kubernetes-tools.log"); then LIGHTSHAFT_KUBERNETES="$programs" run_pytest kubernetes tests/kubernetes
  else count 0 1 0; tail -n 20 "$logs/kubernetes-tools.log"; echo "kubernetes: the API server could not be built"; fi
}

run_upgrade() {
  [ "$upgrade" -eq 1 ] || { left_out "upgrade from the last release" "only with --upgrade"; return 0; }
  local programs
  if programs=$(tests/upgrade/build.sh 2>"$logs/upgrade-build.log"); then LIGHTSHAFT_OLD_BIN="$programs" run_pytest upgrade tests/upgrade
  else count 0 1 0; tail -n 20 "$logs/upgrade-build.log"; echo "upgrade: the last release could not be built"; fi
}

# The engine that this starts ends with the run.
prepare_docker() {
  [ "$docker" -eq 1 ] || return 0
  if tests/docker_engine.sh "$logs/docker" >"$logs/docker.log" 2>&1; then . "$logs/docker/env"; else tail -n 1 "$logs/docker.log"; fi
}
end_docker() { [ ! -e "$logs/docker/dockerd.pid" ] || kill "$(cat "$logs/docker/dockerd.pid")" 2>/dev/null || true; }
trap end_docker EXIT

run_compose() {
  # Docker may be missing, have no engine, no builder, or no way to the base image.
  if ! printf 'FROM debian:bookworm-slim\n' | DOCKER_BUILDKIT=1 docker build -q - >"$logs/docker-build.log" 2>&1; then
    left_out "compose" "Docker builds nothing here ($(tail -n 1 "$logs/docker-build.log"))"
  elif tests/compose/run.sh --prebuilt --network "${LIGHTSHAFT_DOCKER_NETWORK:-default}" >"$logs/compose.log" 2>&1; then count 1 0 0; echo "compose: passed"
  else count 0 1 0; tail -n 40 "$logs/compose.log"; echo "compose: failed"; fi
}

run_docker() {
  # Docker may be missing, have no engine, or not have the image that deploy/images.sh makes.
  local why
  why=$(PYTHONPATH=tests/support /usr/bin/python3 -c 'import docker_engine; print(docker_engine.missing())')
  if [ -z "$why" ]; then run_pytest docker tests/docker
  else left_out "workers in containers" "$why"; fi
}

run_packages() {
  tests/packages/run.sh --prebuilt >"$logs/packages.log" 2>&1
  case $? in
    0) count 1 0 0; echo "packages: passed" ;;
    77) left_out "Debian packages" "$(tail -n 1 "$logs/packages.log")" ;;
    *) count 0 1 0; tail -n 40 "$logs/packages.log"; echo "packages: failed" ;;
  esac
}

wanted() { [ "$only" = " " ] || [[ "$only" = *" $1 "* ]]; }
wanted_any() { local part; for part in "$@"; do if wanted "$part"; then return 0; fi; done; return 1; }
part() { if wanted "$1"; then shift; step "$@"; fi; }  # part, then as for step

waiting_lane() {
  # Most of their time is waiting, so several files run side by side. A file runs in one process: its tests share what is slow
  # to make.
  part system "system tests" run_pytest system -n 3 --dist loadfile tests/system
  part web "browser tests" run_in_venv web -n 2 --dist loadfile tests/web
  part python "Python package" run_in_venv python tests/python tests/packages
  part python "Open Job Description" run_in_venv openjd tests/openjd
  part blender "Blender" run_blender
  part kubernetes "Kubernetes" run_kubernetes
  part upgrade "upgrade" run_upgrade
  part containers "Docker's engine" prepare_docker
  part containers "compose" run_compose
  part containers "Docker" run_docker
  part containers "packages" run_packages
}

computing_lane() {
  renice -n 5 "$BASHPID" >/dev/null  # what waits has short turns, and limits to its patience
  local label=release targets=()
  [ "$only" = " " ] || label=unit  # without the AddressSanitizer's part, the release build runs all unit tests
  if wanted unit; then targets+=("tests-$label"); fi
  if wanted statistical; then targets+=(tests-statistical); fi
  if [ "${#targets[@]}" -gt 0 ]; then step "release build: tests" build release "${targets[@]}"; fi
  part unit "unit and architecture tests" run_ctest release "$label" unit
  part statistical "statistical tests" run_ctest release statistical statistical
  part asan "AddressSanitizer build" build asan tests-asan lightshaft-coordinator lightshaft-worker
  part asan "AddressSanitizer: unit tests" run_ctest asan asan unit-asan
  LIGHTSHAFT_CLI="$LIGHTSHAFT_BIN/lightshaft" LIGHTSHAFT_BIN="$PWD/build/asan/bin" part asan "AddressSanitizer: a farm" run_pytest farm-asan tests/system -m sanitized
  part tsan "ThreadSanitizer build" build tsan tests-tsan
  part tsan "ThreadSanitizer: unit tests" run_ctest tsan tsan threads-tsan
}

deploy/install-deps.sh --tests >"$logs/install.log" 2>&1 || { tail -n 20 "$logs/install.log"; give_up "what the tests need could not be installed"; }
part lint "lint" run_lint
export LIGHTSHAFT_BIN="$PWD/build/release/bin"
if wanted_any unit asan system web python containers blender kubernetes upgrade; then
  step "release build: programs" build release lightshaft lightshaft-coordinator lightshaft-worker fake_oidn_blurs
fi

if [ "$quick" -eq 1 ]; then
  step "system tests, the fast ones" run_pytest system -n 3 --dist loadfile tests/system -m "not slow" &
  waiting=$!
  (step "release build: tests" build release tests-unit
   step "unit and architecture tests" run_ctest release unit unit)
  lane_ended "builds and unit tests" $?
else
  waiting_lane &
  waiting=$!
  (computing_lane)
  lane_ended "builds and unit tests" $?
fi
wait "$waiting"
lane_ended "system tests" $?

printf '\nThe slowest steps (%s):\n' "$times"
tail -n +2 "$times" | sort -t, -k3 -rn | head -n 6 | awk -F, '{ printf "  %5d s  %s\n", $3, $1 }'
# What a run of some parts leaves out, as the runs of a matrix do: nobody asked for it, so it is no failure.
not_asked() {
  local name
  [ "$only" != " " ] || return 0
  for name in lint unit statistical asan tsan system web python containers blender kubernetes upgrade; do
    wanted "$name" || echo "$name: not asked for"
  done
}
others=$(not_asked)
if [ -s "$not_run" ] || [ -n "$others" ]; then printf '\nNot part of this run:\n'; { cat "$not_run"; [ -z "$others" ] || echo "$others"; } | sed 's/^/  /'; fi
if [ "$require_all" -eq 1 ] && [ "$(total 3)" -gt 0 ]; then
  echo "--require-all: $(total 3) tests were skipped"
  count 0 "$(total 3)" "-$(total 3)"
fi
# Of a run of some parts, what is not part of it was asked for.
if [ "$require_all" -eq 1 ] && [ "$only" != " " ] && [ -s "$not_run" ]; then
  echo "--require-all: parts that were asked for did not run"
  count 0 1 0
fi
summary
[ "$(total 2)" -eq 0 ] && [ "$(total 1)" -gt 0 ]
