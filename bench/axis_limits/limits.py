"""Acceleration and rate of the axes, from the step edges alone.

An axis whose acceleration is `a` at most has |x(t-h) - 2x(t) + x(t+h)| <= a h^2. What is not the machine's acceleration is
taken off: two steps for the rounding of three places (four where a window has few steps), and what the ends of lines are
rounded by. A curve in lines turns in jumps; where a line takes longer than h/2 the jump at its end is taken off as well.
"""
import math

import numpy as np

WINDOWS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4)  # h, s
FEWEST = 40  # steps in a h^2 of a window that is looked at
JITTER = 5e-6  # of an edge, s
AROUND = 4  # lines
SHARP = math.radians(15)  # a turn by more is a corner


def worst_acceleration(program, machine, run):
    """The largest share of the acceleration that an axis takes, the axis, h and the time."""
    corners = Corners(program, machine, run)
    scale = machine.steps_per_mm
    rounded = 4 * 0.5 * 10 ** -program.decimals * scale
    worst = (0.0, 0, 0.0, 0.0)
    for h in WINDOWS:
        allowed = machine.acceleration * scale * h * h
        if allowed < FEWEST or h > run.end - run.begin:
            continue
        times = np.arange(run.begin - h, run.end + h, max(h / 16, (run.end - run.begin) / 100_000))
        noise = rounded + (2 + 4 * JITTER * machine.rate / 60 * scale if allowed > 100 else 4)
        for axis in range(2):
            place = lambda shift: run.place(axis, times + shift)
            difference = np.abs(place(-h) - 2 * place(0) + place(h)) - noise
            share = (difference - corners.jumps(axis, h, times)) / allowed
            most = int(share.argmax())
            worst = max(worst, (float(share[most]), axis, h, float(times[most] - run.begin)))
    return worst


def worst_rate(machine, run):
    """The largest share of the rate that an axis takes over 20 ms."""
    h, worst = 0.02, 0.0
    times = np.arange(run.begin, run.end, h / 20)
    for axis in range(2):
        way = np.abs(run.place(axis, times + h) - run.place(axis, times)) - 1
        worst = max(worst, float(way.max()) / (machine.rate / 60 * machine.steps_per_mm * h))
    return worst


def worst_jerk(program, machine, run):
    """The largest share of the jerk along the path, and its time: |x(t+3h/2) - 3x(t+h/2) + 3x(t-h/2) - x(t-3h/2)| <= j h^3.

    Each of the eight places may be half a step off, and a rounded end of a line.
    """
    ends = program.steps(machine.steps_per_mm) / machine.steps_per_mm
    ways = np.diff(ends, axis=0)
    lengths = np.linalg.norm(ways, axis=1)
    moves = lengths > 0
    starts, courses, lengths = ends[:-1][moves], ways[moves] / lengths[moves, None], lengths[moves]
    before = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    ended = passed(program, machine, run)[moves]

    def along(times):
        """How far along the lines: on the one that ends next. Lines of few steps are run as one, and their ends are not passed.
        So a line beside it counts if it is nearer by more than a step."""
        at = np.stack([run.place(axis, times) for axis in range(2)], 1) / machine.steps_per_mm
        next_end = np.searchsorted(ended, times)
        nearest, found = np.full(len(times), np.inf), np.zeros(len(times))
        for shift in range(-AROUND, AROUND + 1):
            line = (next_end + shift).clip(0, len(ended) - 1)
            way = ((at - starts[line]) * courses[line]).sum(1).clip(0, lengths[line])
            off = np.linalg.norm(starts[line] + way[:, None] * courses[line] - at, axis=1)
            off -= 0 if shift else 1 / machine.steps_per_mm
            found = np.where(off < nearest, before[line] + way, found)
            nearest = np.minimum(off, nearest)
        return found

    noise = 8 * (0.5 / machine.steps_per_mm + 0.5 * 10 ** -program.decimals)
    worst = (0.0, 0.0)
    for h in WINDOWS:
        allowed = machine.jerk * h ** 3
        if allowed < 10 * noise or h > run.end - run.begin:
            continue
        times = np.arange(run.begin - 2 * h, run.end + 2 * h, max(h / 16, (run.end - run.begin) / 100_000))
        difference = sum(weight * along(times + share * h) for weight, share in ((1, 1.5), (-3, 0.5), (3, -0.5), (-1, -1.5)))
        share = (np.abs(difference) - noise) / allowed
        worst = max(worst, (float(share.max()), float(times[share.argmax()] - run.begin)))
    return worst


class Corners:
    """The turns of a program: when they are passed, and by how much the speed of each axis may jump there, steps/s."""

    def __init__(self, program, machine, run):
        ends = np.vstack([[0, 0], program.ends])
        ways = np.diff(ends, axis=0)
        lengths = np.linalg.norm(ways, axis=1)
        moves = lengths > 0
        courses, lengths = ways[moves] / lengths[moves, None], lengths[moves]
        self.times = passed(program, machine, run)[moves]
        took = np.diff(np.concatenate([[run.begin], self.times]))
        cosines = (courses[1:] * courses[:-1]).sum(1).clip(-1, 1)
        self.allowed = np.zeros((len(cosines), 2))
        speeds = lengths / np.maximum(took, 1e-9)
        for k, cosine in enumerate(cosines):
            # No faster than it went.
            fastest = 1.3 * max(speeds[k], speeds[k + 1]) + 1
            speed = min(junction_speed(courses[k], courses[k + 1], machine), fastest)
            self.allowed[k] = speed * np.abs(courses[k + 1] - courses[k]) * machine.steps_per_mm
        self.sharp = np.arccos(cosines) > SHARP
        self.longer = np.maximum(took[:-1], took[1:])

    def jumps(self, axis, h, times):
        """What the jumps make of a second difference about each time, steps."""
        sum_of_jumps = np.zeros(len(times))
        for k in np.nonzero(self.sharp | (self.longer > h / 2))[0]:
            first, last = np.searchsorted(times, [self.times[k] - h, self.times[k] + h])
            sum_of_jumps[first:last] += self.allowed[k, axis] * (h - np.abs(times[first:last] - self.times[k]))
        return sum_of_jumps


def passed(program, machine, run):
    """When each line has ended: its last step has come."""
    made = np.abs(np.diff(program.steps(machine.steps_per_mm), axis=0)).cumsum(0)
    times = np.full(len(made), run.begin)
    for axis in range(2):
        at = run.edges[axis][0]
        if len(at):
            last = at[np.clip(made[:, axis] - 1, 0, len(at) - 1)]
            times = np.maximum(times, np.where(made[:, axis] > 0, last, run.begin))
    return times


def ends_where_it_should(program, machine, run):
    """Whether each axis has made the steps to the last end."""
    wanted = program.steps(machine.steps_per_mm)[-1]
    return all((to[-1] if len(to) else 0) == want for (_, to), want in zip(run.edges, wanted))


def junction_speed(before, after, machine):
    """Junction deviation's speed (S. K. Jeon, 2011), mm/s."""
    cosine = -float(before @ after)
    if cosine > 0.999999:
        return 0.0
    if cosine < -0.999999:
        return math.inf
    turn = after - before
    acceleration = machine.acceleration * np.linalg.norm(turn) / np.abs(turn).max()
    s = math.sqrt(0.5 * (1 - cosine))
    return math.sqrt(acceleration * machine.deviation * s / (1 - s))
