"""Where a run failed: the block, the tick, and a message that a user can act on."""

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...base.errors import FmuError, RailcosimError
from ..coupling.loop_solver import BlockError
from ..plan import Plan


@dataclass(frozen=True)
class Place:
    """The block that was at work (None: the engine), the tick, and the values of that moment.

    `recorded` says whether the tick's row had been.
    """

    node: str | None
    tick: int
    recorded: bool
    values: Mapping[str, Any]


class ObserverError(Exception):
    """An observer failed; the cause says how."""

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.label = label


def message(plan: Plan, place: Place | None, tick: int, error: BaseException) -> str:
    """Return what failed, in words."""
    time = plan.clock.time(tick)
    at = f"failed at t = {time:.9g} s"
    if isinstance(error, FmuError) and place is not None:
        return f"{error}{_not_finite(plan, place.values)}"
    if isinstance(error, RailcosimError):
        return str(error)
    if isinstance(error, ObserverError):
        return f"observer '{error.label}' {at}: {_words(error.__cause__ or error)}"
    if isinstance(error, BlockError):
        return f"block '{error.node}' {at}: {_words(error.__cause__ or error)}"
    if place is not None:
        what = no_number(plan, place.values, tick)
        if what is not None:
            return what
    block = f"block '{place.node}'" if place is not None and place.node else "the diagram"
    return f"{block} {at}: {_words(error)}"


def _not_finite(plan: Plan, values: Mapping[str, Any]) -> str:
    """Say which signal is not finite: what an FMU was given may be why it failed."""
    for i, signal in enumerate(plan.signals):
        for register in (f"y{i}", f"a{i}"):
            value = values.get(register, 0.0)
            if isinstance(value, float) and not math.isfinite(value):
                return f"; {signal} is {value!r}"
    return ""


def _words(error: BaseException) -> str:
    words = str(error) or type(error).__name__
    if "unpack" in words:
        words += "; step() returns (outputs, next state), several outputs as a tuple"
    return f"{type(error).__name__}: {words}"


def no_number(plan: Plan, values: Mapping[str, Any], tick: int) -> str | None:
    """Return a message if a block's output is no number, which only a later line noticed."""
    found = [(signal, values.get(f"y{i}", 0.0)) for i, signal in enumerate(plan.signals)]
    # Values ahead, where an FMU is given what a block between makes of another's outputs.
    found += [(signal, values.get(f"a{i}", 0.0)) for i, signal in enumerate(plan.signals)]
    for signal, value in found:
        try:
            struct.pack("d", value)
        except (struct.error, TypeError, OverflowError):
            block, _, port = signal.partition(".")
            time = plan.clock.time(tick)
            return (
                f"block '{block}' at t = {time:.9g} s: output '{port}' is {value!r}, "
                "which is no number"
            )
    return None
