#!/usr/bin/env bash
# The emulator's core against Unicorn and QEMU: an optional job (README.md). Needs Python 3.11, arm-none-eabi-gcc,
# qemu-system-arm; unicorn and capstone come from PyPI into target/oracle. `run.sh [SEED [COUNT]]`
set -euo pipefail
cd "$(dirname "$0")/../../.."
seed=${1:-1}
count=${2:-20000}
target=${CARGO_TARGET_DIR:-$PWD/target}
work=$target/oracle
oracle=$PWD/crates/f407emu/oracle

cargo build --quiet -p leadscrew-f407emu --example vectors --example run
examples=$target/debug/examples

mkdir -p "$work"
[ -x "$work/venv/bin/python" ] || python3 -m venv "$work/venv"
"$work/venv/bin/pip" install --quiet unicorn==2.1.4 capstone==5.0.9

for kind in all fp nan 16; do
  echo "single instructions against Unicorn: $kind, seed $seed, $count"
  "$work/venv/bin/python" "$oracle/difftest.py" "$examples/vectors" "$seed" "$count" "$kind"
done

echo "exceptions against QEMU"
arm-none-eabi-gcc -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -O2 -ffreestanding -nostdlib \
  -T "$oracle/exceptions/exc.ld" -o "$work/exc.elf" "$oracle/exceptions/exc.c"
rm -f "$work/qemu.txt"
# The program ends in an endless loop: QEMU is stopped.
timeout 20 qemu-system-arm -M netduinoplus2 -display none -monitor none -serial null -serial "file:$work/qemu.txt" \
  -kernel "$work/exc.elf" 2>/dev/null || true
"$examples/run" "$work/exc.elf" 1000 >"$work/ours.txt"
line=$(tr -d '\r' <"$work/qemu.txt" | head -1)
echo "QEMU: $line"
[ -n "$line" ]
grep --fixed-strings --quiet -- "$line" "$work/ours.txt" || { echo "ours:"; cat "$work/ours.txt"; exit 1; }
echo "the same"
