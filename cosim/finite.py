"""Signals that are not finite: which one was first, also where nobody records them."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .fmu.instance import FmuInstance
from .plan import Plan


def first_made(plan: Plan, signals: Iterable[str]) -> str:
    """Return the signal that is made first in a tick: it made the others wrong."""

    def place(signal: str) -> int:
        j = plan.signals.index(signal)
        return next(i for i, node in enumerate(plan.nodes) if j in node.outputs)

    return min(signals, key=place)


def present(
    instances: Mapping[str, FmuInstance], partly: Iterable[str], time: float
) -> dict[str, tuple[float, ...]]:
    """Return the FMUs' outputs at a time (s), and get those that the ticks have not got.

    `partly` are the FMUs that have such ones. Raise FmuError if one cannot tell them.
    """
    for name in partly:
        instances[name].time = time
        instances[name].fetch()
    return {name: instance.outputs() for name, instance in instances.items()}


def not_finite(
    plan: Plan, signals: Sequence[Any], outputs: Mapping[str, Sequence[float]], tick: int
) -> str | None:
    """Return a message if a signal, or an FMU's present output ("block.port"), is not finite.

    `signals` are those of the tick before.
    """
    remedy = "; record it to know when it began"
    bad = [j for j, y in enumerate(signals) if isinstance(y, float) and not math.isfinite(y)]
    if bad:
        name = first_made(plan, (plan.signals[j] for j in bad))
        value, time = signals[plan.signals.index(name)], plan.clock.time(tick - 1)
        return f"{name} is {value:g} at the latest at t = {time:.9g} s{remedy}"
    for node in plan.nodes:
        for port, value in zip(node.block.outputs, outputs.get(node.name, ()), strict=False):
            if not math.isfinite(value):
                time = plan.clock.time(tick)
                what = f"{node.name}.{port} is {value:g}"
                return f"{what} at the latest at t = {time:.9g} s{remedy}"
    return None
