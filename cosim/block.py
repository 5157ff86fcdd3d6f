"""The block protocol: a block is a frozen value, its state is passed in and out.

A block with direct feedthrough implements

    step(x, *u) -> (y, x⁺)              in the output phase, once per sample hit,

a block without it

    output(x) -> y                      in the output phase,
    update(x, *u) -> x⁺                 in the update phase,

where x is a nested tuple of numbers, u one value per input port and y one number, or a tuple
where there are several output ports, both in the ports' order. With `timed` set, the time t (s)
follows x: step(x, t, *u), output(x, t), update(x, t, *u).

A block without feedthrough may name inputs in `direct` that output() needs nevertheless: it is
called as output(x, *direct ones), and update() with all inputs.

Nothing may be kept on the block itself: so a run repeats bit for bit, a checkpoint is the tuple,
and one diagram can run many times at once.
"""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache
from typing import Any, Self, get_type_hints

from ..base.errors import ParameterError, listing, suggest
from ..base.ops import finite

# Port -> unit. None: the unit of whatever is connected (see Block.shares_unit).
Ports = Mapping[str, str | None]
State = Any


class Block:
    """Base of all blocks. Subclasses are frozen dataclasses; see the module for the protocol."""

    __slots__ = ()

    inputs: Ports = {}
    outputs: Ports = {}
    feedthrough: bool = True
    direct: tuple[str, ...] = ()  # inputs that output() takes, of a block without feedthrough
    timed: bool = False
    # A piece of wire between ports, not a block of its own: no slave under Jacobi, and within a
    # step it is what it was at the step's start, by passed().
    is_wire: bool = False
    # The output is a continuous signal: a function of time and inputs that is not sampled and held
    # from one hit to the next. Without a state, it is evaluated within a step too.
    continuous: Any = False
    run_by_engine: bool = False  # FMUs and delays: the generated code has them, not step()
    shares_unit: bool = True  # all ports without a unit have one and the same unit
    # s between sample hits, or None: every step of the diagram. Any, so that a block whose
    # period is always a number may say so.
    period: Any = None
    types: Mapping[str, str] = {}  # of those outputs that are no float64: "int64", "bool"

    def start(self) -> State:
        """Return the state at the run's start."""
        return ()

    # *args and **kwargs stand for "any signature": each block names its own inputs.

    def step(self, *args: Any, **kwargs: Any) -> tuple[Any, State]:
        """Return (outputs, next state) of a block with direct feedthrough, from (x, *u)."""
        raise TypeError(f"{type(self).__name__} has feedthrough and must define step()")

    def output(self, *args: Any, **kwargs: Any) -> Any:
        """Return the outputs of a block without direct feedthrough, from (x)."""
        raise TypeError(f"{type(self).__name__} has no feedthrough and must define output()")

    def update(self, *args: Any, **kwargs: Any) -> State:
        """Return the next state of a block without direct feedthrough, from (x, *u)."""
        return args[0]

    def next_event(self, x: State, t: float) -> float:
        """Return the time (s) of the output's next jump after t, math.inf if there is none.

        For blocks without inputs: FMUs that the output reaches land on it, wherever between the
        steps it lies.
        """
        return math.inf

    def passed(self, *args: Any, **kwargs: Any) -> Any:
        """Return the output of a wire within a step, from (x, t, *u), t being the step's start."""
        raise TypeError(f"{type(self).__name__} is a wire and must define passed()")

    @property
    def has_events(self) -> bool:
        """Whether the block announces its events."""
        return type(self).next_event is not Block.next_event

    # Parameters, for `--set` and sweeps

    def parameters(self) -> dict[str, Any]:
        """Return the block's parameters by name; those of a block inside as "block.name"."""
        if not is_dataclass(self):
            return {}
        found: dict[str, Any] = {}
        for name in (f.name for f in fields(self) if f.init):
            value = getattr(self, name)
            if isinstance(value, Block):
                found |= {f"{name}.{inner}": v for inner, v in value.parameters().items()}
            else:
                found[name] = value
        return found

    def with_parameters(self, values: Mapping[str, Any]) -> Self:
        """Return a copy with parameters changed, one after the other; see `with_parameter`."""
        changed = self
        for name, value in values.items():
            changed = changed.with_parameter(name, value)
        return changed

    def with_parameter(self, name: str, value: Any) -> Self:
        """Return a copy with one parameter changed; raise ParameterError if that is not allowed."""
        known = self.parameters()
        if name not in known:
            raise ParameterError(
                f"{type(self).__name__} has no parameter '{name}'; parameters: {listing(known)}"
                f"{suggest(name, known)}"
            )
        outer, dot, inner = name.partition(".")
        if dot:
            value = getattr(self, outer).with_parameter(inner, value)
        elif not (type(value) is float and _is_float(type(self), name)):  # quick: nearly always
            value = _typed(value, _adapter(type(self), name), f"{type(self).__name__}.{name}")
        return replace(self, **{outer: value})  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=512)
def _adapter(block: type[Block], name: str) -> Any:
    """Return what checks a parameter's type: made once for each, since that takes long."""
    from pydantic import TypeAdapter

    return TypeAdapter(get_type_hints(block)[name])


@lru_cache(maxsize=512)
def _is_float(block: type[Block], name: str) -> bool:
    return get_type_hints(block)[name] is float


def _typed(value: Any, adapter: Any, what: str) -> Any:
    from pydantic import ValidationError

    try:
        return adapter.validate_python(value, strict=True)
    except ValidationError as error:
        words = error.errors()[0]["msg"]
        raise ParameterError(f"{what} = {value!r}: {words[0].lower()}{words[1:]}") from None


def require(block: Block, condition: Any, what: str) -> None:
    """Raise ParameterError unless the condition on a block's parameters holds."""
    if not condition:
        raise ParameterError(f"{type(block).__name__}: {what}")


def require_finite(block: Block, *names: str) -> None:
    """Raise ParameterError unless these parameters are finite numbers; symbols pass."""
    for name in names:
        value = getattr(block, name)
        require(block, finite(value), f"{name} must be a finite number, not {value!r}")


def require_positive(block: Block, *names: str) -> None:
    """Raise ParameterError unless these parameters are positive numbers; symbols pass."""
    from ..base.ops import is_symbol

    for name in names:
        value = getattr(block, name)
        if not is_symbol(value):
            good = finite(value) and value > 0.0
            require(block, good, f"{name} must be a positive number, not {value!r}")


def require_limits(block: Block, name: str = "limits") -> None:
    """Raise ParameterError unless the parameter is a pair (low, high) with low < high."""
    from ..base.ops import is_symbol

    pair = getattr(block, name)
    good = isinstance(pair, tuple) and len(pair) == 2
    if good and not any(is_symbol(v) for v in pair):
        good = all(isinstance(v, int | float) for v in pair) and pair[0] < pair[1]
    require(block, good, f"{name} must be a pair (low, high) with low < high, not {pair!r}")
