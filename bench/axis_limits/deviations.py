#!/usr/bin/env python3
"""A greater junction deviation ($11) makes no job slower.

  python3 bench/axis_limits/deviations.py target/release/leadscrew [--jobs 100]

Random curves of `curves.py`, and lines and staircases in pieces of a few steps, with `$11` from 0.001 to 0.5. Fails where a
job takes `MOST` times as long as with a smaller one, or a narrow curve `NARROW` times.
"""
import argparse
import math
import random
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from curves import borders, chains, machine, narrow
from program import Program

MOST = 1.005
NARROW = 1.03
DEVIATIONS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)


def pieces(rng, name):
    """Pieces of 0.01 to 0.2 mm that turn at random, by up to 60 degrees."""
    program, piece = Program(name, rng.choice((600, 1500, 3000)), rng.choice((3, 4))), 10 ** rng.uniform(-2, -0.7)
    most, at, heading = rng.choice((0.05, 0.2, 1.0)), np.zeros(2), rng.uniform(0, 2 * math.pi)
    ends = []
    for _ in range(rng.randint(50, 400)):
        heading += rng.uniform(-most, most)
        at = at + piece * np.array([math.cos(heading), math.sin(heading)])
        ends.append(at)
    program.curve(ends, np.vstack([[0, 0], ends]))
    return program, machine(rng)


def stairs(rng, name):
    """Steps to one side and ahead in turn."""
    program, piece = Program(name, rng.choice((600, 1500, 3000)), 3), rng.choice((0.02, 0.05, 0.1))
    ends = [piece * np.array([(k + 1) // 2, k // 2]) for k in range(1, rng.randint(50, 400))]
    program.curve(ends, np.vstack([[0, 0], ends]))
    return program, machine(rng)


JOBS = {'borders': borders, 'chains': chains, 'narrow': narrow, 'pieces': pieces, 'stairs': stairs}


def judged(binary, number):
    """How many times as long as with a smaller `$11` the job takes at most, whether that is too many, and the times."""
    family = list(JOBS)[number % len(JOBS)]
    name = f'{family} {number}'
    program, of = JOBS[family](random.Random(name), name)
    seconds = [program.seconds(binary, replace(of, deviation=deviation)) for deviation in DEVIATIONS]
    growth = max(later / min(seconds[:k + 1]) for k, later in enumerate(seconds))
    most = NARROW if family == 'narrow' else MOST
    return growth, growth > most, f'{name}: {growth:.4f}; {of}: {" ".join(f"{second:.4f}" for second in seconds)}'


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument('binary')
    args.add_argument('--jobs', type=int, default=100)
    args = args.parse_args()
    with ThreadPoolExecutor(2) as pool:
        results = sorted(pool.map(lambda number: judged(args.binary, number), range(args.jobs)), reverse=True)
    slower = [text for _, failed, text in results if failed]
    print(f'{args.jobs} jobs, $11 from {DEVIATIONS[0]} to {DEVIATIONS[-1]}: {len(slower)} fail, a greater one takes '
          f'at most {results[0][0]:.4f} times as long')
    sys.exit('\n'.join(slower) if slower else 0)


if __name__ == '__main__':
    main()
