"""What a scenario makes of a diagram over time: stretches in which nothing is changed."""

import math
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from ..base.errors import ParameterError
from .algorithms import Master
from .blocks.fmu import Fmu
from .clock import rational
from .diagram import Diagram
from .plan import Plan, make_plan
from .scenario import Scenario
from .scenario.fault import FaultBlock
from .scenario.wiring import faulty_plan


class Phases:
    """The plans of a run: `plan(tick)` holds from a tick up to the next of `boundaries`."""

    def __init__(
        self,
        diagram: Diagram,
        start: float | Fraction,
        algorithm: Master,
        scenario: Scenario | None,
        like: Plan | None = None,
    ) -> None:
        if scenario is not None and not isinstance(scenario, Scenario):
            raise ParameterError(f"scenario must be a Scenario, not {scenario!r}")
        self.diagram, self.start, self.algorithm = diagram, start, algorithm
        self.base = make_plan(diagram, start, algorithm, like=like)
        self.clock = self.base.clock
        self.scenario = scenario = Scenario() if scenario is None else scenario
        scenario.check(diagram)
        self._faults = scenario.faults(self.clock)
        self._rewrites = scenario.rewrites(self.clock)
        self._rings = {
            name: 4 + max(math.ceil(rational(time) / self.clock.step) for time in times)
            for name, times in scenario.delays().items()
        }
        ticks = {tick for tick, *_ in self._rewrites}
        for block in self._faults.values():
            ticks |= {tick for window in self._windows(block) for tick in window}
        self.boundaries = sorted(int(tick) for tick in ticks if math.isfinite(tick))
        for tick in self.boundaries:  # what cannot be is refused before the run
            self.plan(tick)

    def next_boundary(self, tick: int) -> float:
        """Return the first boundary after a tick, inf if there is none."""
        return next((b for b in self.boundaries if b > tick), math.inf)

    def plan(self, tick: int) -> Plan:
        """Return the plan that holds from a tick on."""
        values: dict[str, Any] = {}
        for when, name, parameter, value in self._rewrites:
            if when <= tick and not isinstance(self.diagram.blocks[name], Fmu):
                values[f"{name}.{parameter}"] = value
        diagram = self.diagram.with_values(values) if values else self.diagram
        faults = {
            port: block
            for port, block in self._faults.items()
            if any(begin <= tick < end for begin, end in self._windows(block))
        }
        if not (faults or self._rings or values):
            return self.base
        if not faults:
            return make_plan(diagram, self.start, self.algorithm, self._rings, self.base)
        return faulty_plan(diagram, self.start, self.algorithm, self._rings, faults)

    def fmu_changes(self, tick: int) -> Iterator[tuple[str, str, Any]]:
        """Yield (block, parameter, value) of the FMU parameters that change at a tick."""
        for when, name, parameter, value in self._rewrites:
            if when == tick and isinstance(self.diagram.blocks[name], Fmu):
                yield name, parameter, value

    def _windows(self, block: FaultBlock) -> Iterator[tuple[float, float]]:
        """Yield the ticks (begin, end) between which a fault block must be there."""
        for stage in block.stages:
            first, end = stage.ticks
            yield first, math.inf if end is None else end
