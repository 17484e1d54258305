"""Compares the jobs that `leadscrew import drill` makes with what gerbonara reads in the same files.

    oracle.py LEADSCREW

Random boards of holes and routed slots are written by gerbonara in several units and digits, and by the writers below as KiCad,
Altium, Eagle and Fritzing write files. A hole is its place and its tool's diameter, a cut its ends and its tool's diameter.
"""

import random
import re
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from pathlib import Path

from gerbonara.cam import FileSettings
from gerbonara.excellon import ExcellonFile, ExcellonTool
from gerbonara.graphic_objects import Flash, Line
from gerbonara.utils import MM, Inch

BOARDS = 25  # of each writer
CLOSE = 2e-5  # mm: gerbonara computes in floats; the job writes all decimals of the file
NAME = re.compile(r"\(T\d+ (?P<mm>[\d.]+) mm,")
WORD = re.compile(r"([A-Z])(-?[\d.]+)")


def board(dice):
    """A board: holes and cuts with their tools' diameters, all in tenths of a mil, which inches and mm both write exactly."""
    diameters = dice.sample(range(118, 1260, 4), dice.randint(1, 5))
    place = lambda: (dice.randint(-20000, 90000), dice.randint(-20000, 90000))
    holes = [(dice.choice(diameters), place()) for _ in range(dice.randint(1, 60))]
    cuts = [(dice.choice(diameters), place(), place()) for _ in range(dice.randint(0, 6))]
    return sorted(diameters), holes, cuts


def mm(tenths):
    return tenths * 0.00254


def by_gerbonara(unit, digits):
    """Writes a board with gerbonara."""

    def write(board):
        diameters, holes, cuts = board
        tools = {diameter: ExcellonTool(diameter=mm(diameter), unit=MM) for diameter in diameters}
        objects = [Flash(mm(x), mm(y), tools[tool], unit=MM) for tool, (x, y) in holes]
        objects += [Line(*map(mm, (*a, *b)), tools[tool], unit=MM) for tool, a, b in cuts]
        settings = FileSettings(unit=unit, number_format=digits)
        return ExcellonFile(objects=objects, import_settings=settings).write_to_bytes(settings).decode()

    return write


def in_style(header, number, is_inch, with_cuts=True):
    """Writes a board as a program does: `header` lines, `number` for a coordinate in tenths of a mil."""

    def write(board):
        diameters, holes, cuts = board
        size = lambda tenths: f"{tenths / 10000:.4f}" if is_inch else f"{mm(tenths):.5f}"
        at = lambda place: f"X{number(place[0])}Y{number(place[1])}"
        lines = [*header, *(f"T{n}C{size(d)}" for n, d in enumerate(diameters, 1)), "%", "G90", "G05"]
        for n, diameter in enumerate(diameters, 1):
            lines.append(f"T{n}")
            lines += [at(place) for tool, place in holes if tool == diameter]
            for tool, a, b in cuts if with_cuts else []:
                if tool == diameter:
                    lines += ["G00" + at(a), "M15", "G01" + at(b), "M16", "G05"]
        return "".join(line + "\n" for line in [*lines, "M30"])

    return write


def integer(whole, decimals, scale, keeps):
    """Writes numbers without a point; `keeps` is the side of the zeros that stay: `LZ`, `TZ` or both."""

    def write(tenths):
        value = round(tenths * scale)
        digits = f"{abs(value):0{whole + decimals}d}"
        if keeps == "LZ":
            digits = digits.rstrip("0") or "0"
        elif keeps == "TZ":
            digits = digits.lstrip("0") or "0"
        return ("-" if value < 0 else "") + digits

    return write


KICAD = ["M48", "; DRILL file {KiCad 8.0.4} date 2024-08-19", "; FORMAT={-:-/ absolute / metric / decimal}", "FMAT,2"]
ALTIUM = ["M48", ";Layer_Color=9474304"]
WRITERS = {
    "gerbonara mm 3.3": by_gerbonara(MM, (3, 3)),
    "gerbonara mm 3.5": by_gerbonara(MM, (3, 5)),
    "gerbonara inch 2.4": by_gerbonara(Inch, (2, 4)),
    "gerbonara inch 2.6": by_gerbonara(Inch, (2, 6)),
    "kicad mm": in_style([*KICAD, "METRIC"], lambda tenths: f"{mm(tenths):.5f}", False),
    "kicad inch": in_style(
        [*KICAD[:2], "; FORMAT={-:-/ absolute / inch / decimal}", "FMAT,2", "INCH"], lambda t: f"{t / 10000:.4f}", True
    ),
    "kicad inch, leading zeros left out": in_style(["M48", "FMAT,2", "INCH,TZ"], integer(2, 4, 1, "TZ"), True),
    "kicad inch, trailing zeros left out": in_style(["M48", "FMAT,2", "INCH,LZ"], integer(2, 4, 1, "LZ"), True),
    "altium inch 2:5": in_style([*ALTIUM, ";FILE_FORMAT=2:5", "INCH,LZ"], integer(2, 5, 10, "LZ"), True),
    "altium mm 4:5": in_style([*ALTIUM, ";FILE_FORMAT=4:5", "METRIC,LZ"], integer(4, 5, 254, "LZ"), False),
    "eagle mm": in_style(
        ["M48", "FMAT,2", "ICI,OFF", "METRIC,TZ,000.00000"], integer(3, 5, 254, "TZ"), False, with_cuts=False
    ),
    "fritzing": in_style(["M48", "INCH"], integer(2, 4, 1, "both"), True, with_cuts=False),
}


def read_by_gerbonara(path):
    """Holes and cuts of a file, mm."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        objects = ExcellonFile.open(path).objects
    size = lambda item: item.tool.unit.convert_to(MM, item.tool.diameter)
    length = lambda item, value: item.unit.convert_to(MM, value)
    found = []
    for item in objects:
        names = ("x", "y") if isinstance(item, Flash) else ("x1", "y1", "x2", "y2")
        found.append((size(item), *(length(item, getattr(item, name)) for name in names)))
    return found


def read_job(lines):
    """Holes and cuts of a job, mm, from its lines: where Z goes down without a move after it, there is a hole."""
    found, size, at, numbers = [], None, None, {}
    for line in lines:
        if name := NAME.match(line):
            size = float(name["mm"])
        if not line.startswith("N"):
            continue
        words = dict(WORD.findall(line))
        hole = numbers.setdefault(words["N"], {"size": size, "start": None, "cuts": []})
        if "X" in words:
            place = float(words["X"]), float(words["Y"])
            if hole["start"] is None:
                hole["start"] = place
            else:
                hole["cuts"].append((*at, *place))
            at = place
    for hole in numbers.values():
        found += [(hole["size"], *cut) for cut in hole["cuts"]] or [(hole["size"], *hole["start"])]
    return found


def key(item):
    """A hole or cut, rounded; a cut may be made from either end."""
    size, *places = item
    points = [tuple(round(part / CLOSE / 10) for part in places[i : i + 2]) for i in range(0, len(places), 2)]
    return (round(size / CLOSE / 10), *sorted(points))


def same(ours, theirs):
    """Whether both have the same holes and cuts, each to 0.0002 mm; a value on the border of rounding may be a step off."""
    left = Counter(map(key, ours))
    for item in map(key, theirs):
        steps = [near for near in left if len(near) == len(item) and is_near(near, item)]
        if not steps:
            return False
        left[steps[0]] -= 1
        if not left[steps[0]]:
            del left[steps[0]]
    return not left


def is_near(a, b):
    flat = lambda item: [item[0], *(part for point in item[1:] for part in point)]
    return all(abs(x - y) <= 1 for x, y in zip(flat(a), flat(b)))


def main(program):
    dice = random.Random(14)
    wrong, holes = [], 0
    with tempfile.TemporaryDirectory() as folder:
        for name, write in WRITERS.items():
            for number in range(BOARDS):
                path = Path(folder) / "board.drl"
                path.write_text(write(board(dice)), encoding="ascii")
                done = subprocess.run(
                    [program, "import", "drill", path, "--depth", "-1", "--feed", "100"], text=True, capture_output=True
                )
                theirs = read_by_gerbonara(path)
                ours = read_job(done.stdout.splitlines())
                holes += len(theirs)
                if done.returncode or not same(ours, theirs):
                    wrong.append(f"{name}, board {number}: {len(ours)} of {len(theirs)}\n{done.stderr}")
    print("\n".join(wrong[:5]) or f"{len(WRITERS) * BOARDS} boards in {len(WRITERS)} styles, {holes} holes and cuts: the same")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
