#!/bin/sh
# Makes the secrets of the farm's services. It runs once before all of them (the service `secrets` of docker-compose.yml).
# Every secret lies in a volume that only its users mount. Existing secrets are kept. To change one, stop the farm, remove its
# file from every volume that has it, and start the farm again.
#   /data/join-token, /secrets/worker/join-token                         the token with which workers join
#   /secrets/authority                                                  the farm's own certificate authority, mounted nowhere else
#   /secrets/coordinator/{ca.pem,server.pem,server.key}, /secrets/worker/{ca.pem,worker.pem,worker.key}   certificates, for TLS
#   /secrets/redis/{redis.conf,password}, /secrets/coordinator/coordinator.conf   Redis's password, for both sides
set -eu
umask 077

random_hex() { od -An -v -tx1 -N32 /dev/urandom | tr -d ' \n'; }

write() {  # usage: write FILE TEXT. Writes the file completely or not at all.
  printf '%s\n' "$2" > "$1.new"
  mv "$1.new" "$1"
}

[ -s /data/join-token ] || write /data/join-token "$(random_hex)"
write /secrets/worker/join-token "$(cat /data/join-token)"

[ -s /secrets/redis/password ] || write /secrets/redis/password "$(random_hex)"
password=$(cat /secrets/redis/password)
# Every write reaches the disk within a second. Results that a crash loses are rendered again. Nothing is ever
# evicted.
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

# Makes the farm's own certificate authority, and its certificates for the coordinator and the workers.
# Certificates that end within sixty days are renewed. The authority's key is mounted only here.
certificates=/secrets/authority
if ! openssl x509 -checkend $((60 * 86400)) -noout -in "$certificates/server.pem" >/dev/null 2>&1; then
  /usr/local/lib/lightshaft/make-certificates.sh "$certificates" coordinator,localhost,127.0.0.1 1
fi
for file in ca.pem server.pem server.key; do write "/secrets/coordinator/$file" "$(cat "$certificates/$file")"; done
write /secrets/worker/ca.pem "$(cat "$certificates/ca.pem")"
write /secrets/worker/worker.pem "$(cat "$certificates/worker-1.pem")"
write /secrets/worker/worker.key "$(cat "$certificates/worker-1.key")"
