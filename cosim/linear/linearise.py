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
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.errors import DiagramError
from ..blocks.delay import Delay
from ..blocks.fmu import Fmu
from ..blocks.variable_delay import VariableDelay
from ..clock import Clock, rational
from ..diagram import Diagram
from ..fmu.instance import FmuInstance
from ..options import Options
from ..plan import Node, Plan
from ..results.recording import Recording
from ..simulation import Simulation
from .block import LinearBlock, LinearisationError, delay_map, fmu_map
from .differences import python_map
from .wiring import Wiring, require_held, wire

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
    with _operating_point(diagram, plan, ticks, frame) as point:
        blocks = [_linear(plan, i, point, is_first=ticks == 0) for i in range(len(plan.nodes))]
        pieces = _pieces(plan, point)
    return _state_space(plan, _System(plan, blocks, pieces, wiring), frame)


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
def _operating_point(diagram: Diagram, plan: Plan, ticks: int, frame: int) -> Iterator[_Point]:
    """Run a diagram to a tick; the FMUs live as long as the context."""
    options = Options(start=plan.clock.start, record=Recording(every=max(1, ticks)))
    with Simulation(diagram, options, ticks=max(ticks, frame)) as simulation:
        while simulation.tick < ticks:
            simulation.advance_ticks(ticks)
        simulation.finish()
        signals = [float(signal) for signal in simulation.signals()]
        time, instances = simulation.time, simulation.instances
        yield _Point(time, simulation.states, signals, instances)


def _pieces(plan: Plan, point: _Point) -> list[tuple[Fraction, dict[int, LinearBlock]]]:
    """Return the parts of a step between which held delays jump: where each begins (as a part of
    the step), and the FMUs' maps over it. None if there is but one.
    """
    edges = {edge for i in plan.network.events if (edge := _edge(plan, i))}
    ends = sorted({Fraction(0), *edges, Fraction(1)})
    if len(ends) == 2:
        return []
    return [
        (
            a,
            {
                i: fmu_map(
                    plan.nodes[i],
                    point.instances[plan.nodes[i].name],
                    plan.clock,
                    point.time,
                    b - a,
                )
                for i in plan.network.fmus
            },
        )
        for a, b in pairwise(ends)
    ]


def _edge(plan: Plan, place: int) -> Fraction | None:
    """Return where in a step a held delay jumps, as a part of it."""
    block = plan.nodes[place].block
    if not isinstance(block, Delay) or block.interpolation != "hold":
        return None
    return (rational(block.time) / plan.clock.step) % 1 or None


def _linear(plan: Plan, place: int, point: _Point, *, is_first: bool) -> LinearBlock:
    """Return the map of the block at a place in the plan."""
    node = plan.nodes[place]
    if isinstance(node.block, Delay):
        return delay_map(node, plan.clock)
    if isinstance(node.block, Fmu):
        return fmu_map(node, point.instances[node.name], plan.clock, point.time)
    if isinstance(node.block, VariableDelay):
        raise LinearisationError(
            f"block '{node.name}': a VariableDelay is not linear in its delay; linearise with a "
            "Delay of its present time in its place"
        )
    inputs = [point.signals[i] for i in node.inputs]
    return python_map(node, point.states[place], inputs, point.time, is_first=is_first)


# The diagram's map


@dataclass(frozen=True)
class _System:
    """A diagram's blocks as linear maps; `pieces` as `_pieces` returns them."""

    plan: Plan
    blocks: list[LinearBlock]
    pieces: list[tuple[Fraction, dict[int, LinearBlock]]]
    wiring: Wiring

    @property
    def size(self) -> int:
        """The number of states."""
        return sum(len(block.states) for block in self.blocks)

    def propagated(self, frame: int) -> tuple[np.ndarray, np.ndarray]:
        """Run the plan for one frame with rows (along states and inputs) in place of numbers.

        Inputs are held over the frame. Return the rows of the states after it and of the outputs
        at its beginning.
        """
        plan, n, m = self.plan, self.size, len(self.wiring.inputs)
        cuts = np.cumsum([len(block.states) for block in self.blocks])[:-1]
        states = np.split(np.eye(n, n + m), cuts)
        signals = np.zeros((len(plan.signals), n + m))
        shown = signals
        for tick in range(frame):
            hits = [i for i, node in enumerate(plan.nodes) if tick % node.ticks == 0]
            for i in hits:
                self._output(i, states, signals)
            if tick == 0:
                shown = signals[list(self.wiring.outputs)]
            stepped = self._stepped(states, signals)
            for i in hits:
                if i in stepped:
                    states[i] = stepped[i]
                    continue
                read = self._checked_read(i, signals)
                states[i] = self.blocks[i].A @ states[i] + self.blocks[i].B @ read
        return np.vstack(states), shown

    def _output(self, i: int, states: list[np.ndarray], signals: np.ndarray) -> None:
        node, block = self.plan.nodes[i], self.blocks[i]
        read = _read(node, signals, self.wiring, self.size)
        self._write(node, block.C @ states[i] + block.D @ read, signals)

    def _write(self, node: Node, rows: np.ndarray, signals: np.ndarray) -> None:
        signals[list(node.outputs)] = rows
        for place in set(node.outputs) & self.wiring.signals.keys():
            signals[place, self.size + self.wiring.signals[place]] += 1.0

    def _checked_read(self, i: int, signals: np.ndarray) -> np.ndarray:
        read = _read(self.plan.nodes[i], signals, self.wiring, self.size)
        _require_rigid(self.plan, self.plan.nodes[i], self.blocks[i], read)
        return read

    def _stepped(self, states: list[np.ndarray], signals: np.ndarray) -> dict[int, np.ndarray]:
        """Return the states after a step of the FMUs that held delays jump for."""
        found = {i: states[i] for i in self.plan.network.fmus} if self.pieces else {}
        signals = signals.copy()
        for begin, maps in self.pieces:
            for i in self.plan.network.between if begin else ():
                if isinstance(self.plan.nodes[i].block, Delay):
                    self._jump(i, begin, states, signals)
                elif self.plan.nodes[i].inputs:
                    self._output(i, states, signals)
            for i, block in maps.items():
                found[i] = block.A @ found[i] + block.B @ self._checked_read(i, signals)
        return found

    def _jump(self, i: int, begin: Fraction, states: list[np.ndarray], signals: np.ndarray) -> None:
        """Bring a held delay's output to what it is after its edge, if that has come."""
        node, block, clock = self.plan.nodes[i], self.plan.nodes[i].block, self.plan.clock
        edge = _edge(self.plan, i)
        if edge is None or begin < edge:
            return
        assert isinstance(block, Delay)
        back = block.split(clock.step)[0] - 1  # the sample u[k − back]
        now = _read(node, signals, self.wiring, self.size)
        self._write(node, states[i][back - 1 : back] if back else now, signals)


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


def _state_space(plan: Plan, system: _System, frame: int) -> "StateSpace":
    from control import StateSpace

    wiring = system.wiring
    after, shown = system.propagated(frame)
    states = [name for block in system.blocks for name in block.states]
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
