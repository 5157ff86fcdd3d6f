"""Real time: a run that waits for the clock on the wall, and counts where it came too late."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from ...base.errors import ParameterError
from ..clock import Clock

_LISTED = 20  # late ticks in a report
_SPIN = 3e-4  # s; what is left of a wait is not slept: a sleep wakes up some 0.1 ms late


@dataclass(frozen=True, kw_only=True, slots=True)
class Pace:
    """Run `factor` seconds of simulated time in a second: 1 is real time, 2 twice as fast.

    The tick at t is due (t − start) / factor after the run's first tick. A tick that comes more
    than `tolerance` (s) after it was due is a missed deadline: it is counted, and the run goes on
    without waiting until it has caught up.
    """

    factor: float = 1.0
    tolerance: float = 1e-3

    def __post_init__(self) -> None:
        if not (_is_number(self.factor) and self.factor > 0.0):
            raise ParameterError(f"Pace: factor must be a positive number, not {self.factor!r}")
        if not (_is_number(self.tolerance) and self.tolerance >= 0.0):
            what = "a number of seconds from 0"
            raise ParameterError(f"Pace: tolerance must be {what}, not {self.tolerance!r}")


def _is_number(value: Any) -> bool:
    good = isinstance(value, int | float) and not isinstance(value, bool)
    return good and math.isfinite(value)


@dataclass(frozen=True, slots=True)
class LateTick:
    """A tick, its simulated time in s, and by how much it was late in s."""

    tick: int
    time: float
    lateness: float


@dataclass(frozen=True, slots=True)
class PacingReport:
    """How a run kept its pace: `missed` deadlines of `ticks`, the `worst` lateness in s.

    `late` lists the first late ticks, at most 20.
    """

    factor: float
    tolerance: float
    ticks: int
    missed: int
    worst: float
    late: tuple[LateTick, ...] = ()

    def __str__(self) -> str:
        what = f"{self.factor:g} × real time: "
        worst = f"latest tick {_text(self.worst)}"
        if not self.missed:
            return f"{what}no deadline of {self.ticks} missed, {worst}"
        first = f"first at t = {self.late[0].time:.9g} s" if self.late else ""
        return (
            f"{what}{self.missed} of {self.ticks} deadlines missed by more than "
            f"{_text(self.tolerance)}, {worst}, {first}"
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain values, for a result file."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "PacingReport":
        """Return the report that `to_dict` gave."""
        late = tuple(LateTick(**one) for one in values["late"])
        return cls(**{**values, "late": late})


def _text(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1.0 else f"{seconds:.4g} s"


@dataclass
class Pacer:
    """The pace of one run: `wait(k)` once per tick, before the tick's outputs."""

    pace: Pace
    clock: Clock
    now: Callable[[], float] = time.perf_counter  # s
    sleep: Callable[[float], None] = time.sleep
    ticks: int = field(default=0, init=False)
    missed: int = field(default=0, init=False)
    worst: float = field(default=0.0, init=False)  # s
    late: list[LateTick] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        self._span = float(self.clock.step) / self.pace.factor  # s between two ticks
        self._origin: tuple[int, float] | None = None

    def anchor(self, tick: int) -> None:
        """Let this tick be due now: at the run's start, or when it goes on after a pause."""
        self._origin = (tick, self.now())

    def wait(self, tick: int) -> None:
        """Return when the tick is due, at once if it is late. The first one is due at once.

        Deadlines count from the first tick, so that no error adds up.
        """
        if self._origin is None:
            self.anchor(tick)
        assert self._origin is not None
        first, start = self._origin
        due = start + (tick - first) * self._span
        lateness = self.now() - due
        while lateness < 0.0:
            if lateness < -_SPIN:
                self.sleep(-0.75 * lateness)
            lateness = self.now() - due
        self.ticks += 1
        self.worst = max(self.worst, lateness)
        if lateness > self.pace.tolerance:
            self.missed += 1
            if len(self.late) < _LISTED:
                self.late.append(LateTick(tick, self.clock.time(tick), lateness))

    def report(self) -> PacingReport:
        """Return the report on the ticks so far."""
        pace = self.pace
        return PacingReport(
            float(pace.factor),
            float(pace.tolerance),
            self.ticks,
            self.missed,
            self.worst,
            tuple(self.late),
        )
