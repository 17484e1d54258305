#!/usr/bin/env bash
# Random curves in short lines against the limits of the axes, the shortest time, and a growing $11 (see README.md).
#
#   bench/axis_limits/run.sh           # 320 curves of each sort: two minutes
#   bench/axis_limits/run.sh --quick   # 60: what `.ci/run optimal` asks for
#
# LEADSCREW names the program; without it, it is built first. numpy is installed under target/axis_limits.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
target=${CARGO_TARGET_DIR:-$here/../../target}
jobs=320
if [ "${1:-}" = --quick ]; then jobs=60; fi
if [ -z "${LEADSCREW:-}" ]; then
  cargo build --quiet --manifest-path "$here/../../Cargo.toml" -p leadscrew-cli
  LEADSCREW=$target/debug/leadscrew
fi
python=$target/axis_limits/bin/python
if ! cmp -s "$here/requirements.txt" "$target/axis_limits/requirements.txt"; then
  python3 -m venv "$target/axis_limits"
  "$python" -m pip install --quiet --disable-pip-version-check -r "$here/requirements.txt"
  cp "$here/requirements.txt" "$target/axis_limits/requirements.txt"
fi
"$python" "$here/curves.py" "$LEADSCREW" --jobs "$jobs"
"$python" "$here/deviations.py" "$LEADSCREW" --jobs "$jobs"
