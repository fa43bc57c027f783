#!/bin/sh
# Draws the figures of docs/lecture.md by the commands that stand there. Those that read $YUGEN_DATA are passed over
# where it is not set. Build the program first: cargo build --release
set -eu
cd "$(dirname "$0")/.."
PATH="$PWD/target/release:$PATH"
mkdir -p docs/images/lecture out/lecture
sed -n '/^```sh$/,/^```$/p' docs/lecture.md | grep '^yugen ' | while read -r line; do
    case "$line" in
    *YUGEN_DATA*|*out/lecture*) [ -n "${YUGEN_DATA:-}" ] || continue ;;
    esac
    echo "$line"
    eval "$line" </dev/null
done
