#!/usr/bin/env python3
"""Times circles in lines whose numbers have two or three decimals in mm, three or four in inches.

  python3 bench/decimals.py target/release/leadscrew

Prints each time divided by the time of the same circle with five decimals of an inch.
"""
import json
import math
import subprocess
import sys

INCH = 25.4
TURNS = 3
FEED = 3000.0
SETTINGS = ["$110=5000", "$111=5000", "$120=500", "$121=500"]
WRITTEN = [("mm, 3", 1.0, 3), ("mm, 2", 1.0, 2), ("inches, 4", INCH, 4), ("inches, 3", INCH, 3)]


def program(radius, line, unit, decimals):
    lines = TURNS * round(math.tau * radius / line)
    points = (TURNS * math.tau * k / lines for k in range(lines + 1))
    head = ["G20" if unit == INCH else "G21", f"G90G1F{FEED / unit:.{decimals}f}"]
    body = [
        f"X{radius / unit * math.cos(at):.{decimals}f}Y{radius / unit * math.sin(at):.{decimals}f}"
        for at in points
    ]
    return "\n".join(head + body) + "\n"


def seconds(binary, text):
    options = [part for setting in SETTINGS for part in ("--set", setting)]
    done = subprocess.run(
        [binary, "run", "-", "--json", *options], input=text, capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout)["motion_seconds"]


def main():
    binary = sys.argv[1]
    print("| R, line, mm | " + " | ".join(name for name, _, _ in WRITTEN) + " |")
    print("|---|" + "---|" * len(WRITTEN))
    for radius in (2.0, 10.0, 30.0):
        for line in (0.05, 0.1, 0.2):
            fine = seconds(binary, program(radius, line, INCH, 5))
            ratios = [seconds(binary, program(radius, line, unit, n)) / fine for _, unit, n in WRITTEN]
            print(f"| {radius:g}, {line:g} | " + " | ".join(f"{ratio:.3f}" for ratio in ratios) + " |")


main()
