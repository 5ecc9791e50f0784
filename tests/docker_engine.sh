#!/usr/bin/env bash
# Prepares Docker for the tests that need it: installs Debian's engine where apt-get may, starts it, and makes the image
# debian:bookworm-slim by debootstrap where no registry is in reach.
#   tests/docker_engine.sh FOLDER
# Writes FOLDER/env, to be sourced: PATH, so that `docker` is a client that can build images, and LIGHTSHAFT_DOCKER_NETWORK,
# the network of builds that reaches Debian's archive. If it starts the engine, its process id is in FOLDER/dockerd.pid: whoever
# calls this ends it. Exit codes: 0 Docker builds images here; 1 it does not, and the last line says why.
set -uo pipefail
folder="${1:?usage: tests/docker_engine.sh FOLDER}"
mkdir -p "$folder/bin"
folder="$(cd "$folder" && pwd)"
give_up() { echo "$1"; exit 1; }

if ! command -v dockerd >/dev/null && [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
  apt-get update -q >"$folder/install.log" 2>&1
  DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends docker.io docker-compose debootstrap >>"$folder/install.log" 2>&1 ||
    give_up "Docker could not be installed ($folder/install.log)"
fi

answers() { docker info >/dev/null 2>&1; }
if ! answers; then
  command -v dockerd >/dev/null || give_up "there is no dockerd (apt-get install docker.io docker-compose)"
  [ "$(id -u)" -eq 0 ] || give_up "Docker's engine does not answer, and only root may start it"
  setsid dockerd >"$folder/dockerd.log" 2>&1 </dev/null &
  echo $! >"$folder/dockerd.pid"
  # The engine ends by itself if it cannot work here; else it answers as soon as its log says so.
  until answers; do
    kill -0 "$(cat "$folder/dockerd.pid")" 2>/dev/null ||
      give_up "Docker's engine does not run here: $(grep -m 1 -iE 'fail|error' "$folder/dockerd.log" || tail -n 1 "$folder/dockerd.log")"
    read -r -t 0.2 <> <(:) || true
  done
fi

# Another client than Debian's may lack what builds images.
for client in $(type -ap docker); do
  if printf 'FROM scratch\nLABEL lightshaft=probe\n' | DOCKER_BUILDKIT=1 "$client" build -q - >"$folder/probe.log" 2>&1; then
    ln -sf "$client" "$folder/bin/docker"
    break
  fi
done
[ -e "$folder/bin/docker" ] || give_up "Docker builds nothing here: $(tail -n 1 "$folder/probe.log")"
export PATH="$folder/bin:$PATH"

base=debian:bookworm-slim
if ! docker image inspect "$base" >/dev/null 2>&1 && ! docker pull -q "$base" >"$folder/pull.log" 2>&1; then
  [ "$(id -u)" -eq 0 ] || give_up "the image $base cannot be had here: $(tail -n 1 "$folder/pull.log")"
  command -v debootstrap >/dev/null || DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends debootstrap >>"$folder/install.log" 2>&1
  root="$(mktemp -d)"
  trap 'rm -rf "$root"' EXIT
  debootstrap --variant=minbase bookworm "$root" >"$folder/debootstrap.log" 2>&1 || give_up "debootstrap made no Debian 12 ($folder/debootstrap.log)"
  tar -C "$root" -c . | docker import - "$base" >/dev/null || give_up "the image $base could not be imported"
fi

network=default
if ! docker run --rm "$base" apt-get update >"$folder/network.log" 2>&1 || grep -q '^[WE]:' "$folder/network.log"; then
  network=host
  docker run --rm --network host "$base" apt-get update >>"$folder/network.log" 2>&1 || give_up "no container reaches Debian's archive ($folder/network.log)"
fi
printf 'export PATH=%q:"$PATH" LIGHTSHAFT_DOCKER_NETWORK=%q\n' "$folder/bin" "$network" >"$folder/env"
