"""The block that the engine puts behind a port which a scenario's faults act on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Self

from ...base.errors import DiagramError
from ..block import Block
from ..clock import Clock, rational
from .change import Fault, first_tick

State = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Stage:
    """One fault in a run: active at begin ≤ t < end (s), its held value taken at `capture` (s).

    Outside `ticks`, a first one and one behind the last (inf: none), it neither does nor needs
    anything.
    """

    fault: Fault
    begin: float
    end: float
    capture: float | None
    ticks: tuple[int, float]

    @classmethod
    def of(cls, fault: Fault, clock: Clock) -> Self | None:
        """Return a fault's stage in a run; None if it was over before the start.

        Raise DiagramError if it falls between two ticks, or needs a value from before the start.
        """
        begin = first_tick(clock, fault.at)
        end = None if fault.until is None else first_tick(clock, fault.until)
        if fault.until is not None and begin == end:
            if rational(fault.until) <= clock.start:
                return None
            raise DiagramError(
                f"no tick lies in {float(fault.at):g} s ≤ t < {float(fault.until):g} s; "
                f"the diagram's step is {float(clock.step):g} s"
            )
        capture = fault.captures()
        if capture is not None and begin + capture < 0:
            raise DiagramError(
                f"at t = {clock.time(0):g} s nothing has come in before; give a value"
            )
        return cls(
            fault,
            clock.time(begin),
            math.inf if end is None else clock.time(end),
            None if capture is None else clock.time(begin + capture),
            (begin + (capture or 0), math.inf if end is None else end),
        )


@dataclass(frozen=True, slots=True)
class FaultBlock(Block):
    """y = u but for the faults that are active: each acts on what the one listed before leaves.

    The state is one held number for each fault, of use to those that hold one.
    """

    stages: tuple[Stage, ...]
    _first: float = field(init=False, repr=False, compare=False)  # s: before, nothing happens
    _last: float = field(init=False, repr=False, compare=False)  # s: nor from here on

    timed = True
    is_wire = True
    continuous = True
    inputs = {"u": None}
    outputs = {"y": None}

    def __post_init__(self) -> None:
        times = [t for s in self.stages for t in (s.begin, s.capture) if t is not None]
        object.__setattr__(self, "_first", min(times, default=math.inf))
        object.__setattr__(self, "_last", max((s.end for s in self.stages), default=-math.inf))

    @classmethod
    def of(cls, faults: Sequence[Fault], clock: Clock) -> Self:
        """Return the block of one port's faults, in the order in which they act."""
        stages = (Stage.of(fault, clock) for fault in faults)
        return cls(tuple(stage for stage in stages if stage is not None))

    def start(self) -> State:
        """Return a zero for each fault: nothing is held."""
        return (0.0,) * len(self.stages)

    def step(self, x: State, t: float, u: Any) -> tuple[Any, State]:
        """Return (what the port carries at t (s), the held values)."""
        if t < self._first or t >= self._last:
            return u, x
        for i, stage in enumerate(self.stages):
            if t == stage.capture:
                x = (*x[:i], float(u), *x[i + 1 :])
            if stage.begin <= t < stage.end:
                u = stage.fault.act(u, t, x[i])
        return u, x

    def passed(self, x: State, t: float, u: Any) -> Any:
        """Return what the port carries within the step that began at t (s)."""
        for stage, held in zip(self.stages, x, strict=True):
            if stage.begin <= t < stage.end:
                u = stage.fault.act(u, t, held)
        return u
