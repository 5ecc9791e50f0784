#!/usr/bin/env bash
# Measures, in fresh containers, the seconds from `pip install` to the first picture: of Lightshaft's wheel with `lightshaft up`,
# of the same with the extra `denoise`, and of Mitsuba 3 with the first lines of its manual (its Cornell box, 16 samples per pixel).
# Prints a line for each run, and what numeric class the wheel's programs are of there and which pixels they render.
#   tests/packages/first_picture.sh WHEEL RUNS IMAGE...
# IMAGE is one of Docker that has Python 3.11 or later with venv, and nothing else. The containers use this machine's network.
# WHAT="lightshaft denoise mitsuba" in the environment chooses what is measured.
set -euo pipefail
[ $# -ge 3 ] || { sed -n 's/^#   /usage: /p' "$0" >&2; exit 2; }
wheel=$(realpath "$1") runs=$2 what=${WHAT:-lightshaft denoise mitsuba}
shift 2

begin='
load=$(cut -d" " -f1 /proc/loadavg) begun=$(date +%s%N)'
lightshaft='
python3 -m venv /v && /v/bin/pip install -q --no-cache-dir "$(echo /wheel/*.whl)$EXTRA"
installed=$(date +%s%N)
touch /up.txt
/v/bin/lightshaft up --no-browser --data /state >/up.txt 2>&1 & up=$!
grep -q "^first picture," < <(tail -n +1 -f --pid=$up /up.txt)
ended=$(date +%s%N)
kill -INT $up; wait $up
bath=$(echo /v/lib/python3*/site-packages/lightshaft_command/bath/bath.xml)
facts="$(sed -n "s/numeric class *//p" /up.txt), $(/v/bin/lightshaft render "$bath" --size 160x120 --spp 8 -o /x.exr 2>&1 | grep pixels_sha256)"'
# Mitsuba needs this, and these systems do not have it from the start; that is not counted.
libatomic='{ apt-get update && apt-get install -y libatomic1; } >/apt.txt 2>&1'
mitsuba='
python3 -m venv /v && /v/bin/pip install -q --no-cache-dir mitsuba
installed=$(date +%s%N)
/v/bin/python -c "
import mitsuba as mi
mi.set_variant(\"scalar_rgb\")
mi.util.write_bitmap(\"/first.png\", mi.render(mi.load_dict(mi.cornell_box()), spp=16))"
ended=$(date +%s%N)
facts=$(/v/bin/pip list 2>/dev/null | grep -i "^mitsuba")'
report='
s() { echo $(($1 / 1000000000)).$(($1 / 100000000 % 10)); }
echo "installed after $(s $((installed - begun))) s, first picture after $(s $((ended - begun))) s; load $load; $facts"'

run() {  # image, script, extra of the wheel
  docker run --rm --network host -e EXTRA="${3-}" -v "$wheel:/wheel/$(basename "$wheel"):ro" ${PIP_CERT:+-v "$PIP_CERT:/ca.pem:ro" -e PIP_CERT=/ca.pem} "$1" bash -e -c "$2"
}

for _ in $(seq "$runs"); do
  for image in "$@"; do
    for program in $what; do
      case "$program" in
        lightshaft) line=$(run "$image" "$begin$lightshaft$report") ;;
        denoise) line=$(run "$image" "$begin$lightshaft$report" '[denoise]') ;;
        mitsuba) line=$(run "$image" "$libatomic$begin$mitsuba$report") ;;
        *) echo "error: WHAT names '$program', which is none of lightshaft, denoise, mitsuba" >&2; exit 2 ;;
      esac
      echo "$program $image: $line"
    done
  done
done
