"""The sampled state space of a diagram at an operating point: its linear map over one step.

The diagram runs to the operating point. There each block gives its linear map over its own step,
and the plan is run once more with rows of numbers in place of each signal: how it depends on the
states and on the inputs that were asked for. A diagram with several rates repeats itself after the
least common multiple of its periods; that is then the step.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.errors import DiagramError
from .blocks.delay import Delay
from .blocks.fmu import Fmu
from .clock import Clock, rational
from .diagram import Diagram
from .differences import python_map
from .fmu_instance import FmuInstance
from .generate import generate
from .linear_block import LinearBlock, LinearisationError, delay_map, fmu_map
from .linear_wiring import Wiring, require_held, wire
from .plan import Node, Plan
from .run import _initialize, _Loop

if TYPE_CHECKING:
    from control import StateSpace


def linearise(
    diagram: Diagram,
    at: float | Fraction,
    *,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    open_at: str | None = None,
    start: float | Fraction = 0.0,
) -> "StateSpace":
    """Return a diagram's sampled state space at a time (s); see Diagram.linearise."""
    if not isinstance(at, int | float | Fraction) or not math.isfinite(at):
        raise DiagramError(f"at must be a time in s, not {at!r}")
    plan = diagram.plan(start=start)
    wiring = wire(diagram, plan, inputs, outputs, open_at)
    frame = math.lcm(*(node.ticks for node in plan.nodes))
    ticks = frame * _frames(plan, frame, at)
    if wiring.returns:
        require_held(plan, wiring, frame, str(open_at))
    with _operating_point(plan, ticks, frame) as point:
        blocks = [_linear(plan, i, point, is_first=ticks == 0) for i in range(len(plan.nodes))]
    return _state_space(plan, blocks, wiring, frame)


def _frames(plan: Plan, frame: int, at: float | Fraction) -> int:
    """Return the operating point in frames: spans after which all blocks have a hit again."""
    if rational(at) < plan.clock.start:
        raise DiagramError(f"at = {float(at):g} s lies before start = {plan.clock.time(0):g} s")
    what = "at − start" if plan.clock.start else "at"
    return Clock(plan.clock.step * frame).ticks(rational(at) - plan.clock.start, what)


# The operating point


@dataclass(frozen=True)
class _Point:
    """The operating point: states before its tick, signals at it, FMUs that stand there."""

    time: float
    states: list[Any]
    signals: list[float]
    instances: dict[str, FmuInstance]


@contextmanager
def _operating_point(plan: Plan, ticks: int, frame: int) -> Iterator[_Point]:
    """Run a plan to a tick; the FMUs live as long as the context."""
    instances: dict[str, FmuInstance] = {}
    everything = list(range(len(plan.signals)))
    try:
        for node in plan.nodes:
            if isinstance(node.block, Fmu):
                instances[node.name] = node.block.instance(node.name)
        program = generate(plan, instances, everything)
        values = _initialize(plan, program, instances, max(ticks, frame))
        loop = _Loop(plan, program, everything, ticks, False)
        while loop.done < ticks:
            values = loop._chunk(min(loop.done + 4096, ticks), values)
        loop._last_row(values)
        signals = loop.chunks[-1][-1].tolist()
        yield _Point(plan.clock.time(ticks), values[: len(plan.nodes)], signals, instances)
    finally:
        for instance in instances.values():
            instance.close()


def _linear(plan: Plan, place: int, point: _Point, *, is_first: bool) -> LinearBlock:
    """Return the map of the block at a place in the plan."""
    node = plan.nodes[place]
    if isinstance(node.block, Delay):
        return delay_map(node, plan.clock)
    if isinstance(node.block, Fmu):
        return fmu_map(node, point.instances[node.name], plan.clock, point.time)
    inputs = [point.signals[i] for i in node.inputs]
    return python_map(node, point.states[place], inputs, point.time, is_first=is_first)


# The diagram's map


def _propagated(
    plan: Plan, blocks: list[LinearBlock], wiring: Wiring, frame: int
) -> tuple[np.ndarray, np.ndarray]:
    """Run the plan for one frame with rows (along states and inputs) in place of numbers.

    Inputs are held over the frame. Return the rows of the states after it and of the outputs at
    its beginning.
    """
    n, m = sum(len(block.states) for block in blocks), len(wiring.inputs)
    cuts = np.cumsum([len(block.states) for block in blocks])[:-1]
    states = np.split(np.eye(n, n + m), cuts)
    signals = np.zeros((len(plan.signals), n + m))
    shown = signals
    for tick in range(frame):
        hits = [i for i, node in enumerate(plan.nodes) if tick % node.ticks == 0]
        for i in hits:
            node, block = plan.nodes[i], blocks[i]
            read = _read(node, signals, wiring, n)
            signals[list(node.outputs)] = block.C @ states[i] + block.D @ read
            for place in set(node.outputs) & wiring.signals.keys():
                signals[place, n + wiring.signals[place]] += 1.0
        if tick == 0:
            shown = signals[list(wiring.outputs)]
        for i in hits:
            read = _read(plan.nodes[i], signals, wiring, n)
            _require_rigid(plan, plan.nodes[i], blocks[i], read)
            states[i] = blocks[i].A @ states[i] + blocks[i].B @ read
    return np.vstack(states), shown


def _read(node: Node, signals: np.ndarray, wiring: Wiring, n: int) -> np.ndarray:
    """Return the rows of what a block's inputs read."""
    read = signals[list(node.inputs)]
    for i in range(len(node.inputs)):
        if (node.name, i) in wiring.cut:
            read[i] = 0.0
            if wiring.returns:
                read[i, n] = 1.0
        if (node.name, i) in wiring.ports:
            read[i, n + wiring.ports[node.name, i]] += 1.0
    return read


def _require_rigid(plan: Plan, node: Node, block: LinearBlock, read: np.ndarray) -> None:
    for i in block.rigid:
        if read[i].any():
            raise LinearisationError(
                f"{node.name}.{list(node.block.inputs)[i]} takes whole numbers only, which no "
                f"small change of {plan.signals[node.inputs[i]]} passes; cut there with open_at"
            )


def _state_space(plan: Plan, blocks: list[LinearBlock], wiring: Wiring, frame: int) -> "StateSpace":
    from control import StateSpace

    after, shown = _propagated(plan, blocks, wiring, frame)
    states = [name for block in blocks for name in block.states]
    n = len(states)
    A, B, C, D = after[:, :n], after[:, n:], shown[:, :n], shown[:, n:]
    if wiring.returns:
        C, D = -C, -D
    elif wiring.cut:
        kept = _between(A, B, C)
        A, B, C, states = A[np.ix_(kept, kept)], B[kept], C[:, kept], [states[i] for i in kept]
    return StateSpace(
        A, B, C, D,
        float(plan.clock.step * frame),
        inputs=[_label(name) for name in wiring.inputs],
        outputs=[_label(plan.signals[i]) for i in wiring.outputs],
        states=states,
        name=_label(plan.name),
        remove_useless_states=False,
    )  # fmt: skip


def _between(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> list[int]:
    """Return the states that lie between inputs and outputs: the rest is what a cut left over."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    def reached(links: np.ndarray, first: np.ndarray) -> set[int]:
        graph = np.block([[links, np.zeros((len(links), 1))], [first, np.zeros((1, 1))]])
        found = breadth_first_order(csr_array(graph), len(links), return_predecessors=False)
        return {int(i) for i in found} - {len(links)}

    forwards = reached(A.T != 0.0, (B != 0.0).any(axis=1)[None])
    return sorted(forwards & reached(A != 0.0, (C != 0.0).any(axis=0)[None]))


def _label(name: str) -> str:
    """Return a name that python-control takes: it keeps the dot for itself."""
    return name.replace(".", "/")
