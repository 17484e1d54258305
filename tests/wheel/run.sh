#!/usr/bin/env bash
# Builds the wheel, installs it into a fresh virtual environment, and uses it from there.
# `tests/wheel/run.sh release` builds it as it is handed out; without it as the tests build
# everything else, which takes a tenth of the time.
set -euo pipefail
cd "$(dirname "$0")/../.."
profile=${1:-dev}
target=$(realpath "${CARGO_TARGET_DIR:-target}")
place=$target/wheel
rm -rf "$place"
mkdir -p "$place"
python3 -m venv "$place/tools"
"$place/tools/bin/pip" install --quiet 'maturin>=1.9,<2' mypy
"$place/tools/bin/maturin" build --quiet --profile "$profile" --manifest-path crates/cli/Cargo.toml --target-dir "$target" --out "$place/dist"
ls -lh "$place/dist"
"$place/tools/bin/mypy" --strict --cache-dir "$place/mypy" crates/cli/python/leadscrew
begun=$(date +%s%N)
python3 -m venv "$place/fresh"
"$place/fresh/bin/pip" install --quiet --no-index "$place"/dist/*.whl
"$place/fresh/bin/python" tests/wheel/try_it.py
echo "a fresh environment, the wheel and all that it was used for: $((($(date +%s%N) - begun) / 1000000)) ms"
"$place/fresh/bin/pip" install --quiet 'dask[distributed]>=2024'
"$place/fresh/bin/python" tests/wheel/try_dask.py
