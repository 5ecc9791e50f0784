#!/usr/bin/env bash
# Builds kube-apiserver, from the Go module proxy, and kubectl where there is none that knows kustomize's components; prints the
# folder that has them. The first time takes minutes, and a gigabyte on the disk for Go's caches.
#   tests/kubernetes/tools.sh
# The module k8s.io/kubernetes replaces some thirty modules by folders that are not in its archive. They are modules of the
# proxy, too, in the version 0.MINOR.PATCH of Kubernetes 1.MINOR.PATCH.
set -euo pipefail
version=1.32.4

# Debian's etcd (etcd-server) keeps what the API server stores.
for program in go etcd; do
  command -v "$program" >/dev/null || { echo "error: there is no $program (apt-get install etcd-server; Go 1.23 or newer)" >&2; exit 77; }
done
folder="${XDG_CACHE_HOME:-$HOME/.cache}/lightshaft/kubernetes-$version"
mkdir -p "$folder/bin"

programs=()
[ -x "$folder/bin/kube-apiserver" ] || programs+=(kube-apiserver)
if ! kubectl version --client 2>/dev/null | grep -q 'Kustomize Version: v5'; then
  [ -x "$folder/bin/kubectl" ] || programs+=(kubectl)
fi
if [ "${#programs[@]}" -gt 0 ]; then
  downloaded=$(go mod download -json "k8s.io/kubernetes@v$version" | sed -n 's/^\t"Dir": "\(.*\)",$/\1/p')
  rm -rf "$folder/source"
  cp -r "$downloaded" "$folder/source"
  chmod -R u+w "$folder/source"
  cd "$folder/source"
  rm -f go.work go.work.sum
  sed -i -E "s#^(\s*k8s\.io/[a-z-]+) => \./staging/src/(k8s\.io/[a-z-]+)\$#\1 => \2 v0.${version#1.}#" go.mod
  for program in "${programs[@]}"; do
    GOFLAGS=-mod=mod GOWORK=off CGO_ENABLED=0 go build -trimpath -ldflags "-s -w -X k8s.io/component-base/version.gitVersion=v$version \
      -X k8s.io/component-base/version.gitMajor=1 -X k8s.io/component-base/version.gitMinor=$(cut -d. -f2 <<<"$version")" \
      -o "$folder/bin/$program" "./cmd/$program" >&2
  done
  cd / && rm -rf "$folder/source"
fi
echo "$folder/bin"
