#!/usr/bin/env bash
# Starts an emulator on free ports, does something with it, ends it, and shows what its log says of faults.
#
#     tests/try.sh [FLAGS OF ts3100 serve] -- 'COMMANDS'
#
# The commands find HOST:PORT of the channels in $IP0 and $IP1, of a serial port HOST over TCP in $HOST, and `ts3100`
# in their path; `talk` and `say` are explained below. The exit code is theirs.
set -u
flags=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do flags+=("$1"); shift; done
shift
command -v ts3100 >/dev/null || PATH="${CARGO_TARGET_DIR:-target}/release:${CARGO_TARGET_DIR:-target}/debug:$PATH"

folder="$(mktemp -d)"
mkfifo "$folder/ready"
ts3100 serve --ports auto --ready-json "${flags[@]}" >"$folder/ready" 2>"$folder/log" &
robot=$!
trap 'kill "$robot" 2>/dev/null; wait "$robot" 2>/dev/null; rm -rf "$folder"' EXIT
if ! read -r ready <"$folder/ready"; then cat "$folder/log" >&2; exit 2; fi
port() { sed -n "s/.*\"$1\":\([0-9]*\).*/127.0.0.1:\1/p" <<<"$ready"; }
IP0="$(port ip0)" IP1="$(port ip1)"
HOST="$(sed -n 's/.*"host":"[a-z0-9]*:\/\/\([^"]*\)".*/\1/p' <<<"$ready")"
export IP0 IP1 HOST PATH

# talk CHANNEL RECORD [COMMAND]: connects, runs the command, sends the record, shows what comes.
talk() {
    exec 3<>"/dev/tcp/${1/://}"
    if [ $# -gt 2 ]; then "${@:3}"; fi
    say "" "$2\r" | tr '\r' '\n'
    exec 3>&-
}
# say CHANNEL BYTES: sends bytes, `\r` and `\2` as printf has them, and shows for a second what comes.
say() {
    [ -z "$1" ] || exec 3<>"/dev/tcp/${1/://}"
    printf '%b' "$2" >&3
    timeout 1 cat <&3 | tr '\2\3\32' '<>$' || true
    [ -z "$1" ] || exec 3>&-
}
export -f talk say

bash -uo pipefail -c "$1"
code=$?
kill "$robot" && wait "$robot"
sed -n 's/^[^ ]* *//; /fault/p' "$folder/log"
exit "$code"
