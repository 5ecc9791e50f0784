#!/usr/bin/env bash
# Makes a certificate authority for a farm, and certificates signed by it, with the openssl program. It is for farms whose
# authority's key must not lie on the coordinator; `lightshaft-coordinator --tls` makes its own authority.
#   deploy/make-certificates.sh DIR NAME[,NAME...] [WORKERS]
# NAME: host names and addresses under which users and workers reach the coordinator. Files in DIR afterwards:
#   ca.pem ca.key              made at the first run, valid for ten years; keep the key in a safe place
#   server.pem server.key      for the coordinator: --tls-ca ca.pem --tls-cert server.pem --tls-key server.key
#   worker-1.pem worker-1.key  ... WORKERS (default 1) of them: --tls-ca ca.pem --tls-cert worker-1.pem --tls-key worker-1.key
# Run it again within a year: it then makes new certificates, signed by the same authority.
set -euo pipefail
[ $# -ge 2 ] && [ $# -le 3 ] || { sed -n '2,10s/^# \{0,1\}//p' "$0" >&2; exit 2; }
dir=$1 names=$2 workers=${3:-1}
umask 077
mkdir -p "$dir"
cd "$dir"
days=397

alternatives=""
IFS=, read -ra all <<<"$names"
for name in "${all[@]}"; do
  case "$name" in
    "" | *[!A-Za-z0-9.:_*-]*) echo "error: '$name' is no host name and no address" >&2; exit 2 ;;
    *:* ) kind=IP ;;
    *[!0-9.]*) kind=DNS ;;
    *) kind=IP ;;
  esac
  alternatives+="${alternatives:+,}$kind:$name"
done

new_key() { openssl ecparam -name prime256v1 -genkey -noout | openssl pkcs8 -topk8 -nocrypt -out "$1"; }

if [ ! -f ca.pem ]; then
  new_key ca.key
  openssl req -x509 -new -key ca.key -sha256 -days 3650 -subj "/O=Lightshaft/CN=Lightshaft farm" -out ca.pem \
    -addext "keyUsage=critical,keyCertSign,cRLSign"
fi

issue() {  # usage: issue NAME EXTENSIONS
  new_key "$1.key"
  openssl req -new -key "$1.key" -subj "/O=Lightshaft/CN=$1" -out "$1.csr"
  openssl x509 -req -in "$1.csr" -CA ca.pem -CAkey ca.key -sha256 -days "$days" -out "$1.pem" 2>/dev/null \
    -extfile <(printf 'basicConstraints=critical,CA:FALSE\nkeyUsage=critical,digitalSignature\n%b' "$2")
  rm "$1.csr"
}
issue server "extendedKeyUsage=serverAuth\nsubjectAltName=$alternatives\n"
for n in $(seq "$workers"); do issue "worker-$n" "extendedKeyUsage=clientAuth\n"; done
chmod 644 ./*.pem
echo "made in $dir: ca.pem, server.pem and .key for $names, and $workers for workers; good for $days days"
