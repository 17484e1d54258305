"""What the commands answer. `leadscrew schema check` (`run`, `profile`) prints the same as a JSON schema."""

from __future__ import annotations

from typing import Dict, List, Optional, TypedDict


class Error(TypedDict):
    """A line that the machine refuses."""

    line: int
    column: Optional[int]
    code: int
    message: str
    remedy: str
    text: str


class Warning(TypedDict):
    """A line that the machine takes and nobody can have meant."""

    line: int
    column: Optional[int]
    kind: str
    message: str
    remedy: str
    text: str


class Extent(TypedDict):
    """How far all cuts reach on an axis, mm."""

    min: float
    max: float


class End(TypedDict):
    """How a job ended: `at` is `done` or `stopped`, `by` what stopped it, `words` the same as a person reads it."""

    at: str
    by: Optional[str]
    line: int
    words: str


class Wait(TypedDict):
    """A line at which the job waited for a person, and what the person has to do."""

    line: int
    why: str


class Time(TypedDict):
    """How long a job takes."""

    job_seconds: float
    motion_seconds: float


class Branch(TypedDict):
    """An `if` or `elseif` of a program: how often what follows was run and passed over."""

    line: int
    taken: int
    passed: int


class _Check(TypedDict):
    """What `check` answers. A laser's feed move without power counts as travel, as does a printer's
    without filament.
    """

    version: int
    file: str
    notes: List[str]
    lines: int
    errors: List[Error]
    error_count: int
    warnings: List[Warning]
    warning_count: int
    extents: Optional[Dict[str, Extent]]
    cut_mm: float
    travel_mm: float
    tools: List[int]
    pauses: List[int]


class Check(_Check, total=False):
    """What `check` answers; with its times where they were asked for, and the job has no error, and
    with the conditions that were met where the job is a program.
    """

    time: Time
    grbl: Time
    branches: List[Branch]


class _Axis(TypedDict):
    pulses: int
    net_steps: int
    position_mm: float
    peak_mm_min: float


class Axis(_Axis, total=False):
    """What an axis did; in turns where the machine file has `steps_per_rev`."""

    position_rev: float
    peak_rev_min: float


class Cpu(TypedDict):
    """Share of the microcontroller's cycles in use, 0 to 1."""

    mean: float
    peak: float


class _Run(TypedDict):
    """What `run` answers. Cuts are those of `Check`."""

    version: int
    file: str
    notes: List[str]
    lines: int
    errors: List[Error]
    error_count: int
    warnings: List[Warning]
    warning_count: int
    alarm: Optional[int]
    alarm_line: Optional[int]
    end: End
    pauses: List[int]
    waits: List[Wait]
    tools: List[int]
    extents: Optional[Dict[str, Extent]]
    cut_mm: float
    travel_mm: float
    job_seconds: float
    motion_seconds: float
    step_seconds: float
    axes: Dict[str, Axis]
    step_events: int
    smoothing_ticks: int
    dominant_step_events: int
    peak_step_hz: float
    min_pulse_us: Optional[float]
    min_direction_setup_us: Optional[float]
    late_events: int
    cpu: Cpu
    cycles: int
    wall_seconds: float


class Run(_Run, total=False):
    """What `run` answers; with the time of Grbl where it was asked for."""

    grbl: Time


class Limit(TypedDict):
    """What bound the speed for a while."""

    limit: str
    because: str
    held_by: str
    seconds: float
    share: float


class Trial(TypedDict):
    """The job run again with other settings."""

    change: str
    seconds_saved: float


class LineTime(TypedDict):
    """How long a line moves the machine; a line that does not, such as `G4`, has none."""

    line: int
    seconds: float


class _Profile(TypedDict):
    version: int
    file: str
    notes: List[str]
    lines: int
    errors: List[Error]
    error_count: int
    alarm: Optional[int]
    end: End
    pauses: List[int]
    waits: List[Wait]
    job_seconds: float
    limits: List[Limit]
    trials: List[Trial]


class Profile(_Profile, total=False):
    """What `profile` answers; `line_times` where it was asked for."""

    line_times: List[LineTime]
