#!/usr/bin/env bash
# Imports boards that gerbonara (PyPI) and we write in many formats, and compares the job with what
# gerbonara reads.
#
# LEADSCREW names the program; without it, it is built first. gerbonara is installed under
# target/import.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
target=${CARGO_TARGET_DIR:-$here/../../target}
if [ -z "${LEADSCREW:-}" ]; then
  cargo build --quiet --manifest-path "$here/../../Cargo.toml" -p leadscrew-cli
  LEADSCREW=$target/debug/leadscrew
fi
python=$target/import/bin/python
if ! cmp -s "$here/requirements.txt" "$target/import/requirements.txt"; then
  python3 -m venv "$target/import"
  "$python" -m pip install --quiet --disable-pip-version-check -r "$here/requirements.txt"
  cp "$here/requirements.txt" "$target/import/requirements.txt"
fi
"$python" "$here/oracle.py" "$LEADSCREW"
