#!/usr/bin/env python3
"""Random curves in short lines: the limits of the axes on the step edges, and the time beside the shortest one.

  python3 bench/axis_limits/curves.py target/release/leadscrew [--jobs 100] [--family borders]

Fails where an axis takes more than `MOST` of its acceleration, or more than its rate, where it ends beside its
place, where a family takes more than `SLOWEST` times the shortest time in the mean, or one of its jobs more than `SLOWEST_JOB`.
"""
import argparse
import math
import random
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from limits import ends_where_it_should, worst_acceleration, worst_rate
from program import Machine, Program, along
from shortest import shortest_time

SLOWEST = 1.03
SLOWEST_JOB = {'circles': 1.05, 'rounded': 1.03}
FASTEST = 1.001  # of the rate
LIMITS = ((500, 10), (2000, 200), (3000, 200), (5000, 500), (10000, 1500))  # mm/min, mm/s2
DEVIATIONS = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1)


def machine(rng, scales=(80, 250, 800)):
    rate, acceleration = rng.choice(LIMITS)
    return Machine(rng.choice(scales), rate, acceleration, rng.choice(DEVIATIONS))


def begun(rng, name):
    return Program(name, rng.choice((600, 1500, 3000, 8000)), rng.choice((3, 3, 4)))


def borders(rng, name):
    """A line, a curve that it touches, a line that touches the curve's end, up to three times."""
    program, heading, radius = begun(rng, name), rng.uniform(0, 2 * math.pi), 10 ** rng.uniform(-0.3, 1.3)
    piece, length = min(rng.choice((0.05, 0.1, 0.2, 0.3, 0.5)), 0.35 * radius), rng.uniform(2, 20)
    for _ in range(rng.randint(1, 3)):
        program.line(length * along(heading))
        sweep = rng.choice((1, -1)) * rng.uniform(0.3, 4)
        program.arc(heading, radius, sweep, max(2, round(abs(sweep) * radius / piece)))
        heading += sweep
    program.line(length * along(heading))
    return program, machine(rng)


def chains(rng, name):
    """Arcs that touch each other, to both sides."""
    program, heading, radius = begun(rng, name), rng.uniform(0, 2 * math.pi), 10 ** rng.uniform(-0.3, 1)
    piece = min(rng.choice((0.05, 0.1, 0.2)), 0.15 * radius)
    for _ in range(rng.randint(3, 9)):
        bend, sweep = radius * rng.uniform(0.5, 2), rng.choice((1, -1)) * rng.uniform(0.4, 2.8)
        program.arc(heading, bend, sweep, max(2, round(abs(sweep) * bend / piece)))
        heading += sweep
    return program, machine(rng)


def narrow(rng, name):
    """Curves of a few steps' radius between lines."""
    of, program, heading = machine(rng, (40, 80, 160)), begun(rng, name), rng.uniform(0, 2 * math.pi)
    radius = 10 ** rng.uniform(0.3, 1.7) / of.steps_per_mm
    for _ in range(rng.randint(1, 4)):
        program.line(rng.uniform(1, 10) * along(heading))
        sweep = rng.choice((1, -1)) * rng.uniform(0.3, 4)
        program.arc(heading, radius, sweep, max(2, round(abs(sweep) * radius / rng.choice((0.02, 0.05)))))
        heading += sweep
    program.line(rng.uniform(1, 10) * along(heading))
    return program, of


def circles(rng, name):
    """Full and half circles in lines that stay within 0.01 mm of them."""
    of, program = machine(rng), Program(name, 30000, rng.choice((3, 3, 4)))
    radius = 10 ** rng.uniform(-0.3, 1.3)
    piece = rng.choice([piece for piece in (0.05, 0.1, 0.2, 0.3, 0.5) if piece ** 2 < 8 * radius * 0.0098])
    sweep = rng.choice((1, -1)) * rng.choice((math.pi, 2 * math.pi))
    program.arc(rng.uniform(0, 2 * math.pi), radius, sweep, round(abs(sweep) * radius / piece))
    return program, replace(of, deviation=0.01)


def rounded(rng, name):
    """Rectangles with round corners, at any angle."""
    of, program = machine(rng), Program(name, 30000, rng.choice((3, 3, 4)))
    heading, side, radius = rng.uniform(0, 2 * math.pi), rng.choice((1, -1)), 10 ** rng.uniform(-0.3, 1)
    piece = rng.choice([piece for piece in (0.05, 0.1, 0.2, 0.3, 0.5) if piece ** 2 < 8 * radius * 0.0098])
    lengths = [rng.uniform(2, 60), rng.uniform(2, 60)]
    for length in lengths * 2:
        program.line(length * along(heading))
        program.arc(heading, radius, side * math.pi / 2, max(2, round(math.pi / 2 * radius / piece)))
        heading += side * math.pi / 2
    return program, replace(of, deviation=0.01)


FAMILIES = {'borders': borders, 'chains': chains, 'narrow': narrow, 'circles': circles, 'rounded': rounded}
MOST = 1.05  # of the acceleration


def judged(binary, family, number, ramp):
    name = f'{family} {number}'
    program, of = FAMILIES[family](random.Random(name), name)
    if ramp:
        of = replace(of, jerk=of.acceleration / ramp)
    run = program.run(binary, of)
    share, axis, h, time = worst_acceleration(program, of, run)
    text = (f'{name}: {share:.3f} of the acceleration of {"XY"[axis]} over {h * 1000:g} ms at {time:.3f} s '
            f'({of.steps_per_mm} steps/mm, {of.rate}/{of.acceleration}, $11={of.deviation})')
    return share, worst_rate(of, run), ends_where_it_should(program, of, run), run.seconds / shortest_time(program, of), text


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument('binary')
    args.add_argument('--jobs', type=int, default=100)
    args.add_argument('--first', type=int, default=0)
    args.add_argument('--family', choices=FAMILIES, action='append')
    args.add_argument('--ramp', type=float, help='with a jerk limit: the seconds in which the acceleration grows')
    args = args.parse_args()
    failed = []
    print('| curves | jobs | above 1.01 | most acceleration | most rate | time over the shortest, mean | most |')
    print('|---|---|---|---|---|---|---|', flush=True)
    for family in args.family or FAMILIES:
        with ThreadPoolExecutor(2) as pool:
            jobs = range(args.first, args.first + args.jobs)
            results = list(pool.map(lambda number: judged(args.binary, family, number, args.ramp), jobs))
        shares, rates, ends, times, texts = zip(*results)
        print(f'| {family} | {len(jobs)} | {sum(share > 1.01 for share in shares)} | {max(shares):.3f} | {max(rates):.3f} '
              f'| {np.mean(times):.3f} | {max(times):.3f} |', flush=True)
        failed += [text for share, rate, end, _, text in results if share > MOST or rate > FASTEST or not end]
        if args.ramp:
            continue
        if np.mean(times) > SLOWEST:
            failed.append(f'{family}: {np.mean(times):.3f} of the shortest time in the mean')
        if max(times) > SLOWEST_JOB.get(family, math.inf):
            failed.append(f'{texts[np.argmax(times)]}: {max(times):.3f} of the shortest time')
    sys.exit('\n'.join(failed) if failed else 0)


if __name__ == '__main__':
    main()
