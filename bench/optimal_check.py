#!/usr/bin/env python3
"""No time wasted: `leadscrew run` against the shortest possible time.

  python3 bench/optimal_check.py target/release/leadscrew /tmp/workloads               # whole workloads
  python3 bench/optimal_check.py target/release/leadscrew /tmp/workloads --lines 3000  # their beginnings

Runs raster, spiral and adaptive at four settings with Grbl's corner rule ($704=1) and with 1024 moves of look-ahead, from
the first to the last step, and compares with `optimal_time.py --lookahead inf`, which plans by that rule. Fails where a
job takes 0.1 % longer. The last column is what the rule that keeps all limits ($704=0) costs.
"""
import argparse, json, subprocess, sys, tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
JOBS = ('raster', 'spiral', 'adaptive')
SETTINGS = ((500, 10), (2000, 200), (5000, 200), (5000, 1000))
MOST = 1.001


def run(binary, job, rate, acceleration, rule):
    sets = {f'${number + axis}': value for number, value in ((110, rate), (120, acceleration)) for axis in range(3)}
    sets |= {'$32': 1, '$704': rule}
    flags = [flag for key, value in sets.items() for flag in ('--set', f'{key}={value}')]
    out = subprocess.run([binary, 'run', '--json', *flags, job], check=True, capture_output=True, text=True).stdout
    return json.loads(out)['motion_seconds']


def shortest(job, rate, acceleration):
    with tempfile.NamedTemporaryFile('w', suffix='.json') as settings:
        json.dump({'max_rate': rate, 'accel': acceleration, 'laser_mode': True}, settings)
        settings.flush()
        command = [sys.executable, HERE / 'optimal_time.py', job, '--settings', settings.name, '--lookahead', 'inf', '--json']
        out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return json.loads(out)['seconds']


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument('binary')
    args.add_argument('workloads', type=Path)
    args.add_argument('--lines', type=int, help='take the first so many lines of each')
    args = args.parse_args()
    failed = False
    print('| job | settings | shortest possible | leadscrew | ratio | limits kept |\n|---|---|---|---|---|---|', flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in JOBS:
            lines = (args.workloads / f'{name}.gcode').read_text().splitlines()[:args.lines]
            job = Path(folder) / f'{name}.gcode'
            job.write_text('\n'.join(lines) + '\n')
            for rate, acceleration in SETTINGS:
                least = shortest(job, rate, acceleration)
                grbl, kept = (run(args.binary, job, rate, acceleration, rule) for rule in (1, 0))
                ratio = grbl / least
                failed |= ratio > MOST
                print(f'| {name} | {rate} mm/min, {acceleration} mm/s² | {least:.3f} s | {grbl:.3f} s | {ratio:.5f} '
                      f'| {kept:.3f} s, {kept / grbl:.3f} |', flush=True)
    sys.exit(f'slower than {MOST} of the shortest time' if failed else 0)


if __name__ == '__main__':
    main()
