"""Runs G-code on a simulated GRBL machine: what `leadscrew check`, `run` and `profile` say with `--json`.

    import leadscrew

    report = leadscrew.check("G1 X10\\n")
    report["errors"][0]["message"]               # why line 1 is refused
    leadscrew.run("G1 X10 F600\\n")["job_seconds"]
    leadscrew.profile(pathlib.Path("job.nc"), settings={110: 6000})["limits"][0]["held_by"]

A job is G-code as `str` or `bytes`, or a path of a file. Lengths are millimetres, times simulated seconds; docs/json.md describes
each field.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
from decimal import Decimal
from typing import Any, Mapping, Optional, Sequence, Union, cast

from ._types import Check, Profile, Run

__all__ = ["Check", "LeadscrewError", "Profile", "Run", "check", "profile", "program", "run"]

Job = Union[str, bytes, "os.PathLike[str]"]
Settings = Union["os.PathLike[str]", Mapping[int, float]]

DONE, JOB_FAILED = 0, 1


class LeadscrewError(Exception):
    """The program could not do its work: an option, a file or a setting that it cannot use."""


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
    machine: Optional["os.PathLike[str]"] = None,
    *,
    settings: Optional[Settings] = None,
    origin: Optional[Sequence[float]] = None,
) -> Check:
    """Finds every error in a job, and what is probably not meant; nothing moves.

    `machine` is a file that describes the machine, `settings` a file of lines as `$$` prints them or values by number, `origin`
    where work zero is in machine coordinates: then what leaves the travel from there is found too.
    """
    options = _machine(machine, settings)
    if origin is not None:
        options += ["--origin", ",".join(repr(float(place)) for place in origin)]
    return cast(Check, _ask("check", job, options))


def run(
    job: Job,
    machine: Optional["os.PathLike[str]"] = None,
    *,
    settings: Optional[Settings] = None,
    baud: Optional[int] = None,
    keep_going: bool = False,
) -> Run:
    """Runs a job to the step; an error ends it, unless it is to `keep_going`. `baud` models a serial line of so many bits a second."""
    options = _machine(machine, settings) + _line(baud, keep_going)
    return cast(Run, _ask("run", job, options))


def profile(
    job: Job,
    machine: Optional["os.PathLike[str]"] = None,
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


def _machine(machine: Optional["os.PathLike[str]"], settings: Optional[Settings]) -> list[str]:
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


def _ask(command: str, job: Job, options: list[str]) -> Any:
    text = job.encode() if isinstance(job, str) else job if isinstance(job, bytes) else None
    name = "-" if text is not None else os.fspath(cast("os.PathLike[str]", job))
    words = [program(), command, "--json", "--quiet", *options, "--", name]
    done = subprocess.run(words, input=text, stdin=subprocess.DEVNULL if text is None else None, capture_output=True, check=False)
    if done.returncode not in (DONE, JOB_FAILED):
        raise LeadscrewError(done.stderr.decode(errors="replace").strip() or f"exit status {done.returncode}")
    return json.loads(done.stdout)
