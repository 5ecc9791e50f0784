#!/bin/sh
# Checks whether the worker in this container has a stream to its coordinator: an established connection to
# the port for workers (in hexadecimal, as in /proc/net/tcp).
port=$(printf '%04X' "${LIGHTSHAFT_GRPC_PORT:-50051}")
cat /proc/net/tcp /proc/net/tcp6 2>/dev/null | awk -v port=":$port" '$3 ~ port"$" && $4 == "01" { joined = 1 } END { exit !joined }' ||
  { echo "no connection to the coordinator's port ${LIGHTSHAFT_GRPC_PORT:-50051}"; exit 1; }
