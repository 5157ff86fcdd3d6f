"""The signals within a tick: at a place between t_k and t_{k+1}, and ahead, at a step's end.

Places are exact parts of the tick, from 0 to 1; nothing accumulates.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from ..blocks.delay import Delay
from ..plan import Node, Plan
from ..schedule.delays import delayed_within, jump_within
from .loop_solver import BlockError, numbers

Place = Fraction
_EVENTS = 1000  # of one source within one step: more are a mistake, and would never end
Signals = list[Any]


@dataclass(frozen=True)
class Last:
    """FMU outputs `span` (parts of a tick) before the present ones."""

    span: Fraction
    values: Mapping[int, float]


@dataclass(frozen=True)
class Tick:
    """A tick that is being stepped through: its number and the states of blocks between FMUs."""

    plan: Plan
    k: int
    states: Mapping[int, Any]

    def time(self, place: Place) -> float:
        """Return the time (s) of a place."""
        # The fraction start + (k + place) · step in integers, divided once.
        a, b, q = self.plan.clock.integers
        n, d = place.numerator, place.denominator
        return (a * d + (self.k * d + n) * b) / (q * d)

    def span(self, a: Place, b: Place) -> float:
        """Return the time (s) between two places."""
        step = self.plan.clock.step
        parts = b.numerator * a.denominator - a.numerator * b.denominator
        return parts * step.numerator / (b.denominator * a.denominator * step.denominator)

    def jumps(self) -> list[Place]:
        """Return the places of events inside the tick, in order."""
        found: set[Place] = set()
        clock = self.plan.clock
        for i in self.plan.network.events:
            node, state = self.plan.nodes[i], self.states[i]
            if isinstance(node.block, Delay):
                place = jump_within(node, state, self.k, clock.step)
                found |= set() if place is None else {place}
                continue
            t, end = self.time(Place(0)), self.time(Place(1))
            count = 0
            while (t := next_event(node, state, t)) < end:
                found.add(clock.place(t) - self.k)
                count += 1
                if count > _EVENTS:
                    raise BlockError(node.name) from ValueError(
                        f"next_event() announces more than {_EVENTS} events within one step"
                    )
        return sorted(place for place in found if 0 < place < 1)

    def at(self, place: Place, y: Signals) -> Signals:
        """Return the signals at a place, y holding the FMUs' outputs there."""
        y = list(y)
        t = self.time(place)
        for i in self.plan.network.between:
            node, state = self.plan.nodes[i], self.states[i]
            if isinstance(node.block, Delay):
                y[node.outputs[0]] = delayed_within(node, state, self.k, place, self.plan.clock)
            else:
                _write(node, evaluate(node, state, self._when(node, t), y), y)
        return y

    def _when(self, node: Node, t: float) -> float:
        """Return the time at which a block between FMUs is evaluated for time t (s)."""
        return self.time(Place(0)) if node.block.is_wire else t

    def ahead(self, a: Place, b: Place, y: Signals, last: Last | None) -> dict[int, Any]:
        """Return what continuous signals are taken to be at b, from what is known at a.

        The rules are those of straight-line code: see schedule/ahead.py.
        """
        found: dict[int, Any] = {}
        if last is not None:
            ratio = float((b - a) / last.span)
            found |= {j: y[j] + ratio * (y[j] - p) for j, p in last.values.items()}
        clock = self.plan.clock
        for i in self.plan.network.between:
            node, state = self.plan.nodes[i], self.states[i]
            if not node.continuous:
                continue
            if isinstance(node.block, Delay):
                if node.block.split(clock.step)[0]:
                    value = delayed_within(node, state, self.k, b, clock, before=True)
                    found[node.outputs[0]] = value
            elif not node.inputs:
                middle: dict[int, Any] = {}
                _write(node, evaluate(node, state, self.time((a + b) / 2), y), middle)
                found |= {j: y[j] + 2.0 * (v - y[j]) for j, v in middle.items()}
        self.carry(b, y, found, set(found))
        return found

    def carry(self, b: Place, y: Signals, ahead: dict[int, Any], changed: set[int]) -> None:
        """Bring into `ahead` what continuous blocks make of the signals that changed."""
        t = self.time(b)
        for i in self.plan.network.between:
            node = self.plan.nodes[i]
            if isinstance(node.block, Delay) or changed.isdisjoint(node.inputs):
                continue
            seen = _Ahead(y, ahead)
            _write(node, evaluate(node, self.states[i], self._when(node, t), seen), ahead)
            changed |= set(node.outputs)


@dataclass(frozen=True)
class _Ahead:
    """Signals ahead where they are known, else the present ones."""

    y: Signals
    ahead: Mapping[int, Any]

    def __getitem__(self, j: int) -> Any:
        return self.ahead[j] if j in self.ahead else self.y[j]


def evaluate(node: Node, state: Any, t: float, signals: Any) -> Any:
    """Return the outputs of a block between FMUs at time t (s)."""
    block = node.block
    time = (t,) if block.timed else ()
    try:
        if block.is_wire:
            return block.passed(state, t, *(signals[j] for j in node.inputs))
        if node.inputs and block.feedthrough:
            return block.step(state, *time, *(signals[j] for j in node.inputs))[0]
        return block.output(state, *time)
    except (Exception, SystemExit) as error:
        raise BlockError(node.name) from error


def evaluated(node: Node) -> Callable[..., Any]:
    """Return what gives a node's outputs from (state, t, *inputs), checked as they are within."""

    def values(state: Any, t: float, *inputs: Any) -> Any:
        found: dict[int, Any] = {}
        _write(node, evaluate(node, state, t, dict(zip(node.inputs, inputs, strict=True))), found)
        results = tuple(found[j] for j in node.outputs)
        return results[0] if len(results) == 1 else results

    return values


def _write(node: Node, result: Any, into: Any) -> None:
    ports = zip(node.block.outputs, node.outputs, numbers(node, result), strict=True)
    for port, j, value in ports:
        if not math.isfinite(value):
            raise BlockError(node.name) from ValueError(f"output '{port}' is {value!r}")
        into[j] = value


def next_event(node: Node, state: Any, t: float) -> float:
    """Return a source's next event (s) after t; raise BlockError for what is no time after it."""
    try:
        found = node.block.next_event(state, t)
        if not found > t:
            raise ValueError(f"next_event({t!r}) returned {found!r}, which does not lie after it")
    except Exception as error:
        raise BlockError(node.name) from error
    return found
