#!/usr/bin/env bash
# What action.yml does: `get` brings the program and puts it on the PATH of later steps, `run` runs the tests around it and
# writes the summary of the job. Inputs are in variables INPUT_..., as the action sets them.
set -euo pipefail

# Prints the target of this runner.
target() {
    case "${RUNNER_OS:?}-${RUNNER_ARCH:?}" in
    Linux-X64) echo x86_64-unknown-linux-musl ;;
    Linux-ARM64) echo aarch64-unknown-linux-musl ;;
    Windows-X64) echo x86_64-pc-windows-gnu ;;
    macOS-X64) echo x86_64-apple-darwin ;;
    macOS-ARM64) echo aarch64-apple-darwin ;;
    *)
        echo "no program for $RUNNER_OS on $RUNNER_ARCH; give the input binary" >&2
        exit 2
        ;;
    esac
}

sums() { if command -v sha256sum >/dev/null; then sha256sum "$@"; else shasum -a 256 "$@"; fi; }

get() {
    local folder="$RUNNER_TEMP/ts3100" name archive base
    mkdir -p "$folder"
    if [ -n "${INPUT_BINARY:-}" ]; then
        local ending=""
        [ "${RUNNER_OS:-}" != Windows ] || ending=.exe
        cp "$INPUT_BINARY" "$folder/ts3100$ending"
        chmod +x "$folder/ts3100$ending"
    else
        name="ts3100-$INPUT_VERSION-$(target)"
        archive="$name.tar.gz"
        [ "$RUNNER_OS" != Windows ] || archive="$name.zip"
        base="${TS3100_RELEASES:-${GITHUB_SERVER_URL:-https://github.com}/$ACTION_REPOSITORY/releases/download}/v$INPUT_VERSION"
        curl -fsSL --retry 3 -o "$folder/$archive" "$base/$archive"
        curl -fsSL --retry 3 -o "$folder/SHA256SUMS" "$base/SHA256SUMS"
        if ! (cd "$folder" && grep -F "  $archive" SHA256SUMS >expected && [ "$(sums "$archive")" = "$(cat expected)" ]); then
            echo "$archive is not the file of $base/SHA256SUMS: it was damaged or replaced" >&2
            exit 1
        fi
        case "$archive" in
        *.zip) unzip -qo "$folder/$archive" -d "$folder" ;;
        *) tar -xzf "$folder/$archive" -C "$folder" ;;
        esac
        folder="$folder/$name"
    fi
    "$folder/ts3100" --version
    echo "$folder" >>"$GITHUB_PATH"
}

run() {
    local report="$INPUT_REPORT" code=0 flags=()
    mkdir -p "$report"
    [ -z "${INPUT_LOAD:-}" ] || flags+=(--load "$INPUT_LOAD")
    [ -z "${INPUT_SELECT:-}" ] || flags+=(--select "$INPUT_SELECT")
    [ -z "${INPUT_SCENARIO:-}" ] || flags+=(--scenario "$INPUT_SCENARIO" --junit "$report/scenario.xml")
    [ "${INPUT_DENY:-none}" = none ] || flags+=(--deny "$INPUT_DENY")
    # shellcheck disable=SC2206  # words with blanks between them
    [ -z "${INPUT_ARGS:-}" ] || flags+=($INPUT_ARGS)
    ts3100 exec --time "$INPUT_TIME" --transcript "$report/transcript.txt" --coverage "$report/coverage.html" \
        --findings "$report/findings.md" --findings "$report/findings.json" --findings "$report/findings.xml" \
        --findings "$report/findings.sarif" ${flags[@]+"${flags[@]}"} -- bash -eo pipefail -c "$INPUT_RUN" || code=$?
    [ ! -s "$report/findings.md" ] || cat "$report/findings.md" >>"$GITHUB_STEP_SUMMARY"
    {
        echo "exit-code=$code"
        echo "findings=$report/findings.json"
    } >>"$GITHUB_OUTPUT"
    exit "$code"
}

case "${1-}" in
get | run) "$1" ;;
*)
    echo "usage: packaging/action.sh get|run" >&2
    exit 2
    ;;
esac
