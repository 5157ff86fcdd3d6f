"""Ticks that are divided where held delays jump, as operations.

What `Coupling.split` does for any algorithm and any event is here written out for the most frequent
case: FMUs in parallel with held inputs, and edges of delays, whose places in a tick are always the
same. The signals at a place are those of `Tick.at`.
"""

from collections.abc import Callable, Hashable, Mapping
from fractions import Fraction
from functools import cmp_to_key
from typing import Any

from ..algorithms import Jacobi, TwoPhase
from ..blocks.delay import Delay
from ..clock import Clock
from ..coupling.within import evaluated
from ..plan import Node, Plan
from .delays import edges
from .forms import Values, apart
from .operations import Advance, Call, Divide, Input, Operation, Read, Stop, Within

Place = tuple[int, int]  # a part of a tick, as a fraction in lowest terms: these are fast

_STOPS = 8  # the generated text grows with their square


def divided(
    plan: Plan,
    instances: Mapping[str, Any],
    otherwise: tuple[Operation, ...],
    needed: Mapping[str, tuple[int, ...]],
) -> Divide | None:
    """Return the operations of a tick that edges of delays may divide, or None if there are none.

    `needed` are the places of the outputs that are needed of an FMU, where that is not all. None
    also where only `Coupling.split` knows how.
    """
    algorithm = plan.algorithm
    if not isinstance(algorithm, TwoPhase | Jacobi) or algorithm.extrapolation:
        return None
    tests = jumps(plan)
    if not 0 < len(tests) <= _STOPS:
        return None
    ends = [*tests, (1, 1)]
    changed = _changed(plan)
    later_steps = _steps(plan, instances, changed, needed)
    return Divide(
        steps=_steps(plan, instances, {}, needed),
        spans=_spans(plan.clock, (0, 1), ends),
        stops=tuple(
            Stop(
                tests=tuple(edge for i in found for edge in edges(plan, i)),
                time=_time(plan.clock, place),
                signals=tuple(_signals(plan, instances, place, changed)),
                steps=later_steps,
                spans=_spans(plan.clock, place, ends[n + 1 :]),
            )
            for n, (place, found) in enumerate(tests.items())
        ),
        otherwise=otherwise,
    )


def divided_values(
    plan: Plan, instances: Mapping[str, Any], steps: int
) -> list[tuple[Hashable, Values]]:
    """Return what `apart` says of the pieces that `divided` makes before those of `otherwise`.

    That is quicker than to make them. `steps` is how many a division has at each of its places.
    Only pieces that depend on more than the order of `jumps` have a form here.
    """
    tests, clock, changed = jumps(plan), plan.clock, _changed(plan)
    ends = [*tests, (1, 1)]
    found: list[tuple[Hashable, Values]] = [(None, _spans(clock, (0, 1), ends))]
    stepped = [(None, ())] * steps
    found += stepped
    for n, (place, delays) in enumerate(tests.items()):
        found.append((None, (*_time(clock, place), *_spans(clock, place, ends[n + 1 :]))))
        found += [(None, apart(edge)[1]) for i in delays for edge in edges(plan, i)]
        found += map(apart, _signals(plan, instances, place, changed))
        found += stepped
    return found


def jumps(plan: Plan) -> dict[Place, tuple[int, ...]]:
    """Return the places in a tick where delays may jump, in order, with these delays' nodes."""
    found: dict[Place, tuple[int, ...]] = {}
    for i in plan.network.events:
        node = plan.nodes[i]
        if isinstance(node.block, Delay) and node.steps.denominator != 1:
            n, d = node.steps.numerator, node.steps.denominator
            found[n % d, d] = (*found.get((n % d, d), ()), i)
    return dict(sorted(found.items(), key=_BY_PLACE))


def _difference(one: Any, other: Any) -> int:
    (a, b), (c, d) = one[0], other[0]
    return a * d - c * b


_BY_PLACE = cmp_to_key(_difference)


def _changed(plan: Plan) -> dict[int, str]:
    """Return the registers of the signals that are other ones inside a tick."""
    places = (*plan.network.fmus, *plan.network.between)
    return {j: f"w{j}" for i in places for j in plan.nodes[i].outputs}


def _steps(
    plan: Plan,
    instances: Mapping[str, Any],
    changed: Mapping[int, str],
    needed: Mapping[str, tuple[int, ...]],
) -> tuple[Advance, ...]:
    return tuple(
        Advance(
            instance=instances[node.name],
            inputs=tuple(Input(value=changed.get(j, f"y{j}")) for j in node.inputs),
            span=float(plan.clock.step),
            node=node.name,
            divided=True,
            outputs=needed.get(node.name),
        )
        for node in (plan.nodes[i] for i in plan.network.fmus)
    )


def _time(clock: Clock, place: Place) -> tuple[int, int, int]:
    """Return (a, b, q) with the place's time (a + k · b) / q in tick k."""
    a, b, q = clock.integers
    n, d = place
    return a * d + n * b, d * b, q * d


def _spans(clock: Clock, start: Place, ends: list[Place]) -> tuple[float, ...]:
    n, d = clock.step.numerator, clock.step.denominator
    p, q = start
    return tuple((a * q - p * b) * n / (b * q * d) for a, b in ends)


def _signals(
    plan: Plan, instances: Mapping[str, Any], place: Place, changed: Mapping[int, str]
) -> list[Operation]:
    """Return the operations that give the signals at a place, as far as they are other ones."""
    network = plan.network
    nodes = [plan.nodes[i] for i in (*network.fmus, *network.between)]
    needed = {j for node in nodes if not isinstance(node.block, Delay) for j in node.inputs}
    operations: list[Operation] = []
    for i in network.fmus:
        node = plan.nodes[i]
        slots = zip(node.outputs, instances[node.name].output_slots, strict=True)
        values = tuple((changed[j], array, n) for j, (array, n, _) in slots if j in needed)
        if values:
            operations.append(Read(values=values, node=node.name))
    for i in network.between:
        node = plan.nodes[i]
        if isinstance(node.block, Delay):
            operations.append(_within(plan, i, node, node.block, place, changed))
        else:
            results = tuple(changed[j] for j in node.outputs)
            time = "t" if node.block.is_wire else "tp"
            inputs = (changed.get(j, f"y{j}") for j in node.inputs)
            operations.append(
                Call(
                    function=evaluated(node),
                    arguments=(f"x{i}", time, *inputs),
                    results=results[0] if len(results) == 1 else results,
                    node=node.name,
                )
            )
    return operations


def _within(
    plan: Plan, i: int, node: Node, block: Delay, place: Place, changed: Mapping[int, str]
) -> Within:
    clock = plan.clock
    (n, d), steps = place, node.steps
    size = d * steps.denominator
    behind = n * steps.denominator - steps.numerator * d  # in 1/size of a tick
    shift = behind // size
    initial: float | Callable[[int], Any] = (
        _history(block, clock, Fraction(behind, size)) if callable(block.initial) else block.initial
    )
    return Within(
        result=changed[node.outputs[0]],
        ring=f"x{i}",
        length=node.ring,
        shift=shift,
        part=0.0 if block.interpolation == "hold" else (behind - shift * size) / size,
        initial=initial,
        node=node.name,
    )


def _history(block: Delay, clock: Clock, behind: Fraction) -> Callable[[int], Any]:
    def history(k: int) -> Any:
        return block.history(float(clock.start + (k + behind) * clock.step))

    return history
