"""Makes the example jobs, or verifies that the committed ones are what this script makes.

    python3 examples/make.py           writes examples/*.nc
    python3 examples/make.py --check   writes nothing; exit status 1 where a file differs or breaks a rule of Grbl 1.1

Jobs of other machines are imported by `leadscrew import`: LEADSCREW names the program; without it, cargo builds it.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import drawings
from grbl_rules import problems, read_settings
from heart import heart

HERE = Path(__file__).parent


# Machine 002 counts Z in half steps of 4.375 um below the taught zero: 4000 to the clearance, 5000 through the board, by
# default 500 a second. Its spindle turns at 100000 rpm.
BOARD = ["--clearance", "-17.5", "--depth", "-21.875", "--feed", "131.25", "--spindle", "100000"]
BOARD += ["--settings", str(HERE / "settings" / "drill002.txt")]


def imported(kind, *options):
    """Returns what makes lines of a source: `leadscrew import`."""
    program = [os.environ["LEADSCREW"]] if "LEADSCREW" in os.environ else ["cargo", "run", "--quiet", "--"]

    def make(text):
        arguments = [*program, "import", kind, "-", "--quiet", *options]
        return subprocess.run(arguments, input=text, text=True, check=True, stdout=subprocess.PIPE).stdout.splitlines()

    return make


class Example(NamedTuple):
    """How one job is made, and the settings file (in `settings/`) of a machine that can run it."""

    settings: str
    make: Callable[..., list[str]]
    source: str = ""

    def lines(self):
        """Makes the job's lines from its source, or from nothing where it is drawn by formula."""
        return self.make((HERE / "sources" / self.source).read_text(encoding="ascii")) if self.source else self.make()


EXAMPLES = {
    "heart.nc": Example("default", heart, "003_heart_symmetrised.csv"),
    "spiral.nc": Example("router", drawings.spiral),
    "pocket.nc": Example("router", drawings.pocket),
    "raster.nc": Example("laser", drawings.raster),
    "laser_delay.nc": Example("laser", drawings.delay),
    "drill_holes.nc": Example("drill002", imported("drill", *BOARD), "002_screenshot_holes_40_67.drl"),
    "drill_dip14.nc": Example("drill002", imported("drill", *BOARD), "002_table8_1_dip14_made_up.drl"),
    "print_testbar.nc": Example("printer001", imported("rp"), "001_testbar_50mm_5layers_made_up.rp"),
    "print_square.nc": Example("printer001", imported("rp"), "001_square20_2layers_backward_made_up.rp"),
    "heart_as_printed.nc": Example("engraver003", imported("rows"), "003_heart_as_printed.csv"),
}


def complaints(name, example):
    """Yields what is wrong with a committed job or with its settings file."""
    lines = example.lines()
    path = HERE / name
    if not path.exists() or path.read_bytes() != as_bytes(lines):
        yield "is not what make.py makes: run it without --check and commit the result"
    settings = HERE / "settings" / f"{example.settings}.txt"
    try:
        yield from problems(lines, read_settings(settings.read_text(encoding="ascii")))
    except (OSError, ValueError) as error:
        yield f"settings/{settings.name}: {error}"


def as_bytes(lines):
    """Ends each line with LF on every system, so that the files are the same everywhere."""
    return "".join(line + "\n" for line in lines).encode("ascii")


def main(arguments):
    """Writes the jobs unless only asked to check them, then checks them in both cases."""
    if arguments not in ([], ["--check"]):
        print(__doc__, file=sys.stderr)
        return 2
    if not arguments:
        for name, example in EXAMPLES.items():
            (HERE / name).write_bytes(as_bytes(example.lines()))
    found = [f"examples/{name}: {text}" for name, example in EXAMPLES.items() for text in complaints(name, example)]
    print("\n".join(found) or f"{len(EXAMPLES)} examples are as they should be")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
