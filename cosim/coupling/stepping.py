"""The algorithms at work inside a tick: FMUs from one place to another.

`over(tick, a, b, y, last)` steps the FMUs from place a to b, y being the signals at a, and returns
the signals at b, of which only the FMUs' outputs are new. Straight-line code does the same for a
whole tick without events (see `ahead`); here are events, repeated and divided steps.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from ...base.errors import FmuError
from ..algorithms import Iterated, Newton
from ..fmu.instance import FmuInstance
from ..plan import Node, Plan
from .algebraic import solve
from .within import Last, Place, Signals, Tick


@dataclass
class Fmus:
    """The FMUs of a plan that step at every tick, in order."""

    plan: Plan
    instances: Mapping[str, FmuInstance]
    steps: int = 0  # how many were made
    saved: dict[int, Any] = field(default_factory=dict)

    def step(
        self, i: int, tick: Tick, a: Place, b: Place, y: Signals, ahead: Mapping[int, Any]
    ) -> dict[int, Any]:
        """Step the FMU at place i of the plan from a to b; return its outputs there."""
        node = self.plan.nodes[i]
        instance = self.instances[node.name]
        span = tick.span(a, b)
        if self.plan.algorithm.extrapolation:
            self._sloped(node, instance, y, ahead, tick.time(a), span)
        else:
            instance.inputs([ahead.get(j, y[j]) for j in node.inputs])
            instance.advance(tick.time(a), span)
        self.steps += 1
        return self.outputs(i)

    def _sloped(
        self,
        node: Node,
        instance: FmuInstance,
        y: Signals,
        ahead: Mapping[int, Any],
        t: float,
        span: float,
    ) -> None:
        types = self.plan.types
        pairs: list[tuple[Any, Any]] = []  # (value, line's end); what is no real has no line
        for j, (_, _, convert) in zip(node.inputs, instance.input_slots, strict=True):
            if convert or self.plan.signals[j] in types:
                pairs.append((ahead.get(j, y[j]), None))
            else:
                pairs.append((y[j], ahead.get(j)))
        ends = [end for _, end in pairs]
        if instance.takes_slopes and any(end is not None for end in ends):
            instance.inputs([value for value, _ in pairs])
            instance.slopes([0.0 if e is None else (e - v) / span for v, e in pairs])
            instance.advance_sloped(t, span)
        else:
            instance.inputs([v if e is None else v + 0.5 * (e - v) for v, e in pairs])
            instance.advance(t, span)

    def outputs(self, i: int) -> dict[int, Any]:
        """Return the outputs of the FMU at place i of the plan."""
        node = self.plan.nodes[i]
        slots = self.instances[node.name].output_slots
        return {j: array[n] for j, (array, n, _) in zip(node.outputs, slots, strict=True)}

    def save(self, places: Sequence[int], into: dict[int, Any], time: float) -> None:
        """Save the states of FMUs at a time (s) into handles, to be used again."""
        for i in places:
            instance = self.instances[self.plan.nodes[i].name]
            instance.time = time
            into[i] = instance.save(into.get(i))

    def release(self) -> None:
        """Free the states that were saved."""
        self.free(self.saved)

    def free(self, saved: dict[int, Any]) -> None:
        """Free states that `save` wrote there."""
        for i, handle in saved.items():
            instance = self.instances.get(self.plan.nodes[i].name)
            if instance is not None:
                with suppress(FmuError):  # an FMU that has failed may refuse
                    instance.release(handle)
        saved.clear()

    def restore(self, places: Sequence[int], saved: Mapping[int, Any]) -> None:
        """Bring FMUs back to saved states."""
        for i in places:
            self.instances[self.plan.nodes[i].name].restore(saved[i])


class Stepper(Protocol):
    """One algorithm; see the module."""

    def over(self, tick: Tick, a: Place, b: Place, y: Signals, last: Last | None) -> Signals:
        """Step the FMUs from a to b."""
        ...


@dataclass
class InOrder:
    """Each FMU once, in order: in parallel, or one after the other (Gauss–Seidel)."""

    fmus: Fmus
    sequential: bool

    def over(self, tick: Tick, a: Place, b: Place, y: Signals, last: Last | None) -> Signals:
        """Step the FMUs from a to b."""
        plan = self.fmus.plan
        ahead = tick.ahead(a, b, y, last) if plan.algorithm.extrapolation else {}
        after = list(y)
        for i in plan.network.fmus:
            outputs = self.fmus.step(i, tick, a, b, y, ahead)
            for j, value in outputs.items():
                after[j] = value
            if self.sequential:
                ahead |= outputs
                tick.carry(b, y, ahead, set(outputs))
        return after


@dataclass
class Repeated:
    """Circles of FMUs repeat their step until inputs and outputs agree at its end."""

    fmus: Fmus
    algorithm: Iterated

    def __post_init__(self) -> None:
        plan = self.fmus.plan
        self._unknown = {c: coupled_signals(plan, c) for c in plan.network.circles}

    def over(self, tick: Tick, a: Place, b: Place, y: Signals, last: Last | None) -> Signals:
        """Step the FMUs from a to b."""
        plan = self.fmus.plan
        ahead = tick.ahead(a, b, y, last) if plan.algorithm.extrapolation else {}
        after = list(y)
        for circle in plan.network.circles:
            outputs = self._circle(circle, tick, a, b, y, ahead)
            for j, value in outputs.items():
                after[j] = value
            ahead |= outputs
            tick.carry(b, y, ahead, set(outputs))
        return after

    def _circle(
        self,
        circle: tuple[int, ...],
        tick: Tick,
        a: Place,
        b: Place,
        y: Signals,
        ahead: dict[int, Any],
    ) -> dict[int, Any]:
        plan = self.fmus.plan
        unknown = self._unknown[circle]
        outputs: dict[int, Any] = {}

        def step(values: Mapping[int, Any]) -> None:
            guess = ahead | dict(values)
            tick.carry(b, y, guess, set(values))
            for i in circle:
                outputs.update(self.fmus.step(i, tick, a, b, y, guess))

        if not unknown:
            step({})
            return outputs
        saved = self.fmus.saved
        self.fmus.save(circle, saved, tick.time(a))
        is_first = True

        def around(z: np.ndarray) -> np.ndarray:
            nonlocal is_first
            if not is_first:
                self.fmus.restore(circle, saved)
            is_first = False
            step(dict(zip(unknown, z.tolist(), strict=True)))
            return np.array([float(outputs[j]) for j in unknown])

        names = [plan.signals[j] for j in unknown]
        start = np.array([float(ahead.get(j, y[j])) for j in unknown])
        blocks = ", ".join(plan.nodes[i].name for i in circle)
        slopes = None
        solver = self.algorithm.solver
        if isinstance(solver, Newton) and solver.derivatives == "directional":
            slopes = _directional(self.fmus, circle, unknown, tick, b, y, ahead)
        where = f"coupling of {blocks} at t = {tick.time(b):.9g} s"
        solve(around, start, solver, names=names, where=where, begins=False, slopes=slopes)
        return outputs


def coupled_signals(plan: Plan, circle: Sequence[int]) -> list[int]:
    """Return the real outputs of a circle's FMUs that its FMUs read at the same instant."""
    maker = {j: i for i, node in enumerate(plan.nodes) for j in node.outputs}
    between = set(plan.network.between)
    own = set(circle)
    found: dict[int, None] = {}
    todo = [j for i in circle for j in plan.nodes[i].inputs]
    seen: set[int] = set()
    while todo:
        j = todo.pop()
        if j in seen:
            continue
        seen.add(j)
        node = plan.nodes[maker[j]]
        if maker[j] in own:
            if plan.signals[j] not in plan.types:
                found[j] = None
        elif maker[j] in between and not node.block.run_by_engine:
            todo += node.inputs
    return sorted(found)


def _directional(
    fmus: Fmus,
    circle: Sequence[int],
    unknown: Sequence[int],
    tick: Tick,
    b: Place,
    y: Signals,
    ahead: dict[int, Any],
) -> Any:
    """Return the function that gives the Jacobian of a circle's map by directional derivatives."""
    plan = fmus.plan

    def inputs(z: np.ndarray) -> np.ndarray:
        seen = ahead | dict(zip(unknown, z.tolist(), strict=True))
        tick.carry(b, y, seen, set(unknown))
        return np.array([float(seen.get(j, y[j])) for i in circle for j in plan.nodes[i].inputs])

    return lambda z: feedthrough(fmus, circle, unknown) @ differences(inputs, z)


def feedthrough(fmus: Fmus, circle: Sequence[int], unknown: Sequence[int]) -> np.ndarray:
    """Return the derivatives of the unknown outputs along all inputs of a circle's FMUs."""
    plan = fmus.plan
    columns = [(i, n) for i in circle for n in range(len(plan.nodes[i].inputs))]
    found = np.zeros((len(unknown), len(columns)))
    for column, (i, n) in enumerate(columns):
        node = plan.nodes[i]
        instance = fmus.instances[node.name]
        rows = [row for row, j in enumerate(unknown) if j in node.outputs]
        if not rows or instance.input_slots[n][2]:
            continue
        names = [list(node.block.outputs)[node.outputs.index(unknown[row])] for row in rows]
        known = list(node.block.inputs)[n]
        found[rows, column] = instance.directional(names, [known], [1.0])
    return found


def differences(function: Any, z: np.ndarray) -> np.ndarray:
    """Return the Jacobian of a function that is close to linear."""
    middle = function(z)
    columns = []
    for i in range(len(z)):
        h = 2.0**-20 * max(1.0, abs(z[i]))
        shifted = z.copy()
        shifted[i] += h
        columns.append((function(shifted) - middle) / (shifted[i] - z[i]))
    return np.array(columns).T
