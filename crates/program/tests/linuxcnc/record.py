#!/usr/bin/env python3
"""Makes random programs and records what LinuxCNC's own interpreter does with them.

    apt-get install --no-install-recommends linuxcnc-uspace     # Debian 12: rs274 2.9
    ./record.py 200 > programs.txt                              # the committed file
    ./record.py 5000 1000000 > /tmp/programs.txt                # count, first seed: a campaign
    LINUXCNC_PROGRAMS=/tmp/programs.txt cargo test -p leadscrew-program --test linuxcnc

Form of the output: for each program a line `@ seed`, its text, a line `=`, then what `rs274 -g`
makes of it, a line each: `R x y z` a rapid, `G x y z` a feed move (mm), `F rate`. If it refuses
a line, `! text` with the text of that line.
"""
import random
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path


class Writer:
    """Writes one random program."""

    def __init__(self, seed):
        self.random = random.Random(seed)
        self.label = 100
        self.names = ["_g"]
        self.subs = []
        self.lines = []
        # LinuxCNC 2.9 counts loops wrong after a jump: `do` with `continue` makes the next `repeat
        # [3]` run five times, `break` ends the next `do` after one turn. So a program has either.
        self.jumps = self.random.random() < 0.4

    def number(self):
        pick = self.random.random()
        if pick < 0.5:
            return str(self.random.randint(0, 12))
        if pick < 0.8:
            return f"{self.random.randint(0, 40) / 4:g}"
        return f"{self.random.randint(1, 9999) / 1000:g}"

    def parameter(self):
        pick = self.random.random()
        if pick < 0.7:
            return f"#{self.random.choice([1, 2, 3, 4, 5, 31, 100, 101, 4999])}"
        if pick < 0.76:
            return f"#[{self.random.randint(1, 3)}+{self.random.randint(0, 2)}]"
        if pick < 0.995:
            return f"#<{self.random.choice(self.names)}>"
        return "#<unset>"

    def call(self, depth):
        of = lambda: self.expression(depth - 1)
        name = self.random.choice(
            ["ABS", "COS", "SIN", "FIX", "FUP", "ROUND", "SQRT", "ATAN", "EXISTS", "EXP", "LN",
             "TAN", "ASIN", "ACOS"])
        if name == "ATAN":
            # A double has a zero below zero, in whose direction lie 180 degrees.
            return f"ATAN[{of()}]/[{of()}+0]"
        if name == "EXISTS":
            return f"EXISTS[#<{self.random.choice(self.names + ['unset'])}>]"
        if name == "SQRT" and self.random.random() < 0.95:
            return f"SQRT[ABS[{of()}]]"
        if name == "EXP":
            return f"EXP[[{of()}] MOD 4]"
        if name == "LN" and self.random.random() < 0.95:
            return f"LN[ABS[{of()}]+1]"
        if name == "TAN":
            return f"TAN[[{of()}] MOD 80]"
        if name in ("ASIN", "ACOS") and self.random.random() < 0.95:
            return f"{name}[[[{of()}] MOD 9]/10]"
        return f"{name}[{of()}]"

    def value(self, depth):
        pick = self.random.random()
        if depth <= 0 or pick < 0.35:
            return self.number() if pick < 0.2 else self.parameter()
        if pick < 0.55:
            return self.call(depth)
        if pick < 0.62:
            return "-" + self.parameter()
        return f"[{self.expression(depth - 1)}]"

    def expression(self, depth):
        text = self.value(depth)
        for _ in range(self.random.choice([0, 1, 1, 1, 2, 3]) if depth > 0 else 0):
            operator = self.random.choice(
                ["+", "-", "*", "+", "-", "*", "/", " MOD ", " EQ ", " NE ", " GT ", " GE ",
                 " LT ", " LE ", " AND ", " OR ", " XOR ", "**"])
            if operator == "**":
                text += "**" + self.random.choice(["2", "3", "0", "0.5"])
            elif operator == " MOD " or operator == "/" and self.random.random() < 0.97:
                text += f"{operator}{self.random.randint(1, 9)}"
            else:
                text += operator + self.value(depth - 1)
        return text

    def test(self):
        """A condition without a fault: LinuxCNC calculates those of lines that it passes over."""
        of = lambda: self.random.choice([self.number(), f"#{self.random.randint(1, 5)}", "#<_g>"])
        logic = self.random.choice(["", f" {self.random.choice(['AND', 'OR', 'XOR'])} {of()}"])
        return f"{of()}{self.random.choice(['+', '-', '*'])}{of()} {self.random.choice(['LT', 'GE', 'EQ', 'NE'])} {of()}{logic}"

    def word(self):
        """A value for a coordinate: kept within some metres."""
        pick = self.random.random()
        if pick < 0.2:
            return self.number()
        if pick < 0.35:
            return f"[{self.parameter()} MOD 1000]"
        return f"[[{self.expression(2)}] MOD 1000]"

    def move(self):
        axes = self.random.sample("XYZ", self.random.randint(1, 3))
        words = " ".join(axis + self.word() for axis in axes)
        feed = f" F[ABS[{self.expression(1)}] MOD 900+100]" if self.random.random() < 0.1 else ""
        self.lines.append(f"{self.random.choice(['G0 ', 'G1 ', '', ''])}{words}{feed}")

    def assign(self):
        pick = self.random.random()
        if pick < 0.7:
            target = f"#{self.random.choice([1, 2, 3, 4, 5, 31, 100, 101, 4999])}"
        else:
            name = self.random.choice(["a", "b", "_g", "_h"])
            target = f"#<{name}>"
        text = f"{target}=[{self.expression(2)}]"
        if self.random.random() < 0.1:
            text += f" #{self.random.randint(1, 5)}={self.number()}"
        self.lines.append(text)
        if pick >= 0.7 and name not in self.names:
            self.names.append(name)

    def flow(self, depth, loops):
        self.label += 1
        kind = self.random.choice(["if", "if", "while", *(["while"] if self.jumps else ["do", "repeat"])])
        o, counter = f"o{self.label}", f"#{200 + self.label}"
        turns = self.random.randint(0, 4)
        kept = list(self.names)
        if kind == "if":
            self.lines.append(f"{o} if [{self.expression(2)}]")
            self.body(depth - 1, loops)
            for _ in range(self.random.choice([0, 0, 1, 2])):
                self.lines.append(f"{o} elseif [{self.test()}]")
                self.names = list(kept)
                self.body(depth - 1, loops)
            if self.random.random() < 0.5:
                self.lines.append(f"{o} else")
                self.names = list(kept)
                self.body(depth - 1, loops)
            self.lines.append(f"{o} endif")
        elif kind == "repeat":
            count = self.random.choice([str(turns), f"{turns}.3", f"{turns}.7"])
            self.lines.append(f"{o} repeat [{count}]")
            self.body(depth - 1, loops + [o])
            self.lines.append(f"{o} endrepeat")
        else:
            self.lines.append(f"{counter}=0")
            test = f"[{counter} LT {turns}]"
            self.lines.append(f"{o} while {test}" if kind == "while" else f"{o} do")
            self.lines.append(f"{counter}=[{counter}+1]")
            self.body(depth - 1, loops + [o])
            self.lines.append(f"{o} endwhile" if kind == "while" else f"{o} while {test}")
        self.names = kept

    def jump(self, loops):
        self.label += 1
        self.lines += [f"o{self.label} if [{self.expression(1)}]",
                       f"{loops[-1]} {self.random.choice(['break', 'continue'])}",
                       f"o{self.label} endif"]

    def use_sub(self):
        name, arguments = self.random.choice(self.subs)
        if name.startswith("M98"):
            self.lines.append(f"{name} L{self.random.randint(1, 2)}" if self.random.random() < 0.5 else name)
            return
        given = "".join(f" [{self.expression(1)}]" for _ in range(arguments))
        self.lines.append(f"{name} call{given}")
        self.move()
        if self.random.random() < 0.5:
            self.lines.append("X[#<_value> MOD 1000] Y#<_value_returned>")

    def body(self, depth, loops=()):
        loops = list(loops)
        for _ in range(self.random.randint(1, 4)):
            pick = self.random.random()
            if pick < 0.4 or depth <= 0:
                self.move()
            elif pick < 0.65:
                self.assign()
            elif pick < 0.8:
                self.flow(depth, loops)
            elif pick < 0.87 and loops and self.jumps:
                self.jump(loops)
            elif self.subs:
                self.use_sub()
            else:
                self.assign()

    def sub(self, number):
        main, self.names = self.names, ["_g"]
        o = self.random.choice([f"o{number}", f"o<sub_{number}>"])
        self.lines.append(f"{o} sub")
        self.body(2)
        if self.random.random() < 0.2:
            self.label += 1
            self.lines += [f"o{self.label} if [{self.expression(1)}]",
                           f"{o} return [{self.test()}]", f"o{self.label} endif"]
        ending = self.random.choice(["", f" [{self.test()}]"])
        self.lines.append(f"{o} endsub{ending}")
        self.subs.append((o, self.random.randint(0, 4)))
        self.names = main

    def program(self):
        self.lines = ["G21 G90 G94 G17", "G1 X0 F300", "#<_g>=2.5"]
        for number in range(self.random.choice([0, 1, 2])):
            self.sub(number + 1)
        fanuc = self.random.random() < 0.15
        if fanuc:
            self.subs.append(("M98 P77", 0))
        for _ in range(self.random.randint(2, 4)):
            self.body(3)
        self.lines.append("M2")
        if fanuc:
            self.subs.pop()
            self.lines.append("O77")
            self.names = ["_g"]
            self.body(1)
            self.lines.append("M99")
        return self.lines


MOVE = re.compile(r"STRAIGHT_(TRAVERSE|FEED)\((-?[\d.]+), (-?[\d.]+), (-?[\d.]+)")
RATE = re.compile(r"SET_FEED_RATE\((-?[\d.]+)\)")
IS_COMMAND = re.compile(r"^\s*\d+ N")


def ask(lines):
    """What rs274 makes of a program; None where it takes too long."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.ngc"
        path.write_text("\n".join(lines) + "\n")
        try:
            run = subprocess.run(["rs274", "-g", "a.ngc"], cwd=folder, capture_output=True,
                                 text=True, timeout=10)
        except subprocess.TimeoutExpired:
            return None
    events, said = [], []
    for line in (run.stdout + run.stderr).splitlines():
        move, rate = MOVE.search(line), RATE.search(line)
        if move:
            kind = "R" if move[1] == "TRAVERSE" else "G"
            events.append(" ".join([kind, *(f"{float(at):g}" if abs(float(at)) < 100 else at
                                            for at in move.groups()[1:])]))
        elif rate:
            events += [f"F {rate[1]}"] if float(rate[1]) or events else []
        elif "PROGRAM_END" in line:
            # What follows, and the rate 0 before it, is the end of every program.
            while events and events[-1].startswith("F 0"):
                events.pop()
            return events
        elif line.strip() and not IS_COMMAND.match(line) and line.strip() != "executing":
            said.append(line)
    # Where two of them begin at the same time, one may say nothing.
    return events + [f"! {said[-1]}"] if said else ask(lines)


def record(seed):
    lines = Writer(seed).program()
    events = ask(lines) if len(lines) < 400 else None
    if events is None or len(events) > 400:
        return None
    return "\n".join([f"@ {seed}", *lines, "=", *events])


def main():
    count = int(sys.argv[1])
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    with ThreadPoolExecutor(2) as pool:
        for text in pool.map(record, range(first, first + count)):
            if text is not None:
                print(text)


main()
