"""Jobs that are drawn by formula: a grey-scale laser picture, a spiral and a milled pocket.

Each function returns the lines of one job. Lengths are mm, feeds mm/min; X0 Y0 is the lower left corner unless a
comment in the job says otherwise, and Z0 is the surface of the material.
"""

import math

from gcode import ABSOLUTE_MM, SAFE_Z, block, comment

# --- raster: a lit ball and its shadow ---
RASTER_PIXEL = 0.2  # mm
RASTER_COLUMNS, RASTER_ROWS = 110, 100
RASTER_FEED = 3000
RASTER_GREYS = 64  # levels from white to black: equal neighbours become one move
RASTER_BLACK = 1000  # S: the full power of `$30`
RASTER_LIGHT = (-0.48, 0.6, 0.64)  # unit vector towards the lamp: left, above, in front
BALL_X, BALL_Y, BALL_RADIUS = 9.6, 11.2, 7.8  # mm
SHADOW_X, SHADOW_Y, SHADOW_WIDTH, SHADOW_HEIGHT = 13.2, 3.2, 8.0, 2.4  # mm, half axes of an ellipse


def raster():
    """Burns the ball row by row, there and back, as LaserGRBL does: power by S, white skipped with G0."""
    lines = comment("Grey-scale picture for a laser: M4 scales the power with the speed. Needs $32=1.")
    lines += [ABSOLUTE_MM, "M4 S0", block("G1", f=RASTER_FEED)]
    for row in range(RASTER_ROWS):
        lines += raster_row(row, runs([grey(column, row) for column in range(RASTER_COLUMNS)]))
    return lines + ["M5", "G0 X0 Y0", "M30"]


def grey(column, row):
    """Returns the power of a pixel in S units, in `RASTER_GREYS` steps from white (0) to `RASTER_BLACK`."""
    darkness = ball_darkness((column + 0.5) * RASTER_PIXEL, (row + 0.5) * RASTER_PIXEL)
    return round(darkness * (RASTER_GREYS - 1)) * RASTER_BLACK // (RASTER_GREYS - 1)


def ball_darkness(x, y):
    """Returns 0 (white) to 1 (black) at a point in mm: Lambert's cosine law, Phong's highlight, a soft shadow."""
    nx, ny = (x - BALL_X) / BALL_RADIUS, (y - BALL_Y) / BALL_RADIUS
    if nx * nx + ny * ny > 1:
        distance = math.hypot((x - SHADOW_X) / SHADOW_WIDTH, (y - SHADOW_Y) / SHADOW_HEIGHT)
        return 0.8 * max(0.0, 1 - distance)
    nz = math.sqrt(1 - nx * nx - ny * ny)
    facing = nx * RASTER_LIGHT[0] + ny * RASTER_LIGHT[1] + nz * RASTER_LIGHT[2]
    mirrored = 2 * facing * nz - RASTER_LIGHT[2]  # towards the viewer, who looks along -Z
    brightness = 0.12 + 0.68 * max(0.0, facing) + 0.35 * max(0.0, mirrored) ** 12
    return 1 - min(1.0, brightness)


def runs(powers):
    """Joins equal neighbours: (first column, column after the last, power)."""
    edges = [i for i in range(1, len(powers)) if powers[i] != powers[i - 1]]
    starts, ends = [0, *edges], [*edges, len(powers)]
    return [(start, end, powers[start]) for start, end in zip(starts, ends)]


def raster_row(row, row_runs):
    """Burns the runs of a row, every other row from right to left; the white ends of a row are not visited."""
    inked = [i for i, (_, _, power) in enumerate(row_runs) if power]
    if not inked:
        return []
    row_runs = row_runs[inked[0] : inked[-1] + 1]
    if row % 2:
        row_runs = [(end, start, power) for start, end, power in reversed(row_runs)]
    entry = block("G0", x=row_runs[0][0] * RASTER_PIXEL, y=(row + 0.5) * RASTER_PIXEL, s=0)
    return [entry] + [
        block("G1" if power else "G0", x=end * RASTER_PIXEL, s=power) for _, end, power in row_runs
    ]


# --- delay: a test picture for the laser's switching delay ($703) ---
DELAY_FEEDS = (2000, 4000, 6000, 8000, 10000)  # mm/min, one band of rows each, from the bottom
DELAY_ROWS, DELAY_PITCH = 16, 0.2  # a band's rows, mm between them
DELAY_BAND = 5.0  # mm from band to band
DELAY_RUN_UP = 12.0  # mm: 10000 mm/min at 1500 mm/s2 take 9.3
DELAY_MARKS, DELAY_SPACING, DELAY_WIDTH = 8, 5.0, 0.5  # a row's marks, mm from one to the next, mm


def delay():
    """Burns upright bars row by row, there and back: where the laser switches late, a bar's rows are apart, more with the speed."""
    lines = comment("Bars for setting $703, the laser's delay: one band for each feed. Needs $32=1.")
    lines += [ABSOLUTE_MM, "M4 S0"]
    for band, feed in enumerate(DELAY_FEEDS):
        for row in range(DELAY_ROWS):
            lines += delay_row(band * DELAY_BAND + row * DELAY_PITCH, feed, row % 2)
    return lines + ["M5", "G0 X0 Y0", "M30"]


def delay_row(y, feed, back):
    """Burns one row of marks at full feed from the first to the last."""
    length = 2 * DELAY_RUN_UP + (DELAY_MARKS - 1) * DELAY_SPACING + DELAY_WIDTH
    starts = [DELAY_RUN_UP + mark * DELAY_SPACING for mark in range(DELAY_MARKS)]
    edges = [edge for start in starts for edge in (start, start + DELAY_WIDTH)] + [length]
    if back:
        edges = [length - edge for edge in edges]
    powers = [0, 500] * DELAY_MARKS + [0]
    entry = block("G0", x=length if back else 0.0, y=y)
    return [entry, *(block("G1", x=x, f=feed, s=power) for x, power in zip(edges, powers))]


# --- spiral: short chords, the food of look-ahead ---
SPIRAL_CENTRE, SPIRAL_RADIUS, SPIRAL_PITCH = 40.0, 36.0, 3.0
SPIRAL_TOLERANCE = 0.002  # mm between a chord and the curve: Grbl's `$12`
SPIRAL_FEED, SPIRAL_PLUNGE_FEED, SPIRAL_DEPTH = 2400, 300, 0.5


def spiral():
    """Engraves an Archimedean spiral, r = pitch * angle / 2 pi, outwards, in straight chords."""
    lines = comment("Spiral in short chords: look-ahead keeps the feed where the curve allows it.")
    lines += [ABSOLUTE_MM, block("G0", z=SAFE_Z), "M3 S1000", "G4 P1"]
    lines += [block("G0", x=SPIRAL_CENTRE, y=SPIRAL_CENTRE), block("G1", z=-SPIRAL_DEPTH, f=SPIRAL_PLUNGE_FEED)]
    lines += [block(f=SPIRAL_FEED), *(block("G1", x=x, y=y) for x, y in spiral_points())]
    return lines + [block("G0", z=SAFE_Z), "M5", "G0 X0 Y0", "M30"]


def spiral_points():
    """Yields points so far apart that a chord leaves the curve by the tolerance: angle = sqrt(8 tolerance / r)."""
    angle = 0.0
    while (radius := SPIRAL_PITCH * angle / math.tau) < SPIRAL_RADIUS:
        angle += math.sqrt(8 * SPIRAL_TOLERANCE / max(radius, SPIRAL_PITCH / 10))
        radius = SPIRAL_PITCH * angle / math.tau
        yield SPIRAL_CENTRE + radius * math.cos(angle), SPIRAL_CENTRE + radius * math.sin(angle)


# --- pocket: 40 x 30 mm, 4.5 mm deep, corners of radius 6, with a cutter of 6 mm ---
POCKET_CENTRE_X, POCKET_CENTRE_Y = 25.0, 20.0
POCKET_HALF_WIDTH, POCKET_HALF_HEIGHT, POCKET_CORNER = 17.0, 12.0, 3.0  # mm, the path of the cutter's centre
POCKET_STEP_OVER, POCKET_RINGS = 2.36, 5  # the fifth ring leaves 0.2 mm for the finishing pass
POCKET_LAYER, POCKET_LAYERS = 1.5, 3
POCKET_FEED, POCKET_HELIX_FEED, POCKET_FINISH_FEED = 900, 400, 600
FINISH_LEAD = 2.0  # radius of the quarter circle by which the finishing pass meets and leaves the wall


def pocket():
    """Mills the pocket: a helix down, rings outwards, layer by layer, then the wall in one pass at full depth."""
    lines = comment(
        "Pocket 40 x 30 x 4.5 mm, corners of radius 6 mm, cutter 6 mm, counter-clockwise: climb milling.",
        "Helical entry, rings with arcs by their centre I J, finishing pass with arcs by their radius R.",
    )
    lines += [ABSOLUTE_MM, block("G0", z=SAFE_Z), "M3 S12000", "G4 P2"]
    for layer in range(POCKET_LAYERS):
        lines += pocket_layer(top=-layer * POCKET_LAYER)
    return lines + finishing_pass() + ["M5", "G0 X0 Y0", "M30"]


def pocket_layer(top):
    """Clears one layer below `top` (mm, surface = 0), from the middle outwards."""
    bottom_y = POCKET_CENTRE_Y - POCKET_STEP_OVER
    helix_centre = {"i": 0, "j": POCKET_STEP_OVER}
    lines = [block("G0", x=POCKET_CENTRE_X, y=bottom_y), block("G1", z=top, f=POCKET_HELIX_FEED)]
    lines += [block("G3", x=POCKET_CENTRE_X, y=bottom_y, z=top - POCKET_LAYER, **helix_centre)]
    lines += [block(f=POCKET_FEED)]
    for ring in range(1, POCKET_RINGS + 1):
        half_height = ring * POCKET_STEP_OVER
        if ring > 1:  # the helix ends where the first ring begins
            lines.append(block("G1", x=POCKET_CENTRE_X, y=POCKET_CENTRE_Y - half_height))
        lines += rounded_rectangle(half_height, corner_by_centre)
    return lines + [block("G0", z=SAFE_Z)]


def rounded_rectangle(half_height, corner):
    """Goes once round a ring, counter-clockwise, from the middle of its lower side and back to it.

    The rings are as far apart in X as in Y. `corner(x, y, quarter, radius)` writes the arc that ends at (x, y).
    """
    half_width = POCKET_HALF_WIDTH - POCKET_HALF_HEIGHT + half_height
    radius = min(POCKET_CORNER, half_height)
    lines = []
    for quarter, (x_side, y_side) in enumerate([(1, -1), (1, 1), (-1, 1), (-1, -1)]):
        along_x = (half_width - radius, half_height)  # where the corner meets the lower or upper side
        along_y = (half_width, half_height - radius)  # where it meets the left or right side
        start, end = (along_x, along_y) if quarter % 2 == 0 else (along_y, along_x)
        x, y = pocket_point(x_side * start[0], y_side * start[1])
        if quarter % 2 == 0 or radius < half_height:  # the first ring has no straight right and left sides
            lines.append(block("G1", x=x, y=y))
        lines.append(corner(*pocket_point(x_side * end[0], y_side * end[1]), quarter, radius))
    return lines + [block("G1", x=POCKET_CENTRE_X, y=POCKET_CENTRE_Y - half_height)]


def pocket_point(x, y):
    """Turns a point seen from the middle of the pocket into work coordinates (mm)."""
    return POCKET_CENTRE_X + x, POCKET_CENTRE_Y + y


def corner_by_centre(x, y, quarter, radius):
    """Writes a quarter circle with its centre given from its start; `quarter` 0 is the lower right corner."""
    i, j = [(0, radius), (-radius, 0), (0, -radius), (radius, 0)][quarter]
    return block("G3", x=x, y=y, i=i, j=j)


def corner_by_radius(x, y, _quarter, radius):
    """Writes the same quarter circle by its radius alone."""
    return block("G3", x=x, y=y, r=radius)


def finishing_pass():
    """Mills the wall at full depth, meeting and leaving it along quarter circles, so that no mark is left."""
    wall_y = POCKET_CENTRE_Y - POCKET_HALF_HEIGHT
    away_y = wall_y + FINISH_LEAD
    return [
        block("G0", x=POCKET_CENTRE_X - FINISH_LEAD, y=away_y),
        block("G1", z=-POCKET_LAYERS * POCKET_LAYER, f=POCKET_FINISH_FEED),
        block("G3", x=POCKET_CENTRE_X, y=wall_y, r=FINISH_LEAD),
        *rounded_rectangle(POCKET_HALF_HEIGHT, corner_by_radius),
        block("G3", x=POCKET_CENTRE_X + FINISH_LEAD, y=away_y, r=FINISH_LEAD),
        block("G0", z=SAFE_Z),
    ]
