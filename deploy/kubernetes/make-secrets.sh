#!/bin/sh
# Prints the farm's secrets, new ones at every run, as manifests for `kubectl apply -f -`: join token, Redis's password, and an
# authority's certificates for TLS between all of them, good for 397 days. They are written nowhere else, and of the authority only
# its certificate is left, so that nobody can make more; before they end, run it again and restart all pods.
#   make-secrets.sh [NAME,NAME...]    more names and addresses that people call the coordinator by, e.g. those of an ingress
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
random_hex() { od -An -v -tx1 -N32 /dev/urandom | tr -d ' \n'; }
block() { sed 's/^/    /' "$folder/$1"; }   # prints a file as a block of YAML
join=$(random_hex) password=$(random_hex)
names=coordinator,coordinator.lightshaft,coordinator.lightshaft.svc,coordinator.lightshaft.svc.cluster.local,localhost,127.0.0.1
for name in coordinator-0.coordinators coordinator-1.coordinators; do   # of several, by components/shared
  names=$names,$name,$name.lightshaft,$name.lightshaft.svc,$name.lightshaft.svc.cluster.local
done
"$(dirname "$0")/../make-certificates.sh" "$folder" "$names${1:+,$1}" 1 >&2
cat <<END
apiVersion: v1
kind: Secret
metadata: {name: lightshaft-join-token}
type: Opaque
stringData:
  join-token: "$join"
---
apiVersion: v1
kind: Secret
metadata: {name: lightshaft-worker-tls}
type: Opaque
stringData:
  ca.pem: |
$(block ca.pem)
  worker.pem: |
$(block worker-1.pem)
  worker.key: |
$(block worker-1.key)
---
apiVersion: v1
kind: Secret
metadata: {name: lightshaft-coordinator-tls}
type: Opaque
stringData:
  ca.pem: |
$(block ca.pem)
  server.pem: |
$(block server.pem)
  server.key: |
$(block server.key)
---
apiVersion: v1
kind: Secret
metadata: {name: lightshaft-redis}
type: Opaque
stringData:
  password: "$password"
  redis.conf: |
    bind 0.0.0.0
    protected-mode no
    port 6379
    dir /redis
    appendonly yes
    appendfsync everysec
    save ""
    maxmemory-policy noeviction
    requirepass $password
  coordinator.conf: |
    store = "redis://:$password@redis:6379/0"
END
