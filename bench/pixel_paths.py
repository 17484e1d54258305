#!/usr/bin/env python3
"""Outlines of pixels: what the rule that keeps all limits ($704=0) costs beside Grbl's ($704=1).

  python3 bench/pixel_paths.py target/release/leadscrew [--paths 40]

Paths go from pixel to pixel, to one of the eight neighbours: traced circles, traced blobs, and walks at random. Pixels are
0.02 to 0.1 mm wide. Both times are from the first step to the last. Grbl's rule takes the shortest time that its limits allow
(`optimal_check.py`).
"""
import argparse, json, math, random, subprocess, tempfile
from pathlib import Path

NEIGHBOURS = [(round(math.cos(k * math.pi / 4)), round(math.sin(k * math.pi / 4))) for k in range(8)]


def walk(rng, _):
    heading, x, y, path = 0, 0, 0, []
    for _ in range(400):
        heading = max(-1, min(2, heading + rng.choice((-1, 0, 1))))
        x, y = x + NEIGHBOURS[heading][0], y + NEIGHBOURS[heading][1]
        path.append((x, y))
    return path


def trace(rng, width, lobes):
    radius = rng.uniform(1, 8) / width
    angles = (k / (3 * radius) for k in range(int(6 * math.pi * radius)))
    rings = ((radius * (1 + (0.25 * math.sin(lobes * t) if lobes else 0)), t) for t in angles)
    path = []
    for r, t in rings:
        pixel = (round(r * math.cos(t) - radius), round(r * math.sin(t)))
        if pixel != (path[-1] if path else (0, 0)):
            path.append(pixel)
    return path[:3000]


KINDS = {
    'walk': walk,
    'circle': lambda rng, width: trace(rng, width, 0),
    'blob': lambda rng, width: trace(rng, width, rng.randint(2, 5)),
}


def seconds(binary, job, settings, rule):
    flags = [flag for key, value in (settings | {'$704': rule}).items() for flag in ('--set', f'{key}={value}')]
    out = subprocess.run([binary, 'run', '--json', *flags, job], check=True, capture_output=True, text=True).stdout
    return json.loads(out)['motion_seconds']


def main():
    args = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    args.add_argument('binary')
    args.add_argument('--paths', type=int, default=40)
    args = args.parse_args()
    ratios = []
    print('| path | pixel | steps/mm | mm/s² | mm/min | time beside $704=1 |\n|---|---|---|---|---|---|')
    for number in range(args.paths):
        rng = random.Random(number)
        kind, width = rng.choice(list(KINDS)), rng.choice((0.02, 0.05, 0.1))
        steps, acceleration, feed = rng.choice((80, 250, 800)), rng.choice((200, 500, 1500, 3000)), rng.choice((1000, 3000, 6000))
        path = KINDS[kind](rng, width)
        lines = ['G21G90G94', f'G1F{feed}', *(f'X{x * width:.4f}Y{y * width:.4f}' for x, y in path)]
        settings = {'$0': 1} | {f'${base + axis}': value for base, value in ((100, steps), (110, 6000), (120, acceleration)) for axis in range(3)}
        with tempfile.TemporaryDirectory() as folder:
            job = Path(folder) / 'path.nc'
            job.write_text('\n'.join(lines) + '\n')
            kept, grbl = (seconds(args.binary, job, settings, rule) for rule in (0, 1))
        ratios.append(kept / grbl)
        print(f'| {kind} | {width} mm | {steps} | {acceleration} | {feed} | {kept / grbl:.3f} |', flush=True)
    slow = sum(ratio > 1.10 for ratio in ratios)
    print(f'\n{len(ratios)} paths: mean {sum(ratios) / len(ratios):.3f}, most {max(ratios):.3f}, {slow} above 1.10')


if __name__ == '__main__':
    main()
