#!/usr/bin/env bash
# Renders the demo scene on a fresh Debian 12: installs missing packages, builds, starts a local farm (a coordinator with its
# embedded store and two workers), submits the scene over HTTP, waits, and prints where the image and the dashboard are.
#   deploy/demo.sh            at a terminal the farm runs until Ctrl-C, so that one can look at the dashboard; else it ends
#   deploy/demo.sh --detach   leaves the farm running
#   deploy/demo.sh --stop     ends a farm left running
#   deploy/demo.sh --full     the large setting: more pixels, more samples, a finer grid
#   deploy/demo.sh --raw      does not fetch Open Image Denoise, and shows the picture as it is rendered
#   deploy/demo.sh --denoise  ends with an error where Open Image Denoise cannot be fetched
# The picture is denoised unless told otherwise: Open Image Denoise is fetched into build/oidn, if that can be.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

detach=0 setting=small denoise=wanted
for arg in "$@"; do
  case "$arg" in
    --detach) detach=1 ;;
    --stop) setting=stop ;;
    --full) setting=full ;;
    --raw) denoise=no ;;
    --denoise) denoise=needed ;;
    *) echo "usage: deploy/demo.sh [--detach | --stop] [--full] [--raw | --denoise]" >&2; exit 2 ;;
  esac
done

home="$PWD/build/demo" bin="$PWD/build/release/bin"

stop_farm() {
  local file pid
  for file in "$home"/*.pid; do
    [ -e "$file" ] || continue
    pid=$(cat "$file")
    # Only processes that this script started are ended: process ids are reused.
    if grep -q lightshaft "/proc/$pid/cmdline" 2>/dev/null; then kill -TERM "$pid" 2>/dev/null || true; fi
  done
  for file in "$home"/*.pid; do
    [ -e "$file" ] || continue
    pid=$(cat "$file")
    timeout 20 tail --pid="$pid" -f /dev/null 2>/dev/null || kill -KILL "$pid" 2>/dev/null || true
    rm -f "$file"
  done
}

if [ "$setting" = stop ]; then
  stop_farm
  echo "the farm has stopped"
  exit 0
fi

started=$SECONDS
deploy/install-deps.sh
options=() layer=""
if [ "$denoise" != no ]; then
  if deploy/install-denoiser.sh; then options=(--denoise) layer="&layer=denoised"
  elif [ "$denoise" = needed ]; then exit 1
  else echo "Open Image Denoise could not be downloaded: the picture is not denoised, and noise is visible in it"
  fi
fi
# Denoised, so few samples look finished.
[ "$setting" = full ] || options+=(--size 640x480 --spp 16)
echo "building; this takes some minutes (log: build/demo/build.log)"
mkdir -p "$home"
if ! { cmake --preset release -DLIGHTSHAFT_TESTS=OFF && cmake --build --preset release --target lightshaft lightshaft-coordinator lightshaft-worker; } >"$home/build.log" 2>&1; then
  tail -n 40 "$home/build.log" >&2
  echo "error: the build failed; the whole log is build/demo/build.log" >&2
  exit 1
fi
built=$SECONDS

stop_farm
[ "$detach" = 1 ] || trap stop_farm EXIT

/usr/bin/python3 scenes/bath/make_bath.py "$home/bath" --setting "$setting"

launch() {  # usage: launch NAME COMMAND...
  local name="$1"; shift
  setsid "$@" >"$home/$name.log" 2>&1 </dev/null &
  echo $! >"$home/$name.pid"
}
rm -f "$home/data/ports.json"
http=127.0.0.1:8080
# If the usual port is in use, any free one will do.
if (exec 3<>/dev/tcp/127.0.0.1/8080) 2>/dev/null; then http=127.0.0.1:0; fi
launch coordinator "$bin/lightshaft-coordinator" --http "$http" --grpc 127.0.0.1:0 --data "$home/data"
coordinator=$(cat "$home/coordinator.pid")
until [ -s "$home/data/ports.json" ]; do
  kill -0 "$coordinator" 2>/dev/null || { cat "$home/coordinator.log" >&2; echo "error: the coordinator did not start" >&2; exit 1; }
  sleep 0.1
done
port_of() { python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))[sys.argv[2]])' "$home/data/ports.json" "$1"; }
url="http://127.0.0.1:$(port_of http)"
threads=$(( ($(nproc) + 1) / 2 ))
for k in 1 2; do
  LIGHTSHAFT_JOIN_TOKEN="$(cat "$home/data/join-token")" launch "worker-$k" "$bin/lightshaft-worker" \
    --coordinator "127.0.0.1:$(port_of grpc)" --threads "$threads" --cache "$home/cache-$k" --name "demo-$k"
done

token=$(cat "$home/data/token")
echo "dashboard: $url/#token=$token"
LIGHTSHAFT_URL="$url" LIGHTSHAFT_TOKEN="$token" "$bin/lightshaft" submit "$home/bath/bath.xml" "${options[@]}" --wait -o "$home/bath.exr" | tee "$home/job"
job=$(head -n 1 "$home/job")
# The token is not among curl's arguments, which every user of this machine can see.
curl -fsS -H @- "$url/api/v1/jobs/$job/image.png?exposure=0.8$layer" -o "$home/bath.png" <<<"Authorization: Bearer $token"

cat <<EOF

done: $((built - started)) s to install and build, $((SECONDS - built)) s to start the farm and render
image:      build/demo/bath.exr   (picture: build/demo/bath.png)
dashboard:  $url/#token=$token
EOF
if [ "$detach" = 1 ]; then
  echo "the farm keeps running; stop it with: deploy/demo.sh --stop"
elif [ ! -t 1 ]; then
  echo "without a terminal the farm stops now; deploy/demo.sh --detach keeps it running, with its dashboard"
else
  echo "the farm runs until you press Ctrl-C"
  trap 'exit 0' INT TERM
  while kill -0 "$coordinator" 2>/dev/null; do sleep 1; done
fi
