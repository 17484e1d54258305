#!/usr/bin/env python3
"""Random curves in short lines: the limits of the axes on the step edges, and the time beside the shortest one.

  python3 bench/axis_limits/curves.py target/release/leadscrew [--jobs 100] [--family borders] [--jerk 5000]

Fails where an axis takes more than `MOST` of its acceleration, or more than its rate, where it ends beside its
place, where a family takes more than `SLOWEST` times the shortest time in the mean, or one of its jobs more than `SLOWEST_JOB`.
With a jerk limit it fails where the path takes more than that, and times are only told.
"""
import argparse
import math
import random
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from limits import ends_where_it_should, worst_acceleration, worst_jerk, worst_rate
from program import Machine, Program, along
from shortest import shortest_time

SLOWEST = 1.03
SLOWEST_JOB = {'circles': 1.05, 'rounded': 1.03}
FASTEST = 1.001  # of the rate
JERK = 1.01  # of the jerk
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


def letters(rng, name):
    """Strokes of curves and corners as in a font, in lines of 0.2 mm."""
    program, heading = Program(name, 1500, 3), rng.uniform(0, 2 * math.pi)
    for _ in range(rng.randint(6, 14)):
        if rng.random() < 0.4:
            heading = rng.uniform(0, 2 * math.pi)
        after, size = rng.uniform(0, 2 * math.pi), rng.uniform(1, 5)
        leave, arrive = size * along(heading), size * along(after)
        end = 0.6 * (leave + arrive)
        share = np.linspace(0, 1, 400)[:, None]
        points = 3 * share * (1 - share) ** 2 * 0.45 * leave + 3 * share ** 2 * (1 - share) * (end - 0.45 * arrive) + share ** 3 * end
        lengths = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
        places = np.append(np.arange(0.2, lengths[-1], 0.2), lengths[-1])
        ends = [program.at + [np.interp(place, lengths, points[:, axis]) for axis in range(2)] for place in places]
        program.curve(ends, program.at + points)
        heading = after
    return program, replace(machine(rng, (250,)), deviation=0.01)


FAMILIES = {'borders': borders, 'chains': chains, 'narrow': narrow, 'circles': circles, 'rounded': rounded, 'letters': letters}
MOST = 1.05  # of the acceleration


def judged(binary, family, number, jerk):
    name = f'{family} {number}'
    program, of = FAMILIES[family](random.Random(name), name)
    of = replace(of, jerk=jerk)
    run = program.run(binary, of)
    share, axis, h, time = worst_acceleration(program, of, run)
    text = (f'{name}: {share:.3f} of the acceleration of {"XY"[axis]} over {h * 1000:g} ms at {time:.3f} s '
            f'({of.steps_per_mm} steps/mm, {of.rate}/{of.acceleration}, $11={of.deviation})')
    if jerk:
        from eased import shortest_time as shortest  # needs more packages
        jerked, seconds = worst_jerk(program, of, run)[0], run.seconds + first_step(of)
    else:
        shortest, jerked, seconds = shortest_time, 0.0, run.seconds
    ends = ends_where_it_should(program, of, run)
    return share, worst_rate(of, run), jerked, ends, seconds / shortest(program, of), text


def first_step(machine):
    """The time from rest to the first step, s: x = j t^3 / 6."""
    return (6 / (machine.steps_per_mm * machine.jerk)) ** (1 / 3)


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument('binary')
    args.add_argument('--jobs', type=int, default=100)
    args.add_argument('--first', type=int, default=0)
    args.add_argument('--family', choices=FAMILIES, action='append')
    args.add_argument('--jerk', type=float, default=0.0, help='with a jerk limit, mm/s3; it needs clarabel and scipy')
    args = args.parse_args()
    failed = []
    print('| curves | jobs | above 1.01 | most acceleration | most rate | most jerk | time over the shortest, mean | most |')
    print('|---|---|---|---|---|---|---|---|', flush=True)
    for family in args.family or FAMILIES:
        with ThreadPoolExecutor(2) as pool:
            jobs = range(args.first, args.first + args.jobs)
            results = list(pool.map(lambda number: judged(args.binary, family, number, args.jerk), jobs))
        shares, rates, jerks, ends, times, texts = zip(*results)
        print(f'| {family} | {len(jobs)} | {sum(share > 1.01 for share in shares)} | {max(shares):.3f} | {max(rates):.3f} | {max(jerks):.3f} '
              f'| {np.mean(times):.3f} | {max(times):.3f} |', flush=True)
        failed += [text for share, rate, jerk, end, _, text in results
                   if share > MOST or rate > FASTEST or jerk > JERK or not end]
        if args.jerk:
            continue
        if np.mean(times) > SLOWEST:
            failed.append(f'{family}: {np.mean(times):.3f} of the shortest time in the mean')
        if max(times) > SLOWEST_JOB.get(family, math.inf):
            failed.append(f'{texts[np.argmax(times)]}: {max(times):.3f} of the shortest time')
    sys.exit('\n'.join(failed) if failed else 0)


if __name__ == '__main__':
    main()
