"""Initialization: all FMUs through initialization mode, coupled equations solved by set and get."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...base.errors import AlgebraicLoopError, FmuError
from ..algorithms import Solver
from ..blocks.fmu import Fmu
from ..fmu.instance import FmuInstance
from ..order import loop_chain
from ..plan import Plan
from .algebraic import solve, start_values
from .stepping import Fmus, differences, feedthrough

Signals = Callable[[], list[Any]]


class Initialisation:
    """Brings the FMUs to the start, where outputs may be read after setting inputs.

    `signals` returns all signals at the start, computed from the FMUs' present outputs. First that
    is repeated until these stay as they are: as many sweeps as there are FMUs in a chain. FMUs that
    go on changing depend on each other; then the plan's solver takes over.
    """

    def __init__(
        self,
        plan: Plan,
        instances: Mapping[str, FmuInstance],
        signals: Signals,
        ticks: int | None,
    ) -> None:
        self.plan, self.instances, self.signals = plan, instances, signals
        self.fmus = [i for i, node in enumerate(plan.nodes) if isinstance(node.block, Fmu)]
        self.start = plan.clock.time(0)
        for i in self.fmus:
            node = plan.nodes[i]
            # A slower FMU's last step ends at its own hit, which may lie behind the run's stop.
            last = None if ticks is None else -(-ticks // node.ticks) * node.ticks
            stop = None if last is None else plan.clock.time(last)
            instance = instances[node.name]
            instance.enter_initialization(self.start, stop)
            instance.fetch()

    def settle(self) -> None:
        """Find the outputs that agree with the inputs; raise AlgebraicLoopError if none do."""
        solver = self.plan.algorithm.loops
        if solver is not None and self._circle():
            self._solve(solver)
            return
        for _ in range(len(self.fmus) + 2):
            before = self._outputs()
            try:
                self._sweep()
            except FmuError as error:
                if self._circle():  # it ran away
                    raise AlgebraicLoopError(self._chain()) from error
                raise
            after = self._outputs()
            if all(
                a == b or np.array_equal(a, b, equal_nan=True)
                for a, b in zip(before, after, strict=True)
            ):
                return
        if solver is None:
            raise AlgebraicLoopError(self._chain())
        self._solve(solver)

    def _solve(self, solver: Solver) -> None:
        unknown = self._unknown()
        names = [self.plan.signals[j] for _, j, _ in unknown]
        start = start_values(solver, names, [float(a[n]) for _, _, (a, n) in unknown])

        def around(z: np.ndarray) -> np.ndarray:
            self._write(unknown, z)
            self._sweep()
            return np.array([float(a[n]) for _, _, (a, n) in unknown])

        slopes = None
        if getattr(solver, "derivatives", "") == "directional":
            slopes = self._directional(unknown)
        where = f"initial equations of {', '.join(self.plan.nodes[i].name for i in self.fmus)}"
        solve(around, start, solver, names=names, where=where, begins=True, slopes=slopes)

    def finish(self) -> None:
        """Leave initialization mode; raise ValueError for an output that is not finite."""
        for i in self.fmus:
            node = self.plan.nodes[i]
            instance = self.instances[node.name]
            instance.exit_initialization()
            instance.fetch()
            for port, value in zip(node.block.outputs, instance.outputs(), strict=True):
                if not math.isfinite(value):
                    raise NotFiniteError(
                        f"{node.name}.{port} is {value:g} at the start, t = {self.start:.9g} s"
                    )

    def _outputs(self) -> list[tuple[float, ...]]:
        return [self.instances[self.plan.nodes[i].name].outputs() for i in self.fmus]

    def _sweep(self) -> None:
        """Bring the FMUs' outputs through the diagram to their inputs, and get them anew."""
        signals = self.signals()
        for i in self.fmus:
            node = self.plan.nodes[i]
            instance = self.instances[node.name]
            instance.inputs([signals[j] for j in node.inputs])
            instance.put()
            instance.fetch()

    def _unknown(self) -> list[tuple[int, int, tuple[Any, int]]]:
        """Return (FMU, signal, its slot) for the real outputs that any block reads."""
        read = {j for node in self.plan.nodes for j in node.inputs}
        found = []
        for i in self.fmus:
            node = self.plan.nodes[i]
            slots = self.instances[node.name].output_slots
            for j, (array, n, _) in zip(node.outputs, slots, strict=True):
                if j in read and self.plan.signals[j] not in self.plan.types:
                    found.append((i, j, (array, n)))
        return found

    def _write(self, unknown: Sequence[tuple[int, int, tuple[Any, int]]], z: np.ndarray) -> None:
        for (_, _, (array, n)), value in zip(unknown, z.tolist(), strict=True):
            array[n] = value

    def _directional(self, unknown: Sequence[tuple[int, int, tuple[Any, int]]]) -> Any:
        fmus = Fmus(self.plan, self.instances)
        places = [j for _, j, _ in unknown]

        def inputs(z: np.ndarray) -> np.ndarray:
            self._write(unknown, z)
            signals = self.signals()
            read = (j for i in self.fmus for j in self.plan.nodes[i].inputs)
            return np.array([float(signals[j]) for j in read])

        return lambda z: feedthrough(fmus, self.fmus, places) @ differences(inputs, z)

    def _circle(self) -> list[str]:
        """Return a circle of ports that depend on each other through FMUs, as these declare."""
        plan = self.plan
        maker = {j: node for node in plan.nodes for j in node.outputs}
        arrows = []
        for node in plan.nodes:
            block: Any = node.block
            through = isinstance(block, Fmu)
            for port, j in zip(block.inputs, node.inputs, strict=True):
                if (port in block.direct_inputs) if through else (j in node.direct):
                    arrow = f"{plan.signals[j]} → {node.name}.{port}"
                    arrows.append((maker[j].name, node.name, arrow))
        return loop_chain(arrows, {plan.nodes[i].name for i in self.fmus})

    def _chain(self) -> str:
        names = ", ".join(self.plan.nodes[i].name for i in self.fmus)
        circle = self._circle()
        chain = f": {', '.join(circle)}" if circle else f" ({names})"
        return (
            f"'{self.plan.name}': the initial outputs do not settle; they depend on each "
            f"other without a delay{chain}; have them solved: algorithm=TwoPhase(loops=Newton())"
        )


class NotFiniteError(Exception):
    """An FMU's output is not finite at the start."""
