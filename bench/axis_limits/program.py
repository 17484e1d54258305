"""A program of lines and curves in short lines, and its run in the simulator."""
import json
import math
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

HZ = 168e6  # of the time in `leadscrew run --steps`
AXES = 'XY'


@dataclass
class Machine:
    """Settings that X and Y share, in the units of `$110` and `$120`."""
    steps_per_mm: int
    rate: float
    acceleration: float
    deviation: float
    jerk: float = 0.0

    def flags(self):
        sets = {'$0': 1, '$11': self.deviation, '$705': self.jerk}
        for axis in range(3):
            sets |= {f'$10{axis}': self.steps_per_mm, f'$11{axis}': self.rate, f'$12{axis}': self.acceleration}
        return [flag for key, value in sets.items() for flag in ('--set', f'{key}={value}')]


@dataclass
class Program:
    """`ends` are those of the lines, mm. `parts` are the points of each smooth part as it was meant, close together."""
    name: str
    feed: float
    decimals: int = 3
    at: np.ndarray = field(default_factory=lambda: np.zeros(2))
    ends: list = field(default_factory=list)
    parts: list = field(default_factory=list)

    def line(self, way):
        """A line that goes `way`."""
        self.curve([self.at + way], np.array([self.at, self.at + way]))

    def curve(self, ends, meant):
        """Lines to `ends` on the curve `meant`."""
        self.ends += [np.round(end, self.decimals) for end in ends]
        self.parts.append(np.asarray(meant))
        self.at = np.array(ends[-1], float)

    def arc(self, heading, radius, sweep, lines):
        """An arc in lines that leaves in the direction `heading` and turns by `sweep` (radians, positive to the left)."""
        side = math.copysign(math.pi / 2, sweep)
        centre = self.at + radius * along(heading + side)
        place = lambda share: centre + radius * along(heading + sweep * share - side)
        ends = [place((k + 1) / lines) for k in range(lines)]
        self.curve(ends, [place(share) for share in np.linspace(0, 1, 400)])

    def steps(self, scale):
        """The ends of all lines and where they begin, steps: exactly, half a step away from 0."""
        unit = 10 ** self.decimals
        twice = 2 * scale * np.rint(np.array([[0, 0], *self.ends]) * unit).astype(np.int64)
        return np.sign(twice) * ((np.abs(twice) + unit) // (2 * unit))

    def text(self):
        lines = [f'G1X{x:.{self.decimals}f}Y{y:.{self.decimals}f}' for x, y in self.ends]
        return '\n'.join(['G21G90G94', f'F{self.feed:g}', *lines]) + '\n'

    def run(self, binary, machine):
        with tempfile.TemporaryDirectory() as folder:
            job, steps = Path(folder) / 'job.nc', Path(folder) / 'steps.csv'
            job.write_text(self.text())
            command = [binary, 'run', job, '--json', '--quiet', '--steps', steps, *machine.flags()]
            out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            return Run(json.loads(out)['motion_seconds'], np.loadtxt(steps, delimiter=',', skiprows=1, ndmin=2))

    def seconds(self, binary, machine):
        """The time from the first step to the last."""
        with tempfile.NamedTemporaryFile('w', suffix='.nc') as job:
            job.write(self.text())
            job.flush()
            command = [binary, 'run', job.name, '--json', '--quiet', *machine.flags()]
            out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        return json.loads(out)['motion_seconds']


def along(heading):
    return np.array([math.cos(heading), math.sin(heading)])


class Run:
    """The step edges of a run: for each axis when they came, s, and where they led, steps."""

    def __init__(self, seconds, rows):
        self.seconds = seconds
        self.begin, self.end = rows[0, 0] / HZ, rows[-1, 0] / HZ
        self.edges = []
        for axis in range(len(AXES)):
            steps, directions = ((rows[:, column].astype(np.int64) >> axis) & 1 for column in (1, 2))
            steps = steps == 1
            self.edges.append((rows[steps, 0] / HZ, np.cumsum(1 - 2 * directions[steps])))

    def place(self, axis, times):
        """Where an axis is, steps: between two edges on the line from one to the next."""
        at, to = self.edges[axis]
        if not len(at):
            return np.zeros(len(times))
        at = np.concatenate([[self.begin - 1], at, [self.end + 1]])
        return np.interp(times, at, np.concatenate([[0], to, to[-1:]]).astype(float))
