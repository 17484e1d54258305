#!/usr/bin/env bash
# Replays every recorded conversation with Grbl and compares the answers with Grbl's.
#
#   run.sh [CASES]...     CASES: folders of recordings, those beside this script unless told
#
# LEADSCREW names the program; without it, it is built first.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
[ $# -gt 0 ] || set -- "$here/cases" "$here/round2" "$here/round3"
if [ -z "${LEADSCREW:-}" ]; then
  cargo build --manifest-path "$here/../../Cargo.toml" -p leadscrew-cli
  target=${CARGO_TARGET_DIR:-$here/../../target}
  LEADSCREW=$target/debug/leadscrew
fi
answers=$(mktemp -d)
trap 'rm -rf "$answers"' EXIT
failed=0
for cases in "$@"; do
  folder=$answers/$(basename "$cases")
  (cd "$cases" && find . -name '*.json') | while read -r case; do
    mkdir -p "$folder/$(dirname "$case")"
    "$LEADSCREW" replay "$cases/$case" >"$folder/$case"
  done
  python3 "$here/compare.py" --rows "$here/deviations.toml" --dir "$cases" "$folder" || failed=1
done
exit $failed
