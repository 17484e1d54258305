"""The first job to run: nested hearts, from the table of an engraver that drew in steps of whole units.

    table: a staircase  ->  simplified (Douglas-Peucker)  ->  corners cut (Chaikin)  ->  mirrored, scaled, moved

The job is small because Grbl's default settings allow no more than 500 mm/min and 10 mm/s2. Lengths are table units
up to `nested`, then mm; X0 Y0 is below and to the left of the hearts, Z0 the surface of the material.
"""

import csv
import math

from gcode import ABSOLUTE_MM, SAFE_Z, block, comment

STAIRCASE = 4.0  # units: the steps of the table are 2 high and wide, and some point backwards
CORNER_CUTS = 3  # each turns a corner into two of half the angle
SCALES = (0.5, 0.4, 0.3, 0.2)  # mm a unit
MIDDLE = (0.0, -24.0)  # units: what the hearts shrink towards
MARGIN = 4.0  # mm
FEED, PLUNGE_FEED, DEPTH = 500, 200, 0.3  # mm/min, mm/min, mm


def heart(table):
    """Engraves the hearts from a table of `cum_x, cum_y`, where a heart lies on its side and starts in its notch."""
    outline = smooth_outline(table)
    lines = comment(
        "Hearts, to be run first: Grbl's default settings are enough.",
        "Outline: the table of an engraver built on an STM32F407 in Ljubljana in 2013, smoothed,",
        "with the signs of its rows 7, 11 and 15 mended so that it closes and is symmetrical.",
    )
    lines += [ABSOLUTE_MM, block("G0", z=SAFE_Z), "M3 S1000", "G4 P1"]
    for points in nested(outline):
        lines += engraved_loop(points)
    return lines + ["M5", "G0 X0 Y0", "M30"]


def smooth_outline(table):
    """Returns the outline in units, upright, from the notch round to the notch."""
    steps = [(0, 0)] + [(-int(row["cum_y"]), int(row["cum_x"])) for row in csv.DictReader(table.splitlines())]
    tip = min(range(len(steps)), key=lambda i: steps[i][1])
    half = simplified(steps[: tip + 1], STAIRCASE)
    for _ in range(CORNER_CUTS):
        half = corners_cut(half)
    return half + [(-x, y) for x, y in reversed(half[:-1])]


def simplified(points, tolerance):
    """Leaves out points that are within the tolerance of a line between those kept (Douglas and Peucker, 1973)."""
    first, last = points[0], points[-1]
    distances = [distance_to_line(point, first, last) for point in points]
    farthest = max(range(len(points)), key=distances.__getitem__)
    if distances[farthest] <= tolerance:
        return [first, last]
    return simplified(points[: farthest + 1], tolerance)[:-1] + simplified(points[farthest:], tolerance)


def distance_to_line(point, first, last):
    """Returns how far a point is from the line through two others."""
    dx, dy = last[0] - first[0], last[1] - first[1]
    return abs(dx * (point[1] - first[1]) - dy * (point[0] - first[0])) / math.hypot(dx, dy)


def corners_cut(points):
    """Cuts each corner at a quarter of its sides (Chaikin, 1974); the first and the last point stay: notch and tip."""
    cut = [points[0]]
    for (x0, y0), (x1, y1) in zip(points, points[1:]):
        cut += [(0.75 * x0 + 0.25 * x1, 0.75 * y0 + 0.25 * y1), (0.25 * x0 + 0.75 * x1, 0.25 * y0 + 0.75 * y1)]
    return [*cut[:1], *cut[2:-1], points[-1]]


def nested(outline):
    """Yields the outline in mm at each scale, all about one middle, the largest `MARGIN` from X0 and Y0."""
    left, bottom = (min(point[axis] for point in outline) - MIDDLE[axis] for axis in (0, 1))
    for scale in SCALES:
        yield [
            (
                MARGIN - left * SCALES[0] + (x - MIDDLE[0]) * scale,
                MARGIN - bottom * SCALES[0] + (y - MIDDLE[1]) * scale,
            )
            for x, y in outline
        ]


def engraved_loop(points):
    """Engraves a polygon from its first point to its last, which is the same."""
    (start_x, start_y), (x, y) = points[0], points[1]
    return [
        block("G0", x=start_x, y=start_y),
        block("G1", z=-DEPTH, f=PLUNGE_FEED),
        block("G1", x=x, y=y, f=FEED),
        *(block("G1", x=x, y=y) for x, y in points[2:]),
        block("G0", z=SAFE_Z),
    ]
