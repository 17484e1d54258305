"""The rules of Grbl 1.1 that a job must keep, as far as they can be seen without running it.

Lengths are mm (G21 only), feeds mm/min. The examples use the XY plane (G17) only.
"""

import math
import re

LINE_LIMIT = 79  # characters once spaces and comments are gone; more is error:11
DIGIT_LIMIT = 8  # significant digits of a number, leading zeros included
TOOL_LIMIT = 255
ARC_TOLERANCE = 0.005  # mm between the radius at the start and at the end of an arc

WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))")
MOTIONS = {"G0", "G1", "G2", "G3"}
CODES = MOTIONS | {"G4", "G17", "G21", "G90", "G91", "G94", "M0", "M3", "M4", "M5", "M30"}
SETTING = re.compile(r"\$(\d+)=(\d+(?:\.\d{3})?)")
SETTING_NUMBERS = [0, 1, 2, 3, 4, 5, 6, 10, 11, 12, 13, *range(20, 28), 30, 31, 32]
SETTING_NUMBERS += [hundred + axis for hundred in (100, 110, 120, 130) for axis in range(3)]


def read_settings(text):
    """Reads lines as `$$` prints them into {number: value}; a ValueError names the first line that is not one."""
    settings = {}
    for line in text.splitlines():
        match = SETTING.fullmatch(line)
        if not match:
            raise ValueError(f"not a line of $$: {line!r}")
        settings[int(match[1])] = float(match[2])
    if list(settings) != SETTING_NUMBERS:
        raise ValueError("not the 34 settings of Grbl 1.1h in their order")
    return settings


def problems(lines, settings):
    """Lists what Grbl with these settings would refuse or could not do, each with its line number."""
    job = Job()
    found = [f"line {n}: {problem}" for n, line in enumerate(lines, 1) for problem in job.read(line)]
    return found + job.end(settings)


class Job:
    """Follows a job line by line: where the tool is, and the modes that are in force."""

    def __init__(self):
        self.position = {"X": 0.0, "Y": 0.0, "Z": 0.0}
        self.lowest, self.highest = dict(self.position), dict(self.position)
        self.motion, self.relative, self.feed, self.tool_on, self.ended = "G0", False, 0.0, False, False

    def read(self, line):
        """Returns the problems of a line and takes over what it changes."""
        text = re.sub(r"\([^)]*\)", "", line).replace(" ", "")
        words = WORD.findall(text)
        if "".join(letter + value for letter, value in words) != text or not line.isascii():
            return [f"not words: {line!r}"]
        found = self.wrong_words(text, words)
        codes = {letter + value for letter, value in words if letter in "GM"}
        values = {letter: float(value) for letter, value in words if letter not in "GM"}
        self.take_modes(codes, values)
        if any(axis in values for axis in "XYZ"):
            found += self.take_move(values)
        return found

    def wrong_words(self, text, words):
        """Checks what a line may hold, whatever it means."""
        letters = [letter for letter, _ in words if letter not in "GM"]
        codes = [letter + value for letter, value in words if letter in "GM"]
        found = [f"{code} is not for these examples" for code in codes if code not in CODES]
        found += [f"{value} has too many digits" for _, value in words if len(re.sub(r"\D", "", value)) > DIGIT_LIMIT]
        found += [f"T{value} is too large" for letter, value in words if letter == "T" and float(value) > TOOL_LIMIT]
        if len(text) > LINE_LIMIT:
            found.append(f"{len(text)} characters")
        if len(set(letters)) < len(letters):
            found.append("a letter is repeated")
        if words and self.ended:
            found.append("comes after the end of the program")
        return found

    def take_modes(self, codes, values):
        """Takes over the modal state that the rules need."""
        self.motion = next(iter(codes & MOTIONS), self.motion)
        self.relative = "G91" in codes or (self.relative and "G90" not in codes)
        self.feed = values.get("F", self.feed)
        self.tool_on = bool(codes & {"M3", "M4"}) or (self.tool_on and not codes & {"M5", "M30"})
        self.ended = self.ended or "M30" in codes

    def take_move(self, values):
        """Moves the tool to its target and returns what is wrong with the way there."""
        start, target = self.position, dict(self.position)
        for axis in "XYZ":
            if axis in values:
                target[axis] = values[axis] + (start[axis] if self.relative else 0)
        self.position = target
        for axis, value in target.items():
            self.lowest[axis] = min(self.lowest[axis], value)
            self.highest[axis] = max(self.highest[axis], value)
        found = [] if self.motion == "G0" or self.feed > 0 else ["no feed has been set"]
        return found + (wrong_arc(start, target, values) if self.motion in ("G2", "G3") else [])

    def end(self, settings):
        """Returns what is wrong with the job as a whole."""
        found = [] if self.ended and not self.tool_on else ["does not end with the tool off and M30"]
        for number, axis in enumerate("XYZ", 130):
            reach = self.highest[axis] - self.lowest[axis]
            if reach > settings[number]:
                found.append(f"needs {reach:.1f} mm in {axis}, ${number} allows {settings[number]:.1f}")
        return found


def wrong_arc(start, target, values):
    """Checks an arc in the XY plane: given by R or by I and J, and one circle through both of its ends."""
    dx, dy = target["X"] - start["X"], target["Y"] - start["Y"]
    if "R" in values:
        chord = math.hypot(dx, dy)
        both = "I" in values or "J" in values
        return ["impossible radius"] if both or chord == 0 or abs(values["R"]) < chord / 2 else []
    if "I" not in values and "J" not in values:
        return ["an arc without centre or radius"]
    i, j = values.get("I", 0), values.get("J", 0)
    error = abs(math.hypot(dx - i, dy - j) - math.hypot(i, j))
    return [f"arc centre is off by {error:.4f} mm"] if error > ARC_TOLERANCE else []
