"""The shortest time of a path with a jerk limit.

At each node of a grid `x` is the squared speed; between two nodes the acceleration along the path is constant:

    u = (x' - x) / 2d        d: the length between the nodes

The time between two nodes is a convex function of the speeds, and so is the sum of all. The limits of the axes are linear in
`x`. The jerk limit is not convex:

    |u' - u| <= jerk * (t + t') / 2

Its right side is convex, so it is never below its tangent at a known solution. With the tangent in its place the program is
convex, and its solution keeps the limit itself. It is solved anew around each solution, until the time stays. (It is not proved
that no plan is shorter.)
"""
import math

import clarabel
import numpy as np
import scipy.sparse as sparse

from shortest import path

STEP = 0.04  # mm of the grid
FEWEST = 40  # steps of a part
ROUNDS = 12
SLOWEST = 1e-4  # of the highest speed, around which the jerk limit is solved
SAME = 3e-4  # of the time, between two rounds
# Out of rest the acceleration grows from 0. The time of the first interval, and of the last, is then 3/2 of the time that a
# constant acceleration takes, and the mean acceleration (over the length) is 9/8 of `jerk * t`.
RAMP_TIME, RAMP_ACCELERATION = 3 / 2, 9 / 8


def shortest_time(program, machine):
    """Seconds from rest to rest."""
    lengths, tangents, curvatures, caps = path(program, machine, STEP, FEWEST)
    # In units of the highest speed and the acceleration, so that all numbers are near 1.
    speed, acceleration = math.sqrt(caps.max()), machine.acceleration
    length, time = speed ** 2 / acceleration, speed / acceleration
    problem = Problem(lengths / length, machine.jerk * time / acceleration)
    problem.axes(tangents, curvatures * length)
    problem.squares(caps / speed ** 2)
    problem.times()
    speeds, seconds = problem.solved(), math.inf
    for _ in range(ROUNDS):
        speeds = problem.solved(speeds)
        before, seconds = seconds, time * problem.time(speeds)
        if abs(seconds / before - 1) < SAME:
            break
    return seconds


class Problem:
    """Unknown: the squared speeds x of all nodes, the speeds w, the accelerations u between nodes and the times t."""

    def __init__(self, lengths, jerk):
        self.lengths, self.jerk = lengths, jerk
        self.between = np.arange(len(lengths))
        self.nodes = np.arange(len(lengths) + 1)
        self.width = 2 * (len(self.nodes) + len(self.between))
        self.weights = np.ones(len(lengths))
        self.weights[[0, -1]] = RAMP_TIME
        self.equal, self.bounds, self.cones = [], [], []
        row = self.between
        entries = (row, self.x(row + 1), 1.0), (row, self.x(row), -1.0), (row, self.u(row), -2 * lengths)
        self.equal.append((self.rows(len(row), *entries), np.zeros(len(row))))

    def x(self, node):
        return node

    def w(self, node):
        return len(self.nodes) + node

    def u(self, between):
        return 2 * len(self.nodes) + between

    def t(self, between):
        return 2 * len(self.nodes) + len(self.between) + between

    def time(self, speeds):
        return float(np.sum(self.weights * 2 * self.lengths / (speeds[1:] + speeds[:-1])))

    def rows(self, count, *entries):
        """A matrix of `count` rows; an entry is (rows, columns, values)."""
        flat = lambda part: np.concatenate([np.broadcast_to(entry[part], len(entry[0])) for entry in entries])
        return sparse.csc_matrix((flat(2), (flat(0), flat(1))), shape=(count, self.width))

    def axes(self, tangents, curvatures):
        """|p u + k x| <= 1 at both ends of each interval."""
        row = self.between
        for p, k in zip(tangents.T, curvatures.T):
            for sign in (1, -1):
                for end in (0, 1):
                    entries = (row, self.u(row), sign * p), (row, self.x(row + end), sign * k)
                    self.bounds.append((self.rows(len(row), *entries), np.ones(len(row))))

    def squares(self, caps):
        """0 <= x <= caps, and 0 <= w, w**2 <= x."""
        row, count = self.nodes, len(self.nodes)
        self.bounds.append((self.rows(count, (row, self.x(row), 1.0)), caps))
        self.bounds += [(self.rows(count, (row, of(row), -1.0)), np.zeros(count)) for of in (self.x, self.w)]
        first = 3 * row
        entries = (first, self.x(row), -1.0), (first + 1, self.x(row), -1.0), (first + 2, self.w(row), -2.0)
        self.cones.append((self.rows(3 * count, *entries), np.tile([1.0, -1.0, 0.0], count)))

    def times(self):
        """t (w + w') >= 2 d."""
        row, first = self.between, 3 * self.between
        speeds = [(first + part, self.w(row + end), sign) for part, sign in ((0, -1.0), (1, 1.0)) for end in (0, 1)]
        entries = *speeds, (first, self.t(row), -1.0), (first + 1, self.t(row), -1.0)
        constants = np.zeros(3 * len(row))
        constants[2::3] = 2 * np.sqrt(2 * self.lengths)
        self.cones.append((self.rows(3 * len(row), *entries), constants))

    def jerks(self, speeds):
        """The jerk limit around the solution `speeds`, and at the rests at both ends."""
        speeds = np.maximum(speeds, SLOWEST)
        inner, first, last = self.between[:-1], self.between[:1], self.between[-1:]
        for sign in (1.0, -1.0):
            yield self.jerk_bound(speeds, [(inner, -sign), (inner + 1, sign)], 0.5)
            yield self.jerk_bound(speeds, [(first, sign)], RAMP_ACCELERATION)
            yield self.jerk_bound(speeds, [(last, sign)], RAMP_ACCELERATION)

    def jerk_bound(self, speeds, changes, share):
        """The sum of the accelerations between nodes, each with its sign, is at most `share` of jerk times their times."""
        row = np.arange(len(changes[0][0]))
        entries, constants = [], np.zeros(len(row))
        for at, sign in changes:
            # By its tangent the time is at least  t * (3/2 - (x/w + x'/w') / 2(w + w'))  with t, w of the solution.
            both = speeds[at] + speeds[at + 1]
            gained = share * self.jerk * 2 * self.lengths[at] / both
            entries.append((row, self.u(at), sign))
            entries += [(row, self.x(at + end), gained / (2 * both * speeds[at + end])) for end in (0, 1)]
            constants += 1.5 * gained
        return self.rows(len(row), *entries), constants

    def solved(self, speeds=None):
        """The speeds of the shortest time. Without `speeds` around which to solve: without the jerk limit."""
        bounds = self.bounds + ([] if speeds is None else list(self.jerks(speeds)))
        matrices, constants = zip(*self.equal, *bounds, *self.cones)
        below = sum(len(of) for _, of in bounds)
        cones = [clarabel.ZeroConeT(len(self.between)), clarabel.NonnegativeConeT(below)]
        cones += [clarabel.SecondOrderConeT(3)] * (len(self.nodes) + len(self.between))
        target = np.zeros(self.width)
        target[self.t(0):] = self.weights
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        none = sparse.csc_matrix((self.width, self.width))
        matrix = sparse.vstack(matrices).tocsc()
        solver = clarabel.DefaultSolver(none, target, matrix, np.concatenate(constants), cones, settings)
        return np.sqrt(np.maximum(solver.solve().x[:len(self.nodes)], 0.0))
