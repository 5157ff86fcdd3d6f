"""What a block does to small changes at an operating point: its linear map over one step.

All kinds of blocks come to one form, sampled at the block's own period:

    y = C x + D u,    x⁺ = A x + B u,

x, u and y being differences from the operating point. Here are the maps of FMUs, exact from their
directional derivatives and the matrix exponential, and of delays; those of Python blocks are in
`differences`.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from ...base.errors import FmuError, RailcosimError, listing
from ..blocks.delay import Delay
from ..clock import Clock
from ..fmu.instance import FmuInstance
from ..plan import Node


class LinearisationError(RailcosimError):
    """A diagram has no linear map at an operating point, or none that says what was asked."""


@dataclass(frozen=True)
class LinearBlock:
    """A block's map at the operating point; `states` names x, A may be sparse.

    `rigid` are the places of inputs that take whole numbers only: no small change passes them.
    """

    A: Any
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...] = ()
    rigid: tuple[int, ...] = ()


def delay_map(node: Node, clock: Clock) -> LinearBlock:
    """Return the map of a transport delay: its past samples as a shift register."""
    from scipy.sparse import csr_array

    assert isinstance(node.block, Delay)
    whole, part = node.block.split(clock.step)
    taps = {whole: 1.0 - part, whole + 1: part} if part else {whole: 1.0}
    size = max(taps)
    B = np.zeros((size, 1))
    B[:1] = 1.0
    row = np.array([[taps.get(k, 0.0) for k in range(size + 1)]])
    states = tuple(f"{node.name}.u[k-{k}]" for k in range(1, size + 1))
    younger, older = np.arange(size)[:-1], np.arange(size)[1:]
    A = csr_array((np.ones(len(older)), (older, younger)), shape=(size, size))
    return LinearBlock(A, B, row[:, 1:], row[:, :1], states)


def fmu_map(
    node: Node, instance: FmuInstance, clock: Clock, time: float, part: Fraction = Fraction(1)
) -> LinearBlock:
    """Return the map of an FMU that stands at a time (s), over its step and with inputs held.

    `part` of the step, where the inputs change within it.

    The derivatives belong to its states and to the inputs of the step that ended there: FMI
    promises nothing about what an FMU answers between setting inputs and stepping. States are the
    FMU's, then the inputs that outputs depend on directly: the master reads outputs after a step,
    with the inputs held over it. Raise FmuError for an FMU that does not tell its derivatives.
    """
    from scipy.linalg import expm

    slopes = _slopes(node, instance, time)
    n, m = len(slopes.states), len(node.block.inputs)
    flow = np.zeros((n + m, n + m))
    flow[:n] = slopes.rates
    moved = expm(flow * float(clock.step * node.ticks * part))
    held = [i for i in range(m) if slopes.outputs[:, n + i].any()]
    size = n + len(held)
    A, B = np.zeros((size, size)), np.zeros((size, m))
    A[:n, :n], B[:n] = moved[:n, :n], moved[:n, n:]
    B[n:] = np.eye(m)[held]
    C = slopes.outputs[:, [*range(n), *(n + i for i in held)]]
    inputs = list(node.block.inputs)
    names = [*slopes.states, *(f"{inputs[i]} held" for i in held)]
    states = tuple(f"{node.name}.{name}" for name in names)
    return LinearBlock(A, B, C, np.zeros((len(C), m)), states, slopes.rigid)


@dataclass(frozen=True)
class _Slopes:
    """An FMU's derivatives at a point: `rates` of its states and `outputs`, along (x, u)."""

    states: list[str]
    rates: np.ndarray
    outputs: np.ndarray
    rigid: tuple[int, ...]


def _slopes(node: Node, instance: FmuInstance, time: float) -> _Slopes:
    states, rates = _exposed(node.name, instance)
    by_name = {v.name: v for v in instance.description.modelVariables}
    inputs = [by_name[name] for name in node.block.inputs]
    outputs = [by_name[name] for name in node.block.outputs]
    n, real = len(states), [i for i, v in enumerate(inputs) if v.type == "Real"]
    knowns = [v.name for v in (*states, *(inputs[i] for i in real))]
    columns = [*range(n), *(n + i for i in real)]
    flow, seen = np.zeros((n, n + len(inputs))), np.zeros((len(outputs), n + len(inputs)))
    flow[:, columns] = _directional(instance, time, rates, knowns)
    place = {v.valueReference: i for i, v in enumerate(states)}
    asked = []
    for row, variable in enumerate(outputs):
        if variable.type != "Real":
            continue  # a mode, which stays as it is
        if variable.valueReference in place:
            seen[row, place[variable.valueReference]] = 1.0
        else:
            asked.append(row)
    found = _directional(instance, time, [outputs[row] for row in asked], knowns)
    seen[np.ix_(asked, columns)] = found
    rigid = tuple(i for i in range(len(inputs)) if i not in real)
    return _Slopes([v.name for v in states], flow, seen, rigid)


def _exposed(name: str, instance: FmuInstance) -> tuple[list[Any], list[Any]]:
    """Return the continuous states and their derivatives; raise FmuError if an FMU hides them."""
    description = instance.description
    rates = [unknown.variable for unknown in description.derivatives]
    lacks = []
    if not description.coSimulation.providesDirectionalDerivative:
        lacks.append("provides no directional derivatives (providesDirectionalDerivative)")
    # With a model exchange interface the list of derivatives is complete: none is none.
    known = all(rate.derivative is not None for rate in rates)
    if not known or not (rates or description.modelExchange is not None):
        lacks.append("exposes no states and derivatives (ModelStructure/Derivatives)")
    memories = [v.name for v in description.modelVariables if _is_memory(v)]
    if memories:
        lacks.append(
            f"has memories ({listing(memories, 3)}), whose jumps directional derivatives leave out"
        )
    if lacks:
        raise FmuError(
            f"block '{name}': {instance.path.name} {' and '.join(lacks)}; linearise() needs an "
            "FMU that tells its derivatives, or a Python block in its place"
        )
    return [rate.derivative for rate in rates], rates


def _is_memory(variable: Any) -> bool:
    jumps = variable.type == "Real" and variable.variability == "discrete"
    return jumps and variable.causality not in ("input", "parameter", "calculatedParameter")


def _directional(
    instance: FmuInstance, time: float, unknowns: list[Any], knowns: list[str]
) -> np.ndarray:
    """Return the partial derivatives, one row for each unknown."""
    found = np.zeros((len(unknowns), len(knowns)))
    if not unknowns:
        return found
    names = [v.name for v in unknowns]
    instance.time = time
    for column, known in enumerate(knowns):
        found[:, column] = instance.directional(names, [known], [1.0])
    for row, variable in enumerate(unknowns):
        if not np.isfinite(found[row]).all():
            raise FmuError(
                f"block '{instance.name}': a derivative of {variable.name} is not finite at "
                f"t = {time:.9g} s; linearise at another time"
            )
    return found
