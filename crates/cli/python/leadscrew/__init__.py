"""Runs G-code on a simulated GRBL machine: the commands of `leadscrew`, typed.

    import leadscrew

    report = leadscrew.check("G1 X10\\n")
    report["errors"][0]["message"]               # why line 1 is refused
    leadscrew.run("G1 X10 F600\\n")["job_seconds"]
    leadscrew.profile(pathlib.Path("job.nc"), settings={110: 6000})["limits"][0]["held_by"]

A job is G-code as `str` or `bytes`, or a `pathlib.Path` of a file. Lengths are millimetres, times simulated seconds; docs/json.md
describes each field.
"""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
import sysconfig
from decimal import Decimal
from typing import Any, BinaryIO, Callable, Mapping, NamedTuple, Optional, Sequence, Tuple, Union, cast

from ._types import Check, Profile, Run

__all__ = [
    "Check",
    "LeadscrewError",
    "Made",
    "Profile",
    "Progress",
    "Run",
    "align",
    "calibrate",
    "check",
    "import_job",
    "new_machine",
    "picture",
    "profile",
    "program",
    "replay",
    "run",
]

Job = Union[str, bytes, "os.PathLike[str]"]
File = Union[str, "os.PathLike[str]"]
Settings = Union[str, "os.PathLike[str]", Mapping[int, float]]
Point = Tuple[float, float]
Progress = Callable[[int, int], None]

DONE, JOB_FAILED = 0, 1


class LeadscrewError(Exception):
    """The program could not do its work: an option, a file or a setting that it cannot use."""


class Made(NamedTuple):
    """A job that was made of another file, and what the maker of it has to know."""

    text: str
    notes: Tuple[str, ...]


def program() -> str:
    """The path of the `leadscrew` program that came with this package."""
    name = "leadscrew" + (".exe" if sys.platform == "win32" else "")
    schemes = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user"), os.path.dirname(sys.executable)]
    for folder in schemes:
        path = os.path.join(folder, name)
        if os.path.isfile(path):
            return path
    raise FileNotFoundError(f"{name} is in none of {schemes}")


def check(
    job: Job,
    machine: Optional[File] = None,
    *,
    settings: Optional[Settings] = None,
    origin: Optional[Sequence[float]] = None,
    time: bool = False,
    like: Optional[str] = None,
    progress: Optional[Progress] = None,
) -> Check:
    """Finds every error in a job, and what is probably not meant; nothing moves.

    `machine` is a file that describes the machine, `settings` a file of lines as `$$` prints them or values by number, `origin`
    where work zero is in machine coordinates: then what leaves the travel from there is found too. With `time` the job is timed as
    `run` times it, without its steps; `like="grbl"` adds how long Grbl takes. `progress`: see `run`.
    """
    options = _machine(machine, settings)
    if origin is not None:
        options += ["--origin", ",".join(repr(float(place)) for place in origin)]
    options += ["--time"] if time or like is not None else []
    return cast(Check, _ask("check", job, options + _like(like), progress))


def run(
    job: Job,
    machine: Optional[File] = None,
    *,
    settings: Optional[Settings] = None,
    baud: Optional[int] = None,
    keep_going: bool = False,
    like: Optional[str] = None,
    progress: Optional[Progress] = None,
) -> Run:
    """Runs a job to the step; an error ends it, unless it is to `keep_going`. `baud` models a serial line of so many bits a second;
    `like="grbl"` adds how long Grbl takes.

    `progress` is called with the bytes that the simulator has been given, and how many there are: it reads ahead by 128 KB at most.
    An exception in it ends the run.
    """
    options = _machine(machine, settings) + _line(baud, keep_going)
    return cast(Run, _ask("run", job, options + _like(like), progress))


def profile(
    job: Job,
    machine: Optional[File] = None,
    *,
    settings: Optional[Settings] = None,
    baud: Optional[int] = None,
    keep_going: bool = False,
    trials: bool = False,
    line_times: bool = False,
) -> Profile:
    """Finds out where the time of a job goes: which limit binds when. With `trials`, the job runs again to tell what each change of a
    setting would save; with `line_times`, how long each line moves the machine."""
    options = _machine(machine, settings) + _line(baud, keep_going)
    options += [] if trials else ["--no-trials"]
    options += ["--line-times"] if line_times else []
    return cast(Profile, _ask("profile", job, options))


def picture(
    job: Job,
    machine: Optional[File] = None,
    *,
    settings: Optional[Settings] = None,
    speed: bool = False,
) -> str:
    """Draws a job: an SVG picture of its path. With `speed` the job runs, and the picture has the speed along the time as well."""
    options = [*_machine(machine, settings), "--svg", "-"]
    return _call("run" if speed else "check", job, ["--quiet", *options]).decode()


def import_job(kind: str, *files: Job, **options: object) -> Made:
    """Makes a job of another machine's file: `kind` is `drill`, `rp`, `rows` or `print`.

    `options` are those of `leadscrew import KIND`, with `_` for `-`: `import_job("drill", path, depth=-1.8, feed=120)`. A sequence is
    joined by commas, `True` is an option without a value. Raises `LeadscrewError` with all faults of the file.
    """
    words = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            words.append(option)
        elif value is not False and value is not None:
            words.append(f"{option}={_text(value)}")
    return _make(["import", kind, *words], *files)


def align(job: Job, pairs: Sequence[Tuple[Point, Point]], *, scale: bool = False) -> Made:
    """Turns and shifts a job onto a board that lies askew. Each pair is a point of the job, and where it was found, mm."""
    words = ["align"] + (["--scale"] if scale else [])
    for nominal, measured in pairs:
        words += [f"--ref={_text(nominal)}", f"--measured={_text(measured)}"]
    return _make(words, job)


def calibrate(
    axis: str,
    commanded: float,
    measured: float,
    machine: Optional[File] = None,
    *,
    settings: Optional[Settings] = None,
) -> Tuple[int, float]:
    """The setting with which an axis goes as far as it is told: its number and its value, steps per mm."""
    words = ["calibrate", f"--commanded={_text(commanded)}", f"--measured={_text(measured)}", *_machine(machine, settings)]
    line = _start([*words, "--", axis], None).stdout.decode().split()[0]
    number, value = line.lstrip("$").split("=")
    return int(number), float(value)


def replay(conversation: Job) -> Any:
    """Answers a recorded conversation with Grbl in virtual time: the same JSON object, with this machine's answers."""
    return json.loads(_call("replay", conversation, []))


def new_machine(like: str = "router") -> str:
    """The text of a machine file to begin with: `router`, `laser`, `drill`, `engraver`, `plotter` or `printer`."""
    return _start(["machine", "new", f"--like={like}"], None).stdout.decode()


def _machine(machine: Optional[File], settings: Optional[Settings]) -> list[str]:
    options = [] if machine is None else ["--machine", os.fspath(machine)]
    if isinstance(settings, Mapping):
        for number, value in settings.items():
            options += ["--set", f"${number}={_decimal(value)}"]
    elif settings is not None:
        options += ["--settings", os.fspath(settings)]
    return options


def _decimal(value: float) -> str:
    """The number as G-code has numbers: without an exponent, and a `bool` as 0 or 1."""
    return str(int(value)) if isinstance(value, int) else format(Decimal(repr(float(value))), "f")


def _line(baud: Optional[int], keep_going: bool) -> list[str]:
    return ([] if baud is None else ["--baud", str(baud)]) + (["--keep-going"] if keep_going else [])


def _like(controller: Optional[str]) -> list[str]:
    return [] if controller is None else ["--as", controller]


def _text(value: object) -> str:
    """A value as the command line has it: a sequence with commas."""
    if isinstance(value, (int, float)):
        return _decimal(value)
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    return ",".join(_text(part) for part in cast("Sequence[object]", value))


def _ask(command: str, job: Job, options: list[str], progress: Optional[Progress] = None) -> Any:
    options = ["--json", "--quiet", *options]
    if progress is None:
        return json.loads(_call(command, job, options))
    name, text = _input(job)
    words = [command, *options, "--", "-"]
    if text is not None:
        return json.loads(_feed(words, io.BytesIO(text), len(text), progress))
    try:
        with open(name, "rb") as file:
            answer = json.loads(_feed(words, file, os.path.getsize(name), progress))
    except OSError as error:
        raise LeadscrewError(str(error)) from error
    return {**answer, "file": name}


def _make(words: list[str], *files: Job) -> Made:
    """Calls a command that makes a job. Of texts there can be one: the program reads one standard input."""
    names, text = [], None
    for file in files:
        name, found = _input(file)
        names.append(name)
        text = found if found is not None else text
    done = _start([*words, "--", *names], text, (DONE,))
    notes = done.stderr.decode(errors="replace").splitlines()
    return Made(done.stdout.decode(), tuple(note.removeprefix("note: ") for note in notes))


def _call(command: str, job: Job, options: list[str]) -> bytes:
    name, text = _input(job)
    return _start([command, *options, "--", name], text).stdout


def _input(job: Job) -> Tuple[str, Optional[bytes]]:
    """A job as an argument, and its text if it is one.

    Raises `ValueError` for a `str` that is the name of a file: no G-code looks like it.
    """
    if isinstance(job, bytes):
        return "-", job
    if isinstance(job, str):
        if _is_name(job):
            raise ValueError(f"{job!r} is the name of a file, not its text: pass pathlib.Path({job!r})")
        return "-", job.encode()
    return os.fspath(job), None


def _is_name(text: str) -> bool:
    """Whether a text is one word with a file's ending, or the path of a file that is there."""
    if not text or len(text) > 4096 or any(mark in text for mark in "\n\r\0"):
        return False
    return re.fullmatch(r"\S+\.[A-Za-z]{1,5}", text) is not None or os.path.isfile(text)


def _start(words: list[str], text: Optional[bytes], fine: Sequence[int] = (DONE, JOB_FAILED)) -> "subprocess.CompletedProcess[bytes]":
    silent = subprocess.DEVNULL if text is None else None
    done = subprocess.run([program(), *words], input=text, stdin=silent, capture_output=True, check=False)
    return _fine(done, fine)


def _fine(done: "subprocess.CompletedProcess[bytes]", fine: Sequence[int]) -> "subprocess.CompletedProcess[bytes]":
    if done.returncode not in fine:
        raise LeadscrewError(done.stderr.decode(errors="replace").strip() or f"exit status {done.returncode}")
    return done


def _feed(words: list[str], text: BinaryIO, size: int, progress: Progress) -> bytes:
    """Gives a text to the program piece by piece, as fast as it is read. Returns what the program prints at its end."""
    command, pipe = [program(), *words], subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe) as running:
        assert running.stdin is not None
        given = 0
        try:
            while piece := text.read(1 << 16):
                running.stdin.write(piece)
                running.stdin.flush()
                given += len(piece)
                progress(given, size)
        except BrokenPipeError:
            pass  # The job has ended before its text.
        except BaseException:
            running.kill()
            raise
        answer, complaint = running.communicate()
        done = subprocess.CompletedProcess(command, running.returncode, answer, complaint)
    return _fine(done, (DONE, JOB_FAILED)).stdout
