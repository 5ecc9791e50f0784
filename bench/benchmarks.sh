#!/bin/bash
# Makes docs/measurements/benchmarks anew: races against other programs, and curves of our own with predicted against actual times.
#
# usage: benchmarks.sh [SCENES] [--clock wall|cpu] [--time S] [--seeds K] [--seed N] [--only races|curves|bath] [--out DIR]
# SCENES is a folder with NAME.xml and, for the races, refs/NAME.0.exr and refs/NAME.1.exr: two independent references. Without it
# the scenes and references are those of scenes/bench.
# Entrants of the races are Mitsuba 3 and Cycles, as far as `python3` has the packages mitsuba (and there is an LLVM library for it)
# and bpy (race.py); what is missing is said, and the races of docs/measurements/benchmarks are then not made: they would lose its columns.
# The curves are those of SCENES and, on a page of its own, of the bath, made here if it is not there; they are counted by CPU
# seconds, and so may be made while others use the machine. The races want a quiet one, or --clock cpu. Races in docs/measurements/benchmarks
# give README.md its table of figures (measured.py).
# --only bath races Mitsuba 3 on the bath at 240x180, against two of our renders of 1,024 samples each, which it makes: a quarter of an hour.
set -euo pipefail
cd "$(dirname "$0")/.."
BIN=${LIGHTSHAFT_BIN:-build/release/bin}
ADAPTERS=bench/adapters
clock=wall time=4 seeds=3 seed=0 only= out=docs/measurements/benchmarks
command="bench/benchmarks.sh $*"
if [ $# -ge 1 ] && [ "${1#--}" = "$1" ]; then
  [ -d "$1" ] || { sed -n '4,12s/^# \?//p' "$0" >&2; exit 2; }
  scenes=$1 references=$1/refs; shift
else
  scenes=build/bench references=scenes/bench/references
  /usr/bin/python3 scenes/bench/make_bench.py "$scenes"
fi
while [ $# -ge 2 ]; do
  case $1 in
    --clock) clock=$2 ;; --time) time=$2 ;; --seeds) seeds=$2 ;; --seed) seed=$2 ;; --only) only=$2 ;; --out) out=$2 ;;
    *) echo "benchmarks.sh: unknown option $1" >&2; exit 2 ;;
  esac
  shift 2
done
[ $# -eq 0 ] || { echo "benchmarks.sh: $1 needs a value" >&2; exit 2; }
case $only in ''|races|curves|bath) ;; *) echo "benchmarks.sh: --only $only: it takes races, curves or bath" >&2; exit 2 ;; esac

status=0
programs=()
add_programs() {  # PACKAGE ADAPTER...
  local package=$1; shift
  if ! python3 -c "import $package" 2>/dev/null; then echo "benchmarks.sh: without $package (pip install $package)" >&2; return; fi
  for adapter in "$@"; do programs+=(--program "$ADAPTERS/$adapter.json"); done
}

# Of what a build's name is made of.
sources=(core worker/render worker/CMakeLists.txt CMakeLists.txt cmake)
note_run() {  # FILE: the command, and the commit that last touched the renderer, whatever pages are committed after it
  local commit
  commit=$(git log -1 --format=%h -- "${sources[@]}")
  git diff --quiet HEAD -- "${sources[@]}" || commit="$commit, changed"
  printf '{"commit": "%s", "command": "%s"}\n' "$commit" "${command% }" >"$1"
}

if [ -z "$only" ] || [ "$only" = races ]; then
  if [ "$out" = docs/measurements/benchmarks ] && ! { /usr/bin/python3 "$ADAPTERS/llvm_library.py" && python3 -c 'import mitsuba, bpy'; } >/dev/null 2>&1; then
    echo "benchmarks.sh: the races of $out need an LLVM library, and a python3 with mitsuba and bpy (pip install mitsuba bpy); with --out DIR the races are made without what is missing" >&2
    exit 2
  fi
  if /usr/bin/python3 "$ADAPTERS/llvm_library.py"; then add_programs mitsuba mitsuba3_volpath mitsuba3_volpathmis; fi
  add_programs bpy cycles
  /usr/bin/python3 bench/race.py "$scenes"/*.xml --references "$references" --integrators volpath "${programs[@]}" \
    --time "$time" --seeds "$seeds" --seed "$seed" --clock "$clock" --report "$out/races" || status=$?
  note_run "$out/races/run.json"
  [ "$out" != docs/measurements/benchmarks ] || /usr/bin/python3 bench/measured.py --write README.md
fi
if [ -z "$only" ] || [ "$only" = curves ]; then
  bath=build/benchmarks/bath
  [ -f "$bath/bath.xml" ] || /usr/bin/python3 scenes/bath/make_bath.py "$bath" >&2
  race() {  # FOLDER SCENE...
    "$BIN/lightshaft" compare "${@:2}" --integrators volpath --size 72x48 --time 600 --spp 1024 --seeds "$seeds" --seed "$seed" \
      --clock cpu --report "$out/$1" || status=$?
  }
  race curves "$scenes"/*.xml
  race bath "$bath/bath.xml"
fi
if [ "$only" = bath ]; then
  { /usr/bin/python3 "$ADAPTERS/llvm_library.py" && python3 -c 'import mitsuba'; } >/dev/null 2>&1 || {
    echo "benchmarks.sh: --only bath needs an LLVM library, and a python3 with mitsuba (pip install mitsuba)" >&2; exit 2; }
  bath=build/benchmarks/bath_vol size=240x180
  /usr/bin/python3 scenes/bath/make_bath.py "$bath" --grid vol >&2
  mkdir -p "$bath/references"
  for k in 0 1; do  # of seeds that no race has
    "$BIN/lightshaft" render "$bath/bath.xml" --size $size --spp 1024 --seed $((770000 + k)) --float --quiet -o "$bath/references/bath.$k.exr"
  done
  add_programs mitsuba mitsuba3_volpath mitsuba3_volpathmis
  /usr/bin/python3 bench/race.py "$bath/bath.xml" --references "$bath/references" --size $size --integrators volpath "${programs[@]}" \
    --time "$time" --seeds "$seeds" --seed "$seed" --clock "$clock" --report "$out/bath-race" || status=$?
  note_run "$out/bath-race/run.json"
fi
exit $status
