#!/usr/bin/env bash
# Replays every recorded conversation with Grbl and compares the answers with Grbl's.
#
#   run.sh [CASES]     CASES: a folder of recordings, the one beside this script unless told
#
# LEADSCREW names the program; without it, it is built first.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
cases=${1:-$here/cases}
if [ -z "${LEADSCREW:-}" ]; then
  cargo build --manifest-path "$here/../../Cargo.toml" -p leadscrew-sim
  target=${CARGO_TARGET_DIR:-$here/../../target}
  LEADSCREW=$target/debug/leadscrew
fi
answers=$(mktemp -d)
trap 'rm -rf "$answers"' EXIT
(cd "$cases" && find . -name '*.json') | while read -r case; do
  mkdir -p "$answers/$(dirname "$case")"
  "$LEADSCREW" replay "$cases/$case" >"$answers/$case"
done
python3 "$here/compare.py" --rows "$here/deviations.toml" --dir "$cases" "$answers"
