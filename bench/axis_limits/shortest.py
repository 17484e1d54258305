"""The shortest time of a path: the limits of the axes on the curve that was meant.

Each axis asks |p u + k x| <= a with the tangent p, the curvature k, the squared speed x and the acceleration u along the
path. On a fine grid, backwards and then forwards: H. Pham, Q.-C. Pham, A new approach to time-optimal path parameterization
based on reachability analysis (2018). `topp.c` has the two passes.
"""
import ctypes
import math
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from limits import junction_speed

STEP = 0.002  # mm of the grid
FEWEST = 200  # steps of a part


def library():
    with tempfile.TemporaryDirectory() as folder:
        built = Path(folder) / 'topp.so'
        source = Path(__file__).resolve().parent / 'topp.c'
        subprocess.run(['cc', '-O2', '-shared', '-fPIC', '-o', built, source], check=True)
        loaded = ctypes.CDLL(str(built))
    loaded.topp.restype = ctypes.c_double
    return loaded


TOPP = library()


def shortest_time(program, machine):
    """Seconds from rest to rest."""
    return topp(*path(program, machine, STEP, FEWEST), machine.acceleration)


def path(program, machine, step, fewest):
    """Length, tangent and curvature between the nodes of a grid; the highest squared speed at each node, 0 at both ends."""
    lengths, tangents, curvatures, caps = [], [], [], [0.0]
    for points in program.parts:
        way, tangent, curvature = sampled(points, step, fewest)
        if lengths:
            corner = junction_speed(tangents[-1][-1], tangent[0], machine)
            caps[-1] = min(caps[-1], corner ** 2)
        axis = machine.rate / 60 / np.abs(tangent).max(1)
        top = np.minimum(axis, program.feed / 60) ** 2
        caps[-1] = min(caps[-1], top[0])
        caps += [*np.minimum(top[1:], top[:-1]), top[-1]]
        lengths.append(way)
        tangents.append(tangent)
        curvatures.append(curvature)
    caps[-1] = 0.0
    return np.concatenate(lengths), np.vstack(tangents), np.vstack(curvatures), np.array(caps)


def sampled(points, step, fewest):
    """Length, tangent and curvature of small steps along points that are close together; of a line where there are two."""
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    count = max(fewest, int(along[-1] / step))
    # Finer near the ends.
    share = np.linspace(0, 1, count + 1)
    grid = along[-1] * (share - 0.9 * np.sin(2 * math.pi * share) / (2 * math.pi))
    middle = (grid[1:] + grid[:-1]) / 2
    if len(points) == 2:
        tangent = np.tile((points[1] - points[0]) / along[-1], (count, 1))
        return np.diff(grid), tangent, np.zeros((count, 2))
    tangents = np.gradient(points, along, axis=0, edge_order=2)
    bends = np.gradient(tangents, along, axis=0, edge_order=2)
    at = lambda values: np.stack([np.interp(middle, along, values[:, axis]) for axis in range(2)], 1)
    return np.diff(grid), at(tangents), at(bends)


def topp(lengths, tangents, curvatures, caps, acceleration):
    pointer = lambda array: np.ascontiguousarray(array, float).ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    arrays = [np.ascontiguousarray(array, float) for array in (lengths, tangents, curvatures, caps)]
    speeds = np.zeros(len(lengths) + 1)
    return TOPP.topp(len(lengths), *map(pointer, arrays), ctypes.c_double(acceleration), pointer(speeds))
