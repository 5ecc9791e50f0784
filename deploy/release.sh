#!/usr/bin/env bash
# Makes the artefacts of a release, signs them, or verifies signed ones.
#   deploy/release.sh --key KEY [--out FOLDER] [--prebuilt] [--draft]   makes them, in build/release-artefacts unless told otherwise
#   deploy/release.sh --verify FOLDER --public-key KEY.pub              is every file in FOLDER what was signed?
# Made are the Debian packages, the wheel with the programs and that of Python alone, Blender's add-on, the sources, the bill of materials (CycloneDX), SHA256SUMS of all
# of them and SHA256SUMS.minisig, its signature by minisign. KEY is a secret key of `minisign -G`, kept away from here; it may have
# no password (`minisign -G -W`) where nobody can type one. A release is made of a commit that has its version's tag and section in
# CHANGELOG.md, without changes on top; --draft makes the same of any commit, to try it, and then
# takes --prebuilt of deploy/package.sh as well.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

die() { echo "error: $*" >&2; exit 1; }
usage() { sed -n 's/^#   /  /p' deploy/release.sh >&2; exit 2; }

key="" out="$PWD/build/release-artefacts" folder="" public="" draft=0 prebuilt=()
while [ $# -gt 0 ]; do
  case "$1" in
    --key | --out | --verify | --public-key)
      [ $# -ge 2 ] || usage
      value=$(realpath -m "$2")
      case "$1" in --key) key="$value" ;; --out) out="$value" ;; --verify) folder="$value" ;; --public-key) public="$value" ;; esac
      shift ;;
    --prebuilt) prebuilt=(--prebuilt) ;;
    --draft) draft=1 ;;
    *) usage ;;
  esac
  shift
done
command -v minisign >/dev/null || die "minisign is missing (apt-get install minisign)"

verify() {  # folder, public key
  cd "$1"
  [ -f SHA256SUMS ] && [ -f SHA256SUMS.minisig ] || die "$1 lacks SHA256SUMS or SHA256SUMS.minisig"
  minisign -V -q -p "$2" -m SHA256SUMS || die "SHA256SUMS is not signed by the key of $2: trust none of these files"
  sha256sum --check --strict --quiet SHA256SUMS || die "files named above are missing or not those that were signed"
  local extra
  extra=$(comm -13 <({ sed 's/^[0-9a-f]* [ *]//' SHA256SUMS; echo SHA256SUMS; echo SHA256SUMS.minisig; } | sort) <(find . -mindepth 1 -printf '%P\n' | sort))
  [ -z "$extra" ] || die "nobody signed $(tr '\n' ' ' <<<"$extra")"
  echo "signed and unchanged: $(wc -l <SHA256SUMS) files, $(sed -n 's/^trusted comment: //p' SHA256SUMS.minisig)"
}

if [ -n "$folder" ]; then
  [ -n "$public" ] && [ -z "$key" ] || usage
  verify "$folder" "$public"
  exit
fi
[ -n "$key" ] && [ -z "$public" ] || usage
[ "$draft" = 1 ] || [ "${#prebuilt[@]}" = 0 ] || die "--prebuilt is for --draft: a release is built here"
[ -r "$key" ] || die "there is no key $key: minisign -G -s $key -p ${key%.key}.pub"
[[ "$key" != "$PWD"/* ]] || die "$key lies in the repository: keep secret keys elsewhere"

version=$(sed -n 's/^project(lightshaft VERSION \([0-9.]*\) .*/\1/p' CMakeLists.txt)
commit=$(git rev-parse HEAD)
if [ "$draft" = 0 ]; then
  [ -z "$(git status --porcelain)" ] || die "there are changes that are in no commit (git status)"
  [ "$(git rev-parse -q --verify "v$version^{commit}")" = "$commit" ] || die "this commit is not the one with the tag v$version"
  grep -q "^## $version\$" CHANGELOG.md || die "CHANGELOG.md has no section '## $version'"
fi
# Whoever notes a time in what follows takes the commit's.
SOURCE_DATE_EPOCH=$(git show -s --format=%ct HEAD)
export SOURCE_DATE_EPOCH LC_ALL=C TZ=UTC

rm -rf "$out"
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

deploy/package.sh "${prebuilt[@]}" >"$work/log" 2>&1 || { tail -n 20 "$work/log" >&2; die "the Debian packages were not made"; }
cp build/packages/*.deb "$out"
cp "$(blender/package.py)" "$out/lightshaft-blender-$version.zip"
# A folder of the sources alone: a wheel is made of what lies there.
git archive HEAD python | tar -x -C "$work"
deploy/wheel.sh --prebuilt --out "$out" >"$work/log" 2>&1 || { tail -n 20 "$work/log" >&2; die "the wheel with the programs was not made"; }
python3 -m venv "$work/venv" && "$work/venv/bin/pip" --disable-pip-version-check -q wheel --no-deps -w "$out" "$work/python"
git archive --prefix="lightshaft-$version/" HEAD | gzip -9n >"$out/lightshaft-$version.tar.gz"
deploy/sbom.py "$out" --build build/release --version "$version" --commit "$commit" --time "$SOURCE_DATE_EPOCH" >"$work/sbom"
mv "$work/sbom" "$out/lightshaft-$version.cdx.json"

cd "$out"
chmod 0644 ./*
sha256sum -- * >"$work/sums"
mv "$work/sums" SHA256SUMS
minisign -S -s "$key" -m SHA256SUMS -t "lightshaft $version, commit $commit" >/dev/null
ls -l "$out"
