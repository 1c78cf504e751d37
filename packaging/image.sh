#!/bin/sh
# What the image of packaging/Dockerfile is made of, for a static binary.
#
#     packaging/image.sh root BINARY FILE      the root of the image as a tar file: the binary, /drive and /tmp
#     packaging/image.sh context BINARY        a build context on stdout: that file, and the last stage of the Dockerfile
#
# For example:  packaging/image.sh context ts3100 | docker build -t ts3100 -
set -eu

if [ $# -lt 2 ] || ! [ -f "$2" ]; then
    sed -n '2,8p' "$0" >&2
    exit 2
fi
what="$1" binary="$2"
# There is nothing in the image that would load a shared library.
if LC_ALL=C grep -qE '/ld-(linux|musl)' "$binary"; then
    echo "$binary is not a static program. This builds one:" >&2
    echo "    rustup target add $(uname -m)-unknown-linux-musl" >&2
    echo "    cargo build --profile dist --target $(uname -m)-unknown-linux-musl -p ts3100-emulator --bin ts3100" >&2
    exit 1
fi
here="$(cd "$(dirname "$0")" && pwd)"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

# root FILE
root() {
    mkdir -p "$scratch/image/usr/local/bin" "$scratch/image/drive" "$scratch/image/tmp"
    cp "$binary" "$scratch/image/usr/local/bin/ts3100"
    chmod 755 "$scratch/image/usr/local/bin/ts3100" "$scratch/image/drive"
    chmod 1777 "$scratch/image/tmp"
    # By number: there is no /etc/passwd.
    (cd "$scratch/image" && tar --owner=1000 --group=1000 --numeric-owner -cf - drive tmp usr) >"$1"
}

case "$what" in
root) root "$3" ;;
context)
    mkdir "$scratch/context"
    root "$scratch/context/root.tar"
    version="$(sed -n 's/^version = "\(.*\)"/\1/p' "$here/../Cargo.toml" | head -1)"
    revision="$(git -C "$here" rev-parse HEAD 2>/dev/null || echo unknown)"
    sed -e '1,/^# -- last stage/d' -e 's|^COPY --from=build .*|ADD root.tar /|' \
        -e "s/^ARG .*/ARG VERSION=$version REVISION=$revision/" "$here/Dockerfile" >"$scratch/context/Dockerfile"
    tar -cf - -C "$scratch/context" Dockerfile root.tar
    ;;
*)
    sed -n '2,8p' "$0" >&2
    exit 2
    ;;
esac
