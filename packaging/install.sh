#!/bin/sh
# Installs the program `ts3100` of a release for this machine:
#
#     sh install.sh [--version 0.1.0] [--to DIR]
#
# Without --version the newest release, without --to into ~/.local/bin. TS3100_RELEASES is where the releases are: a folder
# URL below which v0.1.0/SHA256SUMS is. Nothing is installed whose checksum is not that of the release.
set -eu

# The release puts its address here.
releases="${TS3100_RELEASES:-}"
version="" to="${HOME:-}/.local/bin"

fail() {
    echo "install.sh: $*" >&2
    exit 1
}

while [ $# -gt 0 ]; do
    case "$1" in
    --version | --to)
        [ $# -ge 2 ] || fail "$1 needs a value"
        if [ "$1" = --to ]; then to="$2"; else version="${2#v}"; fi
        shift 2
        ;;
    -h | --help)
        sed -n '2,7p' "$0"
        exit 0
        ;;
    *) fail "unknown argument $1; --version 0.1.0 and --to DIR are known" ;;
    esac
done

[ -n "$releases" ] || fail "set TS3100_RELEASES to the address of the releases, such as https://HOST/PROJECT/releases/download"

case "$(uname -s)-$(uname -m)" in
Linux-x86_64 | Linux-amd64) target=x86_64-unknown-linux-musl ;;
Linux-aarch64 | Linux-arm64) target=aarch64-unknown-linux-musl ;;
Darwin-x86_64) target=x86_64-apple-darwin ;;
Darwin-arm64) target=aarch64-apple-darwin ;;
*) fail "there is no program for $(uname -s) on $(uname -m); build it: cargo install --locked --path crates/emulator" ;;
esac

if command -v curl >/dev/null; then
    get() { curl -fsSL --retry 3 -o "$2" "$1"; }
elif command -v wget >/dev/null; then
    get() { wget -q -O "$2" "$1"; }
else
    fail "curl or wget is needed"
fi
if command -v sha256sum >/dev/null; then
    sums() { sha256sum "$@"; }
else
    sums() { shasum -a 256 "$@"; }
fi

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
case "$version" in
"")
    get "${releases%/download}/latest/download/SHA256SUMS" SHA256SUMS || fail "cannot get the newest release of $releases"
    version="$(sed -n "s/.*  ts3100-\(.*\)-$target\.tar\.gz\$/\1/p" SHA256SUMS)"
    [ -n "$version" ] || fail "the newest release has no program for $target"
    ;;
*) get "$releases/v$version/SHA256SUMS" SHA256SUMS || fail "there is no release $version at $releases" ;;
esac
name="ts3100-$version-$target"
get "$releases/v$version/$name.tar.gz" "$name.tar.gz" || fail "release $version has no program for $target"
grep -F "  $name.tar.gz" SHA256SUMS >expected || fail "SHA256SUMS does not list $name.tar.gz"
[ "$(sums "$name.tar.gz")" = "$(cat expected)" ] || fail "$name.tar.gz is not the file of SHA256SUMS: it was damaged or replaced"
tar -xzf "$name.tar.gz"
cd - >/dev/null
mkdir -p "$to"
# In one step: a running program of that name goes on.
cp "$scratch/$name/ts3100" "$to/.ts3100.new"
chmod 755 "$to/.ts3100.new"
mv "$to/.ts3100.new" "$to/ts3100"
echo "$("$to/ts3100" --version) is $to/ts3100"
case ":$PATH:" in
*":$to:"*) ;;
*) echo "$to is not in PATH: add  export PATH=\"$to:\$PATH\"  to the profile of your shell" ;;
esac
