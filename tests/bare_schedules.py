"""Schedules made by hand, carried out by both engines; FMUs that are played in Python."""

import ctypes
import math
import struct
import traceback
from collections.abc import Sequence
from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p
from decimal import Decimal
from fractions import Fraction
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from railcosim.base.errors import FmuError
from railcosim.cosim.clock import Clock
from railcosim.cosim.compiled.engine import CompiledEngine
from railcosim.cosim.compiled.library import load_library
from railcosim.cosim.compiled.table import Table
from railcosim.cosim.engine.generate import Program, generate
from railcosim.cosim.schedule.operations import Call, Operation, Record
from railcosim.cosim.schedule.schedule import Schedule


def schedule(
    operations: Sequence[Operation],
    registers: dict[str, Any],
    *,
    updates: Sequence[Operation] = (),
    step: Fraction = Fraction(1, 10),
    start: Fraction = Fraction(0),
) -> Schedule:
    """Return a schedule of these operations with these living registers and their start values."""
    plan: Any = SimpleNamespace(name="bare", clock=Clock(step, start))
    coupling: Any = None
    return Schedule(
        plan=plan,
        initial=(),
        outputs=tuple(operations),
        observed=(),
        updates=tuple(updates),
        registers=tuple(registers),
        labels=tuple(registers),
        start=tuple(registers.values()),
        coupling=coupling,
    )


def both(
    made: Schedule,
    record: Sequence[str] = (),
    *,
    every: int = 1,
    before: Sequence[Call] = (),
    after: Sequence[Call] = (),
) -> tuple[Program, CompiledEngine]:
    """Return the two engines."""
    row = Record(registers=tuple(record), every=every)
    program = generate(made, row, before=before, after=after)
    return program, CompiledEngine(load_library(), Table(made, row, before, after), program)


class Outcome(NamedTuple):
    """What an engine gave: registers and rows, or the error, its place and the frames of others."""

    values: Any
    rows: np.ndarray
    error: Any = None
    place: Any = None
    frames: Any = None


_ENGINES = ("ticks", "advance", "outcome", "unpack")  # frames


def outcome(
    engine: Any, ticks: tuple[int, int], start: dict[str, Any], width: int, every: int = 1
) -> Outcome:
    """Run an engine, lists (rings) being copies; of a run that fails only rows to be kept count."""
    k, end = ticks
    rows = np.full((max(end - k, 0), width), 7.0)
    values = [list(v) if isinstance(v, list) else v for v in start.values()]
    try:
        return Outcome(engine.advance(k, end, values, rows), rows)
    except Exception as error:
        place = engine.where(error)
        signals = {name: place.values[name] for name in ("k", *start)}
        stack = traceback.extract_tb(error.__traceback__)
        frames = [(f.name, f.line) for f in stack if f.name not in _ENGINES]
        where = (place.node, place.tick, place.recorded, signals)
        rows = rows[: -(-(place.tick + place.recorded) // every) - -(-k // every)]
        return Outcome(None, rows, (type(error), str(error)), where, frames)


def compare(
    operations: Sequence[Operation],
    registers: dict[str, Any],
    *,
    updates: Sequence[Operation] = (),
    record: Sequence[str] = (),
    ticks: tuple[int, int] = (0, 5),
    every: int = 1,
    before: Sequence[Call] = (),
    after: Sequence[Call] = (),
    **options: Any,
) -> Outcome:
    """Run both engines and return the outcome, which must be the same."""
    made = schedule(operations, registers, updates=updates, **options)
    engines = both(made, record, every=every, before=before, after=after)
    python, compiled = (outcome(one, ticks, registers, len(record), every) for one in engines)
    assert_same(python, compiled)
    return compiled


def assert_same(a: Any, b: Any) -> None:
    """Assert that two values are the same, types and bits included."""
    assert type(a) is type(b), (a, b)
    if isinstance(a, float):
        assert struct.pack("d", a) == struct.pack("d", b), (a, b)
    elif isinstance(a, tuple | list):
        assert len(a) == len(b), (a, b)
        for one, other in zip(a, b, strict=True):
            assert_same(one, other)
    elif isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            assert_same(a[key], b[key])
    elif isinstance(a, np.ndarray):
        assert (a.dtype, a.tobytes()) == (b.dtype, b.tobytes())
    else:
        assert a == b or repr(a) == repr(b), (a, b)  # no nan equals itself


class Floaty(float):
    """A float that is no plain one."""


class Noted:
    """Writes down the arithmetic that is done with it."""

    def __init__(self, words: str) -> None:
        self.words = words

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Noted) and self.words == other.words

    def __hash__(self) -> int:
        return hash(self.words)

    def _note(self, a: Any, sign: str, b: Any) -> "Noted":
        words = (one.words if isinstance(one, Noted) else repr(one) for one in (a, b))
        return Noted(f"({f' {sign} '.join(words)})")

    def __add__(self, other: Any) -> "Noted":
        return self._note(self, "+", other)

    def __radd__(self, other: Any) -> "Noted":
        return self._note(other, "+", self)

    def __sub__(self, other: Any) -> "Noted":
        return self._note(self, "-", other)

    def __rsub__(self, other: Any) -> "Noted":
        return self._note(other, "-", self)

    def __rmul__(self, other: Any) -> "Noted":
        return self._note(other, "*", self)

    def __truediv__(self, other: Any) -> "Noted":
        return self._note(self, "/", other)


# What a block may hand out for a number, and what is none.
VALUES: list[Any] = [
    0.1, -0.0, math.inf, math.nan, 5e-324, 3, -(10**400), 2**53 + 1, True, False, Fraction(1, 3),
    Decimal("0.1"), np.float64(0.3), np.float32(0.3), np.int64(5), np.bool_(True), 1 + 2j,
    Floaty(0.7), Noted("n"), "text", None, (1.0, 2.0), [1.0],
]  # fmt: skip


TYPES = {"Real": (c_double, None), "Integer": (c_int, round), "Boolean": (c_int, bool)}


class PlayedFmu:
    """An FMU with two inputs and outputs of each type, whose functions are Python's.

    `log` has what was called and with what; `statuses` what is returned, by function. With
    `steps_inline` false, a step is a call of `advance`.
    """

    def __init__(
        self, *, is_ours: bool = True, takes_slopes: bool = False, steps_inline: bool = True
    ) -> None:
        self.is_ours, self.takes_slopes = is_ours, takes_slopes
        self.steps_inline = steps_inline
        self.log: list[Any] = []
        self.statuses: dict[str, int] = {}
        self.component = c_void_p(1234)
        self.inputs = {name: (kind * 2)() for name, (kind, _) in TYPES.items()}
        self.outputs = {name: (kind * 2)() for name, (kind, _) in TYPES.items()}
        self.input_slots = [
            (self.inputs[name], i, convert) for name, (_, convert) in TYPES.items() for i in (0, 1)
        ]
        self.slope_slots = [0, 1, None, None, None, None]
        self.slope_values = (c_double * 2)()
        self.clock, self.span = c_double(), c_double()
        self._callbacks: list[Any] = []
        self.puts = [self._transfer(f"fmi2Set{name}", a) for name, a in self.inputs.items()]
        self.gets = [self._transfer(f"fmi2Get{name}", a) for name, a in self.outputs.items()]
        self.step = self._step()
        self.slope_puts = [self._slopes()] if takes_slopes else []

    def _call(self, name: str, kinds: tuple[Any, ...], function: Any, *arguments: Any) -> Any:
        callback = ctypes.CFUNCTYPE(c_int, c_void_p, *kinds)(function)
        self._callbacks.append(callback)
        address: Any = ctypes.cast(callback, c_void_p).value
        kind = ctypes.PYFUNCTYPE if self.is_ours else ctypes.CFUNCTYPE
        return kind(c_int)(address), (self.component, *arguments), name

    def _transfer(self, name: str, array: Any) -> Any:
        references = (c_uint * 2)(11, 12)

        def play(component: int, asked: Any, size: int, values: int) -> int:
            lies = (array._type_ * size).from_address(values)
            self.log.append((name, component, asked[:size], list(lies)))
            if name.startswith("fmi2Get"):
                lies[:] = [1 + len(self.log), -len(self.log)]
            return self.statuses.get(name, 0)

        kinds = (ctypes.POINTER(c_uint), c_size_t, c_void_p)
        return self._call(name, kinds, play, byref(references), c_size_t(2), byref(array))

    def _slopes(self) -> Any:
        references, orders = (c_uint * 2)(11, 12), (c_int * 2)(1, 1)
        name = "fmi2SetRealInputDerivatives"

        def play(component: int, asked: Any, size: int, degrees: Any, values: Any) -> int:
            self.log.append((name, component, asked[:size], degrees[:size], values[:size]))
            return self.statuses.get(name, 0)

        pointer = ctypes.POINTER
        kinds = (pointer(c_uint), c_size_t, pointer(c_int), pointer(c_double))
        arguments = (byref(references), c_size_t(2), byref(orders), byref(self.slope_values))
        return self._call(name, kinds, play, *arguments)

    def _step(self) -> Any:
        def play(component: int, t: float, h: float, flag: int) -> int:
            self.log.append(("fmi2DoStep", component, t, h, flag))
            return self.statuses.get("fmi2DoStep", 0)

        kinds = (c_double, c_double, c_int)
        return self._call("fmi2DoStep", kinds, play, self.clock, self.span, 1)

    def fail(self, function: str, status: int, time: float) -> None:
        raise FmuError(f"{function} {status} {time!r}")

    def advance(self, t: float, h: float) -> None:
        self._advance("advance", t, h)

    def advance_sloped(self, t: float, h: float) -> None:
        self._advance("advance_sloped", t, h)

    def _advance(self, *what: Any) -> None:
        inputs = [list(array) for array in self.inputs.values()]
        self.log.append((*what, inputs, list(self.slope_values)))
        if self.statuses:
            raise FmuError("it fails")
