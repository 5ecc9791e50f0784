#!/bin/sh
# Run once before everything else (the service `secrets` of docker-compose.yml): makes what the services must know of each
# other, each where only its reader mounts it. What is there already stays: a farm keeps its secrets for life; to change one,
# stop the farm, remove its file from every volume that has it, and start again.
#   /data/join-token, /secrets/worker/join-token                         what lets a worker in
#   /secrets/authority                                                  the farm's own certificate authority, mounted nowhere else
#   /secrets/coordinator/{ca.pem,server.pem,server.key}, /secrets/worker/{ca.pem,worker.pem,worker.key}   who shows what to whom
#   /secrets/redis/{redis.conf,password}, /secrets/coordinator/coordinator.conf   Redis's password, and who uses it
set -eu
umask 077

random_hex() { od -An -v -tx1 -N32 /dev/urandom | tr -d ' \n'; }

write() {  # file, text: all of it or nothing
  printf '%s\n' "$2" > "$1.new"
  mv "$1.new" "$1"
}

[ -s /data/join-token ] || write /data/join-token "$(random_hex)"
write /secrets/worker/join-token "$(cat /data/join-token)"

[ -s /secrets/redis/password ] || write /secrets/redis/password "$(random_hex)"
password=$(cat /secrets/redis/password)
# Every write reaches the disk within a second; what a crash costs of it is rendered again. Nothing is ever evicted.
write /secrets/redis/redis.conf "bind 0.0.0.0
protected-mode no
port 6379
dir /redis
appendonly yes
appendfsync everysec
save \"\"
maxmemory-policy noeviction
requirepass $password"
write /secrets/coordinator/coordinator.conf "http = \"0.0.0.0:8080\"
grpc = \"0.0.0.0:50051\"
data = \"/data\"
store = \"redis://:$password@redis:6379/0\"
tls-ca = \"/secrets/ca.pem\"
tls-cert = \"/secrets/server.pem\"
tls-key = \"/secrets/server.key\""

# An authority of this farm's own, and certificates of it for the coordinator and the workers; new ones when they end within
# sixty days. The authority's key is mounted nowhere but here.
certificates=/secrets/authority
if ! openssl x509 -checkend $((60 * 86400)) -noout -in "$certificates/server.pem" >/dev/null 2>&1; then
  /usr/local/lib/lightshaft/make-certificates.sh "$certificates" coordinator,localhost,127.0.0.1 1
fi
for file in ca.pem server.pem server.key; do write "/secrets/coordinator/$file" "$(cat "$certificates/$file")"; done
write /secrets/worker/ca.pem "$(cat "$certificates/ca.pem")"
write /secrets/worker/worker.pem "$(cat "$certificates/worker-1.pem")"
write /secrets/worker/worker.key "$(cat "$certificates/worker-1.key")"
