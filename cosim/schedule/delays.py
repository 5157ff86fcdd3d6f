"""A delay in a schedule: its output, and where that may jump between ticks."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

from ..blocks.delay import Delay
from ..clock import Clock
from ..plan import Node, Plan
from .operations import Edge, Past


def past(plan: Plan, i: int, *, result: str, ahead: int = 0) -> Past:
    """Return the output of the delay at place i, `ahead` ticks from now."""
    node = plan.nodes[i]
    block = node.block
    assert isinstance(block, Delay)
    whole, part = node.whole, node.part
    initial: float | Callable[[float], Any] = (
        block.history if callable(block.initial) else float(block.initial)
    )
    return Past(
        result=result,
        ring=f"x{i}",
        length=node.ring,
        whole=whole,
        part=part,
        newest=f"y{node.inputs[0]}",
        # What lies ahead is the limit from the left: at the history's end it is the history's.
        first=whole + 1 if part or ahead else whole,
        initial=initial,
        time=float(block.time),
        node=node.name,
        ahead=ahead,
    )


def edges(plan: Plan, i: int) -> list[Edge]:
    """Return the test for a jump of the delay at place i between two ticks, if there can be one."""
    node = plan.nodes[i]
    block = node.block
    assert isinstance(block, Delay)
    whole = node.whole
    if node.steps.denominator == 1:
        return []
    held = block.interpolation == "hold"
    first = whole - 1 if held else whole
    return [Edge(ring=f"x{i}", length=node.ring, whole=whole, first=first, always=held)]


def delayed(node: Node, ring: Any, k: int, newest: Any, t: float, step: Fraction) -> Any:
    """Return a delay's output at tick k, at time t (s): what `past` says, evaluated here."""
    block = node.block
    assert isinstance(block, Delay)
    whole, part = node.whole, node.part
    if k < (whole + 1 if part else whole):
        return block.history(t - float(block.time))
    new = newest if whole == 0 else ring[(k - whole) % node.ring]
    if not part:
        return new
    old = ring[(k - whole - 1) % node.ring]
    return new + part * (old - new)


def delayed_within(
    node: Node, ring: Any, k: int, offset: Fraction, clock: Clock, *, before: bool = False
) -> Any:
    """Return a delay's output inside tick k, `offset` steps after its start.

    The ring holds the sample of tick k. At a jump it is the value after it, or that `before`.
    """
    block = node.block
    assert isinstance(block, Delay)
    place = k + offset - node.steps  # in the samples
    index = place.numerator // place.denominator
    part = float(place - index)
    if before and not part:
        index, part = index - 1, 1.0
    if index < 0:
        return block.history(float(clock.start + place * clock.step))
    if block.interpolation == "hold":
        return ring[index % node.ring]
    old = ring[index % node.ring]
    if index >= k or not part:
        return old
    return old + part * (ring[(index + 1) % node.ring] - old)


def jump_within(node: Node, ring: Any, k: int, step: Fraction) -> Fraction | None:
    """Return where in tick k (as a part of it) a delay's output jumps, if it does."""
    block, steps = node.block, node.steps
    assert isinstance(block, Delay)
    whole = steps.numerator // steps.denominator
    if steps == whole or k < whole:
        return None
    if k > whole:
        if block.interpolation == "linear":
            return None
        if ring[(k - whole) % node.ring] == ring[(k - whole - 1) % node.ring]:
            return None
    return steps - whole
