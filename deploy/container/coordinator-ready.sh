#!/bin/bash
# Checks whether the coordinator in this container is ready, by GET /readyz. It needs no HTTP client in the
# image, and prints the reason if it is not ready.
set -eu
port=${LIGHTSHAFT_HTTP_PORT:-8080}
request='GET /readyz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n'
if [ -s /secrets/ca.pem ]; then
  answer=$(printf "$request" | openssl s_client -quiet -verify_quiet -CAfile /secrets/ca.pem -verify_return_error -connect "127.0.0.1:$port" 2>/dev/null)
else
  exec 3<>"/dev/tcp/127.0.0.1/$port"
  printf "$request" >&3
  answer=$(cat <&3)
fi
read -r _ status _ <<<"$answer"
if [ "$status" != 200 ]; then printf '%s\n' "$answer"; exit 1; fi
