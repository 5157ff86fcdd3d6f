"""The operations of a schedule: what an engine does in a tick, one after the other.

They work on registers, named values: x0, y0, … live from tick to tick, a0, … within one. `node` is
the block that an operation belongs to, and `every` how many ticks lie between its hits.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Register = str
# What a call takes and gives: registers, and tuples of them.
Registers = tuple[Any, ...]


@dataclass(frozen=True, kw_only=True)
class Call:
    """results = function(arguments); "k" is the tick, "t", "tm", "t1" its start, middle, end.

    `results` None: the function gives nothing to keep.
    """

    function: Callable[..., Any]
    arguments: Registers
    results: Register | Registers | None
    node: str | None = None
    every: int = 1


@dataclass(frozen=True, kw_only=True)
class Read:
    """FMU outputs, as they stand in the instance's arrays: (register, array, index)."""

    values: tuple[tuple[Register, Any, int], ...]
    node: str
    every: int = 1


@dataclass(frozen=True, kw_only=True)
class Input:
    """What an FMU input gets: `value`, and where `ahead` is not None the line to it at the end."""

    value: Register
    ahead: Register | None = None


@dataclass(frozen=True, kw_only=True)
class Advance:
    """Set an FMU's inputs, step it over `span` (s) and get its outputs.

    `outputs` are the places of those that are needed (None: all); the others may be got or not.
    In a tick that is `divided` (see Divide) the step begins and ends where that says.
    """

    instance: Any
    inputs: tuple[Input, ...]
    span: float
    node: str
    every: int = 1
    divided: bool = False
    outputs: tuple[int, ...] | None = None


@dataclass(frozen=True, kw_only=True)
class Past:
    """result = a delay's output at tick k + `ahead`.

    From the ring: u[k − whole] + part · (u[k − whole − 1] − u[k − whole]), with `newest` for a
    sample that the ring does not hold yet; before `first` ticks have passed the initial history.
    """

    result: Register
    ring: Register
    length: int
    whole: int
    part: float
    newest: Register
    first: int
    initial: float | Callable[[float], Any]
    time: float
    node: str
    ahead: int = 0


@dataclass(frozen=True, kw_only=True)
class Keep:
    """Put a sample into a delay's ring."""

    ring: Register
    length: int
    source: Register
    node: str


@dataclass(frozen=True, kw_only=True)
class Move:
    """result = source."""

    result: Register
    source: Register
    every: int = 1
    node: str | None = None


@dataclass(frozen=True, kw_only=True)
class Line:
    """result = start + 2 · (end − start): as far behind the end as the start lies before it."""

    result: Register
    start: Register
    end: Register
    node: str | None = None


@dataclass(frozen=True, kw_only=True)
class Announce:
    """If the event has passed: event = function(state, t), the time of the next one."""

    event: Register
    function: Callable[..., float]
    state: Register
    node: str


@dataclass(frozen=True, kw_only=True)
class Due:
    """Whether an announced event lies before the step's end."""

    event: Register


@dataclass(frozen=True, kw_only=True)
class Edge:
    """Whether a delayed signal jumps within the step.

    That is so at tick `first`, where the history ends, and with `always` wherever the samples
    k − whole and k − whole + 1 differ.
    """

    ring: Register
    length: int
    whole: int
    first: int
    always: bool


@dataclass(frozen=True, kw_only=True)
class Branch:
    """If one of the tests holds, the call, else the other operations."""

    tests: tuple[Due | Edge, ...]
    call: Call
    otherwise: tuple["Operation", ...]


@dataclass(frozen=True, kw_only=True)
class Within:
    """result = a delay's output at a place inside tick k.

    From the ring: u[k + shift], or with a `part` u[k + shift] + part · (u[k + shift + 1] − …);
    before there is such a sample the initial history, a number or a function of k.
    """

    result: Register
    ring: Register
    length: int
    shift: int
    part: float
    initial: float | Callable[[int], Any]
    node: str


@dataclass(frozen=True, kw_only=True)
class Stop:
    """A place inside the tick that FMUs land on if one of the tests holds.

    It is at the time (a + k · b) / q, `time` being (a, b, q). `signals` give what is new there and
    `steps` go on from it, over one of `spans` (s): to each later stop, and to the tick's end.
    """

    tests: tuple[Edge, ...]
    time: tuple[int, int, int]
    signals: tuple["Operation", ...]
    steps: tuple[Advance, ...]
    spans: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Divide:
    """A tick that is divided at those stops whose tests hold; if none does, `otherwise`.

    `steps` begin with the tick, over one of `spans` (s), as those of a stop do. The register "tp"
    is the time (s) at which a step begins.
    """

    steps: tuple[Advance, ...]
    spans: tuple[float, ...]
    stops: tuple[Stop, ...]
    otherwise: tuple["Operation", ...]


@dataclass(frozen=True, kw_only=True)
class Record:
    """Put registers into the row of this tick, at every `every`-th tick."""

    registers: tuple[Register, ...]
    every: int = 1


Operation = (
    Call | Read | Advance | Past | Keep | Move | Line | Announce | Branch | Within | Divide | Record
)
