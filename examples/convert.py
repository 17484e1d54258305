"""Converts the job files of three older machines to G-code for Grbl 1.1.

    python3 examples/convert.py drill   board.drl > board.nc   Excellon holes of a PCB drilling machine
    python3 examples/convert.py print   part.rp   > part.nc    "RP code" of an extruding prototyping machine
    python3 examples/convert.py engrave rows.csv  > rows.nc    relative rows of an engraver

What is known of the three machines stands in `sources/README.md`; each constant below says where it is from.
"""

import csv
import re
import sys
from decimal import Decimal
from pathlib import Path

from gcode import ABSOLUTE_MM, block, comment

# Drilling machine: one half step is 4.375 um; its program counts Z in half steps below the taught zero.
DRILL_HALF_STEP_MM = Decimal("0.004375")
DRILL_CLEARANCE_MM = -4000 * DRILL_HALF_STEP_MM  # between the holes: default "drill-up" of its program
DRILL_BOTTOM_MM = -5000 * DRILL_HALF_STEP_MM  # through the board: default "drill-down" of its program
DRILL_PLUNGE_MM_MIN = Decimal("131.25")  # 500 half steps/s: its default speed for Z
EXCELLON_UNIT_MM = Decimal("0.00254")  # 2.4 inch format: the last digit is 0.1 mil

EXCELLON_TOOL = re.compile(r"T(\d+)C(\d*\.?\d+)F\d+S(\d+)")  # inch, inch/min, 1000/min
EXCELLON_HOLE = re.compile(r"X(\d{6})Y(\d{6})")

# Prototyping machine: speeds follow from its step loops, 190 us and 1 ms for a half step of 3.2 um.
PRINT_FEED_MM_MIN = 1005  # path speed in X and Y
PRINT_LIFT_MM_MIN = 192  # Z, which always moves alone
FEEDER_ON = "M3 S1000"  # the feeder knows on and off only, so S is the full scale of `$30`

RP_HEADER = "RPcode."
RP_ROW = re.compile(r"([01])" + r"\s+(-?\d+\.?\d*)" * 3 + r"\s*")  # feeder flag, X, Y, Z in mm

# Engraver: its rows have no scale and its Z runs between two adjustable switches, so these four are our choice.
ENGRAVE_MM_PER_UNIT = 1
ENGRAVE_FEED_MM_MIN = 600
ENGRAVE_PLUNGE_MM_MIN = 200
ENGRAVE_LIFT_MM = 2


def drill(text):
    """Converts Excellon (2.4 inch, leading zeros kept) to one G0, G1, G0 cycle a hole.

    The machine starts at the taught zero: board corner in X and Y, well above the board in Z.
    """
    lines = comment("X0 Y0: the corner of the board. Z0: the taught height, 17.5 mm above the clearance.")
    lines += [ABSOLUTE_MM, block("G0", z=DRILL_CLEARANCE_MM)]
    tool_loaded = False
    for number, row in enumerate(text.splitlines(), 1):
        if row == "M30":
            break
        if tool := EXCELLON_TOOL.fullmatch(row):
            lines += change_tool(*tool.groups(), is_first=not tool_loaded)
            tool_loaded = True
        elif tool_loaded and (hole := EXCELLON_HOLE.fullmatch(row)):
            lines += drill_hole(*(int(digits) * EXCELLON_UNIT_MM for digits in hole.groups()))
        elif row not in ("", "%"):
            raise not_understood(number, row)
    if not tool_loaded:
        raise ValueError("no tool and no hole before the end")
    return lines + ["M5", "G0 Z0", "G0 X0 Y0", "M30"]


def change_tool(tool, diameter_in, speed_krpm, is_first):
    """Names the tool; stops (M0) for the operator to change it, but not for the first, which is in the spindle.

    The file's feed in inch/min is left out: 200 inch/min is fifteen times what the machine can do.
    """
    stop = [] if is_first else ["M5", "M0"]
    name = comment(f"Tool {tool}: {number_mm(diameter_in)} mm, {diameter_in} inch")
    return [*name, *stop, f"T{tool}", block("M3", s=Decimal(speed_krpm) * 1000), "G4 P1"]


def number_mm(inches):
    """Writes a length given in inches as mm with three decimals."""
    return f"{Decimal(inches) * Decimal('25.4'):.3f}"


def drill_hole(x_mm, y_mm):
    """Drills one hole: above it, down at the plunge feed, up as fast as the machine goes."""
    return [
        block("G0", x=x_mm, y=y_mm),
        block("G1", z=DRILL_BOTTOM_MM, f=DRILL_PLUNGE_MM_MIN),
        block("G0", z=DRILL_CLEARANCE_MM),
    ]


def extrude(text):
    """Converts RP code (a header, then rows of flag, X, Y, Z in mm) to G1 with the feeder on M3 and M5.

    Z moves alone and after X and Y, as on the original; Grbl lets the motion end before it obeys M3 or M5.
    """
    if not text.startswith(RP_HEADER):
        raise not_understood(1, text)
    lines = comment("X0 Y0 Z0: the start point of the part. Heat nozzle and bed first: Grbl has no words for it.")
    lines += [ABSOLUTE_MM, "M5"]
    feeding, at = False, (Decimal(0), Decimal(0), Decimal(0))
    for number, row in enumerate(text.splitlines()[1:], 2):
        if not (match := RP_ROW.fullmatch(row)):
            raise not_understood(number, row)
        flag, *target = match.groups()
        target = tuple(map(Decimal, target))
        if feeding != (flag == "1"):
            feeding = not feeding
            lines.append(FEEDER_ON if feeding else "M5")
        lines += extruder_moves(at, target, feeding)
        at = target
    return lines + ["M5", "M30"]


def extruder_moves(start, end, feeding):
    """Moves X and Y together, then Z, leaving out what stays where it is; travels are rapids."""
    code, xy_feed, z_feed = ("G1", {"f": PRINT_FEED_MM_MIN}, {"f": PRINT_LIFT_MM_MIN}) if feeding else ("G0", {}, {})
    moves = []
    if start[:2] != end[:2]:
        moves.append(block(code, x=end[0], y=end[1], **xy_feed))
    if start[2] != end[2]:
        moves.append(block(code, z=end[2], **z_feed))
    return moves


def engrave(text):
    """Converts rows of `dx, dy, engrave` to relative moves: the tool is down where `engrave` is 1."""
    lines = comment("Starts with the tool on the surface, at the first point. 1 mm a unit: the rows have no scale.")
    lines += ["G21 G91 G94 G17", block("G0", z=ENGRAVE_LIFT_MM), "M3 S1000", "G4 P1"]
    is_down = False
    for dx, dy, engraved in engraver_rows(text):
        if is_down != engraved:
            is_down = engraved
            lines += move_tool(is_down)
        moved = {axis: units * ENGRAVE_MM_PER_UNIT for axis, units in (("x", dx), ("y", dy)) if units}
        if moved:
            lines.append(block("G1" if is_down else "G0", **moved))
    return lines + (move_tool(False) if is_down else []) + ["M5", "G90", "M30"]


def engraver_rows(text):
    """Yields dx and dy in units, and whether the row is engraved."""
    reader = csv.DictReader(text.splitlines())
    if not {"dx", "dy", "engrave"}.issubset(reader.fieldnames or ()):
        raise not_understood(1, text)
    for row in reader:
        try:
            yield int(row["dx"]), int(row["dy"]), row["engrave"] == "1"
        except (TypeError, ValueError):
            raise not_understood(reader.line_num, ",".join(map(str, row.values()))) from None


def move_tool(down):
    """Lowers the tool to the surface and sets the feed of the rows that follow, or lifts it."""
    if not down:
        return [block("G0", z=ENGRAVE_LIFT_MM)]
    return [block("G1", z=-ENGRAVE_LIFT_MM, f=ENGRAVE_PLUNGE_MM_MIN), block(f=ENGRAVE_FEED_MM_MIN)]


def not_understood(number, text):
    """Returns the error for a row (numbered from 1, at the start of `text`) that is not in its machine's format."""
    row = text.partition("\n")[0]
    return ValueError(f"line {number}: not understood: {row[:40]!r}")


CONVERTERS = {"drill": drill, "print": extrude, "engrave": engrave}


def main(arguments):
    """Converts one file to standard output; exit status 2 where the arguments or the file make no sense."""
    if len(arguments) != 2 or arguments[0] not in CONVERTERS:
        print(__doc__, file=sys.stderr)
        return 2
    kind, path = arguments
    try:
        print("\n".join(CONVERTERS[kind](Path(path).read_text(encoding="ascii"))))
    except (OSError, ValueError) as error:
        print(f"{path}: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
